"""A touched surface as triangles: nearest points, outward normals and places to touch.

A curved surface is seen as the finite elements see it, its elements split into many small triangles. Between their
corners the elements of a round body bulge out of its straight triangles, by h²/(8 R) for an edge h on a radius R:
0.09 mm for 6 mm on 50 mm. Depths are measured to the bulging surface.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.naming import members

if TYPE_CHECKING:
    from collections.abc import Hashable

    from palpate.physics.shapes.meshing import FineMesh
    from palpate.physics.shapes.shape import Geometry

__all__ = ["Patch", "cross", "surface_of"]


PLANE = 1e-9  # by how much the mean normal of a plane surface may fall short of one
PARTS = 4  # triangles along an edge: what they still miss is a sixteenth
SAME = 1e-9  # share of the surface's size: points closer than that are one


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the area spanned by two vectors (..., 2) of the plane, positive counter-clockwise."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of a surface."""

    points: np.ndarray  # (node, 3) positions, m
    triangles: np.ndarray  # (t, 3) nodes, counter-clockwise as seen from outside

    @classmethod
    def from_mesh(cls, mesh: BodyMesh, surface: str, displacement: np.ndarray | None = None) -> Patch:
        """Return the named surface of a body, displaced by (node, 3) in m."""
        points = mesh.points if displacement is None else mesh.points + displacement
        return cls(points, mesh.triangles_of(surface))

    @cached_property
    def corners(self) -> np.ndarray:
        """Corner points of the triangles, shape (t, 3, 3)."""
        return np.asarray(self.points[self.triangles])

    @cached_property
    def area_vectors(self) -> np.ndarray:
        """Outward normal times area of each triangle in m², shape (t, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.asarray(np.cross(b - a, c - a) / 2)

    @cached_property
    def facing(self) -> np.ndarray:
        """Mean outward normal (3,): of length one where the surface is plane, zero where it is closed."""
        area = np.linalg.norm(self.area_vectors, axis=1).sum()
        return np.asarray(self.area_vectors.sum(axis=0) / area)

    @property
    def is_plane(self) -> bool:
        """True where all triangles face one way."""
        return bool(np.linalg.norm(self.facing) > 1 - PLANE)

    @cached_property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner in m, each (3,)."""
        return self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))

    @cached_property
    def node_normals(self) -> np.ndarray:
        """Outward unit normals at the nodes, means of the triangles' weighted by area, shape (node, 3)."""
        sums = np.zeros_like(self.points)
        for column in self.triangles.T:
            np.add.at(sums, column, self.area_vectors)
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        return np.asarray(sums / np.where(length > 0, length, 1.0))

    def nearest(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the nearest point (3,) of the surface, the outward unit normal (3,) there, the signed distance in m.

        The distance is negative on the inner side. The normal is interpolated between the nodes', so that it
        varies smoothly over a curved surface.
        """
        weights = _nearest_weights(self.corners, point)
        projections = np.einsum("tk,tki->ti", weights, self.corners)
        distances = np.linalg.norm(projections - point, axis=1)
        nearest = int(np.argmin(distances))
        normal = weights[nearest] @ self.node_normals[self.triangles[nearest]]
        normal = normal / np.linalg.norm(normal)
        side = 1.0 if (point - projections[nearest]) @ normal >= 0 else -1.0
        return projections[nearest], normal, side * float(distances[nearest])

    def cast(self, axis: int, sign: float, places: np.ndarray) -> np.ndarray:
        """Return the outermost points (N, 3) of the surface above `places` (N, 2), the other two coordinates in m.

        The look is along a coordinate axis; `sign` is positive where outside is at larger coordinates. A point is NaN
        where there is no surface.
        """
        across = [i for i in range(3) if i != axis]
        a, b, c = np.moveaxis(self.corners[:, :, across], 1, 0)
        outermost = np.full((len(places), 3), np.nan)
        for row, place in enumerate(places):
            weights = _barycentric(a, b, c, place)
            hits = np.flatnonzero((weights >= -1e-9).all(axis=1))
            if hits.size:
                points = np.einsum("tk,tki->ti", weights[hits], self.corners[hits])
                outermost[row] = points[np.argmax(sign * points[:, axis])]
        return outermost

    def spread(self, unit: np.ndarray) -> np.ndarray:
        """Return points (N, 3) spread evenly over the area, from places (N, 2) in the unit square."""
        chosen, weights = self._spread_weights(unit)
        return np.asarray(np.einsum("nk,nki->ni", weights, self.corners[chosen]))

    def spread_with_normals(self, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points (N, 3) as `spread` does, and the outward unit normals (N, 3) there, as `nearest` has them."""
        chosen, weights = self._spread_weights(unit)
        normals = np.einsum("nk,nki->ni", weights, self.node_normals[self.triangles[chosen]])
        return (
            np.asarray(np.einsum("nk,nki->ni", weights, self.corners[chosen])),
            np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True)),
        )

    def _spread_weights(self, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return triangles (N,) and barycentric weights (N, 3) of places (N, 2) in the unit square, even by area."""
        area = np.linalg.norm(self.area_vectors, axis=1)
        edges = np.concatenate([[0.0], np.cumsum(area)]) / area.sum()
        chosen = np.clip(np.searchsorted(edges, unit[:, 0], side="right") - 1, 0, len(area) - 1)
        # what is left of the first number within its triangle serves as the second one
        rest = np.clip((unit[:, 0] - edges[chosen]) / (edges[chosen + 1] - edges[chosen]), 0.0, 1.0)
        root = np.sqrt(rest)
        return chosen, np.stack([1 - root, root * (1 - unit[:, 1]), root * unit[:, 1]], axis=1)


def _barycentric(a: np.ndarray, b: np.ndarray, c: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return weights (t, 3) of a place (2,) in triangles of the plane."""
    area = cross(b - a, c - a)
    area = np.where(np.abs(area) > 1e-14, area, np.nan)  # a triangle seen edge-on hides nothing
    second = cross(place - a, c - a) / area
    third = cross(b - a, place - a) / area
    return np.stack([1 - second - third, second, third], axis=1)


def _nearest_weights(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return barycentric weights (t, 3) of the point of each triangle that is nearest to a point (3,)."""
    best = _inner_weights(corners, point)
    outside = (best < 0).any(axis=1) | ~np.isfinite(best).all(axis=1)
    edges = [_edge_weights(corners, point, i) for i in range(3)]
    distance = [np.linalg.norm(np.einsum("tk,tki->ti", w, corners) - point, axis=1) for w in edges]
    choice = np.argmin(distance, axis=0)
    nearest_edge = np.stack(edges)[choice, np.arange(len(corners))]
    return np.where(outside[:, None], nearest_edge, best)


def _inner_weights(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return weights (t, 3) of the projection of a point in the plane of each triangle."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("ti,ti->t", normal, normal)
    second = np.einsum("ti,ti->t", np.cross(point - a, c - a), normal) / square
    third = np.einsum("ti,ti->t", np.cross(b - a, point - a), normal) / square
    return np.stack([1 - second - third, second, third], axis=1)


def _edge_weights(corners: np.ndarray, point: np.ndarray, edge: int) -> np.ndarray:
    """Return weights (t, 3) of the point of one edge of each triangle that is nearest to a point."""
    start, end = edge, (edge + 1) % 3
    along = corners[:, end] - corners[:, start]
    share = np.einsum("ti,ti->t", point - corners[:, start], along) / np.einsum("ti,ti->t", along, along)
    weights = np.zeros(corners.shape[:2])
    weights[:, end] = np.clip(share, 0.0, 1.0)
    weights[:, start] = 1 - weights[:, end]
    return weights


def surface_of(geometry: Geometry, surface: str, refinements: tuple[FineMesh, ...] = ()) -> Patch:
    """Return the named surface of a body at rest, its curved elements split into small triangles."""
    straight = Patch.from_mesh(geometry.rest(refinements), surface)
    if not getattr(geometry, "curved", False) or straight.is_plane:
        return straight
    return _split_elements(cast("Hashable", geometry), surface, refinements)


# a sweep asks for the ranges, the design and the chains of a few surfaces
@lru_cache(maxsize=8)
def _split_elements(geometry: Hashable, surface: str, refinements: tuple[FineMesh, ...]) -> Patch:
    import ngsolve as ngs

    mesh = cast("Any", geometry).mesh(refinements)
    corners, pattern = _pattern(PARTS)
    rule = ngs.IntegrationRule([tuple(corner) for corner in corners.tolist()], [1.0] * len(corners))
    names = "|".join(re.escape(name) for name in members(surface, mesh.GetBoundaries()))
    points = mesh.MapToAllElements(rule, mesh.Boundaries(names))
    places = np.asarray(ngs.CF((ngs.x, ngs.y, ngs.z))(points))
    normals = np.asarray(ngs.specialcf.normal(3)(points)).reshape(-1, len(corners), 3).mean(axis=1)
    nodes, numbers = _unique_points(places)
    triangles = numbers.reshape(-1, len(corners))[:, pattern]
    return Patch(nodes, _outward(nodes, triangles, normals).reshape(-1, 3))


def _pattern(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 2) in the reference triangle, and the small triangles between them (parts², 3)."""
    number: dict[tuple[int, int], int] = {}
    for j in range(parts + 1):
        for i in range(parts + 1 - j):
            number[i, j] = len(number)
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in number if i + j < parts]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in number if i + j < parts - 1]
    return np.array(list(number)) / parts, np.array([[number[p] for p in corners] for corners in up + down])


def _unique_points(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points (M, 3) without those that occur several times, and the numbers (N,) of all among them."""
    size = float(np.ptp(places, axis=0).max())
    _, first, numbers = np.unique(
        np.round(places / (SAME * size)).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    return places[first], np.ravel(numbers)


def _outward(nodes: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return triangles (t, n, 3), turned over where an element's normal (t, 3) says so."""
    a, b, c = np.moveaxis(nodes[triangles[:, 0]], 1, 0)
    turned = np.einsum("ti,ti->t", np.cross(b - a, c - a), normals) < 0
    return np.where(turned[:, None, None], triangles[:, :, ::-1], triangles)
