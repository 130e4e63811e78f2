"""What is trained of a painted surface: all of the paint where the force is known, and nothing beyond its border."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.painted_region import DEVIATION, MOST, SLACK, cover, painted_region
from palpate.surrogates.model_card import card_of
from palpate.validation import validate
from palpate.validation.limits import FORCE_JND, Limits
from pressed import DEEPEST, RADIUS, places, solves, surrogate

PAINT = 0.015  # half the side of the painted square, m


def square(low_x, high_x, low_y, high_y):
    """Two triangles (2, 3, 3) of a rectangle in the plane z = 0 that face up."""
    a, b, c, d = (
        [x, y, 0.0] for x, y in ((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y))
    )
    return np.array([[a, b, c], [a, c, d]])


PAINTED = square(-PAINT, PAINT, -PAINT, PAINT)
AROUND = np.concatenate(
    [
        square(-0.03, -PAINT, -0.03, 0.03),
        square(PAINT, 0.03, -0.03, 0.03),
        square(-PAINT, PAINT, PAINT, 0.03),
        square(-PAINT, PAINT, -0.03, -PAINT),
    ]
)


def energy_of(slope: float):
    """The flat body, its force sure to 1 % in the middle and less so to one side, by a slope of the deviation."""
    root = np.zeros((6, 2))
    root[0, 0], root[1, 1] = 0.01, slope
    return replace(surrogate(root=root).energy, region=None)


def presses(x, y, s):
    return np.column_stack([x, y, RADIUS - s])


def test_the_paint_is_trained_and_its_surroundings_are_not():
    energy = energy_of(0.0)
    painted = painted_region(energy, PAINTED, AROUND, radius=RADIUS, deepest=DEEPEST)
    energy = replace(energy, region=painted.region)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.02, 0.02, (2, 20_000))
    s = rng.uniform(0.04 * DEEPEST, DEEPEST, 20_000)
    inside = energy.inside(presses(x, y, s))
    beyond = np.maximum(np.abs(x), np.abs(y)) - PAINT
    assert inside[beyond < 0].mean() > 0.97
    # the places that stand for the surroundings are some tenths of a mm from each other
    assert inside[beyond > 1.5 * SLACK * RADIUS].mean() < 1e-3
    assert not inside[beyond > 2.5 * SLACK * RADIUS].any()
    assert not energy.inside(presses(x, y, np.full_like(x, 1.01 * DEEPEST))).any()
    assert painted.painted_area == pytest.approx(4 * PAINT**2)
    assert painted.trained_area == pytest.approx(painted.painted_area * inside[beyond < 0].mean(), rel=0.02)
    assert len(painted.region.points) <= MOST


def test_a_force_less_sure_than_a_hand_can_tell_is_not_trained():
    assert DEVIATION == FORCE_JND == Limits().force_p95


@pytest.mark.full
def test_where_the_force_is_not_known_nothing_is_trained():
    energy = energy_of(0.12)
    painted = painted_region(energy, PAINTED, AROUND, radius=RADIUS, deepest=DEEPEST)
    energy = replace(energy, region=painted.region)
    rng = np.random.default_rng(2)
    X = presses(*rng.uniform(-PAINT, PAINT, (2, 20_000)), rng.uniform(0.04 * DEEPEST, DEEPEST, 20_000))
    deviation, inside = energy.deviation(X), energy.inside(X)
    assert 0.2 < (deviation < DEVIATION).mean() < 0.95  # the bound cuts through the paint
    assert inside[deviation < 0.9 * DEVIATION].mean() > 0.95
    assert inside[deviation > 1.15 * DEVIATION].mean() < 0.01


def test_after_few_solves_what_is_known_best_is_trained():
    energy = energy_of(0.12)
    painted = painted_region(energy, PAINTED, AROUND, radius=RADIUS, deepest=DEEPEST, deviation=1e-4)
    assert 0.15 < painted.trained_area / painted.painted_area < 0.26


def test_balls_hold_no_place_outside():
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (6000, 2))
    radius = np.linalg.norm(points, axis=1)
    region = cover(points[radius < 0.6], points[radius > 0.65])
    distances = region.distances(points)
    assert not (distances[radius > 0.65] <= region.radius).any()
    assert (distances[radius < 0.6] <= region.radius).mean() > 0.98


def test_the_card_says_how_much_of_the_paint_is_trained():
    card = card_of(surrogate(meta={"painted": {"painted_area": 54e-4, "trained_area": 53e-4}}))
    assert card.as_dict()["trained_on"]["painted_area"] == 54e-4
    assert card.as_dict()["trained_on"]["trained_area"] == 53e-4
    assert any("54 cm²" in sentence and "53 cm²" in sentence for sentence in card.limits)
    assert "m²" in card.to_markdown()


@pytest.mark.full
def test_solves_that_were_learnt_from_judge_nothing():
    """A region by the paint is no list of solves: the record has them."""
    X = places(40)
    region = painted_region(energy_of(0.0), PAINTED, AROUND, radius=RADIUS, deepest=DEEPEST).region
    learnt = surrogate(region=region, meta={"solved_at": X[:30].tolist()})
    assert validate(learnt, solves(X)).samples == 10
    with pytest.raises(UsageError, match="trained on all 30"):
        validate(learnt, solves(X[:30]))
