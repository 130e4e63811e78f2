"""The drawing of a body whose own surface is finer than the triangles of its fields."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from slabs import HALF, carried_slab

from palpate.runtime.touchable import touchable
from palpate.viewer.surface_drawing import SurfaceDrawing


def test_the_own_surface_is_drawn_with_sharp_edges():
    body = carried_slab()
    drawing, shown = SurfaceDrawing(touchable(body)), body.fields["displacement"]
    points, triangles = shown.pictured
    rest = drawing.surface.rest.reshape(-1, 3)
    faces = drawing.surface.triangles.reshape(-1, 3)
    np.testing.assert_array_equal(rest[faces], points[triangles])
    a, b, c = np.moveaxis(rest[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # the six faces share no point, and so no normal: 31² on each of six sides
    assert len(rest) == 6 * 31**2
    assert np.abs(normals).max(axis=1).min() > 1 - 1e-12


def test_the_touched_side_alone_can_be_touched():
    drawing = SurfaceDrawing(touchable(carried_slab()))
    corners = drawing.surface.rest.reshape(-1, 3)[drawing.surface.triangles.reshape(-1, 3)]
    top = (corners[:, :, 2] > -1e-9).all(axis=1)
    np.testing.assert_array_equal(drawing.surface.touchable > 0, top)


def test_modes_and_local_mode_are_those_of_the_nodes_that_carry_them():
    body = carried_slab()
    drawing, shown = SurfaceDrawing(touchable(body)), body.fields["displacement"]
    got = drawing.modes(0)
    wanted = shown.at_pictured(shown.modes)[:, drawing.nodes]
    np.testing.assert_array_equal(got.modes.reshape(wanted.shape), wanted)
    shares = np.zeros(len(drawing.nodes))
    shares[got.touched] = got.shares
    inner = np.abs(shown.pictured[0][drawing.nodes][:, :2]).max(axis=1) < 0.7 * HALF
    top = shown.pictured[0][drawing.nodes][:, 2] > -1e-9
    np.testing.assert_allclose(shares[inner & top], 1.0, atol=1e-12)
    assert not shares[shown.pictured[0][drawing.nodes][:, 2] < -0.006].any()


def test_a_field_without_an_own_surface_is_drawn_on_its_triangles():
    body = carried_slab()
    fields = {name: replace(field, drawn=None) for name, field in body.fields.items()}
    plain, coarse = (
        SurfaceDrawing(touchable(replace(body, fields=fields))),
        SurfaceDrawing(touchable(body), detail=False),
    )
    np.testing.assert_array_equal(plain.surface.rest, coarse.surface.rest)
    np.testing.assert_array_equal(plain.modes(0).modes, coarse.modes(0).modes)
