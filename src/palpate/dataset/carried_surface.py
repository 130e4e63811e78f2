"""A body's own surface at full detail, carried by the coarser elements on which its field is known.

Each vertex of the surface is bound once to the nearest point of the elements' surface: a triangle and the barycentric
coordinates in it. Elements of second order bend between their vertices, so a triangle has six nodes, its corners and
the middles of its sides, and carries a value by their shape functions

    N = w (2 w − 1) at the corners,   4 w_a w_b in the middles of the sides.

A field of second order on the elements is carried exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np

from palpate.checks import own_arrays

if TYPE_CHECKING:
    from palpate.dataset.dataset import Dataset

__all__ = [
    "CarriedSurface",
    "has_middles",
    "quadratic_triangles",
    "quarter_triangles",
    "surface_nodes",
    "surface_values",
]

SIDES = ((0, 1), (1, 2), (2, 0))
QUARTERS = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))  # of a triangle of six nodes
GRAIN = 4  # parts of each side of a triangle, by whose corners near triangles are looked up
NEAREST = 24  # of these corners that a vertex is compared with
PART = 4096  # vertices that are bound at a time
AWAY = 1.0  # how far a triangle that faces the other way counts as farther, over the distance to the nearest ones


def quadratic_triangles(triangles: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges (m, 2) of triangles (t, 3), and the triangles with six nodes (t, 6).

    The middle of edge k is node `nodes` + k. Edges are sorted, so they follow from the triangles alone.
    """
    ends = np.sort(triangles[:, SIDES].reshape(-1, 2), axis=1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    return edges, np.hstack([triangles, nodes + which.reshape(-1, 3)])


def quarter_triangles(cells: np.ndarray) -> np.ndarray:
    """Return four triangles (4 t, 3) in place of each one of six nodes (t, 6)."""
    return np.asarray(cells[:, QUARTERS].reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class CarriedSurface:
    """A surface whose vertices are bound to triangles of six nodes."""

    points: np.ndarray  # (p, 3), its vertices at rest, m
    triangles: Annotated[np.ndarray, np.int64]  # (t, 3) of these, counter-clockwise as seen from outside
    # (p,), the triangle of six nodes that carries each vertex, counted along a field's triangles, four for each
    cells: Annotated[np.ndarray, np.int64]
    weights: np.ndarray  # (p, 3), barycentric coordinates in it, not negative; they add up to one

    def __post_init__(self) -> None:
        own_arrays(self, "points", "weights")
        own_arrays(self, "triangles", "cells", dtype=np.int64)

    @classmethod
    def bind(
        cls, points: np.ndarray, triangles: np.ndarray, nodes: np.ndarray, cells: np.ndarray
    ) -> CarriedSurface:
        """Bind vertices (p, 3) of triangles (t, 3) to triangles (c, 6) of nodes (n, 3) at rest; lengths in m."""
        from scipy.spatial import cKDTree

        corners, facing = nodes[cells[:, :3]], _normals(points, triangles)
        grid = _grid()
        tree, steps = cKDTree(np.einsum("gk,cki->cgi", grid, corners).reshape(-1, 3)), len(grid)
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        cell, weights = np.empty(len(points), np.int64), np.empty((len(points), 3))
        for first in range(0, len(points), PART):
            rows = slice(first, first + PART)
            near = tree.query(points[rows], k=min(NEAREST, len(cells) * steps))[1].reshape(
                len(points[rows]), -1
            )
            near = near // steps
            w = _nearest_weights(corners[near], points[rows])
            feet = np.einsum("pckj,pck->pcj", corners[near], w)
            distance = np.linalg.norm(feet - points[rows][:, None], axis=2)
            away = np.einsum("pci,pi->pc", across[near], facing[rows]) <= 0
            chosen = np.argmin(distance + AWAY * away * distance.max(axis=1, keepdims=True), axis=1)
            every = np.arange(len(chosen))
            cell[rows], weights[rows] = near[every, chosen], w[every, chosen]
        return cls(points, triangles, cell, weights)

    def fault_beside(self, triangles: np.ndarray) -> str:
        """Return what does not fit the triangles (4 c, 3) of a field; "" if all does."""
        count = len(self.points)
        if (
            self.points.shape != (count, 3)
            or self.weights.shape != (count, 3)
            or self.cells.shape != (count,)
        ):
            return f"its drawn surface has {self.cells.size} bindings of {count} vertices"
        if len(triangles) % 4 or ((self.cells < 0) | (4 * self.cells >= len(triangles))).any():
            return "its drawn surface is bound to triangles that are not there"
        own = self.triangles
        if own.shape != (len(own), 3) or ((own < 0) | (own >= count)).any():
            return "the triangles of its drawn surface are not of its vertices"
        finite = np.isfinite(self.points).all() and np.isfinite(self.weights).all()
        return "" if finite else "a number of its drawn surface is not finite"

    @cached_property
    def shares(self) -> np.ndarray:
        """Shape functions (p, 6) of the corners and the middles of the sides at each vertex."""
        w = self.weights
        return np.hstack([w * (2.0 * w - 1.0), 4.0 * np.stack([w[:, a] * w[:, b] for a, b in SIDES], axis=1)])

    def nodes(self, triangles: np.ndarray) -> np.ndarray:
        """Return the nodes (p, 6) that carry each vertex, from a field's triangles (4 c, 3)."""
        quarters = triangles.reshape(-1, 4, 3)[self.cells]
        return np.hstack([quarters[:, [0, 1, 2], [0, 1, 2]], quarters[:, 3]])

    def carry(self, values: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Return values (..., p, c) at the vertices, from those (..., n, c) at the nodes of a field's triangles."""
        nodes = self.nodes(triangles)
        out: np.ndarray = np.zeros((*values.shape[:-2], len(self.points), values.shape[-1]))
        for k in range(6):
            out += self.shares[:, k, None] * values[..., nodes[:, k], :]
        return out

    def spread_mark(self, mark: np.ndarray) -> np.ndarray:
        """Return for each triangle (t,) whether a corner is bound where a mark (4 c,) of a field's triangles is."""
        marked = np.asarray(np.asarray(mark, dtype=bool).reshape(-1, 4).any(axis=1))
        bound = marked[self.cells]
        return np.asarray(bound[self.triangles].any(axis=1))


def has_middles(data: Dataset) -> bool:
    """Return whether all rows have what carries the body's own surface; those of earlier versions have not."""
    known = "mid_displacement" in data and "drawn_points" in data
    return known and bool(np.isfinite(data["mid_displacement"]).all())


def surface_nodes(rest: np.ndarray, triangles: np.ndarray, middles: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface's nodes (n, 3) at rest, m, and its triangles (t, 3), or (t, 6) with middles of edges."""
    nodes, own = np.unique(triangles, return_inverse=True)
    points, own = rest[nodes], own.reshape(-1, 3)
    if not middles:
        return points, own
    edges, cells = quadratic_triangles(own, len(points))
    return np.concatenate([points, points[edges].mean(axis=1)]), cells


def surface_values(data: Dataset, name: str, middles: bool) -> np.ndarray:
    """Return a field (N, n, components) of all solves at the `surface_nodes`.

    A stress is averaged over the elements around a node, and has no more detail in the middle of an edge.
    """
    values = np.asarray(data[name]).reshape(len(data), len(data.rest), -1)
    at_nodes = values[:, np.unique(data.triangles)]
    if not middles:
        return at_nodes
    edges, _ = quadratic_triangles(data.triangles, 0)
    further = data["mid_displacement"] if name == "displacement" else values[:, edges].mean(axis=2)
    return np.concatenate([at_nodes, further], axis=1)


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the sums (p, 3) of the area vectors of the triangles around each vertex, of any length."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normals = np.zeros_like(points)
    for corner in triangles.T:
        np.add.at(normals, corner, np.cross(b - a, c - a))
    return normals


def _grid() -> np.ndarray:
    """Return barycentric coordinates (g, 3) of the corners of a triangle's parts."""
    steps = [(i, j, GRAIN - i - j) for i in range(GRAIN + 1) for j in range(GRAIN + 1 - i)]
    return np.array(steps) / GRAIN


def _nearest_weights(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return barycentric coordinates (p, c, 3) of the points of triangles (p, c, 3, 3) nearest to points (p, 3)."""
    a, ab, ac = corners[:, :, 0], corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    to = points[:, None] - a
    aa, bb, cc = (np.einsum("pci,pci->pc", u, v) for u, v in ((ab, ab), (ab, ac), (ac, ac)))
    u, v = np.einsum("pci,pci->pc", to, ab), np.einsum("pci,pci->pc", to, ac)
    size = np.maximum(aa * cc - bb * bb, 1e-300)
    one, two = (cc * u - bb * v) / size, (aa * v - bb * u) / size
    inner = np.stack([1.0 - one - two, one, two], axis=2)
    best = inner
    least = np.where((inner >= 0).all(axis=2), 0.0, np.inf)  # within the triangle nothing is nearer
    for start, end in SIDES:
        along = corners[:, :, end] - corners[:, :, start]
        off = points[:, None] - corners[:, :, start]
        square = np.maximum(np.einsum("pci,pci->pc", along, along), 1e-300)
        t = np.clip(np.einsum("pci,pci->pc", off, along) / square, 0.0, 1.0)
        far = np.linalg.norm(off - t[:, :, None] * along, axis=2)
        edge = np.zeros_like(inner)
        edge[:, :, start], edge[:, :, end] = 1.0 - t, t
        nearer = far < least
        best, least = np.where(nearer[:, :, None], edge, best), np.where(nearer, far, least)
    return np.asarray(best)
