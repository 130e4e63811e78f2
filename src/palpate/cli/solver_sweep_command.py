"""`palpate sweep` of a study with `[solver]`: the one command that starts another program."""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli.console import Console
from palpate.errors import AccuracyError
from palpate.format import count, duration, share

if TYPE_CHECKING:
    from palpate.improvement import ImprovementStep
    from palpate.options import ImprovementOptions
    from palpate.study.solver_study import SolverStudy
    from palpate.sweeps import JobQueue, Scheduler

__all__ = ["SolverSweepOptions", "sweep_solver_file"]


@dataclass(frozen=True)
class SolverSweepOptions:
    """Options of the command that a study with `[solver]` takes or refuses."""

    samples: int | None
    workers: int | None
    case_limit: float
    scheduler: Scheduler | JobQueue | None
    improvement: ImprovementOptions | None  # of --until


def sweep_solver_file(path: Path, options: SolverSweepOptions, console: Console) -> None:
    """Print the command of a study, run it for each case, and print where the solves are and which failed."""
    from palpate.study.solver_study import read_solver_study
    from palpate.study.solver_sweep import sweep_solver
    from palpate.study.study_lock import hold_study

    study, began = read_solver_study(path), time.monotonic()
    samples = options.samples if options.improvement is None else None  # there the most solves
    changed = {"samples": samples, "workers": options.workers}
    wanted = {name: value for name, value in changed.items() if value is not None}
    study = study.model_copy(update={"sweep": study.sweep.model_copy(update=wanted)})
    if options.improvement is not None:
        _improve(study, path.parent, options, options.improvement, console)
        return
    paths = study.paths(path.parent)
    with hold_study(paths, "palpate sweep"):
        solves = sweep_solver(
            study,
            path.parent,
            limit=options.case_limit,
            progress=not console.as_json,
            scheduler=options.scheduler,
            announce=Console().say,  # also beside --json: nobody's program starts without a word
            log=lambda stage: console.say(f"Solving: {stage} …"),
        )
    failures = solves.failures
    parts = [solves.data] if solves.unseen is None else [solves.data, solves.unseen]
    lines = [str(solves.data)] if console.verbose else []
    lines.append(f"{paths.data}: {count(len(solves.data), 'solve')} to learn from")
    if solves.unseen is not None:
        lines.append(f"{paths.random}: {count(len(solves.unseen), 'further solve')} for testing")
    if failures:
        lines.append(f"{count(len(failures), 'case')} failed. The first: {failures[0]}")
    seconds = [float(s) for part in parts for s in part["solve_seconds"]]
    lines.append(
        f"{count(len(seconds), 'solve')}, {duration(statistics.median(seconds))} each at the median; "
        f"this took {duration(time.monotonic() - began)}"
    )
    lines.append(f"next    palpate learn {paths.data}")
    console.result(
        "\n".join(lines),
        {
            "data": str(paths.data),
            "random": None if solves.unseen is None else str(paths.random),
            "rows": len(seconds),
            "failed": len(failures),
            "failures": failures,
        },
    )


def _improve(
    study: SolverStudy,
    folder: Path,
    options: SolverSweepOptions,
    improvement: ImprovementOptions,
    console: Console,
) -> None:
    """Choose the cases of a study until an error is kept, and print a line for each surrogate.

    All is kept and printed when an `AccuracyError` says that the error was not reached.
    """
    from palpate.study.solver_sweep import improve_solver
    from palpate.study.study_lock import hold_study

    paths, steps, last = study.paths(folder), list[dict[str, Any]](), None
    with hold_study(paths, "palpate sweep"):
        for step in improve_solver(
            study,
            folder,
            options=improvement,
            scheduler=options.scheduler,
            progress=not console.as_json,
            announce=Console().say,  # also beside --json: nobody's program starts without a word
            log=lambda stage: console.say(f"{stage} …"),
        ):
            last = step
            if step.phase in {"judged", "learnt"}:
                console.say(_step_line(step))
                steps.append({"solves": step.solves, "answer_p95": step.error, "seconds": step.seconds})
    assert last is not None
    lines = [last.reason] if last.reached else []
    lines.append(
        f"solves  {paths.data} ({last.solves} to learn from), {paths.random} ({last.unseen} unseen)\n"
        f"model   {paths.model}\n"
        f"next    palpate view {paths.model}, palpate validate {paths.model} {paths.random}"
    )
    files = {"data": str(paths.data), "random": str(paths.random), "model": str(paths.model)}
    console.result("\n".join(lines), {"steps": steps, "reached": last.reached, "reason": last.reason} | files)
    if not last.reached:
        raise AccuracyError(
            f"The error of {study.name} is {share(last.error)} after {count(last.solves, 'solve')}, "
            f"not {share(improvement.until)}.",
            why=f"{last.reason} Everything is kept.",
            fix="Run the same command again, which goes on, with more --samples, more --minutes or a larger --until.",
        )


def _step_line(step: ImprovementStep) -> str:
    """Return the figures of a step as a line."""
    kept = (
        "" if step.is_new or math.isnan(step.tried) else f"; a new one has {share(step.tried)}, and is left"
    )
    return (
        f"{count(step.solves, 'solve')}: error {share(step.median)} of the range at the median, {share(step.error)} "
        f"at the 95th percentile of {count(step.unseen, 'unseen solve')}, after {duration(step.seconds)}{kept}"
    )
