"""Large triangles of a surface in parts: a file needs two triangles for a face, and a dent in it hundreds."""

from __future__ import annotations

import numpy as np

__all__ = ["MOST_DRAWN", "divide_large"]

MOST_DRAWN = 100_000  # triangles of a surface that pictures show: a page draws them without a stop
LARGE = 2.5  # an edge of the file this many times longer than wanted is divided; others are fine enough as they are
SIDES = ((0, 1), (1, 2), (2, 0))
ROUNDS = 20  # each halves edges


def divide_large(
    points: np.ndarray, triangles: np.ndarray, length: float, most: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return a surface whose long edges are halved until they are no longer than a length, m.

    Points (n, 3) are in m, triangles (t, 3) of these. The surface stays the same, and closed where it was: triangles
    beside a divided edge share its middle. Edges of the file up to `LARGE` times the length stay whole, because parts
    of a facet would lie in its plane, and be shaded as a facet. The length grows where there would be more than `most`
    triangles.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    length = max(length, float(np.sqrt(4.0 * area / max(most - len(triangles), 1))))
    given = len(points)
    for _ in range(ROUNDS):
        ends = np.sort(triangles[:, SIDES].reshape(-1, 2), axis=1)
        edges, which = np.unique(ends, axis=0, return_inverse=True)
        sizes = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        long = sizes > np.where((edges < given).all(axis=1), LARGE, 1.0) * length
        if not long.any():
            break
        middle = np.full(len(edges), -1)
        middle[long] = len(points) + np.arange(int(long.sum()))
        points = np.vstack([points, points[edges[long]].mean(axis=1)])
        triangles = _divide_sides(triangles, middle[np.ravel(which)].reshape(-1, 3))
    return points, triangles


def _divide_sides(triangles: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Return triangles (t, 3) in parts; `middles` (t, 3) of their sides are points, −1 where a side stays whole."""
    count = (middles >= 0).sum(axis=1)
    parts = [triangles[count == 0]]
    # turned, so that one divided side is the first, and one whole side the last
    turn = np.where(count == 1, np.argmax(middles >= 0, axis=1), (np.argmin(middles >= 0, axis=1) + 1) % 3)
    around = (turn[:, None] + np.arange(3)) % 3
    t, m = np.take_along_axis(triangles, around, axis=1), np.take_along_axis(middles, around, axis=1)
    for wanted, pieces in (
        (1, ("a p c", "p b c")),
        (2, ("p b q", "a p q", "a q c")),
        (3, ("a p r", "p b q", "r q c", "p q r")),
    ):
        some = count == wanted
        names = dict(zip("abcpqr", [*t[some].T, *m[some].T], strict=True))
        parts += [np.stack([names[name] for name in piece.split()], axis=1) for piece in pieces]
    return np.concatenate(parts)
