"""Histories of a held body as a dataset with a time axis: each row is one sample of one history.

Beside the load, its input, each row has the number of its ``history``, its ``time``, the ``place`` of the held node,
and the energies that can be had back and that can't. A history of the number `ELASTIC` is of the same body without its
memory: what it is at once after a load, or below yield.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.dataset.assemble import assemble
from palpate.dataset.dataset import Dataset
from palpate.dataset.schema import Field, Layout
from palpate.errors import UsageError
from palpate.units import Range

__all__ = ["ELASTIC", "LoadHistory", "elastic_of", "histories_of", "history_dataset", "is_history"]

ELASTIC = -1
_COLUMNS = ("times", "place", "force", "stored", "lost")


@dataclass(frozen=True, eq=False)
class LoadHistory:
    """One history, from the virgin body at time 0; between two samples it goes evenly.

    Attributes
    ----------
    times : (N,)
        In s, ascending; for a body that knows no time, any.
    place : (N,)
        w, displacement of the held node along the load, m.
    force : (N,)
        P, the load that holds it there, N.
    stored, lost : (N,)
        Energy that can be had back, and energy that can't, J.
    displacement : (N, node, 2)
        Of the mesh nodes, m.

    Raises
    ------
    UsageError
        If the arrays don't fit together, or a number isn't finite.
    """

    times: np.ndarray
    place: np.ndarray
    force: np.ndarray
    stored: np.ndarray
    lost: np.ndarray
    displacement: np.ndarray

    def __post_init__(self) -> None:
        arrays = [np.asarray(getattr(self, name), dtype=float) for name in _COLUMNS]
        shapes = {a.shape for a in arrays} | {np.shape(self.displacement)[:1]}
        sound = len(shapes) == 1 and all(np.isfinite(a).all() for a in (*arrays, self.displacement))
        if not sound or not (np.diff(arrays[0], prepend=0.0) >= 0).all():
            raise UsageError(
                f"These samples are no history; their shapes are {shapes}.",
                why="Each sample has a time, a place, a force and energies, all finite, and time ascends from 0.",
                fix="Leave out what follows a solve that failed.",
            )

    def __len__(self) -> int:
        return len(self.times)


def history_dataset(
    paths: Sequence[LoadHistory],
    load: Range,
    layout: Layout,
    origin: Mapping[str, Any],
    *,
    elastic: LoadHistory | None = None,
    seconds: float = 0.0,
) -> Dataset:
    """Return histories under one load, N, as a dataset; learning needs the one of the body without its memory too.

    `layout` is of a plane body, with the held node and the direction of its load. `origin` is the provenance; its
    ``relaxes`` says whether the body creeps with time, else it yields. `seconds` is the time of a solve.
    """
    numbered = [*enumerate(paths), *([] if elastic is None else [(ELASTIC, elastic)])]
    nodes, count = len(layout.rest), sum(len(path) for _, path in numbered)

    def column(name: str) -> np.ndarray:
        return np.concatenate([np.zeros(0), *(getattr(path, name) for _, path in numbered)])

    shapes = [np.zeros((0, nodes, 2)), *(path.displacement for _, path in numbered)]
    owners = [np.zeros(0, np.int64), *(np.full(len(path), number) for number, path in numbered)]
    answers = {
        "history": np.concatenate(owners),
        "time": column("times"),
        "place": column("place"),
        "strain_energy": column("stored"),
        "dissipated": column("lost"),
        "displacement": np.concatenate(shapes),
        "converged": np.ones(count, dtype=bool),
        "iterations": np.zeros(count, dtype=np.int64),
        "residual": np.zeros(count),
        "message": np.full(count, "solved", dtype=object),
        "solve_seconds": np.full(count, seconds),
    }
    schema = (
        Field("history", meaning=f"number of the history; {ELASTIC}: of the body without its memory", fill=0),
        Field("time", unit="s", meaning="time since the virgin body"),
        Field("place", unit="m", meaning="displacement of the held node along the load"),
        Field("strain_energy", unit="J", meaning="energy that can be had back"),
        Field("dissipated", unit="J", meaning="energy lost for good since the virgin body"),
        Field("displacement", ("node", "axis"), (nodes, 2), "m", "offset from the rest position"),
    )
    return assemble([load], layout, column("force")[:, None], answers, origin, schema=schema)


def is_history(data: Dataset) -> bool:
    """Return whether the rows of a dataset are samples of histories."""
    return data.is_history


def histories_of(data: Dataset) -> tuple[LoadHistory, ...]:
    """Return the histories of a dataset, in their order, without that of the body without its memory."""
    owners = data["history"]
    return tuple(_history(data, owners == number) for number in np.unique(owners[owners >= 0]))


def elastic_of(data: Dataset) -> LoadHistory | None:
    """Return the history of the body without its memory; None where the dataset has none."""
    rows = data["history"] == ELASTIC
    return _history(data, rows) if rows.any() else None


def _history(data: Dataset, rows: np.ndarray) -> LoadHistory:
    names = ("time", "place", "strain_energy", "dissipated", "displacement")
    times, place, stored, lost, displacement = (data[name][rows] for name in names)
    return LoadHistory(times, place, data.X[rows, 0], stored, lost, displacement)
