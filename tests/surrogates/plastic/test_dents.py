"""Prints over an elastic energy: the virgin curve, the way back, places, energy."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.surrogates.memories import Indentation, IndentationState
from remembering import press

P, Q, KAPPA = np.array([0.0, 0.5, 2.0]), np.array([0.4, 1.2, 3.0]), np.array([1.0, 1.05, 1.1])
PLACES = np.array([(x, 0.0, 0.0) for x in np.arange(-4.0, 5.0)])


def bowl(c: np.ndarray) -> tuple[float, np.ndarray]:
    """U = ½ s^(5/2) of the depth s = −c_z under a plane, and its gradient."""
    s = max(-c[2], 0.0)
    return 0.5 * s**2.5, np.array([0.0, 0.0, -1.25 * s**1.5])


def lead(memory: IndentationState, points: np.ndarray) -> np.ndarray:
    out = np.empty((len(points), 3))
    for row, c in zip(out, points, strict=True):
        assert press(memory, c, *bowl(c))
        row[:] = memory.force
    return out


def down(*depths: float, x: float = 0.0) -> np.ndarray:
    return np.array([(x, 0.0, -s) for s in depths])


def test_below_first_yield_the_body_is_elastic() -> None:
    memory = Indentation(P, Q, KAPPA, PLACES, 0.7).start()
    for c in down(0.1, 0.3, 0.2):
        press(memory, c, *bowl(c))
        np.testing.assert_allclose(memory.force, -bowl(c)[1], rtol=1e-12)
    assert memory.lost == 0
    assert not memory.depths.any()


def test_one_press_follows_the_virgin_curve_and_leaves_its_dent() -> None:
    memory = Indentation.single(P, Q, KAPPA).start()
    s = 1.5
    q = math.sqrt(2 * bowl(down(s)[0])[0])
    p = float(np.interp(q, Q, P))
    force = lead(memory, down(s))[0, 2]
    assert force == pytest.approx(np.interp(p, P, KAPPA) * (q - p) * 1.25 * s**1.5 / q, rel=1e-12)
    residual = p ** (1 / 1.25)  # q = s^(5/4)
    assert lead(memory, down(residual * (1 - 1e-9)))[0, 2] == 0
    assert lead(memory, down(residual * (1 + 1e-3)))[0, 2] > 0


def test_reloading_goes_back_by_the_way_of_unloading() -> None:
    memory = Indentation(P, Q, KAPPA, PLACES, 0.7).start()
    way = np.linspace(1.5, 0.5, 11)
    lead(memory, down(1.5))
    there = lead(memory, down(*way))
    lost = memory.lost
    back = lead(memory, down(*way[::-1]))
    np.testing.assert_allclose(back[::-1], there, atol=1e-13)
    assert memory.lost == pytest.approx(lost, rel=1e-12)


def test_steps_of_any_length_end_in_the_same_force() -> None:
    dents = Indentation(P, Q, KAPPA, PLACES, 0.7)
    once, often = dents.start(), dents.start()
    np.testing.assert_allclose(
        lead(often, down(*np.linspace(0, 1.5, 50)))[-1], lead(once, down(1.5))[0], rtol=1e-12, atol=1e-15
    )


def test_a_dent_stays_where_it_was_made() -> None:
    memory = Indentation(P, Q, KAPPA, PLACES, 0.5).start()
    virgin = lead(memory, down(0.7, x=4.0))[0]
    memory.reset()
    lead(memory, down(1.5, -0.1))
    here = lead(memory, down(0.7))[0]
    away = lead(memory, down(0.7, x=4.0))[0]
    assert here[2] < 0.9 * virgin[2]
    # what is left of the dent there is e^{−(3.5² − 0.5²)/2w²} of it, w = 0.5
    np.testing.assert_allclose(away, virgin, atol=1e-5 * virgin[2])


def test_the_force_is_the_gradient_of_what_is_stored() -> None:
    memory = Indentation(P, Q, KAPPA, PLACES, 0.8).start()
    lead(memory, down(1.6, -0.1))
    depths, c, h = memory.depths, np.array([0.6, 0.2, -1.0]), 1e-6

    def at(point: np.ndarray) -> float:
        memory.depths = depths
        press(memory, point, *bowl(point))
        np.testing.assert_array_equal(memory.depths, depths)  # nothing yields there
        return memory.stored

    slope = [(at(c + h * axis) - at(c - h * axis)) / (2 * h) for axis in np.eye(3)]
    at(c)
    np.testing.assert_allclose(memory.force, -np.array(slope), atol=1e-7 * np.abs(memory.force).max())
    assert abs(memory.force[0]) > 1e-3


def test_closed_ways_over_a_print_take_nothing() -> None:
    memory = Indentation(P, Q, KAPPA, PLACES, 0.8).start()
    lead(memory, down(1.8, 1.4))
    t = np.linspace(0, 2 * np.pi, 257)
    circle = np.stack([0.15 * np.sin(t), 0.1 * np.sin(t), -1.45 + 0.05 * np.cos(t)], axis=1)
    lead(memory, circle[:1])
    lost, work = memory.lost, memory.work
    force = lead(memory, circle)
    assert memory.lost == lost
    assert abs(memory.work - work) <= 1e-9 * work
    # ∮ F·dc by the trapezoid in t, which for a smooth periodic integrand errs by rounding only
    rate = np.stack([0.15 * np.cos(t), 0.1 * np.cos(t), -0.05 * np.sin(t)], axis=1)
    power = (force * rate).sum(axis=1)[:-1]
    assert abs(power.sum()) < 1e-9 * np.abs(power).sum()
    assert force[:, 2].min() > 0


def test_a_random_drive_never_gives_energy() -> None:
    rng, memory = np.random.default_rng(5), Indentation(P, Q, KAPPA, PLACES, 0.8).start()
    knots = rng.uniform((-3, -1, -2.0), (3, 1, 0.4), (60, 3))
    knots[0, 2] = 0.4  # from outside
    t = np.linspace(0, 59, 6000)
    way = np.stack([np.interp(t, np.arange(60), k) for k in knots.T], axis=1)
    force, worst = np.zeros(3), 0.0
    work = 0.0
    for last, c in itertools.pairwise(way):
        press(memory, c, *bowl(c))
        work -= float((force + memory.force) @ (c - last)) / 2
        force = memory.force.copy()
        assert memory.lost_in_step >= 0
        assert memory.stored >= 0
        worst = min(worst, work)
    assert worst > -1e-9
    assert work == pytest.approx(memory.stored + memory.lost, rel=0.02)  # first order in the step


@pytest.mark.parametrize(
    ("residual", "reach", "kappa"),
    [
        (P + 0.1, Q, KAPPA),
        (P, P, KAPPA),
        (P, Q, KAPPA + 1),
        (P, Q, np.array([1.0, 0.9, 9.0])),  # would give energy back as it grows
        (P[::-1], Q, KAPPA),
    ],
)
def test_tables_that_promise_nothing_are_refused(
    residual: np.ndarray, reach: np.ndarray, kappa: np.ndarray
) -> None:
    with pytest.raises(UsageError):
        Indentation(residual, reach, kappa, PLACES, 0.7)


def test_what_is_not_finite_changes_nothing() -> None:
    memory = Indentation(P, Q, KAPPA, PLACES, 0.7).start()
    lead(memory, down(1.5))
    depths = memory.depths
    assert not press(memory, np.array([0.0, np.nan, -2.0]), 1.0, np.zeros(3))
    assert not press(memory, np.zeros(3), -1.0, np.zeros(3))
    np.testing.assert_array_equal(memory.depths, depths)
    assert not memory.force.any()


def test_shares_are_what_a_probe_meets() -> None:
    memory = Indentation(P, Q, np.ones(3), PLACES, 0.7).start()
    memory.depths = np.random.default_rng(0).uniform(0.1, 0.4, len(PLACES))
    before = memory.depths
    for x in (-3.7, 0.0, 1.3):
        c = down(0.6, x=x)[0]
        press(memory, c, *bowl(c))
        met = math.sqrt(2 * bowl(c)[0]) - math.sqrt(2 * memory.stored)
        assert memory.indentation.shares(c[None])[0] @ memory.depths == pytest.approx(met, rel=1e-12)
    np.testing.assert_array_equal(memory.now, before)  # nothing yielded
    with pytest.raises(ValueError, match="read-only"):
        memory.now[0] = 1.0
