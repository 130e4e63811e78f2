"""The sweep: solve at many points in parallel, and keep every answer."""

from __future__ import annotations

import contextlib
import functools
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset, Field, Layout, assemble
from palpate.dataset.assemble import check_schema
from palpate.dataset.fields import complete
from palpate.errors import SolverError, UsageError
from palpate.sweeps.answers import Columns, empty, put
from palpate.sweeps.chunks import chunks
from palpate.sweeps.designs import Design, design_points
from palpate.sweeps.ledger import Ledger
from palpate.sweeps.problem import Chained, Designed, Problem, is_problem
from palpate.sweeps.progress import Report, reporter
from palpate.sweeps.provenance import config_hash, provenance
from palpate.sweeps.runner import connect, run
from palpate.sweeps.space import Space

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
    plan = _plan(body, interactions, samples, seed, design, points)
    ledger = Ledger(Path(path), plan.config) if path is not None else None
    data = ledger.complete() if ledger else None
    if data is None:
        data = _solve(plan, ledger, workers, cluster, progress)
    _check_failures(data, max_failed)
    return data


@dataclass(frozen=True)
class _Plan:
    """What is to be solved, and the labels of the answers."""

    problem: Problem
    space: Space
    points: np.ndarray
    design: str
    seed: int

    @functools.cached_property
    def config(self) -> str:
        return config_hash(self.problem, self.points)

    @functools.cached_property
    def layout(self) -> Layout:
        return self.problem.layout  # a solid is meshed for it

    @functools.cached_property
    def fields(self) -> tuple[Field, ...]:
        schema = tuple(self.problem.schema)
        check_schema(schema, self.layout, len(self.space))
        return schema

    @property
    def schema(self) -> tuple[Field, ...]:
        """Every column, the bookkeeping among them."""
        return complete(self.fields)

    @functools.cached_property
    def origin(self) -> dict[str, Any]:
        return provenance(self.problem, self.points, self.design, self.seed)

    def chains(self) -> list[np.ndarray]:
        """Rows in the order in which one solver solves them."""
        if isinstance(self.problem, Chained):
            return _checked([np.asarray(rows) for rows in self.problem.chains(self.points)], len(self.points))
        rest = self.space.to_unit(np.clip(0.0, self.space.low, self.space.high))
        return chunks(self.space.to_unit(self.points), rest)

    def label(self, columns: Columns, rows: np.ndarray) -> Dataset:
        """Dataset of some rows."""
        return assemble(
            self.space.ranges, self.layout, self.points[rows], columns, self.origin, rows, self.fields
        )


def _plan(
    body: Any, interactions: Any, samples: int | None, seed: int, design: str | Design | None, points: Any
) -> _Plan:
    problem = _problem(body, interactions)
    space = Space(problem.ranges)
    if (samples is None) == (points is None):
        raise UsageError(
            "A sweep needs either samples or points.",
            why=f"Given were samples={samples} and points={'None' if points is None else 'an array'}.",
            fix="For example sweep(body, loads, samples=256).",
        )
    if points is not None:
        return _Plan(problem, space, _some(space.points(points)), "points", seed)
    own = getattr(problem, "design_name", "the problem's own")
    if isinstance(problem, Designed) and (design is None or design == own):
        return _Plan(problem, space, _some(space.points(problem.design(samples or 0, seed))), own, seed)
    design = "sobol" if design is None else design
    name = design if isinstance(design, str) else getattr(design, "__name__", type(design).__name__)
    return _Plan(problem, space, _some(design_points(design, space, samples or 0, seed)), name, seed)


def _problem(body: Any, interactions: Any) -> Problem:
    if interactions is None and is_problem(body):
        problem: Problem = body
    elif interactions is None or not hasattr(body, "problem"):
        raise UsageError(
            "A sweep needs a body and what varies: loads or an interaction.",
            why=f"Given were {type(body).__name__} and {type(interactions).__name__}.",
            fix="For example sweep(Cantilever(...), TipLoad(0, 5), samples=256).",
        )
    else:
        problem = body.problem(interactions)
    return problem


def _checked(chains: list[np.ndarray], count: int) -> list[np.ndarray]:
    """The chains, if each row is in just one."""
    rows = np.sort(np.concatenate([np.empty(0, dtype=np.int64), *(rows.ravel() for rows in chains)]))
    if not np.array_equal(rows, np.arange(count)):
        raise UsageError(
            "The problem's chains don't hold each sample once.",
            why=f"They hold {rows.size} rows of {count} samples, {np.unique(rows).size} different ones.",
            fix="Let chains(points) part the rows 0 … N − 1.",
        )
    return [rows for rows in chains if rows.size]


def _some(points: np.ndarray) -> np.ndarray:
    if not len(points):
        raise UsageError("A sweep needs at least one point.", why="There is none.", fix="Give some.")
    return points


def _solve(
    plan: _Plan, ledger: Ledger | None, workers: int | None, cluster: Any, progress: bool | Report
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
def _keeping(plan: _Plan, ledger: Ledger | None, columns: Columns) -> Iterator[Callable[[np.ndarray], None]]:
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


def _take_up(plan: _Plan, ledger: Ledger | None, columns: Columns, chains: list[np.ndarray]) -> np.ndarray:
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
