"""Normals at the corners of triangles, one for each smooth piece of surface that meets there.

Inside a smooth piece the facets' normals are summed by the weights of Max (1999, "Weights for computing vertex
normals from facet normals"), exact on a sphere however irregular its mesh. Where the piece ends, that sum leans to one
side; there a paraboloid through the neighbourhood tells the normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.surrogates.surface.skin import Skin

__all__ = ["Corners", "corners_of"]

TURNS = 3  # of the paraboloid's frame towards the normal that it tells
UNKNOWNS = 5
FARTHEST = np.cos(np.radians(30.0))  # a fit that turns the normal by more has not understood the surface


@dataclass(frozen=True, eq=False)
class Corners:
    """What is known at the corners of triangles.

    Attributes
    ----------
    normals : (t, 3, 3) array
        Outward unit normals.
    sharp : (t, 3) bool array
        Corners at the end of a smooth piece: on the border or on a crease.
    pieces : (t, 3) int array
        Number of the fan of triangles around its vertex to which each corner belongs.
    """

    normals: np.ndarray
    sharp: np.ndarray
    pieces: np.ndarray


def corners_of(skin: Skin) -> Corners:
    """Normals of a surface at the corners of its triangles."""
    ends = skin.border | skin.creases
    pieces = _pieces(skin, ends)
    sharp = np.zeros(pieces.max() + 1, dtype=bool)
    sharp[pieces[ends]] = True
    sharp[np.roll(pieces, -1, axis=1)[ends]] = True
    normals = _summed(skin, pieces)
    for piece, normal in _fitted(skin, pieces, normals, np.flatnonzero(sharp)):
        normals[piece] = normal
    return Corners(normals[pieces], sharp[pieces], pieces)


def _pieces(skin: Skin, ends: np.ndarray) -> np.ndarray:
    """Fan numbers (t, 3): corners are joined across edges at which the surface goes on smoothly."""
    edge = np.flatnonzero(~ends.ravel())
    partner = skin.neighbours.ravel()[edge]
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


def _summed(skin: Skin, pieces: np.ndarray) -> np.ndarray:
    """Unit normals of the fans (s, 3) by the weights of Max (1999)."""
    out = np.roll(skin.corners, -1, axis=1) - skin.corners
    back = np.roll(skin.corners, -2, axis=1) - skin.corners
    shares = np.cross(out, back) / ((out**2).sum(axis=2) * (back**2).sum(axis=2))[..., None]
    sums = np.zeros((pieces.max() + 1, 3))
    np.add.at(sums, pieces.ravel(), shares.reshape(-1, 3))
    some = np.zeros_like(sums)
    some[pieces.ravel()] = np.repeat(skin.facets, 3, axis=0)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(length > 0, sums / np.where(length > 0, length, 1.0), some)


def _fitted(
    skin: Skin, pieces: np.ndarray, normals: np.ndarray, chosen: np.ndarray
) -> list[tuple[int, np.ndarray]]:
    """(fan, unit normal) of the chosen fans, from the paraboloid through all points two edges around."""
    order = np.argsort(pieces.ravel(), kind="stable")
    begin = np.searchsorted(pieces.ravel()[order], np.arange(pieces.max() + 2))
    fans = [order[begin[k] : begin[k + 1]] for k in range(len(begin) - 1)]
    found = []
    for piece in chosen.tolist():
        vertex = skin.triangles.ravel()[fans[piece][0]]
        ring = np.unique(pieces[fans[piece] // 3])
        near = np.unique(skin.triangles[np.concatenate([fans[k] for k in ring]) // 3])
        normal = _paraboloid(skin.points[near[near != vertex]] - skin.points[vertex], normals[piece])
        if normal @ normals[piece] > FARTHEST:
            found.append((piece, normal))
    return found


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
