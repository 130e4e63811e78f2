"""Orientations as quaternions w, x, y, z, of the rotations that libraries tell."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

__all__ = ["rotation_into"]


def rotation_into(rows: Iterable[float], quaternion: np.ndarray) -> None:
    """Fill the quaternion (4,) of a rotation given row by row, nine numbers; not-a-number where it is none.

    The largest of the four components is found first, so that none is a quotient of small numbers.
    """
    a, b, c, d, e, f, g, h, i = rows
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i)
    largest = squares.index(max(squares)) if math.isfinite(sum(squares)) else 0
    size = math.sqrt(squares[largest]) if squares[largest] > 0.0 else math.nan
    mixed = (
        (size, (h - f) / size, (c - g) / size, (d - b) / size),
        ((h - f) / size, size, (b + d) / size, (c + g) / size),
        ((c - g) / size, (b + d) / size, size, (f + h) / size),
        ((d - b) / size, (c + g) / size, (f + h) / size, size),
    )[largest]
    for k in range(4):
        quaternion[k] = 0.5 * mixed[k]
