"""Closed surfaces of triangles: reading, cleaning and the faults that make them no body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Triangulation", "edge_faces", "merged", "require_closed"]


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Triangles in space.

    Attributes
    ----------
    points : (n, 3) array
        In m.
    triangles : (t, 3) int array
        Counter-clockwise as seen from outside.
    """

    points: np.ndarray
    triangles: np.ndarray

    @property
    def corners(self) -> np.ndarray:
        """Corners of each triangle in m, shape (t, 3, 3)."""
        return np.asarray(self.points[self.triangles])

    @property
    def normals(self) -> np.ndarray:
        """Unit normal of each triangle, shape (t, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        normal = np.cross(b - a, c - a)
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))

    @property
    def volume(self) -> float:
        """Enclosed volume in m³; negative if the triangles face inwards."""
        return float(np.linalg.det(self.corners - self.points.mean(axis=0)).sum() / 6)

    @property
    def longest(self) -> float:
        """Longest side of the box around it in m."""
        return float((self.points.max(axis=0) - self.points.min(axis=0)).max())


def merged(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Unite points that coincide to 1e-6 of the body's length; drop triangles without area and duplicates.

    Parameters
    ----------
    points : (n, 3) array
    triangles : (t, 3) int array
    """
    tolerance = 1e-6 * float((points.max(axis=0) - points.min(axis=0)).max() or 1.0)
    _, first, inverse = np.unique(
        np.round(points / tolerance), axis=0, return_index=True, return_inverse=True
    )
    nodes = inverse.ravel()[triangles]
    a, b, c = nodes.T
    nodes = nodes[(a != b) & (b != c) & (c != a)]
    united = points[first]
    p, q, r = np.moveaxis(united[nodes], 1, 0)
    return Triangulation(united, nodes[np.linalg.norm(np.cross(q - p, r - p), axis=1) > tolerance**2])


def edge_faces(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of a triangulation.

    Returns
    -------
    edges : (k, 2) int array
        Nodes of each edge, the smaller first.
    edge_of : (t, 3) int array
        Index of the edges 01, 12 and 20 of each triangle.
    count : (k,) int array
        How many triangles each edge belongs to.
    """
    pairs = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    edges, inverse, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    return edges, inverse.reshape(-1, 3), count


def require_closed(surface: Triangulation, source: str) -> None:
    """Refuse a surface that bounds no body: empty, open, not a manifold, facing inwards or cutting itself.

    Raises
    ------
    UsageError
        Naming the fault, how many edges have it and where.
    """
    if not len(surface.triangles):
        raise UsageError(
            f"{source} holds no triangles.",
            why="The file is empty.",
            fix="Export the surface of the body again.",
        )
    edges, _, count = edge_faces(surface.triangles)
    open_edges, crowded = edges[count == 1], edges[count > 2]
    if len(open_edges):
        raise UsageError(
            f"The surface of {source} is open: {len(open_edges)} edges belong to one triangle only.",
            why=f"There is a hole {_where(surface, open_edges)}, and a body needs a closed surface.",
            fix="Close the hole in the program that made the file, with its repair or fill-holes function.",
        )
    if len(crowded):
        raise UsageError(
            f"The surface of {source} is not a manifold: {len(crowded)} edges belong to more than two triangles.",
            why=f"Sheets meet {_where(surface, crowded)}, so that inside and outside are not defined.",
            fix="Remove inner walls and doubled sheets, or unite touching bodies, before the export.",
        )
    _require_oriented(surface, source)
    if (crossing := _crossing(surface)) is not None:
        at = ", ".join(f"{v:.4g}" for v in surface.corners[crossing[0]].mean(axis=0))
        raise UsageError(
            f"The surface of {source} cuts itself: triangles {crossing[0]} and {crossing[1]} cross.",
            why=f"They do so near ({at}) m; a body's surface has an inside and an outside everywhere.",
            fix="Unite overlapping parts (Boolean union) in the program that made the file.",
        )


def _require_oriented(surface: Triangulation, source: str) -> None:
    ordered = np.stack([surface.triangles, np.roll(surface.triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    twice = len(ordered) - len(np.unique(ordered, axis=0))
    if twice:
        raise UsageError(
            f"The triangles of {source} disagree on which side is outside, along {twice} edges.",
            why="Some of them are inverted: their corners run the other way than their neighbours'.",
            fix="Make the normals consistent (recalculate outside) and export again.",
        )
    if surface.volume < 0:
        raise UsageError(
            f"The surface of {source} is inside out.",
            why="Its triangles face inwards, so that the body would be everything around it.",
            fix="Flip the normals and export again.",
        )


def _where(surface: Triangulation, edges: np.ndarray) -> str:
    middle = surface.points[edges].mean(axis=(0, 1))
    return "around (" + ", ".join(f"{v:.4g}" for v in middle) + ") m"


def _crossing(surface: Triangulation) -> tuple[int, int] | None:
    """Two triangles that cross without sharing a node; None where there are none."""
    corners = surface.corners
    low, high = corners.min(axis=1), corners.max(axis=1)
    order = np.argsort(low[:, 0], kind="stable")
    starts = low[order, 0]
    for rank, i in enumerate(order):
        stop = int(np.searchsorted(starts, high[i, 0], side="right"))
        others = order[rank + 1 : stop]
        near = others[((low[others] <= high[i]) & (high[others] >= low[i])).all(axis=1)]
        near = near[~(surface.triangles[near][:, :, None] == surface.triangles[i]).any(axis=(1, 2))]
        if len(near):
            mine = np.broadcast_to(corners[i], (len(near), 3, 3))
            hit = _pierces(mine, corners[near]) | _pierces(corners[near], mine)
            if hit.any():
                return int(i), int(near[hit.argmax()])
    return None


def _pierces(edges_of: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Whether an edge of one triangle passes through the inside of the other; both (n, 3, 3), result (n,).

    Segment against triangle by Möller & Trumbore 1997 (J. Graph. Tools 2, 21-28).
    """
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    hit = np.zeros(len(triangles), dtype=bool)
    for k in range(3):
        start = edges_of[:, k]
        along = edges_of[:, (k + 1) % 3] - start
        across = np.cross(along, v)
        determinant = np.einsum("ni,ni->n", u, across)
        slanted = np.abs(determinant) > 1e-12 * np.linalg.norm(u, axis=1) * np.linalg.norm(across, axis=1)
        scale = 1 / np.where(slanted, determinant, 1.0)
        reach = start - a
        turned = np.cross(reach, u)
        p = scale * np.einsum("ni,ni->n", reach, across)
        q = scale * np.einsum("ni,ni->n", along, turned)
        t = scale * np.einsum("ni,ni->n", v, turned)
        edge = 1e-9
        hit |= slanted & (p > edge) & (q > edge) & (p + q < 1 - edge) & (t > edge) & (t < 1 - edge)
    return hit
