"""Places of solves as dots on a part's surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from palpate.viewer.shown_part import ShownPart

__all__ = ["on_surface"]

PIECE = 64  # places at a time, so that the table of distances stays small


def on_surface(part: ShownPart, places: np.ndarray) -> np.ndarray:
    """Return the points (k, 3) of a part's surface that are nearest to places (k, 3) of the ball's centre, both in m.

    Each lies on the plane of the triangle whose middle is nearest.
    """
    corners = np.asarray(part.points, dtype=float)[np.asarray(part.triangles)]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    rows = [
        np.argmin(np.linalg.norm(middle[None] - piece[:, None], axis=2), axis=1)
        for piece in np.split(places, range(PIECE, len(places), PIECE))
    ]
    nearest = np.concatenate(rows).astype(np.int64)
    above = np.einsum("ki,ki->k", places - middle[nearest], normal[nearest])
    return np.asarray(places - above[:, None] * normal[nearest])
