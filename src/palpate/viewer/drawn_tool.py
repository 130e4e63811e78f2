"""The tool that presses a body as a page draws it: its surface around its place, and how it may be turned."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.tools import PosedTool
from palpate.tools.tool_mesh import tool_mesh
from palpate.units import Range
from palpate.viewer.messages import DrawnTool

__all__ = ["drawn_tool"]

DIGITS = 7  # decimals of lengths in m: a tenth of a micrometre


def drawn_tool(
    tool: PosedTool, parameters: tuple[Range, ...] = (), shift: Sequence[float] = (0.0, 0.0, 0.0)
) -> DrawnTool:
    """Return a tool as the page draws it; `parameters` are the inputs that a hand does not supply.

    `shift` (3,) is the way in m from its place to the ball whose depth counts.
    """
    mesh, turn = tool_mesh(tool.shape), tool.turn
    points, normals = (
        (mesh.points, mesh.normals) if turn is None else (mesh.points @ turn.T, mesh.normals @ turn.T)
    )
    x, y, z = tool.to_centre.tolist()
    names = [parameter.name for parameter in parameters]
    a, b, c = (names.index(name) if name in names else -1 for name in ("tip_rx", "tip_ry", "tip_rz"))
    return DrawnTool(
        words=str(tool),
        centre=(x, y, z),
        shift=(float(shift[0]), float(shift[1]), float(shift[2])),
        points=tuple((points + tool.to_centre).round(DIGITS).ravel().tolist()),
        normals=tuple(normals.round(4).ravel().tolist()),
        triangles=tuple(mesh.triangles.ravel().tolist()),
        turns=(a, b, c),
    )
