"""Places all over a surface: even by area whatever its slope, far from each other, the first of them spread too."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.physics.interactions.spread_places import border_distance, depth_sequence, spread_places
from palpate.physics.interactions.surface_patch import Patch


def strip(parts: int = 12) -> Patch:
    """Two squares of 10 mm that share an edge, one lying, one standing upright."""
    s = np.linspace(0, 1, parts + 1)
    u, v = np.meshgrid(np.linspace(0, 2, 2 * parts + 1), s, indexing="ij")
    points = 0.01 * np.stack([np.minimum(u, 1), v, -np.maximum(u - 1, 0)], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(u.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return Patch(points, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3))


@pytest.mark.parametrize("count", [8, 40])
def test_places_are_as_far_apart_as_the_area_allows(count):
    patch = strip()
    places, normals = spread_places(patch, count, seed=3)
    # n discs of half the least distance d do not overlap: n π d²/4 ≤ area + a margin; and greedy choice covers all
    # within d (Gonzalez 1985), so that n π d² ≥ area
    gap = cKDTree(places).query(places, k=2)[0][:, 1].min()
    area, perimeter = 2e-4, 0.06
    assert count * np.pi * gap**2 >= area
    assert count * np.pi * gap**2 / 4 <= area + perimeter * gap / 2 + np.pi * gap**2 / 4
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    # a grid seen from above would have no place at all on the upright half
    upright = places[:, 2] < 0
    assert upright.sum() == pytest.approx(count / 2, abs=np.sqrt(count) / 2)
    assert (normals[upright & (places[:, 2] < -1e-3)] @ [1.0, 0, 0] > 0.99).all()


def test_the_first_places_are_the_same_whatever_their_number():
    patch = strip()
    assert np.array_equal(spread_places(patch, 12, 5)[0], spread_places(patch, 200, 5)[0][:12])
    assert not np.array_equal(spread_places(patch, 12, 5)[0], spread_places(patch, 12, 6)[0])


def test_the_distance_from_the_border_is_that_of_a_folded_rectangle():
    patch = strip()
    points = np.array([[0.005, 0.004, 0], [0.01, 0.003, 0], [0.002, 0.005, 0], [0.01, 0.005, -0.009]])
    assert border_distance(patch, points) == pytest.approx([4e-3, 3e-3, 2e-3, 1e-3], rel=0.01)


def test_a_closed_surface_has_no_border():
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    patch = Patch(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]), tetrahedron)
    assert np.isinf(border_distance(patch, patch.points)).all()
    assert spread_places(patch, 5, 0)[0].shape == (5, 3)


def test_any_first_depths_are_spread():
    depths = depth_sequence((1e-3, 5e-3), 34, seed=2)
    for count in (5, 13, 34):  # of n in a golden sequence none of n equal cells' neighbours stays empty
        gaps = np.diff(np.sort(np.r_[1e-3, depths[:count], 5e-3]))
        assert gaps.max() < 2.0 * 4e-3 / count
