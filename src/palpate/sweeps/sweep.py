"""The sweep: many solves in parallel, every answer kept, progress reported."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from palpate import checks
from palpate.dataset import Dataset
from palpate.errors import SolverError
from palpate.processes import CASE_LIMIT
from palpate.sweeps.case import Columns, empty, put
from palpate.sweeps.ledger import Ledger
from palpate.sweeps.plan import Plan, make_plan
from palpate.sweeps.runner import connect, run, seconds_per_case
from palpate.sweeps.space import Design

__all__ = ["Report", "reporter", "sweep"]

_FLUSH_SECONDS = 3.0  # most work that a killed sweep loses; a store of many small files is slow to write
_FLUSH_SHARE = 0.1  # of the time goes into writing at most, before that
_FLUSH_GROWTH = 0.01  # s that each part adds to the time between two: all are read when the sweep goes on


def sweep(
    body: Any,
    interactions: Any = None,
    *,
    samples: int | None = None,
    seed: int = 0,
    design: str | Design | None = None,
    points: Any = None,
    workers: int | None = None,
    cluster: Any = None,
    progress: bool | Report = True,
    path: str | os.PathLike[str] | None = None,
    max_failed: float = 0.5,
    case_limit: float = CASE_LIMIT,
) -> Dataset:
    """Solve a body under many loads, or touched at many places, in parallel.

    Samples are solved in chains, each solve starting from the last one's answer. The chains are settled before
    the first solve, by the problem and the points alone: how many workers there are, and whether the sweep was
    interrupted, changes no bit of the answers. A sample that fails becomes a row with NaN and a message, and the
    sweep goes on, also where it ends the process that solves it or never ends.

    Parameters
    ----------
    body : body or Problem
        Anything with a method ``problem(interactions)``, such as a `Cantilever` or a `Body`; or a `Problem`,
        without `interactions`.
    interactions : load or interaction, or sequence of them
        What varies: the n inputs.
    samples : int, optional
        How many points the design gets; needed unless `points` are given.
    seed : int
        Decides the design; the same seed gives the same dataset.
    design : str or Design, optional
        ``"sobol"``, ``"grid"``, ``"random"``, or a function (space, samples, seed) -> points. By default the
        problem's own, for a probe columns over the surface; where it has none, ``"sobol"``.
    points : (N, n) array, optional
        The points themselves, in place of a design; (N,) will do for one input.
    workers : int, optional
        Processes on this machine, by default one for each core.
    cluster : optional
        What to run on instead: a `local_cluster`, a `JobQueue`, a `Scheduler` or its address, or a cluster or
        client of Dask's.
    progress : bool or callable
        A bar on standard error if that is a terminal; or a function (done, total).
    path : path, optional
        A Zarr store to write. An interrupted sweep takes up its finished chains there; a finished one is read.
    max_failed : float
        Largest share of failed samples that is put up with.
    case_limit : float
        Time in s after which the solve of a sample has failed; by default an hour.

    Returns
    -------
    Dataset
        Rows in the order of the design.

    Raises
    ------
    UsageError
        For a wrong argument, or if `path` holds another sweep.
    ResourceError
        If no scheduler answers or it is lost, or the disk is full; what is solved is kept at `path`.
    SolverError
        If more than `max_failed` of the samples failed.
    """
    checks.positive("The limit of a case", case_limit, "s")
    plan = make_plan(body, interactions, samples, seed, design, points)
    ledger = Ledger(Path(path), plan.config) if path is not None else None
    data = ledger.complete() if ledger else None
    if data is None:
        data = _solve(plan, ledger, workers, cluster, progress, case_limit)
    _check_failures(data, max_failed)
    return data


def _solve(
    plan: Plan,
    ledger: Ledger | None,
    workers: int | None,
    cluster: Any,
    progress: bool | Report,
    case_limit: float,
) -> Dataset:
    columns = empty(len(plan.points), plan.schema)
    chains = plan.chains()
    done = _read_finished(plan, ledger, columns, chains)
    with reporter(progress) as report, _saving(plan, ledger, columns) as save_rows:
        report(int(done.sum()), done.size)

        def accept(rows: np.ndarray, answers: Columns) -> None:
            put(columns, rows, answers)
            done[rows] = True
            save_rows(rows)
            report(int(done.sum()), done.size)

        unsolved = [rows for rows in chains if not done[rows].all()]
        if unsolved:
            with connect(cluster, workers) as machines:
                run(
                    machines,
                    plan.problem,
                    plan.schema,
                    plan.points,
                    unsolved,
                    accept,
                    case_limit,
                    seconds_per_case(columns),
                )
    data = plan.label(columns, np.arange(len(plan.points)))
    return ledger.finish(data) if ledger else data


@contextlib.contextmanager
def _saving(plan: Plan, ledger: Ledger | None, columns: Columns) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield a function that takes finished rows; after an interruption all of them are in the ledger."""
    fresh: list[np.ndarray] = []
    begun, interval, parts = monotonic(), 0.0, 0

    def flush() -> None:
        nonlocal begun, interval, parts
        started = monotonic()
        if ledger and fresh:
            rows = np.concatenate(fresh)
            ledger.add(plan.label({name: values[rows] for name, values in columns.items()}, rows))
            parts += 1
        fresh.clear()
        begun = monotonic()
        interval = min(_FLUSH_SECONDS, max((begun - started) / _FLUSH_SHARE, _FLUSH_GROWTH * parts))

    def save_rows(rows: np.ndarray) -> None:
        fresh.append(rows)
        if monotonic() - begun > interval:
            flush()

    try:
        yield save_rows
    except BaseException:
        flush()
        raise


