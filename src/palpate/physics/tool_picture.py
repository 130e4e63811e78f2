"""A rigid tool in a picture of a solved body: its surface beside the body, and its outline."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.tools import PosedTool
from palpate.tools.tool_mesh import ToolMesh, tool_mesh

__all__ = ["outline_of", "tool_surface"]

SAME = 9  # decimals of places in m that are one


def tool_surface(solution: Any) -> ToolMesh | None:
    """Return the surface of the tool of a solution where it presses; None where no tool does."""
    tool, pose = getattr(solution, "tool", None), getattr(solution, "pose", None)
    if tool is None or pose is None:
        return None
    meshes = [_surface_at(own, x) for own, x in tool.solids(pose)]
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    return ToolMesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, first, strict=False)]),
    )


def _surface_at(tool: PosedTool, x: np.ndarray) -> ToolMesh:
    """Return the surface of one tool at its own inputs."""
    place, turn = tool.pose(x)
    mesh = tool_mesh(tool.shape)
    points = place + (mesh.points + np.array([0.0, 0.0, tool.shape.front])) @ turn.T
    return ToolMesh(points, mesh.normals @ turn.T, mesh.triangles)


def outline_of(mesh: ToolMesh, towards: np.ndarray) -> np.ndarray:
    """Return the segments (s, 2, 3) in m of a tool's silhouette as it is seen from a direction (3,)."""
    places, which = np.unique(mesh.points.round(SAME), axis=0, return_inverse=True)
    triangles = which.ravel()[mesh.triangles]
    # by the normals of the tool: those of narrow triangles between flat parts are lost in rounding
    facing = mesh.normals[mesh.triangles].sum(axis=1) @ towards > 0
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    sides = np.concatenate([facing, facing, facing])
    seen = {tuple(edge) for edge in edges[sides].tolist()}
    hidden = {(b, a) for a, b in edges[~sides].tolist()}
    between = np.array(sorted(edge for edge in seen & hidden if edge[0] != edge[1]), dtype=int).reshape(-1, 2)
    return np.asarray(places[between])
