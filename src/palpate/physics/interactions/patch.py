"""A touched surface as triangles: its nearest points, outward normals and footprints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.physics.interactions.plane import cross
from palpate.physics.shapes.mesh import BodyMesh

__all__ = ["Patch", "winding_number"]

PLANE = 1e-9  # by how much the mean normal of a plane surface may fall short of one


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of a surface.

    Attributes
    ----------
    points : (node, 3) array
        Positions in m.
    triangles : (t, 3) int array
        Nodes, counter-clockwise as seen from outside.
    """

    points: np.ndarray
    triangles: np.ndarray

    @classmethod
    def of(cls, mesh: BodyMesh, surface: str, displacement: np.ndarray | None = None) -> Patch:
        """The named surface of a body, displaced by (node, 3) in m."""
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
        """Whether all triangles face one way."""
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
        """Nearest point (3,) of the surface, the outward unit normal (3,) there, the signed distance in m.

        The distance is negative on the inner side. The normal is interpolated between the nodes', so that it
        varies smoothly over a curved surface.
        """
        weights = _nearest_weights(self.corners, point)
        foots = np.einsum("tk,tki->ti", weights, self.corners)
        distances = np.linalg.norm(foots - point, axis=1)
        nearest = int(np.argmin(distances))
        normal = weights[nearest] @ self.node_normals[self.triangles[nearest]]
        normal = normal / np.linalg.norm(normal)
        side = 1.0 if (point - foots[nearest]) @ normal >= 0 else -1.0
        return foots[nearest], normal, side * float(distances[nearest])

    def cast(self, axis: int, sign: float, places: np.ndarray) -> np.ndarray:
        """Outermost points of the surface above places given by their other two coordinates.

        Parameters
        ----------
        axis : int
            Coordinate axis along which to look.
        sign : float
            Positive where outside is at larger coordinates.
        places : (N, 2) array
            In m.

        Returns
        -------
        (N, 3) array
            NaN where there is no surface.
        """
        across = [i for i in range(3) if i != axis]
        a, b, c = np.moveaxis(self.corners[:, :, across], 1, 0)
        found = np.full((len(places), 3), np.nan)
        for row, place in enumerate(places):
            weights = _barycentric(a, b, c, place)
            hits = np.flatnonzero((weights >= -1e-9).all(axis=1))
            if hits.size:
                points = np.einsum("tk,tki->ti", weights[hits], self.corners[hits])
                found[row] = points[np.argmax(sign * points[:, axis])]
        return found

    def spread(self, unit: np.ndarray) -> np.ndarray:
        """Points (N, 3) spread evenly over the area, from places (N, 2) in the unit square."""
        area = np.linalg.norm(self.area_vectors, axis=1)
        edges = np.concatenate([[0.0], np.cumsum(area)]) / area.sum()
        chosen = np.clip(np.searchsorted(edges, unit[:, 0], side="right") - 1, 0, len(area) - 1)
        # what is left of the first number within its triangle serves as the second one
        rest = np.clip((unit[:, 0] - edges[chosen]) / (edges[chosen + 1] - edges[chosen]), 0.0, 1.0)
        root = np.sqrt(rest)
        weights = np.stack([1 - root, root * (1 - unit[:, 1]), root * unit[:, 1]], axis=1)
        return np.asarray(np.einsum("nk,nki->ni", weights, self.corners[chosen]))


def winding_number(points: np.ndarray, triangles: np.ndarray, place: np.ndarray) -> float:
    """How often a closed surface winds around a place: 1 inside, 0 outside (Van Oosterom & Strackee 1983).

    Parameters
    ----------
    points : (node, 3) array
    triangles : (t, 3) int array
        Counter-clockwise as seen from outside.
    place : (3,) array
    """
    a, b, c = np.moveaxis(points[triangles] - place, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = np.einsum("ti,ti->t", a, np.cross(b, c))
    dots = [np.einsum("ti,ti->t", v, w) for v, w in ((a, b), (b, c), (c, a))]
    below = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    return float(2 * np.arctan2(above, below).sum() / (4 * np.pi))


def _barycentric(a: np.ndarray, b: np.ndarray, c: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Weights (t, 3) of a place (2,) in triangles of the plane."""
    area = cross(b - a, c - a)
    area = np.where(np.abs(area) > 1e-14, area, np.nan)  # a triangle seen edge-on hides nothing
    second = cross(place - a, c - a) / area
    third = cross(b - a, place - a) / area
    return np.stack([1 - second - third, second, third], axis=1)


def _nearest_weights(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Barycentric weights (t, 3) of the point of each triangle that is nearest to a point (3,)."""
    best = _inner_weights(corners, point)
    outside = (best < 0).any(axis=1) | ~np.isfinite(best).all(axis=1)
    edges = [_edge_weights(corners, point, i) for i in range(3)]
    distance = [np.linalg.norm(np.einsum("tk,tki->ti", w, corners) - point, axis=1) for w in edges]
    choice = np.argmin(distance, axis=0)
    nearest_edge = np.stack(edges)[choice, np.arange(len(corners))]
    return np.where(outside[:, None], nearest_edge, best)


def _inner_weights(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Weights (t, 3) of the foot of a point in the plane of each triangle."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("ti,ti->t", normal, normal)
    second = np.einsum("ti,ti->t", np.cross(point - a, c - a), normal) / square
    third = np.einsum("ti,ti->t", np.cross(b - a, point - a), normal) / square
    return np.stack([1 - second - third, second, third], axis=1)


def _edge_weights(corners: np.ndarray, point: np.ndarray, edge: int) -> np.ndarray:
    """Weights (t, 3) of the point of one edge of each triangle that is nearest to a point."""
    start, end = edge, (edge + 1) % 3
    along = corners[:, end] - corners[:, start]
    share = np.einsum("ti,ti->t", point - corners[:, start], along) / np.einsum("ti,ti->t", along, along)
    weights = np.zeros(corners.shape[:2])
    weights[:, end] = np.clip(share, 0.0, 1.0)
    weights[:, start] = 1 - weights[:, end]
    return weights
