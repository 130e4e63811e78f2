"""Histories to learn a held body from, and to judge it by: a dataset with a time axis."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from palpate import checks
from palpate.dataset import Dataset
from palpate.dataset.histories import LoadHistory, history_dataset
from palpate.errors import UsageError
from palpate.sweeps.drives import held_loads, load_unload_reload, random_times, random_turns
from palpate.sweeps.plan import provenance
from palpate.sweeps.problem import Problem

__all__ = ["HistoryProblem", "solve_elastic", "solve_histories"]

SAMPLES = 20  # of the way from no load to the largest: a step of a history at most
ELASTIC_SAMPLES = 30  # of the body without its memory
RAISES = 12  # of its load by half, until it reaches as far
BEYOND = 1.05  # how far it reaches over the histories, for those that go farther


class HistoryProblem(Problem, Protocol):
    """A problem with one load that can be led through histories; `palpate.physics.beam.BeamProblem` is one."""

    def solve_path(self, loads: Any, times: Any = None) -> Sequence[Any]:
        """Answers with `converged`, `displacement` (node, 3), `strain_energy` and `dissipated`, one for each load."""


def solve_histories(
    problem: HistoryProblem,
    *,
    elastic: HistoryProblem | None = None,
    count: int,
    seed: int = 0,
    relaxes: bool = False,
    outward: float = 3.0,
    span: float = 8.0,
    step: float = 0.05,
    progress: Callable[[int, int], None] | None = None,
) -> Dataset:
    """Lead a body through random histories.

    One that yields: each third one loads, unloads a part of the way and loads further; the others turn at random.
    One that creeps: the first is put on and held, the others are random drives.

    Parameters
    ----------
    problem : HistoryProblem
        The body under one load.
    elastic : HistoryProblem, optional
        The same body without its memory, which learning needs; histories to be judged by do without.
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
    progress : callable, optional
        Called with (done, count).

    Raises
    ------
    UsageError
        If the problem has not one load, or the first load of a history or the elastic body can't be solved.
    """
    _require_one_load(problem)
    checks.fits("The number of histories", count, least=1, whole=True)
    checks.positive("The length of a history", span, "s")
    checks.positive("The step of a history", step, "s")
    load, rng, paths, began = problem.ranges[0], np.random.default_rng(seed), [], time.perf_counter()
    low, high, largest = load.low, load.high, max(-load.low, load.high)
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
        paths.append(_follow(problem, loads, times))
        if progress is not None:
            progress(i + 1, count)
    same = None if elastic is None else solve_elastic(elastic, paths)
    samples = np.concatenate([path.force for path in paths])[:, None]
    origin = provenance(problem, samples, "histories", seed) | {"relaxes": relaxes}
    seconds = (time.perf_counter() - began) / (len(samples) + (0 if same is None else len(same)))
    return history_dataset(paths, load, problem.layout, origin, elastic=same, seconds=seconds)


def solve_elastic(problem: HistoryProblem, paths: Sequence[LoadHistory]) -> LoadHistory:
    """Load the body without its memory, at first by its largest load, until it has gone farther than all histories."""
    _require_one_load(problem)
    load, reach = problem.ranges[0].high, BEYOND * max(float(np.abs(path.place).max()) for path in paths)
    for _ in range(RAISES):
        path = _follow(problem, np.linspace(load / ELASTIC_SAMPLES, load, ELASTIC_SAMPLES), None)
        if path.place[-1] >= reach:
            return path
        load *= 1.5
    raise UsageError(
        f"The elastic body went to {path.place[-1]:.4g} m under {load / 1.5:.4g} N.",
        why=f"The histories go to {reach:.4g} m.",
        fix="Check that it is the same body without its memory.",
    )


def _follow(problem: HistoryProblem, loads: np.ndarray, times: np.ndarray | None) -> LoadHistory:
    """Lead a body through loads (N,) in N, from its virgin state; where a solve fails the history ends."""
    answers = problem.solve_path(loads, times)
    good = 0
    while good < len(answers) and answers[good].converged:
        good += 1
    if not good:
        raise UsageError(
            "The first load of a history has no answer.", why=answers[0].message, fix="Begin with less."
        )
    node, direction = problem.layout.load_nodes[0], problem.layout.load_directions[0]
    shapes = np.array([one.displacement[:, :2] for one in answers[:good]])
    return LoadHistory(
        times=np.arange(1.0, 1.0 + good) if times is None else np.asarray(times, dtype=float)[:good],
        place=shapes[:, node] @ np.asarray(direction, dtype=float),
        force=np.asarray(loads, dtype=float)[:good],
        stored=np.array([one.strain_energy for one in answers[:good]]),
        lost=np.array([one.dissipated for one in answers[:good]]),
        displacement=shapes,
    )


def _require_one_load(problem: HistoryProblem) -> None:
    nodes, directions = problem.layout.load_nodes, problem.layout.load_directions
    if len(set(nodes)) != 1 or len(set(map(tuple, directions))) != 1:
        raise UsageError(
            f"The loads act on nodes {tuple(nodes)} along {tuple(directions)}.",
            why="A held body that remembers is held at one node, along one direction.",
            fix="Give one load.",
        )
