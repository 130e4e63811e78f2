"""Vectors of the plane."""

from __future__ import annotations

import numpy as np

__all__ = ["cross"]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Area spanned by two vectors (..., 2) of the plane, positive counter-clockwise."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
