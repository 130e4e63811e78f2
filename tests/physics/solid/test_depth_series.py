"""Designs and chains of a probe's positions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from solids import PROBE, RADIUS, SIZE, pressed

from palpate.errors import UsageError
from palpate.physics.interactions import PointForce, SphereProbe
from palpate.physics.interactions.surface_patch import Patch
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, Dome
from palpate.physics.solid import Body

PROBLEM = pressed()


def depths(points):
    return SIZE[2] + RADIUS - points[:, 2]


@pytest.mark.parametrize("samples", [1, 7, 64])
def test_a_design_has_as_many_samples_as_asked_for_within_the_ranges(samples):
    points = PROBLEM.design(samples, seed=3)
    assert points.shape == (samples, 3)
    for column, r in zip(points.T, PROBLEM.ranges, strict=True):
        assert (column >= r.low - 1e-12).all()
        assert (column <= r.high + 1e-12).all()
    np.testing.assert_array_equal(points, PROBLEM.design(samples, seed=3))
    if samples > 1:
        assert not np.array_equal(points, PROBLEM.design(samples, seed=4))


def test_chains_are_columns_from_shallow_to_deep():
    points = PROBLEM.design(64, seed=0)
    chains = PROBLEM.chains(points)
    assert sorted(np.concatenate(chains)) == list(range(64))
    for chain in chains:
        np.testing.assert_allclose(np.ptp(points[chain, :2], axis=0), 0, atol=1e-12)
        assert (np.diff(depths(points[chain])) > 0).all()


def test_scattered_points_are_grouped_with_their_neighbours_from_shallow_to_deep():
    rng = np.random.default_rng(0)
    low, high = (np.array(ends) for ends in zip(*((r.low, r.high) for r in PROBLEM.ranges), strict=True))
    points = low + rng.random((50, 3)) * (high - low)
    chains = PROBLEM.chains(points)
    assert sorted(np.concatenate(chains)) == list(range(50))
    assert 4 < len(chains) < 25
    for chain in chains:
        assert (np.diff(depths(points[chain])) >= 0).all()
    # a group is narrower than the whole
    widths = [np.ptp(points[chain, :2], axis=0).max() for chain in chains]
    assert max(widths) < 0.8 * np.ptp(points[:, :2], axis=0).max()


@pytest.mark.full
def test_columns_on_a_dome_are_chains_too():
    dome, probe = Dome(radius=0.06), SphereProbe(radius=RADIUS, depth=(0.0, 0.008))
    points = probe.design(dome, 36, 0)
    chains = probe.chains(dome, points)
    assert [len(chain) for chain in chains] == [4] * 9
    np.testing.assert_array_equal(np.concatenate(chains), np.arange(36))
    # three radii from the rim, and on the normal through the centre, but for the facets' slopes
    height = np.linalg.norm(points, axis=1)
    assert np.abs(points[:, :2]).max() < 0.03 * 1.2
    assert height.max() == pytest.approx(0.06 + RADIUS, rel=0.02)


@pytest.mark.full
def test_the_contact_points_keep_three_radii_from_the_rim():
    x, y, z = SphereProbe(radius=0.01).ranges(Block((0.1, 0.1, 0.05)))
    assert (x.low, x.high) == pytest.approx((0.03, 0.07))
    assert (y.low, y.high) == pytest.approx((0.03, 0.07))
    assert (z.low, z.high) == pytest.approx((0.045, 0.06))


@pytest.mark.full
@pytest.mark.parametrize("surface", ["bottom", "side"])
def test_any_surface_can_be_touched_from_outside(surface):
    block = Block(SIZE)
    points = SphereProbe(radius=RADIUS, touches=surface, depth=(0.0, 0.005)).design(block, 16, 0)
    patch = Patch.from_mesh(block.rest(), surface)
    distance = [patch.nearest(point)[2] for point in points]
    assert min(distance) >= RADIUS - 0.005 - 1e-9
    assert max(distance) <= RADIUS + 1e-9


def test_a_surface_that_is_not_there_is_named():
    body = Body(Block(SIZE), NeoHookean(9e3, 0.45))
    with pytest.raises(UsageError, match="top, bottom, x_min"):
        body.problem(SphereProbe(RADIUS, touches="lid")).design(4)


def test_a_problem_is_a_value():
    import pickle

    again = pickle.loads(pickle.dumps(PROBLEM))
    assert again == PROBLEM
    assert again.hash == PROBLEM.hash
    assert hash(again) == hash(PROBLEM)
    assert pressed(poisson=0.44).hash != PROBLEM.hash
    assert PROBE.describe()["radius"] == RADIUS


def test_other_interactions_leave_the_design_to_the_caller():
    force = PointForce(at=(0.03, 0.03, 0.03), radius=0.01, force=(0.0, 1.0))
    problem = Body(Block(SIZE), NeoHookean(9e3, 0.45)).problem(force)
    assert problem.design_name is None
    with pytest.raises(UsageError):
        problem.design(4)
    assert [list(chain) for chain in problem.chains(np.zeros((3, 1)))] == [[0, 1, 2]]


@pytest.mark.full
def test_contact_points_are_denser_where_the_surface_ends():
    whole = SphereProbe(0.01, depth=(0.0, 0.005), over=((0.0, 0.0), (0.1, 0.1)))
    corner = replace(whole, over=((0.05, 0.0), (0.1, 0.05)))
    middle = replace(whole, over=((0.02, 0.02), (0.08, 0.08)))
    geometry = Block((0.1, 0.1, 0.05))
    for probe, laws in (
        (whole, (arcsine, arcsine)),
        (corner, (late, early)),
        (middle, (lambda x: (x - 0.2) / 0.6,) * 2),
    ):
        feet = probe.design(geometry, 256, seed=1, depths=1)[:, :2]
        for axis, law in enumerate(laws):
            # 256 points of a scrambled Sobol sequence: one in each of 256 intervals of equal probability
            share = np.sort(law(feet[:, axis] / 0.1))
            assert np.abs(share - (np.arange(256) + 0.5) / 256).max() <= 0.5 / 256 + 1e-9


def arcsine(x):
    """Distribution of Chebyshev's points on 0 … 1."""
    return np.arccos(1 - 2 * x) / np.pi


def late(x):
    """The same of 0.5 … 1, from x = 0.5 on."""
    return 2 / np.pi * np.arcsin(2 * x - 1)


def early(x):
    """The same of 0 … 0.5."""
    return 2 / np.pi * np.arccos(1 - 2 * x)
