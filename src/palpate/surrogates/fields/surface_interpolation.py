"""Values at the nodes of one surface mesh, carried to other places on the same surface.

Locally, by cubic radial functions |r|³ with a quadratic tail in the tangent plane (Duchon 1977; Wendland 2005, ch. 11),
through the nearest nodes that face the same way: of third order between nodes, exact at them. Straight facets would
cut off the bottom of a local mode by h²/8R, a third of a millimetre for elements of 5 mm under a ball of 10 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["SurfaceInterpolation", "node_normals"]

NEAREST = 20  # nodes that decide a value
FACING = 0.5  # how far a normal turned by 1 rad sets a node back, over the distance of nodes around
TAIL = 6  # terms of a quadratic in two coordinates
RIDGE = 1e-10  # ridge relative to the system, for nodes that coincide or lie on a conic in the tangent plane


@dataclass(frozen=True, eq=False)
class SurfaceInterpolation:
    """Interpolation weights that carry values from P nodes to Q places."""

    nodes: np.ndarray  # (Q, k) int, nodes that each place takes its value from
    weights: np.ndarray  # (Q, k), share of each of them; a row adds up to one

    @classmethod
    def of(
        cls, points: np.ndarray, triangles: np.ndarray, places: np.ndarray, facing: np.ndarray
    ) -> SurfaceInterpolation:
        """From the nodes (P, 3) of triangles (t, 3) to places (Q, 3) with outward unit normals (Q, 3); lengths in m."""
        count = min(NEAREST, len(points))
        nodes = _neighbours(points, node_normals(points, triangles), places, facing, count)
        return cls(nodes, _weights(points[nodes] - places[:, None], facing))

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Values (N, P, c) at the places, (N, Q, c)."""
        carried: np.ndarray = np.zeros((len(values), len(self.nodes), values.shape[2]))
        for node, weight in zip(self.nodes.T, self.weights.T, strict=True):
            carried += weight[:, None] * values[:, node]
        return carried


def node_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (P, 3) at the nodes: the mean of their triangles', by area; zero where a node has none."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in triangles.T:
        np.add.at(normals, corner, areas)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(np.divide(normals, length, out=normals, where=length > 0))


def _neighbours(
    points: np.ndarray, normals: np.ndarray, places: np.ndarray, facing: np.ndarray, count: int
) -> np.ndarray:
    """The nearest nodes (Q, count) of each place; those that face another way count as farther."""
    nearest = np.empty((len(places), count), dtype=np.int64)
    for i, (place, normal) in enumerate(zip(places, facing, strict=True)):
        square = ((points - place) ** 2).sum(axis=1)
        around = np.partition(square, count - 1)[count - 1]
        square = square + FACING * around * ((normals - normal) ** 2).sum(axis=1)
        nearest[i] = np.argpartition(square, count - 1)[:count]
    return nearest


def _weights(offsets: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Return the weights (Q, k) at each place of k nodes at offsets (Q, k, 3)."""
    Q, k = offsets.shape[:2]
    size = np.linalg.norm(offsets, axis=2).max(axis=1)
    offsets = offsets / size[:, None, None]
    apart = np.linalg.norm(offsets[:, :, None] - offsets[:, None], axis=3) ** 3
    first, second = _tangents(facing)
    a, b = ((offsets @ along[:, :, None])[..., 0] for along in (first, second))
    tail = np.stack([np.ones((Q, k)), a, b, a * a, a * b, b * b], axis=2)
    system = np.zeros((Q, k + TAIL, k + TAIL))
    system[:, :k, :k] = apart + RIDGE * np.eye(k)
    system[:, :k, k:], system[:, k:, :k] = tail, tail.transpose(0, 2, 1)
    system[:, k:, k:] = -RIDGE * np.eye(TAIL)
    right = np.zeros((Q, k + TAIL, 1))
    right[:, :k, 0] = np.linalg.norm(offsets, axis=2) ** 3
    right[:, k, 0] = 1.0
    return np.asarray(np.linalg.solve(system, right)[:, :k, 0])


def _tangents(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (Q, 3) across each normal (Q, 3); where it is zero, as if it were that of the plane z = 0."""
    normals = np.where(normals.any(axis=1, keepdims=True), normals, (0.0, 0.0, 1.0))
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)
