"""A held body that remembers: the elastic limit, cycles, going back, letting go, its answer along a history."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bent import CREEPS, REACH, STIFFNESS, YIELDS, D, body
from palpate.errors import UsageError
from palpate.learning.loading import load
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import IwanElements
from palpate.surrogates.moving_rest import MovingRest

NONE = np.zeros(0)


class Walk:
    """A body led by its energy and its memory, and let go."""

    def __init__(self, made: Surrogate) -> None:
        self.elastic, self.memory = made.energy.evaluator(), made.memory.start()
        self.rest = MovingRest(self.elastic, self.memory, D)

    def __call__(self, w: float, dt: float = 0.0) -> np.ndarray:
        self.elastic(w * D, NONE)
        assert self.memory.step(w * D, self.elastic.amplitude, self.elastic.slope, dt)
        return self.memory.force

    def release(self, dt: float = 0.0) -> float:
        assert self.rest.release(dt, NONE)
        return float(self.rest.lies @ D)


def test_below_first_yield_the_force_is_the_gradient_of_the_elastic_energy() -> None:
    for w in (0.09, -0.05):
        walk = Walk(body())
        force, h = walk(w), w * math.exp(w * w / 2)
        slope = (1 + w * w) * math.exp(w * w / 2)
        np.testing.assert_allclose(force, -STIFFNESS * h * slope * D, rtol=1e-12, atol=1e-15)
        assert walk.memory.stored == pytest.approx(0.5 * STIFFNESS * h * h, rel=1e-12)
        assert walk.memory.lost == 0


def test_closed_cycles_inside_the_elastic_domain_take_nothing() -> None:
    walk = Walk(body())
    for w in (0.35, 0.2):
        walk(w)
    lost, work = walk.memory.lost, walk.memory.work
    t = np.linspace(0, 2 * np.pi, 129)
    forces = [-walk(w) @ D for w in 0.26 + 0.06 * np.cos(t)]
    walk(0.2)
    assert walk.memory.lost == lost
    assert abs(walk.memory.work - work) < 1e-9 * work
    # ∮ P dw by the trapezoid in t, which for a smooth periodic integrand errs by rounding only
    rate = -0.06 * np.sin(t)
    circuit = np.sum(np.array(forces[:-1]) * rate[:-1]) * (t[1] - t[0])
    assert abs(circuit) < 1e-9 * np.abs(np.array(forces) * rate).sum() * (t[1] - t[0])


def test_it_stays_bent_and_reloads_along_the_way_of_unloading() -> None:
    walk = Walk(body())
    peak = walk(0.35).copy()
    left = walk.release()
    assert 0.05 < left < 0.3
    assert not walk.memory.force.any()
    assert np.abs(walk(left)).max() < 1e-10 * np.abs(peak).max()
    np.testing.assert_allclose(walk(0.35), peak, rtol=1e-12)


def test_a_released_body_that_creeps_comes_back_in_time() -> None:
    walk = Walk(body(CREEPS))
    walk(0.3)
    walk(0.3, 5.0)
    left = [walk.release(0.01) for _ in range(400)]
    assert left[0] > 0.05
    assert (np.diff(left) < 0).all()
    # free: 0.6 q + 0.4 e = 0, and so q decays by exp(−t 0.6/0.5)
    q = [w * math.exp(w * w / 2) for w in left]
    assert math.log(q[100] / q[300]) == pytest.approx(2.0 * 0.6 / 0.5, rel=2e-3)


@pytest.mark.full
@pytest.mark.parametrize("elements", [YIELDS, CREEPS], ids=["yields", "creeps"])
def test_a_random_hand_gets_no_energy_out(elements: IwanElements) -> None:
    rng = np.random.default_rng(2)
    knots = np.append(0.0, rng.uniform(-0.5, 0.5, 39))
    way = np.interp(np.linspace(0, 39, 20_000), np.arange(40), knots)
    led = body(elements).follow(way[:, None], 1e-3 * np.arange(20_000))
    pull = -led.force @ D
    work = np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(way))
    assert (np.diff(led.lost) >= 0).all()
    # the trapezoid's error against the exact work of each step
    assert work == pytest.approx(led.stored[-1] + led.lost[-1], rel=1e-3)


def test_beyond_the_trained_range_it_says_so_and_goes_on_smoothly() -> None:
    hand, place = touchable(body()).evaluator(), np.zeros(3)
    answers = []
    for w in (0.0, REACH - 1e-7, REACH + 1e-7):
        place[:] = w * D
        hand.place(place, holding=True, believed=True)
        hand(place, NONE)
        answers.append((hand.inside, hand.force.copy(), hand.contact.copy()))
    assert [inside for inside, _, _ in answers] == [True, True, False]
    np.testing.assert_allclose(answers[1][1], answers[2][1], rtol=1e-5)
    np.testing.assert_allclose(answers[2][2], REACH * D)


def test_a_body_without_a_memory_is_followed_along_its_energy() -> None:
    way = np.linspace(-0.3, 0.3, 7)[:, None]
    made = body().with_memory(None)
    led = made.follow(way)
    np.testing.assert_allclose(led.force, made.energy.force(way), rtol=1e-12)
    np.testing.assert_allclose(led.stored, made.energy.energy(way), rtol=1e-12)
    assert not led.lost.any()
    assert not led.rest.any()


def test_a_history_of_another_body_is_refused() -> None:
    for X, times in ((np.zeros(3), None), (np.zeros((3, 2)), None), (np.zeros((2, 1)), [1.0, 0.5])):
        with pytest.raises(UsageError, match="no history of this body"):
            body().follow(X, times)


def test_a_file_gives_the_same_body_back(tmp_path) -> None:
    made = body()
    again = load(made.save(tmp_path / "made.palpate"))
    way = np.array([[0.1], [0.35], [0.2], [-0.1]])
    mine, its = made.follow(way), again.follow(way)
    for name in ("force", "stored", "lost", "rest"):
        np.testing.assert_array_equal(getattr(mine, name), getattr(its, name))
    assert str(again) == str(made)
