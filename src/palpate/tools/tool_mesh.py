"""The surface of a tool as triangles, for the eye: a grid of normals, and at each the point of the tool that faces it.

The support function h(n) = max n·y of a convex tool is continued to all vectors as |d| h(d/|d|); its gradient at a unit
normal n is the point of the surface where n is the normal. So a grid of normals is fine where a tool is round and
coarse where it is flat. A normal across which the gradient jumps, such as that of a flat face, belongs to a whole
face: the central difference finds its middle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.tools.tool_shape import Tool

__all__ = ["ToolMesh", "tool_mesh"]

# degrees in a right angle: near its ends, so that faces across the axes are drawn flat
QUARTER = (1.0, 13.0, 26.0, 39.0, 51.0, 64.0, 77.0, 89.0)
STEP = 1e-6  # of the difference of the support function
HALVINGS = 40  # of the search for the last normal that a long tool has
TALL = 4.0  # length of the side of a long tool that is drawn, over its size


@dataclass(frozen=True, eq=False)
class ToolMesh:
    """A closed surface of triangles."""

    points: np.ndarray  # (n, 3), m, from the tool's centre in its own frame
    normals: np.ndarray  # (n, 3), outward unit normals there
    triangles: np.ndarray  # (t, 3) int, counter-clockwise as seen from outside


def tool_mesh(shape: Tool) -> ToolMesh:
    """Return the surface of a tool; of the side of one without an end, four times its size."""
    rows = [0.0, *QUARTER, *(180.0 - angle for angle in reversed(QUARTER)), 180.0]
    last = _last_angle(shape)
    if last < math.pi:
        rows = [*(math.degrees(last) * angle / 90.0 for angle in (0.0, *QUARTER)), math.degrees(last)]
    columns = np.radians([quarter + angle for quarter in (0.0, 90.0, 180.0, 270.0) for angle in QUARTER])
    tilt, turn = np.radians(rows)[:, None], columns[None]
    normals = np.stack(
        np.broadcast_arrays(np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)), axis=-1
    )
    points: np.ndarray = _facing(shape, normals.reshape(-1, 3)).reshape(normals.shape)
    if last < math.pi:
        points, normals = _with_shaft(shape, points, normals, last, columns)
    return ToolMesh(
        points.reshape(-1, 3), normals.reshape(-1, 3), _grid_triangles(points.shape[0], points.shape[1])
    )


def _facing(shape: Tool, normals: np.ndarray) -> np.ndarray:
    """Return the points (n, 3) in m at which a tool has normals (n, 3)."""

    def reach(d: np.ndarray) -> np.ndarray:
        length = np.linalg.norm(d, axis=1)
        return np.asarray(length * shape.support(d / length[:, None]))

    # a long tool ends at its last normal: beyond that there is no difference
    inward = 1.0 - 2.0 * STEP
    normals = np.column_stack([inward * normals[:, :2], normals[:, 2] - (1.0 - inward)])
    steps = STEP * np.eye(3)
    changes = [reach(normals + step) - reach(normals - step) for step in steps]
    return np.asarray(np.stack(changes, axis=-1) / (2 * STEP))


def _last_angle(shape: Tool) -> float:
    """Return the largest angle in rad from −z at which a tool has a normal: π for one that ends."""

    def has(angle: float) -> bool:
        normal = np.array([[math.sin(angle), 0.0, -math.cos(angle)]])
        return bool(np.isfinite(shape.support(normal))[0])

    if has(math.pi):
        return math.pi
    low, high = 0.0, math.pi
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if has(middle) else (low, middle)
    return low - 4.0 * STEP


def _with_shaft(
    shape: Tool, points: np.ndarray, normals: np.ndarray, last: float, columns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals (r, c, 3) of a long tool with its side up to a height, and a lid."""
    along = np.stack([math.cos(last) * np.cos(columns), math.cos(last) * np.sin(columns)], axis=-1)
    along = np.column_stack([along, np.full(len(columns), math.sin(last))])
    top = points[-1] + TALL * shape.size * along
    middle = np.broadcast_to(top.mean(axis=0), top.shape)
    up = np.broadcast_to([0.0, 0.0, 1.0], top.shape)
    return (
        np.concatenate([points, top[None], top[None], middle[None]]),
        np.concatenate([normals, normals[-1:], up[None], up[None]]),
    )


def _grid_triangles(rows: int, columns: int) -> np.ndarray:
    """Return the triangles (t, 3) of a grid that closes around its columns, counter-clockwise as seen from outside."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
