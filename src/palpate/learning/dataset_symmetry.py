"""The symmetry that a dataset tells of its body, and the ranges that its images reach."""

from __future__ import annotations

import itertools

import numpy as np

from palpate.dataset import Dataset
from palpate.units import Range, bounds

__all__ = ["declared_symmetry", "widen_ranges"]


def declared_symmetry(data: Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Isometries (k, 3, 3) by a dataset's provenance, the identity among them, and the point (3,) that stays, m."""
    record = data.provenance.get("symmetry") or {"about": [0.0, 0.0, 0.0], "isometries": [np.eye(3).tolist()]}
    return np.array(record["isometries"], dtype=float), np.array(record["about"], dtype=float)


def widen_ranges(ranges: tuple[Range, ...], matrices: np.ndarray, about: np.ndarray) -> tuple[Range, ...]:
    """Return the ranges of a vector's n components, so that all images of their box are inside.

    Isometries are (k, n, n), the identity among them, and leave the point `about` (n,) where it is.
    """
    low, high = bounds(ranges)
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    images = about + (corners - about) @ matrices.transpose(0, 2, 1)
    least, most = images.min(axis=(0, 1)), images.max(axis=(0, 1))
    return tuple(
        Range(r.name, float(a), float(b), r.unit) for r, a, b in zip(ranges, least, most, strict=True)
    )
