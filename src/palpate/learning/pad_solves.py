"""A dataset of a body held by a glued pad: solves with the displacement's inputs first, wherever they stand there."""

from __future__ import annotations

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.dataset_symmetry import declared_symmetry, widen_ranges
from palpate.learning.pad_fit import fit_pad
from palpate.learning.recognised import Recognised, Request, recogniser
from palpate.surrogates import Solves

__all__ = ["is_padded", "pad_solves", "recognise_held"]

_UNITS, _NETWORKS = 192, 4  # of one network and of a mean, for a pad in five dimensions
_MOVES = ("d_x", "d_y", "d_z")
_AXES = {"p_x": 0, "p_y": 1, "p_z": 2}


def is_padded(data: Dataset) -> bool:
    """Return whether a dataset is of a body under one glued pad and nothing else."""
    acting = data.provenance.get("problem", {}).get("interactions", [])
    return [interaction.get("type") for interaction in acting] == ["GluedPad"]


@recogniser
def recognise_held(data: Dataset, request: Request) -> Recognised | None:
    """Return the body of solves under one glued pad; None of any other dataset."""
    if not is_padded(data):
        return None
    solves = pad_solves(data)
    own, further = request.split("degree", "stiffening")
    baseline = fit_pad(solves, **own)[0]
    return Recognised(baseline, solves, {"units_max": _UNITS, "networks": _NETWORKS} | further)


def pad_solves(data: Dataset) -> Solves:
    """Return the converged solves of a body under one glued pad: displacement, then place, then further inputs.

    The ranges are widened to all images under the body's symmetry.
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
    return Solves(
        data.X[:, order],
        data.potential_energy,
        data.response[:, order],
        data.response_gradient[:, order][:, :, order],
        inputs,
        matrices if len(matrices) > 1 else np.zeros((0, 3, 3)),
        about,
        axes,
    )
