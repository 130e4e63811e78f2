"""Solves of a held body from a dataset, the displacement's inputs first, wherever they stand there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.dataset_symmetry import declared_symmetry, widen_ranges
from palpate.units import Range

__all__ = ["HeldSolves"]

_MOVES = ("d_x", "d_y", "d_z")
_AXES = {"p_x": 0, "p_y": 1, "p_z": 2}


@dataclass(frozen=True, eq=False)
class HeldSolves:
    """Converged solves of a body under one glued pad.

    Attributes
    ----------
    X : (N, n)
        Displacement (m), then place (m), then further inputs.
    energy, force, stiffness : (N,), (N, n), (N, n, n)
        U, −∂U/∂x and its derivative.
    inputs : n ranges
        Widened to all images under the symmetry.
    axes : tuple of int
        Along which axes the place's coordinates are.
    matrices, about : (k, 3, 3), (3,) arrays
        The body's symmetry, the identity among it, and the point that stays (m).
    """

    X: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    inputs: tuple[Range, ...]
    axes: tuple[int, ...]
    matrices: np.ndarray
    about: np.ndarray

    @classmethod
    def of(cls, data: Dataset) -> HeldSolves:
        """The converged rows of a dataset.

        Raises
        ------
        UsageError
            If its inputs are not the three components of one pad's displacement, and others.
        """
        data = data.ok
        own = [r.name.split()[-1] for r in data.ranges]
        if any(own.count(move) != 1 for move in _MOVES):
            raise UsageError(
                f"These solves of {', '.join(r.name for r in data.ranges)} are not those of one held pad.",
                why="A pad is held with all three components of its displacement as inputs.",
                fix="Sweep with pp.GluedPad(..., displacement=((low, high),) * 3).",
            )
        moves = [own.index(move) for move in _MOVES]
        places = [i for i, name in enumerate(own) if name in _AXES]
        order = moves + places + [i for i in range(len(own)) if i not in (*moves, *places)]
        axes = tuple(_AXES[own[i]] for i in places)
        matrices, about = declared_symmetry(data)
        ranges = tuple(data.ranges[i] for i in order)
        end, k = 3 + len(axes), list(axes)
        inputs = (
            *widen_ranges(ranges[:3], matrices, np.zeros(3)),
            *(widen_ranges(ranges[3:end], matrices[:, k][:, :, k], about[k]) if axes else ()),
            *ranges[end:],
        )
        return cls(
            data.X[:, order],
            data.potential_energy,
            data.response[:, order],
            data.response_gradient[:, order][:, :, order],
            inputs,
            axes,
            matrices,
            about,
        )
