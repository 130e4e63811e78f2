"""The tool that presses a body as a page draws it: its surface around its place, and how it may turn or open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.tools import Gripper, PosedTool
from palpate.tools.gripper import OPENING
from palpate.tools.tool_mesh import tool_mesh
from palpate.units import Range
from palpate.viewer.messages import DrawnTool

__all__ = ["drawn_tool"]

DIGITS = 7  # decimals of lengths in m: a tenth of a micrometre


def drawn_tool(
    tool: PosedTool | Gripper, parameters: tuple[Range, ...] = (), shift: Sequence[float] = (0.0, 0.0, 0.0)
) -> DrawnTool:
    """Return a tool as the page draws it; `parameters` are the inputs that a hand does not supply.

    `shift` (3,) is the way in m from its place to the ball whose depth counts.
    """
    names = [parameter.name for parameter in parameters]
    if isinstance(tool, Gripper):
        return _drawn_jaws(tool, names.index(OPENING) if OPENING in names else -1)
    points, normals, triangles = _posed_mesh(tool)
    x, y, z = tool.to_centre.tolist()
    a, b, c = (names.index(name) if name in names else -1 for name in ("tip_rx", "tip_ry", "tip_rz"))
    return DrawnTool(
        words=str(tool),
        centre=(x, y, z),
        shift=(float(shift[0]), float(shift[1]), float(shift[2])),
        points=tuple(points.round(DIGITS).ravel().tolist()),
        normals=tuple(normals.round(4).ravel().tolist()),
        triangles=tuple(triangles.ravel().tolist()),
        turns=(a, b, c),
    )


def _posed_mesh(tool: PosedTool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (n, 3) in m from its place, normals (n, 3) and triangles (t, 3) of a tool in its orientation."""
    mesh, turn = tool_mesh(tool.shape), np.eye(3) if tool.turn is None else tool.turn
    return mesh.points @ turn.T + tool.to_centre, mesh.normals @ turn.T, mesh.triangles


def _drawn_jaws(gripper: Gripper, opening: int) -> DrawnTool:
    """Return two jaws that touch each other in the middle; a parameter, if any, is their opening."""
    first, last = (_posed_mesh(jaw) for jaw in gripper.jaws)
    points, normals = (np.concatenate([first[i], last[i]]) for i in range(2))
    x, y, z = gripper.along.tolist()
    return DrawnTool(
        words=str(gripper),
        centre=(0.0, 0.0, 0.0),
        shift=(0.0, 0.0, 0.0),
        points=tuple(points.round(DIGITS).ravel().tolist()),
        normals=tuple(normals.round(4).ravel().tolist()),
        triangles=tuple(np.concatenate([first[2], last[2] + len(first[0])]).ravel().tolist()),
        turns=(-1, -1, -1),
        opening=opening,
        along=(x, y, z),
        first=len(first[0]),
    )
