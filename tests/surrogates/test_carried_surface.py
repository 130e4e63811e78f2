"""A surface carried by triangles of six nodes, against mathematics."""

from __future__ import annotations

from dataclasses import replace

import field_made
import numpy as np
import pytest
from touch_made import touch_energy

from palpate.dataset.carried_surface import CarriedSurface, quadratic_triangles, quarter_triangles
from palpate.errors import UsageError
from palpate.surrogates import FieldSurrogate, Surrogate

RADIUS = 0.05


def sphere(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a sphere: an octahedron whose triangles are halved so many times, m."""
    points = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    triangles = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    )
    for _ in range(parts):
        edges, cells = quadratic_triangles(triangles, len(points))
        points, triangles = np.concatenate([points, points[edges].sum(axis=1)]), quarter_triangles(cells)
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return RADIUS * points, triangles


def bound(coarse: int, fine: int) -> tuple[CarriedSurface, np.ndarray, np.ndarray]:
    """A fine sphere bound to a coarse one, with the coarse one's six-node triangles: nodes (n, 3) and quarters."""
    points, triangles = sphere(coarse)
    edges, cells = quadratic_triangles(triangles, len(points))
    nodes = np.concatenate([points, points[edges].mean(axis=1)])
    return CarriedSurface.bind(*sphere(fine), nodes, cells), nodes, quarter_triangles(cells)


def feet(own: CarriedSurface, nodes: np.ndarray, quarters: np.ndarray) -> np.ndarray:
    return own.carry(nodes, quarters)


def test_affine_and_quadratic_fields_are_carried_exactly():
    own, nodes, quarters = bound(2, 4)
    random = np.random.default_rng(0)
    at = feet(own, nodes, quarters)
    A, b, Q = random.normal(size=(3, 3)), random.normal(size=3), random.normal(size=(3, 3, 3))
    affine = own.carry(nodes @ A + b, quarters)
    np.testing.assert_allclose(affine, at @ A + b, rtol=0, atol=1e-13)

    def quadratic(x: np.ndarray) -> np.ndarray:
        return x @ A + np.einsum("cij,pi,pj->pc", Q, x, x)

    np.testing.assert_allclose(own.carry(quadratic(nodes), quarters), quadratic(at), rtol=0, atol=1e-13)


def test_many_fields_are_carried_at_once():
    own, nodes, quarters = bound(1, 3)
    fields = np.random.default_rng(1).normal(size=(4, len(nodes), 2))
    together = own.carry(fields, quarters)
    np.testing.assert_array_equal(together, [own.carry(field, quarters) for field in fields])


def test_each_vertex_is_bound_to_its_nearest_place():
    own, nodes, quarters = bound(2, 3)
    distance = np.linalg.norm(own.points - feet(own, nodes, quarters), axis=1)
    # a dense cloud of places on the coarse surface comes no nearer
    w = np.random.default_rng(2).dirichlet(np.ones(3), 4000)
    places = np.einsum("gk,tki->gti", w, nodes[quarters]).reshape(-1, 3)
    some = np.random.default_rng(3).permutation(len(own.points))[:30]
    nearest = np.array([np.linalg.norm(places - own.points[i], axis=1).min() for i in some])
    assert (distance[some] <= nearest + 1e-12).all()
    assert (own.weights >= 0).all()
    np.testing.assert_allclose(own.weights.sum(axis=1), 1.0, atol=1e-12)


def test_the_sides_of_a_thin_wall_are_told_apart():
    """The lower side of a sheet hangs on the lower side of coarser elements, though the upper is as near."""
    thick, side = 1e-4, np.linspace(-0.01, 0.01, 9)
    grid = np.array([[x, y, 0.0] for x in side for y in side])
    lower = np.array([[i, i + 9, i + 1] for i in range(71) if i % 9 < 8])[:, ::-1]
    half = np.array([0.0, 0.0, thick / 2])
    fine = np.concatenate([grid + half, grid - half])
    triangles = np.concatenate([lower[:, ::-1], lower + 81])
    square = 0.012 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    rough = np.concatenate([square - 0.2 * half, square + 0.2 * half])  # sides cross
    pairs = np.array([[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]])
    edges, cells = quadratic_triangles(pairs, len(rough))
    own = CarriedSurface.bind(fine, triangles, np.concatenate([rough, rough[edges].mean(axis=1)]), cells)
    used = np.unique(triangles)
    upper = used < 81
    assert (own.cells[used[upper]] < 2).all()
    assert (own.cells[used[~upper]] >= 2).all()


def test_error_falls_with_the_third_power_of_the_element():
    """A smooth field on a curved surface, carried by finer and finer elements."""

    def smooth(x: np.ndarray) -> np.ndarray:
        return np.sin(x / RADIUS @ np.array([[1.0, 0.3, 0.0], [0.2, 1.1, 0.5], [0.0, -0.4, 0.9]]))

    def error(coarse: int) -> float:
        own, nodes, quarters = bound(coarse, 5)
        return float(np.abs(own.carry(smooth(nodes), quarters) - smooth(feet(own, nodes, quarters))).max())

    assert np.log2(error(2) / error(3)) > 2.5


def drawn_field() -> FieldSurrogate:
    """A field on triangles of six nodes of a square grid, which carry a finer one."""
    made = field_made.field(curved=False)
    side = 15  # a node in the middle of each coarse edge
    k = (np.arange(0, side - 1, 2)[:, None] * side + np.arange(0, side - 1, 2)).ravel()
    corners = np.vstack(
        [
            np.stack([k, k + 2 * side, k + 2], 1),
            np.stack([k + 2, k + 2 * side, k + 2 * side + 2], 1),
        ]
    )
    cells = np.hstack([corners, (corners + np.roll(corners, -1, axis=1)) // 2])
    fine = field_made.grid(29)
    own = CarriedSurface.bind(fine[0][:-1], fine[1], made.points, cells)
    return replace(made, triangles=quarter_triangles(cells), drawn=own)


def test_a_field_keeps_its_drawn_surface_in_the_file(tmp_path):
    field = drawn_field()
    file = Surrogate(touch_energy(), {"displacement": field}).save(tmp_path / "body.palpate")
    back = Surrogate.load(file).fields["displacement"]
    for name in ("points", "triangles", "cells", "weights"):
        np.testing.assert_array_equal(getattr(back.drawn, name), getattr(field.drawn, name))


def test_a_binding_to_other_triangles_is_refused():
    field = drawn_field()
    with pytest.raises(UsageError, match="drawn surface is bound to triangles that are not there"):
        replace(field, triangles=field.triangles[:4])
