"""The energy ledger against the work it speaks of, its bound, and the damping that pays its debts."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.runtime.passivity import PassivityController, largest_damping

T = 1e-3


def controller(**options):
    return PassivityController(T, **({"max_force": 100.0, "max_damping": 0.0} | options))


def test_largest_damping_is_stable_on_the_mass_with_the_hold_and_the_delay():
    """A sampled damper by backward differences on a mass, alone: its poles lie inside the unit circle."""
    mass = 0.2
    for late in (0, 1, 4):
        alpha = largest_damping(mass, 1 / T, delay=late * T)
        # v' = v - (α T/m) (mean speed of the interval before, `late` intervals earlier)
        n = late + 3
        step = np.zeros((n, n))
        step[0, 0] = 1.0
        step[0, late + 1] -= 0.5 * alpha * T / mass
        step[0, late + 2] -= 0.5 * alpha * T / mass
        step[np.arange(1, n), np.arange(n - 1)] = 1.0
        poles = np.abs(np.linalg.eigvals(step))
        assert poles.max() < 1.0
    for bad in ((0.0, 1000.0, 0.0), (0.1, 0.0, 0.0), (0.1, 1000.0, -1.0)):
        with pytest.raises(UsageError):
            largest_damping(bad[0], bad[1], delay=bad[2])


@pytest.mark.parametrize("late", [0.0, 0.4, 1.0, 3.25])
def test_the_ledger_is_the_work_of_the_held_and_delayed_force(late):
    rng = np.random.default_rng(1)
    X, F = rng.normal(0, 1e-3, (40, 3)).cumsum(axis=0), rng.normal(0, 2.0, (40, 3))
    ledger = controller()
    ledger.delay = late * T
    for x, f in zip(X, F, strict=True):
        ledger.apply(x, f.copy(), T)
    work, fine = 0.0, 400
    for k in range(39):  # straight ways between samples, each in small parts with the force that acts on it
        for j in range(fine):
            sent = int(np.floor(k + (j + 0.5) / fine - late))
            if sent >= 0:
                work += F[sent] @ (X[k + 1] - X[k]) / fine
    assert ledger.energy == pytest.approx(-work, rel=1e-9, abs=1e-12)
    assert ledger.leak == pytest.approx((0.5 + late) * (np.diff(X, axis=0) ** 2).sum())


@pytest.mark.parametrize("late", [0.0, 1.0, 2.5])
def test_a_sampled_energy_leaks_no_more_than_its_bound(late):
    """E ≥ U − K Σ (½ + d/T) |Δx|² on random convex energies along random ways."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        root = rng.normal(0, 10, (3, 3))
        H = root @ root.T
        ledger = controller(max_force=1e9)
        ledger.delay = late * T
        x = np.zeros(3)
        for _ in range(100):
            ledger.apply(x, -H @ x, T)
            x = x + rng.normal(0, 1e-3, 3)
        ledger.apply(x, np.zeros(3), T)
        bound = 0.5 * x @ H @ x - np.linalg.eigvalsh(H)[-1] * ledger.leak
        assert ledger.energy >= bound - 1e-12


def swing(*, max_damping, push=0.5, ticks=2000, late=0):
    """A mass between springs whose force pushes along the motion; returns the ledger and the last speeds."""
    mass, x, v = 0.2, np.zeros(3), np.array([0.1, 0.0, 0.0])
    ledger = controller(max_damping=max_damping)
    ledger.delay = late * T
    speeds, sent = [], [np.zeros(3)] * (late + 1)
    for _ in range(ticks):
        force = push * v - 200.0 * x
        ledger.apply(x, force, T)
        sent.append(force)
        v = v + T / mass * sent[-1 - late]
        x = x + T * v
        speeds.append(np.linalg.norm(v))
    return ledger, np.array(speeds)


