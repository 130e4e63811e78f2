"""A body's symmetry in scaled inputs: the maps that its isometries are, of what a hand moves and of where it is."""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.sample_checks import numbers
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import Baseline, Solves
from palpate.units import bounds

__all__ = ["images_of"]


def images_of(solves: Solves, baseline: Baseline) -> Images | None:
    """Return the maps of scaled inputs that a body's isometries M are; None without symmetry.

    A probe's centre c becomes p₀ + M(c − p₀), p₀ the point that stays; a displacement d becomes M d, and the place of
    what is held, whose coordinates are along `solves.axes`, p₀ + M(p − p₀). Felt coordinates are turned within the
    baseline's directions. By default p₀ is the middle of the place's ranges. A rotation vector w becomes det M M w: in
    a mirror a turn goes the other way. Further inputs stay what they are.
    """
    if not len(solves.symmetry):
        return None
    M = numbers("Isometries", np.asarray(solves.symmetry, float).reshape(len(solves.symmetry), -1), (None, 9))
    M, D = M.reshape(-1, 3, 3), baseline.directions
    if not np.allclose(M @ M.transpose(0, 2, 1), np.eye(3), atol=1e-9):
        raise UsageError(
            "A matrix of the symmetry is no isometry.",
            why="Images of a touch keep lengths: M Mᵀ is the identity.",
            fix="Pass rotations and reflections, as (3, 3) matrices.",
        )
    k, n, axes = len(D), len(solves.inputs), list(solves.axes)
    _require_axes(M, axes)
    low, high = bounds(solves.inputs)
    middle, half = (low + high) / 2, (high - low) / 2
    about = None if solves.about is None else numbers("The point of symmetry", solves.about, (3,))
    turns, shifts = np.tile(np.eye(n), (len(M), 1, 1)), np.zeros((len(M), n))
    felt, place = slice(0, k), slice(k, k + len(axes))
    point = np.zeros(k) if baseline.holds else (middle[felt] if about is None else D @ about)
    for where, own, fixed in (
        (felt, D @ M @ D.T, point),
        (place, M[:, axes][:, :, axes], middle[place] if about is None else about[axes]),
    ):
        turns[:, where, where] = own * half[where] / half[where, None]
        moved = (middle[where] - fixed) @ own.transpose(0, 2, 1) + fixed - middle[where]
        shifts[:, where] = moved / half[where]
    some = slice(k, k + solves.angles)
    own = np.linalg.det(M)[:, None, None] * M[:, : solves.angles, : solves.angles]
    turns[:, some, some] = own * half[some] / half[some, None]
    return Images(turns, shifts)


def _require_axes(M: np.ndarray, axes: list[int]) -> None:
    others = [a for a in range(3) if a not in axes]
    if axes and np.abs(M[:, axes][:, :, others]).max(initial=0.0) > 1e-9:
        raise UsageError(
            f"A symmetry mixes the place's axes {axes} with axis {others[0]}.",
            why="Of a place that is told by two coordinates the third is not known.",
            fix="Give the place by all three coordinates, or leave that isometry out.",
        )
