"""Large triangles of a file in parts: the same closed surface, fine enough to show a dent."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from palpate.physics.shapes.divided_surface import LARGE, divide_large
from palpate.physics.shapes.sample_part import kidney_surface


@pytest.mark.parametrize("length", [0.002, 0.005, 0.011])
def test_a_box_of_twelve_triangles_is_the_same_closed_box_in_small_ones(length):
    box = trimesh.creation.box((0.04, 0.03, 0.02))
    points, triangles = divide_large(box.vertices, box.faces, length, 100_000)
    fine = trimesh.Trimesh(points, triangles, process=False)
    assert fine.is_watertight
    assert fine.is_winding_consistent
    assert fine.volume == pytest.approx(box.volume)
    assert fine.area == pytest.approx(box.area)
    assert fine.edges_unique_length.max() <= LARGE * length
    assert len(triangles) > box.area / length**2
    np.testing.assert_array_equal(points[: len(box.vertices)], box.vertices)


def test_a_surface_that_is_fine_enough_stays():
    own = kidney_surface()
    points, triangles = divide_large(*own, 0.004, 100_000)
    np.testing.assert_array_equal(points, own[0])
    np.testing.assert_array_equal(triangles, own[1])


def test_there_are_never_many_more_than_are_wanted():
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    assert 200 < len(divide_large(box.vertices, box.faces, 1e-3, 2_000)[1]) < 4_000
