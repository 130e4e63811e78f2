"""The surface of a tool that is drawn lies on the tool, closed, with the normals of its distance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.tools import Cone, PosedTool, Punch, Tool
from palpate.tools.tool_mesh import STEP, TALL, tool_mesh
from palpate.tools.tool_sizes import USUAL

SHAPES = (*USUAL.values(), Punch(0.008, 0.0001), Cone(math.radians(85), 0.002))


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_points_lie_on_the_tool_with_its_normals(shape: Tool):
    mesh = tool_mesh(shape)
    # the lid of a long tool is where it is cut off, not on it
    own = (
        np.abs(mesh.normals[:, 2] - 1.0) > 1e-9
        if isinstance(shape, Punch | Cone)
        else np.full(len(mesh.points), True)
    )
    points, normals = mesh.points[own], mesh.normals[own]
    # the side of a long tool leaves it by four steps of the differences in angle
    assert np.abs(shape.distance(points)).max() < 1.01 * 4 * STEP * TALL * shape.size + 1e-8
    outside = points + 1e-4 * normals
    np.testing.assert_allclose(shape.distance(outside), 1e-4, atol=2e-6)
    assert points[:, 2].min() == pytest.approx(-shape.front, abs=1e-7)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_it_is_closed_and_looks_outwards(shape: Tool):
    mesh = tool_mesh(shape)
    places, which = np.unique(mesh.points.round(9), axis=0, return_inverse=True)
    triangles = which.ravel()[mesh.triangles]
    triangles = triangles[
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    ]
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forth = {tuple(edge) for edge in edges.tolist()}
    assert len(forth) == len(edges)
    assert forth == {(b, a) for a, b in forth}
    a, b, c = places[triangles].swapaxes(0, 1)
    assert np.einsum("ti,ti->", a, np.cross(b, c)) > 0


def test_the_lowest_point_of_a_tilted_mesh_is_where_the_tool_touches_a_plane():
    tool = PosedTool(USUAL["capsule"], (0.1, 0.2, 0.3))
    up = np.array([[0.0, 0.0, 1.0]])
    mesh = tool_mesh(tool.shape)
    heights = (mesh.points @ tool.turn.T + tool.to_centre)[:, 2]
    # normals of the mesh are 13° apart at most: the plane is missed by R (1 − cos 6.5°)
    assert 0.0 <= tool.offset(up)[0] + heights.min() < tool.shape.radius * (1 - math.cos(math.radians(6.6)))
