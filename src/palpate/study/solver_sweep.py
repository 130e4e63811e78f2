"""The sweep of a study with `[solver]`: solves to learn from and solves for testing, made by another program.

They follow the study's design, or are chosen batch by batch until an error is kept.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.format import count
from palpate.improvement import ImprovementStep, improve
from palpate.learning.learn_dataset import learn
from palpate.options import ImprovementOptions
from palpate.study.solver_study import SolverStudy
from palpate.sweeps import JobQueue, OnDemandCluster, Scheduler, Space, grow, random, sweep
from palpate.sweeps.command_problem import READING

__all__ = ["SolverSolves", "improve_solver", "sweep_solver"]


@dataclass(frozen=True, eq=False)
class SolverSolves:
    """Datasets of a sweep: what is learnt from, and what is kept for testing, None where nothing is."""

    data: Dataset
    unseen: Dataset | None

    @property
    def failures(self) -> list[str]:
        """Why cases have no answer, one text for each of them."""
        parts = [self.data] if self.unseen is None else [self.data, self.unseen]
        return [str(part.message[row]) for part in parts for row in np.flatnonzero(~part.converged)]


def sweep_solver(
    study: SolverStudy,
    folder: Path,
    *,
    limit: float,
    progress: Any = True,
    scheduler: Scheduler | JobQueue | None = None,
    announce: Callable[[str], None],
    log: Callable[[str], None] = lambda _: None,
) -> SolverSolves:
    """Run the program of a study, whose files stand in `folder`, for all cases, and return their datasets.

    `announce` gets the command before anything runs; a program takes at most `limit` s. An interrupted sweep goes on
    where it stopped. On the machines of a `scheduler` program and folder must be there under the same paths.
    """
    problem, paths = study.problem(folder, limit), study.paths(folder)
    problem.check()
    common = {"progress": progress, "case_limit": problem.limit + READING}
    train = {"samples": study.sweep.samples, "seed": study.sweep.seed, "design": study.sweep.design}
    further = {"samples": study.test.random, "seed": study.test.seed, "design": "random"}
    announce(f"Runs for each case:\n  {problem.shown_command()}")
    with _machines(study, scheduler) as cluster:

        def solve(path: Path, wanted: dict[str, Any]) -> Dataset:
            grown = grow(path, problem, wanted)
            return sweep(problem, path=path, **wanted, **common, cluster=cluster) if grown is None else grown

        log(f"{count(study.sweep.samples, 'solve')} to learn from")
        data = solve(paths.data, train)
        unseen = None
        if study.test.random:
            log("further solves for testing only, which learning never sees")
            unseen = solve(paths.random, further)
    problem.tidy()
    return SolverSolves(data, unseen)


def improve_solver(
    study: SolverStudy,
    folder: Path,
    *,
    options: ImprovementOptions,
    scheduler: Scheduler | JobQueue | None = None,
    progress: Any = True,
    announce: Callable[[str], None],
    log: Callable[[str], None] = lambda _: None,
) -> Iterator[ImprovementStep]:
    """Choose the cases of a study batch by batch, learn, and yield each step, until an error is kept.

    The surrogate of each step stays as the study's. As many cases as ``[test]`` asks for judge it. The rest is as of
    `sweep_solver`.
    """
    problem, paths = study.problem(folder, options.case_limit), study.paths(folder)
    problem.check()
    number = study.test.random
    if not number:
        raise UsageError(
            "No cases judge what is learnt, so nobody could say when to stop.",
            why="The study says random = 0 in [test].",
            fix="Say random = 20 there, or leave --until out.",
        )
    announce(f"Runs for each case:\n  {problem.shown_command()}")
    with _machines(study, scheduler) as cluster:
        for step in improve(
            problem,
            unseen=random(Space(problem.ranges), number, study.test.seed),  # those of `sweep_solver`
            path=paths.data,
            unseen_path=paths.random,
            learner=lambda data, _: learn(data, name=study.name, workers=1),
            cluster=cluster,
            progress=progress,
            log=log,
            options=replace(options, seed=study.sweep.seed, case_limit=problem.limit + READING),
        ):
            if step.is_new and step.surrogate is not None:
                step.surrogate.save(paths.model)
            yield replace(step, model_path=paths.model if paths.model.exists() else None)
    problem.tidy()


def _machines(
    study: SolverStudy, scheduler: Scheduler | JobQueue | None
) -> contextlib.AbstractContextManager[Any]:
    """Return the machines that solve: those of a scheduler, else processes of this one, once they are needed."""
    return OnDemandCluster(study.sweep.workers) if scheduler is None else contextlib.nullcontext(scheduler)
