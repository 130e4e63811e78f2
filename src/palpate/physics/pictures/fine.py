"""A body as it is drawn: its elements in eight and its triangles in four, where mid-side nodes are known.

An element of second order bends between its vertices; drawn by these alone, a dent a few elements wide looks faceted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["EDGES", "FineBody", "fine_body", "middles_of"]

QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])  # of a triangle; 3, 4, 5 between 01, 12, 20
SIDES = np.array([[0, 1], [1, 2], [2, 0]])
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
# of a tetrahedron; 4 … 9 between the ends of `EDGES`. The octahedron in the middle is parted along 5-8
EIGHTHS = np.array(
    [
        *([0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]),
        *([5, 8, 4, 7], [5, 8, 7, 9], [5, 8, 9, 6], [5, 8, 6, 4]),
    ]
)


@dataclass(frozen=True, eq=False)
class FineBody:
    """Nodes and cells to draw; the first nodes are the mesh's own.

    Attributes
    ----------
    points, displacement : (node, 3) array
        m.
    triangles : (t, 3) int array
        Outer surface.
    surface_of : (t,) int array
        Index into `surfaces`.
    tetrahedra : (e, 4) int array
    wires : (s, 2) int array
        The edges of the mesh's own triangles, in pieces.
    edges : (m, 2) int array
        Vertices that the further nodes lie between.
    surfaces : tuple of str
    """

    points: np.ndarray
    displacement: np.ndarray
    triangles: np.ndarray
    surface_of: np.ndarray
    tetrahedra: np.ndarray
    wires: np.ndarray
    edges: np.ndarray
    surfaces: tuple[str, ...]

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Values (node,) at all nodes, from those at the mesh's own."""
        return np.concatenate([values, values[self.edges].mean(axis=1)])


def fine_body(solution: Any) -> FineBody:
    """What to draw of a solution: all that it knows of the displacement."""
    mesh = solution.mesh
    displacement = np.asarray(solution.displacement, dtype=float)
    between = getattr(solution, "mid_sides", None)
    sides = mesh.triangles[:, SIDES].reshape(-1, 2)
    if between is None:
        wires, none = np.unique(np.sort(sides, axis=1), axis=0), np.empty((0, 2), dtype=np.int64)
        cells = (mesh.triangles, mesh.surface_of, mesh.tetrahedra)
        return FineBody(mesh.points, displacement, *cells, wires, none, mesh.surfaces)
    count = len(mesh.points)
    six = np.concatenate(
        [mesh.triangles, count + middles_of(between.edges, mesh.triangles[:, SIDES])], axis=1
    )
    ten = np.concatenate(
        [mesh.tetrahedra, count + middles_of(between.edges, mesh.tetrahedra[:, EDGES])], axis=1
    )
    middle = six[:, 3:].ravel()
    halves = np.concatenate([np.stack([sides[:, end], middle], axis=1) for end in (0, 1)])
    return FineBody(
        np.concatenate([mesh.points, between.points]),
        np.concatenate([displacement, between.displacement]),
        six[:, QUARTERS].reshape(-1, 3),
        np.repeat(mesh.surface_of, 4),
        ten[:, EIGHTHS].reshape(-1, 4),
        np.unique(halves, axis=0),
        between.edges,
        mesh.surfaces,
    )


def middles_of(edges: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which of the edges (m, 2), in ascending order, have the given ends (..., 2)."""
    span = int(edges.max()) + 1
    wanted = np.sort(ends, axis=-1)
    keys = edges[:, 0] * span + edges[:, 1]
    return np.asarray(np.searchsorted(keys, wanted[..., 0] * span + wanted[..., 1]))
