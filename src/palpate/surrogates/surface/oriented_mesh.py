"""Triangles of a touched surface, checked: neighbours, borders, creases, and normals at their corners.

A corner has one normal for each smooth piece of surface that meets there.

Inside a smooth piece the facets' normals are summed by the weights of Max (1999, "Weights for computing vertex
normals from facet normals"), exact on a sphere however irregular its mesh. Where the piece ends, that sum leans to one
side; there a paraboloid through the neighbourhood tells the normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.errors import UsageError

__all__ = ["CREASE", "Corners", "OrientedMesh", "corners_of"]

# cosine; facets that turn by more meet in an edge of the body, not in one of the mesh
CREASE = np.cos(np.radians(40.0))
FLAT = 1e-7  # height over longest edge, below which a triangle has no normal
SAME = 1e-9  # distance over the surface's size, within which two points are one


@dataclass(frozen=True, eq=False)
class OrientedMesh:
    """An oriented surface, open or closed, in which each edge belongs to one or two triangles.

    Edge k of a triangle runs from its corner k to the next.
    """

    points: np.ndarray  # (P, 3), corners that are used, m
    triangles: np.ndarray  # (t, 3) int, counter-clockwise as seen from outside
    neighbours: np.ndarray  # (t, 3) int, 3 × the triangle across each edge + its edge there; -1 at the border

    @classmethod
    def of(cls, points: np.ndarray, triangles: np.ndarray) -> OrientedMesh:
        """Return the surface of triangles (t, 3) between points (P, 3) in m, of which not all need be used.

        Refused are meshes without a triangle, with a corner that does not exist or is not finite, a triangle without
        area, two points in one place, or an edge that has more than two triangles or two that face opposite ways.
        """
        points, triangles = _arrays(points, triangles)
        used, numbers = np.unique(triangles, return_inverse=True)
        points, triangles = points[used], numbers.reshape(triangles.shape)
        _refuse_flat(points, triangles)
        _refuse_coincident(points)
        return cls(points, triangles, _neighbours(len(points), triangles))

    @cached_property
    def corners(self) -> np.ndarray:
        """Corner points in m, (t, 3, 3)."""
        return np.asarray(self.points[self.triangles])

    @cached_property
    def facets(self) -> np.ndarray:
        """Outward unit normals of the triangles, (t, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        area = np.cross(b - a, c - a)
        return np.asarray(area / np.linalg.norm(area, axis=1, keepdims=True))

    @cached_property
    def border(self) -> np.ndarray:
        """Edges at which the surface ends, (t, 3) bool."""
        return np.asarray(self.neighbours < 0)

    @cached_property
    def creases(self) -> np.ndarray:
        """Edges over which the surface turns sharply, (t, 3) bool."""
        across = self.facets[self.neighbours // 3]
        return np.asarray((np.einsum("ti,tki->tk", self.facets, across) < CREASE) & ~self.border)


def _arrays(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points, triangles = np.asarray(points, dtype=np.float64), np.asarray(triangles)
    if points.ndim != 2 or points.shape[1:] != (3,) or triangles.ndim != 2 or triangles.shape[1:] != (3,):
        raise UsageError(
            f"Points of shape {points.shape} and triangles of shape {triangles.shape} make no surface.",
            fix="Pass points (P, 3) in m and triangles (t, 3) of point numbers.",
        )
    if not len(triangles) or triangles.dtype.kind not in "iu":
        raise UsageError(
            "A touched surface needs triangles, as whole numbers of its points.",
            why=f"{len(triangles)} were given, of kind {triangles.dtype}.",
        )
    triangles = triangles.astype(np.int64)
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise UsageError(
            f"A triangle has corner {triangles.max() if triangles.min() >= 0 else triangles.min()}; "
            f"there are {len(points)} points.",
            fix="Number the points from 0.",
        )
    if not np.isfinite(points[triangles]).all():
        raise UsageError("A corner of the touched surface is not a finite number.")
    return points, triangles


def _refuse_flat(points: np.ndarray, triangles: np.ndarray) -> None:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    longest = np.max([((q - p) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    flat = np.flatnonzero(~(np.linalg.norm(np.cross(b - a, c - a), axis=1) > FLAT * longest))
    if flat.size:
        raise UsageError(
            f"{flat.size} of {len(triangles)} triangles have no area, the first is number {flat[0]}.",
            why="Two of its corners are one, or all three lie on a line.",
            fix="Remove such triangles, or mesh the surface again.",
        )


def _refuse_coincident(points: np.ndarray) -> None:
    cells = np.round((points - points.min(axis=0)) / (SAME * np.ptp(points, axis=0).max())).astype(np.int64)
    distinct = len(np.unique(cells, axis=0))
    if distinct < len(points):
        raise UsageError(
            f"{len(points) - distinct} points of the touched surface lie where another one is.",
            why="Triangles that share no point share no edge: the surface would end between them.",
            fix="Merge the points that coincide and number the triangles anew.",
        )


def _neighbours(count: int, triangles: np.ndarray) -> np.ndarray:
    """Partners (t, 3) of the edges; -1 where there is none."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    key = key[order]
    pair = np.flatnonzero(key[1:] == key[:-1])
    if (pair[1:] == pair[:-1] + 1).any():
        raise UsageError(
            "An edge of the touched surface belongs to more than two triangles.",
            why="Such a surface has no outer side.",
            fix="Pass only the triangles of the outer skin.",
        )
    one, other = order[pair], order[pair + 1]
    if turned := int((start[one] == start[other]).sum()):
        raise UsageError(
            f"At {turned} edges of the touched surface two triangles face opposite ways.",
            why="A distance has a sign only if all triangles are counter-clockwise as seen from outside.",
            fix="Turn the corners of the wrong ones over.",
        )
    partner = np.full(len(start), -1)
    partner[one], partner[other] = other, one
    return partner.reshape(triangles.shape)


TURNS = 3  # turns of the paraboloid's frame towards the normal that it finds
UNKNOWNS = 5  # coefficients of the paraboloid
# cosine; a fit that turns the normal by more has not understood the surface
FARTHEST = np.cos(np.radians(30.0))


@dataclass(frozen=True, eq=False)
class Corners:
    """Normals and smooth pieces at the corners of triangles."""

    normals: np.ndarray  # (t, 3, 3), outward unit normals
    sharp: np.ndarray  # (t, 3) bool, ends of a smooth piece: on the border or on a crease
    pieces: np.ndarray  # (t, 3) int, number of each corner's fan of triangles around its vertex


def corners_of(mesh: OrientedMesh) -> Corners:
    """Normals of a surface at the corners of its triangles."""
    ends = mesh.border | mesh.creases
    pieces = _pieces(mesh, ends)
    sharp = np.zeros(pieces.max() + 1, dtype=bool)
    sharp[pieces[ends]] = True
    sharp[np.roll(pieces, -1, axis=1)[ends]] = True
    normals = _summed(mesh, pieces)
    for piece, normal in _fitted(mesh, pieces, normals, np.flatnonzero(sharp)):
        normals[piece] = normal
    return Corners(normals[pieces], sharp[pieces], pieces)


def _pieces(mesh: OrientedMesh, ends: np.ndarray) -> np.ndarray:
    """Fan numbers (t, 3): corners are joined across edges at which the surface goes on smoothly."""
    edge = np.flatnonzero(~ends.ravel())
    partner = mesh.neighbours.ravel()[edge]
    after = edge // 3 * 3 + (edge + 1) % 3
    # the partner runs the other way: its start is this edge's end
    links = np.stack([after, partner], axis=1)
    label = np.arange(ends.size)
    while True:
        low = label[links].min(axis=1)
        new = label.copy()
        np.minimum.at(new, links[:, 0], low)
        np.minimum.at(new, links[:, 1], low)
        if (new == label).all():
            break
        label = new
    return np.asarray(np.unique(label, return_inverse=True)[1]).reshape(ends.shape)


def _summed(mesh: OrientedMesh, pieces: np.ndarray) -> np.ndarray:
    """Unit normals of the fans (s, 3) by the weights of Max (1999)."""
    out = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    back = np.roll(mesh.corners, -2, axis=1) - mesh.corners
    shares = np.cross(out, back) / ((out**2).sum(axis=2) * (back**2).sum(axis=2))[..., None]
    sums = np.zeros((pieces.max() + 1, 3))
    np.add.at(sums, pieces.ravel(), shares.reshape(-1, 3))
    some = np.zeros_like(sums)
    some[pieces.ravel()] = np.repeat(mesh.facets, 3, axis=0)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(length > 0, sums / np.where(length > 0, length, 1.0), some)


def _fitted(
    mesh: OrientedMesh, pieces: np.ndarray, normals: np.ndarray, chosen: np.ndarray
) -> list[tuple[int, np.ndarray]]:
    """(fan, unit normal) of the chosen fans, from the paraboloid through all points two edges around."""
    order = np.argsort(pieces.ravel(), kind="stable")
    begin = np.searchsorted(pieces.ravel()[order], np.arange(pieces.max() + 2))
    fans = [order[begin[k] : begin[k + 1]] for k in range(len(begin) - 1)]
    fitted = []
    for piece in chosen.tolist():
        vertex = mesh.triangles.ravel()[fans[piece][0]]
        ring = np.unique(pieces[fans[piece] // 3])
        near = np.unique(mesh.triangles[np.concatenate([fans[k] for k in ring]) // 3])
        normal = _paraboloid(mesh.points[near[near != vertex]] - mesh.points[vertex], normals[piece])
        if normal @ normals[piece] > FARTHEST:
            fitted.append((piece, normal))
    return fitted


def _paraboloid(around: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Normal at the origin of z = p x + q y + quadratic terms through points (n, 3), from a first guess."""
    if len(around) < UNKNOWNS:
        return normal
    size = np.sqrt((around**2).sum(axis=1).mean())
    for _ in range(TURNS):
        first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        first /= np.linalg.norm(first)
        frame = np.stack([first, np.cross(normal, first), normal])
        x, y, z = frame @ around.T / size
        slopes, _, rank, _ = np.linalg.lstsq(np.stack([x, y, x * x, x * y, y * y], axis=1), z, rcond=1e-6)
        if rank < UNKNOWNS:
            return normal
        normal = np.array([-slopes[0], -slopes[1], 1.0]) @ frame
        normal = normal / np.linalg.norm(normal)
    return np.asarray(normal)
