"""Signed distances of tools against what a distance is: its sphere is free, its gradient a unit vector, its support."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate import tools
from palpate.errors import UsageError

SHAPES = [
    tools.Sphere(0.010),
    tools.Capsule(0.006, 0.030),
    tools.Cylinder(0.006, 0.030, 0.001),
    tools.Punch(0.006, 0.0015),
    tools.Cone(math.radians(75), 0.002),
    tools.Box(0.012, 0.016, 0.010, 0.002),
    tools.Fingertip(0.018, 0.016, 0.014),
]
shapes = pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)


def surface_points(shape, rng, count=400):
    """Points (N, 3) on the surface of the forward half, found from outside along the gradient."""
    directions = rng.normal(size=(count, 3))
    directions[:, 2] = -np.abs(directions[:, 2])
    points = 0.05 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    for _ in range(200):
        points = points - shape.distance(points)[:, None] * shape.gradient(points)
    assert np.abs(shape.distance(points)).max() < 1e-9
    return points


@shapes
def test_the_gradient_is_a_unit_vector_on_the_surface(shape):
    points = surface_points(shape, np.random.default_rng(0))
    np.testing.assert_allclose(np.linalg.norm(shape.gradient(points), axis=1), 1.0, atol=1e-6)


@shapes
def test_the_foremost_point_lies_on_the_surface_and_nothing_before_it(shape):
    points = surface_points(shape, np.random.default_rng(1))
    assert abs(shape.distance(np.array([0.0, 0.0, -shape.front]))) < 1e-9
    assert points[:, 2].min() >= -shape.front - 1e-9


@shapes
def test_the_support_function_bounds_the_surface_and_is_reached(shape):
    """On a convex surface a point's own normal is the direction in which it is the foremost."""
    points = surface_points(shape, np.random.default_rng(2))
    normals = shape.gradient(points)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    reach = shape.support(normals)
    bounded = np.isfinite(reach)
    np.testing.assert_allclose(np.einsum("ni,ni->n", points, normals)[bounded], reach[bounded], atol=2e-8)
    assert (points @ normals[bounded].T <= reach[bounded] + 1e-8).all()


@pytest.mark.parametrize("shape", [s for s in SHAPES if not isinstance(s, tools.Fingertip)], ids=str)
def test_outside_it_is_the_distance_to_the_surface(shape):
    """A point moved out along the normal by t is t away; of an ellipsoid the formula is of first order only."""
    points = surface_points(shape, np.random.default_rng(3))
    moved = points + 0.003 * shape.gradient(points)
    np.testing.assert_allclose(shape.distance(moved), 0.003, atol=1e-7)


@shapes
@pytest.mark.parametrize("share", [0.2, 0.8])
def test_the_cut_is_as_wide_as_its_half_widths_say(shape, share):
    """At the end of each half width, at the depth of the cut, the distance is zero."""
    depth = share * shape.least_radius if not isinstance(shape, tools.Cone) else 3 * share * shape.tip
    half_x, half_y = shape.half_widths(depth)
    ends = np.array([[half_x, 0, depth - shape.front], [0, half_y, depth - shape.front]])
    np.testing.assert_allclose(shape.distance(ends), 0.0, atol=1e-9)


def test_a_sphere_within_a_tool_of_its_sizes():
    """A capsule, a box and a cylinder that leave nothing but their rounding are nearly a ball's distance."""
    rng = np.random.default_rng(4)
    points = 0.02 * rng.normal(size=(50, 3))
    ball = tools.Sphere(0.005).distance(points)
    np.testing.assert_allclose(
        tools.Box(0.01, 0.01, 0.01, 0.005).distance(points)[ball > 0], ball[ball > 0], atol=1e-8
    )
    np.testing.assert_allclose(
        tools.Cylinder(0.005, 0.01, 0.005).distance(points)[ball > 0], ball[ball > 0], atol=1e-8
    )
    np.testing.assert_allclose(tools.Capsule(0.005, 0.01 + 1e-9).distance(points), ball, atol=1e-8)


@shapes
def test_the_same_distance_in_finite_elements(shape):
    """A coefficient function has the values of the array."""
    import ngsolve as ngs
    from netgen.csg import unit_cube

    mesh = ngs.Mesh(unit_cube.GenerateMesh(maxh=1))
    scaled = 0.02 * (ngs.CF((ngs.x, ngs.y, ngs.z)) - ngs.CF((0.5, 0.45, 0.6)))
    places = np.random.default_rng(5).random((20, 3))
    found = [shape.distance(scaled)(mesh(*place)) for place in places]
    np.testing.assert_allclose(found, shape.distance(0.02 * (places - [0.5, 0.45, 0.6])), atol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: tools.Capsule(0.006, 0.010), "more than 12 mm"),
        (lambda: tools.Punch(0.006, 0.007), "at most 0.006"),
        (lambda: tools.Box(0.01, 0.01, 0.002, 0.003), "at most 0.001"),
        (lambda: tools.Cone(75, 0.002), "radians"),
        (lambda: tools.Sphere(-1.0), "radius of a sphere"),
        (lambda: tools.Fingertip(size_y=0), "along y"),
    ],
)
def test_impossible_shapes_are_refused(make, words):
    with pytest.raises(UsageError, match=words):
        make()
