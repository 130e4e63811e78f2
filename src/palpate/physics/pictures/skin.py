"""The surface to draw: smooth normals, and what a cutting plane leaves of a body.

A *soup* is an array (t, 3, k) of triangles whose corners carry all they need: position, normal, scalar. Cutting then
is interpolation along edges, whatever the columns mean.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["CREASE", "ball", "clip", "corner_normals", "section", "section_lines"]

CREASE = math.cos(math.radians(40.0))  # edges sharper than this stay edges


def corner_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals at the corners of a surface's triangles, shape (t, 3, 3), smooth except across creases."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    vectors = np.cross(b - a, c - a) / 2
    size = np.linalg.norm(vectors, axis=1)
    corner, other = _around(triangles.ravel(), len(points))
    own = corner // 3
    cosine = np.einsum("pi,pi->p", vectors[own], vectors[other])
    level = cosine >= CREASE * size[own] * size[other]
    sums = [np.bincount(corner[level], vectors[other[level], i], minlength=triangles.size) for i in range(3)]
    normals = np.stack(sums, axis=1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray((normals / np.where(length > 0, length, 1.0)).reshape(-1, 3, 3))


def _around(flat: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of a corner (p,) and a triangle (p,) at its node, from the corners' nodes (3 t,)."""
    order = np.argsort(flat, kind="stable")
    count = np.bincount(flat, minlength=nodes)
    starts = np.cumsum(count) - count
    corner = np.repeat(np.arange(len(flat)), count[flat])
    first = np.cumsum(count[flat]) - count[flat]
    place = np.arange(len(corner)) - np.repeat(first, count[flat])
    return corner, order[starts[flat][corner] + place] // 3


def clip(soup: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """The part of triangles below a plane.

    Parameters
    ----------
    soup : (t, 3, k) array
    heights : (t, 3) array
        Of the corners above the plane; what is above 0 goes.
    """
    kept = heights <= 0
    parts = [soup[kept.all(axis=1)]]
    for inside in (1, 2):
        chosen = kept.sum(axis=1) == inside
        # turn the triangles so that the corner that differs from the two others comes first
        first = np.argmax(kept[chosen] == (inside == 1), axis=1)
        turn = (first[:, None] + np.arange(3)) % 3
        corners = np.take_along_axis(soup[chosen], turn[:, :, None], axis=1)
        h = np.take_along_axis(heights[chosen], turn, axis=1)
        left, right = _between(corners, h, 0, 1), _between(corners, h, 0, 2)
        if inside == 1:
            parts.append(np.stack([corners[:, 0], left, right], axis=1))
        else:
            parts.append(np.stack([left, corners[:, 1], corners[:, 2]], axis=1))
            parts.append(np.stack([left, corners[:, 2], right], axis=1))
    return np.concatenate(parts)


def section(solids: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Triangles (t, 3, k) in which a plane cuts tetrahedra (e, 4, k); `heights` (e, 4) above the plane."""
    above = heights > 0
    parts = []
    for count in (1, 3):
        chosen = above.sum(axis=1) == count
        apex = np.argmax(above[chosen] == (count == 1), axis=1)
        turn = (apex[:, None] + np.arange(4)) % 4
        corners, h = np.take_along_axis(solids[chosen], turn[:, :, None], axis=1), heights[chosen]
        h = np.take_along_axis(h, turn, axis=1)
        parts.append(np.stack([_between(corners, h, 0, i) for i in (1, 2, 3)], axis=1))
    chosen = above.sum(axis=1) == 2
    order = np.argsort(~above[chosen], axis=1, kind="stable")  # the two above come first
    corners = np.take_along_axis(solids[chosen], order[:, :, None], axis=1)
    h = np.take_along_axis(heights[chosen], order, axis=1)
    ring = [_between(corners, h, *pair) for pair in ((0, 2), (0, 3), (1, 3), (1, 2))]
    parts += [np.stack([ring[0], ring[1], ring[2]], axis=1), np.stack([ring[0], ring[2], ring[3]], axis=1)]
    return np.concatenate(parts)


def section_lines(soup: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Segments (s, 2, k) in which a plane cuts triangles (t, 3, k); `heights` (t, 3) above the plane."""
    above = heights > 0
    parts = []
    for count in (1, 2):
        chosen = above.sum(axis=1) == count
        apex = np.argmax(above[chosen] == (count == 1), axis=1)
        turn = (apex[:, None] + np.arange(3)) % 3
        corners = np.take_along_axis(soup[chosen], turn[:, :, None], axis=1)
        h = np.take_along_axis(heights[chosen], turn, axis=1)
        parts.append(np.stack([_between(corners, h, 0, 1), _between(corners, h, 0, 2)], axis=1))
    return np.concatenate(parts)


def _between(corners: np.ndarray, heights: np.ndarray, i: int, j: int) -> np.ndarray:
    """Attributes where the edge from corner i to corner j meets the plane."""
    share = heights[:, i] / (heights[:, i] - heights[:, j])
    return np.asarray(corners[:, i] + share[:, None] * (corners[:, j] - corners[:, i]))


def ball(centre: np.ndarray, radius: float, rings: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """A sphere's triangles (t, 3, 3) and their corners' normals (t, 3, 3)."""
    polar = np.linspace(0, np.pi, rings + 1)
    around = np.linspace(0, 2 * np.pi, 2 * rings + 1)
    p, a = np.meshgrid(polar, around, indexing="ij")
    unit = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    corners = [unit[:-1, :-1], unit[1:, :-1], unit[1:, 1:], unit[:-1, 1:]]
    pieces = [np.stack([corners[i] for i in way], axis=2).reshape(-1, 3, 3) for way in ((0, 1, 2), (0, 2, 3))]
    normals = np.concatenate(pieces)
    return np.asarray(centre + radius * normals), normals
