"""The plan of a sweep: points, order and labels, all settled before the first solve.

Points are solved in chains of neighbours, which share a solver and its warm start. A problem may arrange them itself.
"""

from __future__ import annotations

import datetime
import functools
import hashlib
import importlib.metadata
import json
import os
import platform
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate import checks
from palpate.dataset import Dataset, Field, Layout, assemble, check_schema, with_bookkeeping
from palpate.errors import UsageError
from palpate.sweeps.case import Columns
from palpate.sweeps.problem import Checking, Designed, Problem, has_chains, missing_members, own_design
from palpate.sweeps.space import Design, Space, design_points

__all__ = ["Plan", "config_hash", "make_plan", "neighbour_chains", "provenance"]


@dataclass(frozen=True)
class Plan:
    """Points to solve at, and the labels of the answers."""

    problem: Problem  # the question that is asked at each point
    space: Space  # ranges of its inputs
    points: np.ndarray  # (N, n) inputs of each sample
    design: str  # name of the design that placed the points
    seed: int  # of the design

    @functools.cached_property
    def config(self) -> str:
        """Hash of everything that decides the answers."""
        return config_hash(self.problem, self.points)

    @functools.cached_property
    def layout(self) -> Layout:
        """Layout of the problem; a solid is meshed for it."""
        return self.problem.layout

    @functools.cached_property
    def fields(self) -> tuple[Field, ...]:
        """The problem's schema, if it fits the layout."""
        schema = tuple(self.problem.schema)
        check_schema(schema, self.layout, len(self.space))
        return schema

    @property
    def schema(self) -> tuple[Field, ...]:
        """Fields of all columns, with the bookkeeping."""
        return with_bookkeeping(self.fields)

    @functools.cached_property
    def origin(self) -> dict[str, Any]:
        """Provenance, with the time at which the sweep began."""
        return provenance(self.problem, self.points, self.design, self.seed)

    def chains(self) -> list[np.ndarray]:
        """Return the rows in chains, each of which one solver solves in order."""
        if has_chains(self.problem):
            return _check_chains(self.problem.chains(self.points), len(self.points))
        rest = self.space.to_unit(np.clip(0.0, self.space.low, self.space.high))
        return neighbour_chains(self.space.to_unit(self.points), rest)

    def label(self, columns: Columns, rows: np.ndarray) -> Dataset:
        """Make a dataset of some rows."""
        return assemble(
            self.space.ranges, self.layout, self.points[rows], columns, self.origin, rows, self.fields
        )


def make_plan(
    body: Any, interactions: Any, samples: int | None, seed: int, design: str | Design | None, points: Any
) -> Plan:
    """Make the plan of a sweep; the arguments are those of `sweep`."""
    problem = _problem(body, interactions)
    space = Space(problem.ranges)
    if (samples is None) == (points is None):
        raise UsageError(
            "A sweep needs either samples or points.",
            why=f"Given were samples={samples} and points={'None' if points is None else 'an array'}.",
            fix="For example sweep(body, loads, samples=256).",
        )
    if points is not None:
        given = _check_not_empty(space.points(points))
        if isinstance(problem, Checking):
            problem.check_points(given)
        return Plan(problem, space, given, "points", seed)
    count: int = checks.fits("The number of samples", samples, least=1, whole=True)
    own = own_design(problem)
    if isinstance(problem, Designed) and own is not None and (design is None or design == own):
        name, placed = own, space.points(problem.design(count, seed))
    else:
        design = "sobol" if design is None else design
        name = design if isinstance(design, str) else getattr(design, "__name__", type(design).__name__)
        placed = design_points(design, space, count, seed)
    return Plan(problem, space, _check_not_empty(placed), name, seed)


