"""A held body that remembers: the elastic limit, cycles, going back, letting go, its file."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from allocated import kept_by
from bent import CREEPS, REACH, YIELDS, D, body
from palpate.errors import FileFormatError, UsageError
from palpate.surrogates.memories import IwanElements
from palpate.surrogates.plastic import HeldBody


def test_below_first_yield_the_force_is_the_gradient_of_the_elastic_energy() -> None:
    made = body()
    for w in (0.09, -0.05):
        ev = made.evaluator()
        ev.step(w * D, 0.0)
        h, slope = w * math.exp(w * w / 2), (1 + w * w) * math.exp(w * w / 2)
        np.testing.assert_allclose(ev.force, -120.0 * h * slope * D, rtol=1e-12, atol=1e-15)
        assert ev.stored == pytest.approx(60.0 * h * h, rel=1e-12)
        assert ev.lost == 0
        np.testing.assert_allclose(ev.contact, w * D, atol=1e-15)
        np.testing.assert_allclose(made.displacement(ev.loads)[1], w * D, atol=1e-15)


def test_closed_cycles_inside_the_elastic_domain_take_nothing() -> None:
    ev = body().evaluator()
    for w in (0.35, 0.2):
        ev.step(w * D, 0.0)
    lost, work, forces = ev.lost, ev.work, []
    t = np.linspace(0, 2 * np.pi, 129)
    for w in 0.26 + 0.06 * np.cos(t):
        ev.step(w * D, 0.0)
        forces.append(-ev.force @ D)
    ev.step(0.2 * D, 0.0)
    assert ev.lost == lost
    assert abs(ev.work - work) < 1e-9 * work
    # ∮ P dw by the trapezoid in t, which for a smooth periodic integrand errs by rounding only
    rate = -0.06 * np.sin(t)
    circuit = np.sum(np.array(forces[:-1]) * rate[:-1]) * (t[1] - t[0])
    assert abs(circuit) < 1e-9 * np.abs(np.array(forces) * rate).sum() * (t[1] - t[0])


def test_it_stays_bent_and_reloads_along_the_way_of_unloading() -> None:
    ev = body().evaluator()
    ev.step(0.35 * D, 0.0)
    peak = ev.force.copy()
    assert ev.release(0.0)
    left = ev.loads[0]
    assert 0.05 < left < 0.3
    assert not ev.force.any()
    ev.step(left * D, 0.0)
    assert np.abs(ev.force).max() < 1e-10 * np.abs(peak).max()
    ev.step(0.35 * D, 0.0)
    np.testing.assert_allclose(ev.force, peak, rtol=1e-12)


def test_a_released_body_that_creeps_comes_back_in_time() -> None:
    ev = body(CREEPS).evaluator(period=0.01)
    ev.step(0.3 * D, 0.0)
    ev.step(0.3 * D, 5.0)
    left = []
    for _ in range(400):
        ev.release()
        left.append(ev.loads[0])
    assert left[0] > 0.05
    assert (np.diff(left) < 0).all()
    # free: 60 h + 40 e = 0, and so h decays by exp(−t 0.6/0.5)
    h = [w * math.exp(w * w / 2) for w in left]
    assert math.log(h[100] / h[300]) == pytest.approx(2.0 * 0.6 / 0.5, rel=2e-3)


@pytest.mark.parametrize("elements", [YIELDS, CREEPS], ids=["yields", "creeps"])
def test_a_random_hand_gets_no_energy_out(elements: IwanElements) -> None:
    rng, ev = np.random.default_rng(2), body(elements).evaluator()
    knots = np.append(0.0, rng.uniform(-0.5, 0.5, 39))
    way = np.interp(np.linspace(0, 39, 20_000), np.arange(40), knots)
    work, last, pull = 0.0, 0.0, 0.0
    for w in way:
        ev(w * D)
        now = float(-ev.force @ D)
        work += 0.5 * (pull + now) * (w - last)
        assert ev.lost_in_step >= 0
        last, pull = w, now
    # the trapezoid's error against the exact work of each step
    assert work == pytest.approx(ev.stored + ev.lost, rel=1e-3)
    assert ev.work == pytest.approx(ev.stored + ev.lost, rel=1e-9)


def test_a_state_goes_back_to_its_moment() -> None:
    ev = body().evaluator()
    ev.step(0.3 * D, 0.0)
    ev.step(0.1 * D, 0.0)
    then, force = ev.state, ev.force.copy()
    ev.step(-0.4 * D, 0.0)
    ev.state = then
    np.testing.assert_allclose(ev.force, force, rtol=1e-12)
    assert ev.lost == then.ledger[1]
    with pytest.raises(UsageError, match="elements"):
        body(CREEPS).evaluator().state = then


def test_beyond_the_trained_range_it_says_so_and_goes_on_smoothly() -> None:
    ev = body().evaluator()
    assert ev.inside
    forces = []
    for w in (REACH - 1e-7, REACH + 1e-7):
        ev.step(w * D, 0.0)
        forces.append(ev.force.copy())
    assert not ev.inside
    np.testing.assert_allclose(*forces, rtol=1e-5)
    np.testing.assert_allclose(ev.contact, REACH * D)


def test_a_step_allocates_nothing_that_stays_and_refuses_what_is_not_finite() -> None:
    ev = body().evaluator()
    position = 0.2 * D
    assert kept_by(lambda: ev(position)) < 500
    lost = ev.lost
    assert not ev.step(np.array([0.0, np.nan, 0.0]), 1e-3)
    assert not ev.step(position, -1.0)
    assert not ev.force.any()
    assert ev.lost == lost
    with pytest.raises(UsageError):
        ev(np.zeros(2))
    with pytest.raises(UsageError):
        ev(position, np.ones(1))


def test_a_file_gives_the_same_body_back(tmp_path: Path) -> None:
    made = body()
    found = HeldBody.load(made.save(tmp_path / "made.palpate"))
    way = np.array([0.1, 0.35, 0.2, -0.1])
    for mine, its in zip(made.follow(way), found.follow(way), strict=True):
        np.testing.assert_array_equal(mine, its)
    assert str(found) == str(made)
    broken = dataclasses.replace(made, touch_node=7)
    broken_file = broken.save(tmp_path / "broken.palpate")
    with pytest.raises(FileFormatError, match="held body"):
        HeldBody.load(broken_file)
    made.stretch.save(tmp_path / "alone.palpate")
    with pytest.raises(FileFormatError):
        HeldBody.load(tmp_path / "alone.palpate")
