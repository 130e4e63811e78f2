"""`palpate sweep` of a study with `[solver]`: the one command that starts another program."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass
from pathlib import Path

from palpate.cli.console import Console
from palpate.errors import UsageError
from palpate.format import count, duration

__all__ = ["SolverSweepOptions", "sweep_solver_file"]


@dataclass(frozen=True)
class SolverSweepOptions:
    """Options of the command that a study with `[solver]` takes or refuses."""

    samples: int | None
    workers: int | None
    case_limit: float
    until: bool  # whether --until or --minutes is there
    scheduler: bool  # whether --scheduler or a certificate is there


def sweep_solver_file(path: Path, options: SolverSweepOptions, console: Console) -> None:
    """Print the command of a study, run it for each case, and print where the solves are and which failed."""
    from palpate.study.solver_study import read_solver_study
    from palpate.study.solver_sweep import sweep_solver

    if options.scheduler:
        raise UsageError(
            "The program of a study with [solver] runs on this machine.",
            why="On a scheduler's machines neither the program nor the folder of the templates need be there.",
            fix="Leave --scheduler and certificates out.",
        )
    if options.until:
        raise UsageError(
            "Solves of a study with [solver] follow its design.",
            fix="Leave --until and --minutes out, and ask for more with --samples: a finished sweep is continued.",
        )
    study, began = read_solver_study(path), time.monotonic()
    changed = {"samples": options.samples, "workers": options.workers}
    wanted = {name: value for name, value in changed.items() if value is not None}
    study = study.model_copy(update={"sweep": study.sweep.model_copy(update=wanted)})
    solves = sweep_solver(
        study,
        path.parent,
        limit=options.case_limit,
        progress=not console.as_json,
        announce=Console().say,  # also beside --json: nobody's program starts without a word
        log=lambda stage: console.say(f"Solving: {stage} …"),
    )
    paths, failures = study.paths(path.parent), solves.failures
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