@pytest.mark.parametrize("late", [0, 3])
def test_damping_pays_what_an_active_force_owes(late):
    alone, wild = swing(max_damping=0.0, late=late)
    kept, calm = swing(max_damping=20.0, late=late)
    assert alone.lowest < -0.05, "the rival: energy without end"
    assert wild[-200:].max() > 3 * wild[0]
    assert kept.lowest > 0.02 * alone.lowest
    assert calm.max() < 2 * calm[0]
    assert kept.injected > 0.0 == alone.injected


def test_a_late_device_is_damped_once_for_one_debt():
    ledger = controller(max_damping=1e3)
    ledger.delay = 5 * T
    ledger.apply(np.zeros(3), np.array([10.0, 0, 0]), T)
    x = np.zeros(3)
    asked = []
    for _ in range(12):
        x = x + np.array([1e-3, 0, 0])
        ledger.apply(x, np.zeros(3), T)
        asked.append(ledger.damping * 1e-6 / T)
    assert sum(asked) == pytest.approx(10.0 * 1e-3), "the push of 10 N over 1 mm, and nothing twice"


def test_credit_ends_in_the_air_and_debts_stay():
    ledger = controller()
    for k in range(3):
        ledger.apply(np.array([1e-3 * k, 0, 0]), np.array([-1.0, 0, 0]), T)
    assert ledger.energy == pytest.approx(2e-3)
    ledger.apply(np.array([2e-3, 0, 0]), np.array([1.0, 0, 0]), T, free=True)
    assert ledger.energy == 0.0
    ledger.apply(np.array([4e-3, 0, 0]), np.zeros(3), T)
    assert ledger.energy == pytest.approx(-2e-3)
    ledger.interrupt()
    ledger.apply(np.array([9.0, 0, 0]), np.zeros(3), T, free=True)
    assert ledger.energy == pytest.approx(-2e-3), "the way that nobody saw costs nothing"
    assert ledger.lowest == pytest.approx(-2e-3)


def test_what_was_not_delivered_does_no_work():
    ledger = controller()
    ledger.apply(np.zeros(3), np.array([5.0, 0, 0]), T)
    ledger.amend()
    ledger.apply(np.array([1e-3, 0, 0]), np.zeros(3), T)
    assert ledger.energy == 0.0


def test_limits_of_the_damping():
    ledger = controller(max_force=1.5, max_damping=50.0)
    ledger.apply(np.zeros(3), np.array([2.0, 0, 0]), T)
    force = np.zeros(3)
    ledger.apply(np.array([1e-2, 0, 0]), force, T)
    assert ledger.damping == pytest.approx(0.2), "2 N over 10 mm, at 10 m/s"
    np.testing.assert_allclose(force, [-1.5, 0, 0])
    slow = controller(max_damping=50.0)
    slow.apply(np.zeros(3), np.array([2.0, 0, 0]), T)
    force = np.zeros(3)
    slow.apply(np.array([0.9e-6, 0, 0]), force, T)
    assert slow.energy < 0.0
    assert not force.any(), "noise of an encoder is not damped"
    for bad in ({"max_force": 0.0}, {"max_damping": -1.0}, {"max_damping": np.inf}):
        with pytest.raises(UsageError):
            controller(**bad)


def test_its_state_put_back_gives_the_same_bits():
    rng = np.random.default_rng(4)
    X, F = rng.normal(0, 1e-3, (60, 3)).cumsum(axis=0), rng.normal(0, 2.0, (60, 3))
    first, second = controller(max_damping=5.0), controller(max_damping=5.0)
    for x, f in zip(X[:30], F[:30], strict=True):
        first.apply(x, f.copy(), T)
    second.state[:], second.sent[:] = first.state, first.sent
    for x, f in zip(X[30:], F[30:], strict=True):
        one, two = f.copy(), f.copy()
        first.apply(x, one, T)
        second.apply(x, two, T)
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(first.ledger, second.ledger)


def test_a_step_keeps_no_memory():
    ledger, x, f = controller(max_damping=1.0), np.zeros(3), np.ones(3)
    ledger.apply(x, f, T)
    tracemalloc.start()
    for _ in range(1000):
        ledger.apply(x, f, T)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 1000
