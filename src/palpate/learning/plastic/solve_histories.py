"""Histories to learn a held body from, and to judge it by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from palpate.errors import UsageError
from palpate.learning.plastic.drives import held_loads, load_unload_reload, random_times, random_turns
from palpate.learning.plastic.load_histories import LoadHistories, LoadHistory, follow_loads

__all__ = ["HistoryProblem", "solve_elastic", "solve_histories"]

SAMPLES = 20  # of the way from no load to the largest: a step of a history at most
ELASTIC = 30  # samples of the elastic body
RAISES = 12  # of its load by half, until it reaches as far


class HistoryProblem(Protocol):
    """A body with one load that can be led through histories; `palpate.physics.beam.BeamProblem` is one.

    Attributes
    ----------
    rest : (node, 2)
        Mesh nodes, m.
    of_interest : (node,) bool
        Mask of the nodes that the study asks for.
    load_nodes : sequence of int
        The node that each load acts on.
    load_directions : sequence of pairs
        Unit direction of each load.
    """

    @property
    def rest(self) -> np.ndarray:
        """Mesh nodes at rest (node, 2), m."""

    @property
    def of_interest(self) -> np.ndarray:
        """Which of them are of interest."""

    @property
    def load_nodes(self) -> tuple[int, ...]:
        """The node that each input's load acts on."""

    @property
    def load_directions(self) -> tuple[tuple[float, float], ...]:
        """Its direction."""

    def solve_path(self, loads: Any, times: Any = None) -> Sequence[Any]:
        """Answers along a history of loads."""


def solve_histories(
    problem: HistoryProblem,
    *,
    low: float,
    high: float,
    count: int,
    seed: int = 0,
    relaxes: bool = False,
    outward: float = 3.0,
    span: float = 8.0,
    step: float = 0.05,
    radius: float = 0.005,
    progress: Callable[[int, int], None] | None = None,
) -> LoadHistories:
    """Lead a body through random histories.

    One that yields: each third one loads, unloads a part of the way and loads further; the others turn at random.
    One that creeps: the first is put on and held, the others are random drives.

    Parameters
    ----------
    problem : HistoryProblem
        The body under one load.
    low, high : float
        Range of the load, N.
    count : int
        Number of histories.
    seed : int
        Decides the random loads.
    relaxes : bool
        Whether the body creeps with time; else it yields.
    outward : float
        How much turning points are drawn to the ends; 0 for those to be judged by.
    span, step : float
        Length of a history and of its steps in s, where time counts.
    radius : float
        Half the height of the section, m, for the picture.
    progress : callable, optional
        Called with (done, count).

    Raises
    ------
    UsageError
        If the problem has not one load.
    """
    node, direction = _held(problem)
    rng, paths = np.random.default_rng(seed), list[LoadHistory]()
    largest = max(-low, high)
    for i in range(count):
        times: np.ndarray | None = None
        if relaxes and i == 0 and outward > 0:
            times, loads = held_loads(largest, ramp=step, span=span, count=40)
        elif relaxes:
            times, loads = random_times(rng, low, high, span=span, step=step)
        elif i % 3 == 0:
            loads = load_unload_reload(rng, low, high, step=largest / SAMPLES)
        else:
            loads = random_turns(rng, low, high, turns=5, step=largest / SAMPLES, outward=outward)
        paths.append(follow_loads(problem, node, direction, loads, times))
        if progress is not None:
            progress(i + 1, count)
    interest = tuple(int(k) for k in np.flatnonzero(problem.of_interest))
    return LoadHistories(np.asarray(problem.rest), node, direction, tuple(paths), radius, interest)


def solve_elastic(problem: HistoryProblem, *, reach: float, load: float) -> LoadHistory:
    """Load the elastic body until it has gone as far as `reach`, m, beginning with `load`, N.

    Raises
    ------
    UsageError
        If it doesn't get there.
    """
    node, direction = _held(problem)
    for _ in range(RAISES):
        path = follow_loads(problem, node, direction, np.linspace(load / ELASTIC, load, ELASTIC))
        if path.place[-1] >= reach:
            return path
        load *= 1.5
    raise UsageError(
        f"The elastic body went to {path.place[-1]:.4g} m under {load / 1.5:.4g} N.",
        why=f"The histories go to {reach:.4g} m.",
        fix="Check that it is the same body without its memory.",
    )


def _held(problem: HistoryProblem) -> tuple[int, np.ndarray]:
    if len(set(problem.load_nodes)) != 1 or len(set(problem.load_directions)) != 1:
        raise UsageError(
            f"The loads act on nodes {problem.load_nodes} along {problem.load_directions}.",
            why="A held body that remembers is held at one node, along one direction.",
            fix="Give one load.",
        )
    return int(problem.load_nodes[0]), np.asarray(problem.load_directions[0], dtype=float)
