"""Histories of a held body: where it was led, what held it there, and how it looked."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.network import Archive, load_archive, save_archive

__all__ = ["LoadHistories", "LoadHistory", "Marches", "follow_loads"]

KIND = "held-paths"
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


class Marches(Protocol):
    """A problem that can be led through a history of loads; `palpate.physics.beam.BeamProblem` is one."""

    def solve_path(self, loads: Any, times: Any = None) -> Sequence[Any]:
        """Answers with `converged`, `displacement` (node, 3), `strain_energy` and `dissipated`, one for each load."""


@dataclass(frozen=True, eq=False)
class LoadHistories:
    """Load histories of one body held at one node.

    Attributes
    ----------
    rest : (node, 2)
        Mesh nodes at rest, m.
    node : int
        The held one.
    direction : (2,)
        Unit direction of the load.
    paths : tuple of LoadHistory
        The histories, each from the virgin body.
    radius : float
        Half the height of the section, m, for the picture.
    nodes_of_interest : tuple of int
        Mesh nodes that the study asks for.
    """

    rest: np.ndarray
    node: int
    direction: np.ndarray
    paths: tuple[LoadHistory, ...]
    radius: float = 0.005
    nodes_of_interest: tuple[int, ...] = ()

    def __len__(self) -> int:
        return len(self.paths)

    def __str__(self) -> str:
        if not self.paths:
            return "LoadHistories: none"
        reach = max(float(np.abs(path.place).max()) for path in self.paths)
        force = max(float(np.abs(path.force).max()) for path in self.paths)
        samples = sum(map(len, self.paths))
        return f"LoadHistories: {len(self)} with {samples} samples, to {reach:.4g} m and {force:.4g} N"

    def take(self, rows: Sequence[int]) -> LoadHistories:
        """Some of the histories."""
        chosen = tuple(self.paths[i] for i in rows)
        return LoadHistories(
            self.rest, self.node, self.direction, chosen, self.radius, self.nodes_of_interest
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write them to one file.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        arrays = {name: np.concatenate([getattr(one, name) for one in self.paths]) for name in _COLUMNS}
        arrays["displacement"] = np.concatenate([one.displacement for one in self.paths])
        arrays |= {"rest": self.rest, "direction": self.direction}
        arrays["lengths"] = np.array([len(one) for one in self.paths], dtype=np.int64)
        interest = [int(i) for i in self.nodes_of_interest]
        meta = {"node": int(self.node), "radius": float(self.radius), "of_interest": interest}
        return save_archive(path, Archive({}, arrays, meta, KIND))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> LoadHistories:
        """Read them back, bit for bit.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign or from a later version.
        """
        archive = load_archive(path, kind=KIND)
        try:
            arrays, meta = archive.arrays, archive.meta
            ends = np.cumsum(arrays["lengths"])[:-1]
            columns = [np.split(arrays[name], ends) for name in (*_COLUMNS, "displacement")]
            paths = tuple(LoadHistory(*parts) for parts in zip(*columns, strict=True))
            interest = tuple(int(i) for i in meta["of_interest"])
            return cls(
                arrays["rest"],
                int(meta["node"]),
                arrays["direction"],
                paths,
                float(meta["radius"]),
                interest,
            )
        except (KeyError, TypeError, ValueError, IndexError, UsageError) as error:
            raise FileFormatError(f"{path} does not hold histories.", why=str(error)) from error


def follow_loads(
    problem: Marches, node: int, direction: np.ndarray, loads: np.ndarray, times: np.ndarray | None = None
) -> LoadHistory:
    """Lead a body through loads, from its virgin state.

    Parameters
    ----------
    problem : Marches
        With one load, at the node and in the direction.
    node : int
        The held mesh node.
    direction : (2,)
        Unit direction of its load.
    loads : (N,)
        N; where a solve fails the history ends.
    times : (N,), optional
        In s; bodies that creep need them.

    Raises
    ------
    UsageError
        If not even the first load could be solved.
    """
    loads = np.asarray(loads, dtype=float)
    answers = problem.solve_path(loads, times)
    good = 0
    while good < len(answers) and answers[good].converged:
        good += 1
    if not good:
        raise UsageError(
            "The first load of a history has no answer.", why=answers[0].message, fix="Begin with less."
        )
    shapes = np.array([one.displacement[:, :2] for one in answers[:good]])
    return LoadHistory(
        times=np.arange(1.0, 1.0 + good) if times is None else np.asarray(times, dtype=float)[:good],
        place=shapes[:, node] @ np.asarray(direction, dtype=float),
        force=loads[:good],
        stored=np.array([one.strain_energy for one in answers[:good]]),
        lost=np.array([one.dissipated for one in answers[:good]]),
        displacement=shapes,
    )