def _read_finished(
    plan: Plan, ledger: Ledger | None, columns: Columns, chains: list[np.ndarray]
) -> np.ndarray:
    """Fill in the rows that an earlier run finished; return True for them, bool of shape (N,).

    A chain counts only as a whole: a solver that entered one in its midst would have another past, and answer
    with other last bits.
    """
    done = np.zeros(len(plan.points), dtype=bool)
    if ledger:
        ledger.begin(len(plan.points))
        for part in ledger.read():
            if not np.array_equal(part.rest, plan.layout.rest):
                continue  # of another mesh: a mesher of another version made it
            rows = part["sample"]
            # parts of an earlier version lack what is recorded since
            answers = {name: part[name] if name in part else columns[name][rows] for name in columns}
            put(columns, rows, answers)
            done[rows] = True
        for rows in chains:
            done[rows] = done[rows].all()
    return done


def _check_failures(data: Dataset, max_failed: float) -> None:
    failed = np.flatnonzero(~data.converged)
    if failed.size == 0 or failed.size <= max_failed * len(data):
        return
    # without the tracebacks, which the rows keep
    reasons = [str(data.message[row]).partition("\n\n")[0] for row in failed[:3]]
    first = [f"{_inputs(data, row)}: {reason}" for row, reason in zip(failed[:3], reasons, strict=True)]
    heading = "The first of them:" if failed.size > 3 else "They are:" if failed.size > 1 else "It is:"
    raise SolverError(
        f"{failed.size} of {len(data)} solves failed.",
        why="\n".join([heading, *(f"  {line}" for line in first)]),
        fix=_advice(failed.size / len(data)),
    )


def _advice(share: float) -> str:
    narrow = "Narrow the ranges of the inputs, or refine the mesh"
    return (
        f"{narrow}."
        if share == 1
        else f"{narrow}; in Python, max_failed={share:.2g} allows so many failures."
    )


def _inputs(data: Dataset, row: int) -> str:
    return ", ".join(
        f"{r.name} = {value:g} {r.unit}" for r, value in zip(data.ranges, data.X[row], strict=True)
    )


_LOG_INTERVAL = 10.0  # s between two lines in a log

Report = Callable[[int, int], None]
"""Called with the number of samples done and of all."""


@contextlib.contextmanager
def reporter(progress: bool | Report) -> Iterator[Report]:
    """Yield a report: the caller's function, a bar in a terminal, else a line on standard error now and then."""
    if callable(progress):
        yield progress
    elif progress and sys.stderr.isatty():
        with _bar() as report:
            yield report
    elif progress:
        yield _lines()
    else:
        yield _silent


def _silent(done: int, total: int) -> None:
    """Report to nobody."""


def _lines() -> Report:
    """Return a report for a log: a line every so often, and one at the end of what took that long."""
    last, before = monotonic(), -1

    def report(done: int, total: int) -> None:
        nonlocal last, before
        late = monotonic() - last > _LOG_INTERVAL
        if late or (done == total and 0 <= before < total):
            print(f"solved {done} of {total}", file=sys.stderr, flush=True)  # noqa: T201
            last, before = monotonic(), done

    return report


@contextlib.contextmanager
def _bar() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("solving"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task: TaskID | None = None

        def report(done: int, total: int) -> None:
            nonlocal task
            if task is None:  # rows that an earlier run finished are no part of the speed
                task = bar.add_task("solving", total=total, completed=done)
            else:
                bar.update(task, completed=done, total=total)

        yield report