def _problem(body: Any, interactions: Any) -> Problem:
    if interactions is not None and hasattr(body, "problem"):
        problem: Problem = body.problem(interactions)
        return problem
    missing = missing_members(body)
    if interactions is None and not missing:
        own: Problem = body
        return own
    given = f"Given were {type(body).__name__} and {type(interactions).__name__}."
    raise UsageError(
        "A sweep needs a body and what varies: loads or an interaction.",
        why=f"{given} To be a problem by itself, {type(body).__name__} lacks {', '.join(missing)}."
        if interactions is None
        else given,
        fix="For example sweep(Cantilever(...), TipLoad(0, 5), samples=256).",
    )


def _check_chains(given: list[np.ndarray], count: int) -> list[np.ndarray]:
    """Return the chains that hold a row; raise unless each row is in just one."""
    chains = [np.asarray(rows) for rows in given]
    rows = np.sort(np.concatenate([np.empty(0, dtype=np.int64), *(rows.ravel() for rows in chains)]))
    if not np.array_equal(rows, np.arange(count)):
        raise UsageError(
            "The problem's chains don't hold each sample once.",
            why=f"They hold {rows.size} rows of {count} samples, {np.unique(rows).size} different ones.",
            fix="Let chains(points) put each of the rows 0 … N − 1 in one chain.",
        )
    return [rows for rows in chains if rows.size]


def _check_not_empty(points: np.ndarray) -> np.ndarray:
    if not len(points):
        raise UsageError("A sweep needs at least one point.", why="There is none.", fix="Give some.")
    return points


_LONGEST, _SHORTEST = 32, 4  # samples of a chain


def neighbour_chains(unit: np.ndarray, rest: np.ndarray) -> list[np.ndarray]:
    """Return samples as chains of neighbours, each a list of rows in an order that makes warm starts pay.

    The points are halved across their widest side until a chain is short (a k-d tree); within a chain the order goes
    from the point next to `rest` to its nearest neighbour and so on. The chains depend on the points alone, not on the
    number of workers: the same sweep gives the same bits with any number of them. The points (N, n) and the point
    without load (n,) are scaled to [0, 1].
    """
    # some eight chains at least, to keep the workers busy to the end
    largest = int(np.clip(len(unit) // 8, _SHORTEST, _LONGEST))
    pending, done = [np.arange(len(unit))], []
    while pending:
        rows = pending.pop()
        if rows.size > largest:
            axis = int(np.argmax(np.ptp(unit[rows], axis=0)))
            ranked = rows[np.argsort(unit[rows, axis], kind="stable")]
            # pushed in reverse, so that the list comes out in ascending order
            pending += [ranked[rows.size // 2 :], ranked[: rows.size // 2]]
        elif rows.size:
            done.append(_nearest_first(unit, rows, rest))
    return done


def _nearest_first(unit: np.ndarray, rows: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Order rows by going to the nearest row left, beginning next to `rest`."""
    left, here, order = list(rows), rest, []
    while left:
        nearest = int(np.argmin(((unit[left] - here) ** 2).sum(axis=1)))
        order.append(left.pop(nearest))
        here = unit[order[-1]]
    return np.array(order)


_PACKAGES = ("palpate", "ngsolve", "numpy", "scipy", "distributed", "xarray", "zarr")


def config_hash(problem: Problem, points: np.ndarray) -> str:
    """Return the SHA-256 of everything that decides a sweep's answers, as hexadecimal digits."""
    digest = hashlib.sha256(json.dumps(problem.describe(), sort_keys=True).encode())
    digest.update(repr(points.shape).encode())
    digest.update(np.ascontiguousarray(points).tobytes())
    return digest.hexdigest()


def provenance(problem: Problem, points: np.ndarray, design: str, seed: int) -> dict[str, Any]:
    """Return the origin of a sweep's answers as plain data: configuration, versions, machine."""
    return {
        "problem": problem.describe(),
        "words": getattr(problem, "words", ""),
        "symmetry": getattr(problem, "symmetry", None),
        **({} if (motion := getattr(problem, "motion", None)) is None else {"motion": motion}),
        "design": design,
        "seed": seed,
        "samples": len(points),
        "config_hash": config_hash(problem, points),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in _PACKAGES}},
        "machine": {"system": platform.system(), "processor": platform.machine(), "cpus": os.cpu_count()},
    }


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
