"""The energy ledger against the work it speaks of, its bound, and the damping that pays its debts."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.runtime import passivity
from palpate.runtime.passivity import PassivityController, largest_damping

T = 1e-3


def controller(**options):
    return PassivityController(T, **({"max_force": 100.0} | options))


def mass_for(damping, period=T, delay=0.0):
    """Apparent mass, kg, on which so much damping is stable."""
    return damping * (period + delay) / largest_damping(1.0, 1.0)


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


def swing(*, damping, push=0.5, ticks=2000, late=0):
    """A mass between springs whose force pushes along the motion; returns the ledger and the last speeds."""
    mass, x, v = 0.2, np.zeros(3), np.array([0.1, 0.0, 0.0])
    ledger = controller(mass=mass_for(damping, delay=late * T))
    ledger.delay = late * T
    speeds, sent = [], [np.zeros(3)] * (late + 1)
    for _ in range(ticks):
        force = push * v - 200.0 * x
        ledger.apply(x, force, T, stored=100.0 * float(x @ x))
        sent.append(force)
        v = v + T / mass * sent[-1 - late]
        x = x + T * v
        speeds.append(np.linalg.norm(v))
    return ledger, np.array(speeds)


@pytest.mark.parametrize("late", [0, 3])
def test_damping_pays_what_an_active_force_owes(late):
    alone, wild = swing(damping=0.0, late=late)
    kept, calm = swing(damping=20.0, late=late)
    assert alone.lowest < -0.05, "the rival: energy without end"
    assert wild[-200:].max() > 3 * wild[0]
    assert kept.lowest > 0.02 * alone.lowest
    assert calm.max() < 2 * calm[0]
    assert kept.injected > 0.0 == alone.injected


def stroke(ticks, noise, *, late=0, stiffness=200.0, speed=0.05, seed=0, mass=0.2):
    """A hand led to and fro on a spring and seen with noise: the ledger, the work, and what was added to the force."""
    rng = np.random.default_rng(seed)
    time = T * np.arange(ticks)
    X = np.column_stack([speed * 0.25 * (1.0 - np.cos(time / 0.25)), 0.0 * time, 0.0 * time])
    ledger = controller(max_force=10.0, mass=mass)
    ledger.delay, ledger.stiffness = late * T, stiffness
    work, sent, damped = 0.0, [np.zeros(3)] * (late + 1), []
    for k in range(ticks - 1):
        seen = X[k] + (noise * rng.normal(size=3) if noise else 0.0)
        force = -stiffness * seen
        wanted = force.copy()
        ledger.apply(seen, force, T, stored=0.5 * stiffness * float(seen @ seen))
        damped.append(force - wanted)
        sent.append(force)
        work += float(sent[-1 - late] @ (X[k + 1] - X[k]))
    return ledger, work, np.array(damped)


PERIODS = 3142  # ticks of two whole strokes, at whose ends the hand is where it began


@pytest.mark.parametrize("noise", [0.0, 2e-5, 3e-4])
@pytest.mark.parametrize("late", [0, 5])
def test_noise_carries_no_energy(noise, late):
    """The ledger of a noisy sensor is the work of the force on the true handle; raw differences are far from it."""
    ledger, work, _ = stroke(PERIODS, noise, late=late, mass=0.0)
    assert work > 0.0, "a sampled spring leaks"
    # what the noise does by chance: K σ v T √n, three deviations
    chance = 3.0 * 200.0 * noise * 0.05 * T * np.sqrt(PERIODS)
    # and what is not yet booked: the force at the end times the ball, which is less than 1 N σ here
    # and what the filter lets through, 3/2 K a² σ² a tick with a = T/(τ + T) on the lightest device of 0.1 kg
    share = min(1.0, T / np.sqrt(0.5 * 0.1 * np.sqrt(6.0) * noise / (0.02 * 10.0))) if noise else 0.0
    passed = 1.5 * 200.0 * (share * noise) ** 2 * PERIODS
    assert ledger.energy == pytest.approx(-work, rel=0.05, abs=chance + noise + passed)


@pytest.mark.grid
@pytest.mark.parametrize("noise", [0.0, 2e-5, 3e-4])
@pytest.mark.parametrize("late", [0, 5])
def test_a_leak_is_paid_while_the_body_is_touched_and_noise_is_not_felt(noise, late):
    bare = stroke(PERIODS, 0.0, late=late, mass=0.0)[1]
    ledger, work, damped = stroke(PERIODS, noise, late=late)
    assert work < 0.5 * bare
    answer = 200.0 * noise  # N, standard deviation of what the body makes of the noise
    change = np.linalg.norm(np.diff(damped, axis=0), axis=1)
    smooth = np.linalg.norm(np.diff(stroke(PERIODS, 0.0, late=late)[2], axis=0), axis=1).max()
    assert change.max() <= smooth + 6.0 * answer + 1e-3
    assert ledger.noise == pytest.approx(noise, rel=0.5, abs=1e-7)


def test_a_still_hand_with_a_noisy_sensor_owes_nothing():
    rng = np.random.default_rng(3)
    ledger = controller(max_force=3.0, mass=0.1)
    ledger.stiffness = 300.0
    place, forces = np.array([0.0, 0.0, -0.01]), []
    for _ in range(3000):
        seen = place + 2e-5 * rng.normal(size=3)
        force = -300.0 * seen
        ledger.apply(seen, force, T, stored=150.0 * float(seen @ seen))
        forces.append(force)
    assert abs(ledger.energy) < 3.0 * 2e-5, "3 N over one deviation, J"
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() < 12 * 300.0 * 2e-5


def test_a_debt_is_forgotten_in_seconds_and_damps_nothing_in_the_air():
    ledger, x = controller(mass=1.0), np.zeros(3)
    ledger.apply(x, np.array([10.0, 0, 0]), T)
    for k in range(16000):
        x = np.array([1e-3 + 1e-5 * k, 0, 0])
        force = np.zeros(3)
        ledger.apply(x, force, T, free=True)
        assert not force.any(), "a hand in the air feels nothing"
    assert ledger.energy == pytest.approx(-10.0 * 1e-3), "the record stays"
    force = np.array([1e-2, 0, 0])
    ledger.apply(x + 1e-4, force, T)
    assert force[0] == pytest.approx(1e-2, rel=1e-2), "and the debt is forgotten"


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
    """A debt that can't be paid: no more than is stable, than the force of the body, than the device bears."""
    for size, most in ((2.0, 50.0), (2.0, 3.0), (0.2, 50.0)):
        ledger, x = controller(max_force=1.5, mass=mass_for(most)), np.zeros(3)
        for k in range(200):
            x = np.array([1e-4 * k, 0, 0])
            force = np.array([size, 0, 0])
            ledger.apply(x, force, T)
        speed = 0.1
        assert 0.0 < ledger.damping <= most
        assert ledger.damping * speed <= size + 1e-12
        assert force[0] == pytest.approx(min(1.5, size - ledger.damping * speed), abs=1e-12)
    for bad in ({"max_force": 0.0}, {"mass": -1.0}, {"mass": np.inf}, {"noise": -1.0}):
        with pytest.raises(UsageError):
            controller(**bad)


