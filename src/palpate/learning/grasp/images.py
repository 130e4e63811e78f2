"""A body's symmetry, which turns the place of a pad and its displacement together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.errors import UsageError
from palpate.learning.energy.images import images_of
from palpate.rbf.sample_checks import numbers
from palpate.rbf.symmetric_units import Images
from palpate.units import Range, bounds

__all__ = ["hold_images"]


def hold_images(
    symmetry: Sequence[np.ndarray],
    about: np.ndarray | None,
    inputs: Sequence[Range],
    axes: Sequence[int],
) -> Images | None:
    """The maps of scaled inputs that (3, 3) isometries M about a point (m) are; None without symmetry.

    d becomes M d, and the place, whose coordinates are along `axes`, p₀ + M(p − p₀). By default p₀ is the middle of
    the place's ranges. Further inputs stay what they are.

    Raises
    ------
    UsageError
        If a matrix is no isometry, turns the place off its axes, or all of them are no group.
    """
    held = images_of(symmetry, np.zeros(3), inputs[:3])
    if held is None:
        return None
    M, k, n = np.asarray(symmetry, float).reshape(-1, 3, 3), list(axes), len(inputs)
    others = [a for a in range(3) if a not in k]
    if np.abs(M[:, k][:, :, others]).max(initial=0.0) > 1e-9:
        raise UsageError(
            f"A symmetry mixes the place's axes {k} with axis {others[0]}.",
            why="Of a place that is told by two coordinates the third is not known.",
            fix="Give the place by all three coordinates, or leave that isometry out.",
        )
    low, high = bounds(inputs)
    middle, half = ((low + high) / 2)[3 : 3 + len(k)], ((high - low) / 2)[3 : 3 + len(k)]
    point = middle if about is None else numbers("The point of symmetry", about, (3,))[k]
    turns, shifts = np.tile(np.eye(n), (len(M), 1, 1)), np.zeros((len(M), n))
    turns[:, :3, :3], shifts[:, :3] = held.turns, held.shifts
    place, own = slice(3, 3 + len(k)), M[:, k][:, :, k]
    turns[:, place, place] = own * half / half[:, None]
    shifts[:, place] = ((middle - point) @ own.transpose(0, 2, 1) + point - middle) / half
    return Images(turns, shifts)
