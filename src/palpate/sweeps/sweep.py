"""The sweep: solve at many points in parallel, and keep every answer."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import SolverError
from palpate.sweeps.answers import Columns, empty, put
from palpate.sweeps.designs import Design
from palpate.sweeps.ledger import Ledger
from palpate.sweeps.plan import Plan, make_plan
from palpate.sweeps.progress import Report, reporter
from palpate.sweeps.runner import connect, run

__all__ = ["sweep"]

FLUSH_SECONDS = 3.0  # most work that a killed sweep loses; a store of many small files is slow to write


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
) -> Dataset:
    """Solve a body under many loads, or touched at many places, in parallel.

    Samples are solved in chains, each solve starting from the last one's answer. The chains are settled before
    the first solve, by the problem and the points alone: how many workers there are, and whether the sweep was
    interrupted, changes no bit of the answers. A sample that fails becomes a row with NaN and a message, and the
    sweep goes on.

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
        What to run on instead: a `local_cluster`, a scheduler's address, or a cluster or client of Dask's.
    progress : bool or callable
        A bar on standard error if that is a terminal; or a function (done, total).
    path : path, optional
        A Zarr store to write. An interrupted sweep takes up its finished chains there; a finished one is read.
    max_failed : float
        Largest share of failed samples that is put up with.

    Returns
    -------
    Dataset
        Rows in the order of the design.

    Raises
    ------
    UsageError
        For a wrong argument, or if `path` holds another sweep.
    SolverError
        If more than `max_failed` of the samples failed.
    """
    plan = make_plan(body, interactions, samples, seed, design, points)
    ledger = Ledger(Path(path), plan.config) if path is not None else None
    data = ledger.complete() if ledger else None
    if data is None:
        data = _solve(plan, ledger, workers, cluster, progress)
    _check_failures(data, max_failed)
    return data


def _solve(
    plan: Plan, ledger: Ledger | None, workers: int | None, cluster: Any, progress: bool | Report
) -> Dataset:
    columns = empty(len(plan.points), plan.schema)
    chains = plan.chains()
    done = _take_up(plan, ledger, columns, chains)
    with reporter(progress) as report, _keeping(plan, ledger, columns) as keep:
        report(int(done.sum()), done.size)

        def accept(rows: np.ndarray, answers: Columns) -> None:
            put(columns, rows, answers)
            done[rows] = True
            keep(rows)
            report(int(done.sum()), done.size)

        left = [rows for rows in chains if not done[rows].all()]
        if left:
            with connect(cluster, workers) as (client, revive):
                run(client, revive, plan.problem, plan.schema, plan.points, left, accept)
    data = plan.label(columns, np.arange(len(plan.points)))
    return ledger.finish(data) if ledger else data


@contextlib.contextmanager
def _keeping(plan: Plan, ledger: Ledger | None, columns: Columns) -> Iterator[Callable[[np.ndarray], None]]:
    """Yield what to call with rows as they are finished; on an interruption all of them are in the ledger."""
    fresh: list[np.ndarray] = []
    begun = time.monotonic()

    def flush() -> None:
        nonlocal begun
        if ledger and fresh:
            rows = np.concatenate(fresh)
            ledger.add(plan.label({name: values[rows] for name, values in columns.items()}, rows))
        fresh.clear()
        begun = time.monotonic()

    def keep(rows: np.ndarray) -> None:
        fresh.append(rows)
        if time.monotonic() - begun > FLUSH_SECONDS:
            flush()

    try:
        yield keep
    except BaseException:
        flush()
        raise


def _take_up(plan: Plan, ledger: Ledger | None, columns: Columns, chains: list[np.ndarray]) -> np.ndarray:
    """Fill in what an earlier run finished; which rows these are, bool of shape (N,).

    A chain counts only as a whole: a solver that entered one in its midst would have another past, and answer
    with other last bits.
    """
    done = np.zeros(len(plan.points), dtype=bool)
    if ledger:
        ledger.begin()
        for part in ledger.read():
            if not np.array_equal(part.rest, plan.layout.rest):
                continue  # of another mesh: a mesher of another version made it
            rows = part["sample"]
            # parts of an earlier version lack what is recorded since
            known = {name: part[name] for name in columns if name in part}
            put(columns, rows, {name: values[rows] for name, values in columns.items()} | known)
            done[rows] = True
        for rows in chains:
            done[rows] = done[rows].all()
    return done


def _check_failures(data: Dataset, max_failed: float) -> None:
    failed = np.flatnonzero(~data.converged)
    if failed.size == 0 or failed.size <= max_failed * len(data):
        return
    first = [f"{_inputs(data, row)}: {data.data['message'].values[row]}" for row in failed[:3]]
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