def test_what_a_clamped_force_does_not_take_is_no_debt():
    """A hand that presses a spring beyond the limit of the device and comes back has got nothing."""
    owed = {}
    for told in (True, False):
        ledger = controller(max_force=1.0, mass=0.2)
        for k in range(800):
            x = np.array([5e-5 * min(k, 800 - k), 0, 0])
            wanted = -100.0 * x
            force = wanted * min(1.0, 1.0 / max(np.linalg.norm(wanted), 1e-9))
            clamped = bool(told and np.linalg.norm(wanted) > 1.0)
            ledger.apply(x, force, T, stored=50.0 * float(x @ x), clamped=clamped)
        owed[told] = ledger.injected
    assert owed[True] < 0.1 * owed[False]


def test_its_state_put_back_gives_the_same_bits():
    rng = np.random.default_rng(4)
    X, F = rng.normal(0, 1e-3, (60, 3)).cumsum(axis=0), rng.normal(0, 2.0, (60, 3))
    first, second = controller(mass=0.01, noise=1e-4), controller(mass=0.01, noise=1e-4)
    for x, f in zip(X[:30], F[:30], strict=True):
        first.apply(x, f.copy(), T)
    second.state[:], second.sent[:], second.places[:] = first.state, first.sent, first.places
    for x, f in zip(X[30:], F[30:], strict=True):
        one, two = f.copy(), f.copy()
        first.apply(x, one, T)
        second.apply(x, two, T)
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(first.ledger, second.ledger)


def test_a_step_keeps_no_memory():
    ledger, x, f = controller(mass=0.1), np.zeros(3), np.ones(3)
    ledger.apply(x, f, T)
    tracemalloc.start()
    for _ in range(1000):
        ledger.apply(x, f, T)
    own = tracemalloc.Filter(True, passivity.__file__)  # not what other threads keep meanwhile
    kept = tracemalloc.take_snapshot().filter_traces([own]).statistics("filename")
    tracemalloc.stop()
    assert sum(part.size for part in kept) < 1000
