"""The benchmark's own check of a touched block, on displacements whose answers are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmarks.touching_check import Inspector

from palpate.physics.shapes import Block

HEIGHT, RADIUS, STOP = 0.05, 0.010, 0.004


@pytest.fixture(scope="module")
def mesh():
    return Block((0.10, 0.10, HEIGHT), element=0.03).mesh()


def inspected(mesh, displacement, centre):
    from ngsolve import CF, GridFunction, VectorH1, x, y, z

    state = GridFunction(VectorH1(mesh, order=2))
    state.Set(CF(displacement(x, y, z)))
    return Inspector(mesh, "top", RADIUS).inspect(state.vec.FV().NumPy(), np.array(centre))


def test_uniform_stretch_has_the_product_of_its_stretches(mesh):
    found = inspected(mesh, lambda x, y, z: (0.1 * x + 3 * y * z, 0.05 * y, -0.2 * z), (0.05, 0.05, 0.2))
    assert found.volume_ratio == pytest.approx(1.1 * 1.05 * 0.8, rel=1e-9)
    assert found.admissible(STOP)


def test_determinant_is_read_in_the_corners(mesh):
    # ∂u_z/∂z = -40 (z - 0.025) falls to -1 in the top corners alone: det F = 0 there, positive at any inner point
    found = inspected(mesh, lambda x, y, z: (0 * x, 0 * y, -20 * (z - 0.025) ** 2), (0.05, 0.05, 0.2))
    assert found.volume_ratio == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("depth", "kept"), [(0.002, True), (0.0045, False)])
def test_penetration_of_a_flat_surface_is_the_depth(mesh, depth, kept):
    corner = (0.10, 0.10, HEIGHT + RADIUS - depth)  # a corner is a point of the lattice
    found = inspected(mesh, lambda x, y, z: (0 * x, 0 * y, 0 * z), corner)
    assert found.penetration == pytest.approx(depth, rel=1e-9)
    assert found.admissible(STOP) == kept
    assert found.facing >= (RADIUS - depth) / RADIUS - 1e-9


def test_surface_that_has_passed_the_centre_faces_away(mesh):
    found = inspected(mesh, lambda x, y, z: (0 * x, 0 * y, 0 * z), (0.10, 0.10, HEIGHT - 0.008))
    assert found.facing < 0
    assert not found.admissible(math.inf)


def test_centre_inside_the_body_is_seen(mesh):
    found = inspected(mesh, lambda x, y, z: (0 * x, 0 * y, 0 * z), (0.05, 0.052, 0.02))
    assert found.enclosed
    assert not found.admissible(math.inf)
