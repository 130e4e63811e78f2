"""The sweep of a study with `[solver]`: solves to learn from and solves for testing, made by another program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.format import count
from palpate.study.solver_study import SolverStudy
from palpate.sweeps import OnDemandCluster, grow, sweep
from palpate.sweeps.command_problem import READING

__all__ = ["SolverSolves", "sweep_solver"]


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
    announce: Callable[[str], None],
    log: Callable[[str], None] = lambda _: None,
) -> SolverSolves:
    """Run the program of a study, whose files stand in `folder`, for all cases, and return their datasets.

    `announce` gets the command before anything runs; a program takes at most `limit` s. An interrupted sweep goes on
    where it stopped.
    """
    problem, paths = study.problem(folder, limit), study.paths(folder)
    problem.check()
    common = {"progress": progress, "case_limit": problem.limit + READING}
    train = {"samples": study.sweep.samples, "seed": study.sweep.seed, "design": study.sweep.design}
    further = {"samples": study.test.random, "seed": study.test.seed, "design": "random"}
    announce(f"Runs for each case:\n  {problem.shown_command()}")
    with OnDemandCluster(study.sweep.workers) as cluster:

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
