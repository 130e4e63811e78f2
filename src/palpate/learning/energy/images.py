"""A body's symmetry: isometries of the body, its supports and its touched surface, in scaled inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.sample_checks import numbers
from palpate.rbf.symmetric_units import Images
from palpate.units import Range, bounds

__all__ = ["images_of"]


def images_of(
    symmetry: Sequence[np.ndarray], about: np.ndarray | None, inputs: Sequence[Range]
) -> Images | None:
    """The maps of scaled inputs that (3, 3) isometries about a point (m) are; None without symmetry.

    By default the point is the middle of the ranges. Further inputs stay what they are.

    Raises
    ------
    UsageError
        If a matrix is no isometry, or all of them are no group.
    """
    if not len(symmetry):
        return None
    M = numbers("Isometries", np.asarray(symmetry, float).reshape(len(symmetry), -1), (None, 9)).reshape(
        -1, 3, 3
    )
    if not np.allclose(M @ M.transpose(0, 2, 1), np.eye(3), atol=1e-9):
        raise UsageError(
            "A matrix of the symmetry is no isometry.",
            why="Images of a touch keep lengths: M Mᵀ is the identity.",
            fix="Pass rotations and reflections, as (3, 3) matrices.",
        )
    low, high = bounds(inputs)
    middle, half, n = (low + high) / 2, (high - low) / 2, len(low)
    point = middle[:3] if about is None else numbers("The point of symmetry", about, (3,))
    turns, shifts = np.tile(np.eye(n), (len(M), 1, 1)), np.zeros((len(M), n))
    turns[:, :3, :3] = M * half[:3] / half[:3, None]
    shifts[:, :3] = ((middle[:3] - point) @ M.transpose(0, 2, 1) + point - middle[:3]) / half[:3]
    return Images(turns, shifts)
