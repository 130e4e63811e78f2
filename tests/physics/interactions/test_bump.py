"""The bump under pads and point forces, and the surface's own coordinates."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.interactions.bump import (
    QUADRATURE,
    bump,
    bump_area,
    chart_at,
    chart_of,
    require_on_surface,
)
from palpate.physics.shapes import Block, Cylinder, FineMesh

BLOCK = Block((0.04, 0.03, 0.02), element=0.01)


def test_its_integral_over_a_plane_is_a_quarter_of_the_disc():
    import ngsolve

    mesh = Block((0.04, 0.03, 0.02)).mesh((FineMesh("top", 0.004),))
    weight = bump(chart_of(BLOCK.rest(), "top"), (0.021, 0.014), 0.008)
    surface = ngsolve.ds(definedon=mesh.Boundaries("top"), bonus_intorder=QUADRATURE)
    assert ngsolve.Integrate(weight * surface, mesh) == pytest.approx(bump_area(0.008), rel=1e-5)
    assert bump_area(0.008) == pytest.approx(math.pi * 0.008**2 / 4)


def test_it_is_there_on_the_side_that_faces_the_axis_only():
    """On a round side seen along x, the far half of the cylinder has none."""
    import ngsolve

    solid = Cylinder(radius=0.02, height=0.04)
    mesh, chart = solid.mesh(), chart_of(solid.rest(), "side", "+x")
    weight = bump(chart, (0.0, 0.02), 0.01)
    surface = ngsolve.ds(definedon=mesh.Boundaries("side"), bonus_intorder=QUADRATURE)
    middle = ngsolve.Integrate(weight * ngsolve.x * surface, mesh) / ngsolve.Integrate(weight * surface, mesh)
    assert 0.018 < middle < 0.02


@pytest.mark.parametrize(
    ("point", "surface", "axis", "sign"),
    [
        ((0.01, 0.01, 0.02), "top", 2, 1),
        ((0.01, 0.01, 0.0), "bottom", 2, -1),
        ((0.0, 0.01, 0.01), "side", 0, -1),
    ],
)
def test_a_surface_is_seen_along_the_axis_that_it_faces(point, surface, axis, sign):
    chart = chart_at(BLOCK.rest(), surface, point)
    assert (chart.axis, chart.sign) == (axis, sign)
    assert chart.names == tuple(n for i, n in enumerate("xyz") if i != axis)


def test_a_surface_that_faces_all_ways_asks_for_a_side():
    with pytest.raises(UsageError, match="faces all ways"):
        chart_of(BLOCK.rest(), "side")
    assert chart_of(BLOCK.rest(), "side", "-y").axis == 1


def test_a_point_beside_the_surface_is_refused():
    with pytest.raises(
        UsageError, match=r"nearest point of that surface is \(0.01, 0.01, 0.02\) m, 0.01 m away"
    ):
        chart_at(BLOCK.rest(), "top", (0.01, 0.01, 0.03))


def test_a_footprint_over_the_edge_is_refused():
    mesh, chart = BLOCK.rest(), chart_of(BLOCK.rest(), "top")
    inside, near = np.array([0.01, 0.01]), np.array([0.004, 0.01])
    require_on_surface(mesh, chart, inside, inside, 0.008)
    with pytest.raises(UsageError, match="hangs over the edge"):
        require_on_surface(mesh, chart, near, near, 0.008)
    with pytest.raises(UsageError, match="hangs over the edge"):
        require_on_surface(mesh, chart, near, inside, 0.008)
