"""What a sweep will solve, in which order, and how the answers are labelled: all settled before it begins."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

from palpate.dataset import Dataset, Field, Layout, assemble
from palpate.dataset.assemble import check_schema
from palpate.dataset.fields import complete
from palpate.errors import UsageError
from palpate.sweeps.answers import Columns
from palpate.sweeps.chunks import chunks
from palpate.sweeps.designs import Design, design_points
from palpate.sweeps.problem import Checking, Designed, Problem, has_chains, missing_members, own_design
from palpate.sweeps.provenance import config_hash, provenance
from palpate.sweeps.space import Space

__all__ = ["Plan", "make_plan"]


@dataclass(frozen=True)
class Plan:
    """What is to be solved, and the labels of the answers.

    Attributes
    ----------
    problem : Problem
    space : Space
    points : (N, n) array
    design : str
        Name of what placed the points.
    seed : int
    """

    problem: Problem
    space: Space
    points: np.ndarray
    design: str
    seed: int

    @functools.cached_property
    def config(self) -> str:
        """Hash of everything that decides the answers."""
        return config_hash(self.problem, self.points)

    @functools.cached_property
    def layout(self) -> Layout:
        """The problem's; a solid is meshed for it."""
        return self.problem.layout

    @functools.cached_property
    def fields(self) -> tuple[Field, ...]:
        """The problem's schema, if it fits the layout."""
        schema = tuple(self.problem.schema)
        check_schema(schema, self.layout, len(self.space))
        return schema

    @property
    def schema(self) -> tuple[Field, ...]:
        """Every column, the bookkeeping among them."""
        return complete(self.fields)

    @functools.cached_property
    def origin(self) -> dict[str, Any]:
        """Provenance, with the time at which the sweep began."""
        return provenance(self.problem, self.points, self.design, self.seed)

    def chains(self) -> list[np.ndarray]:
        """Rows in the order in which one solver solves them."""
        if has_chains(self.problem):
            return _checked([np.asarray(rows) for rows in self.problem.chains(self.points)], len(self.points))
        rest = self.space.to_unit(np.clip(0.0, self.space.low, self.space.high))
        return chunks(self.space.to_unit(self.points), rest)

    def label(self, columns: Columns, rows: np.ndarray) -> Dataset:
        """Dataset of some rows."""
        return assemble(
            self.space.ranges, self.layout, self.points[rows], columns, self.origin, rows, self.fields
        )


def make_plan(
    body: Any, interactions: Any, samples: int | None, seed: int, design: str | Design | None, points: Any
) -> Plan:
    """Settle what a sweep solves; the arguments are those of `sweep`.

    Raises
    ------
    UsageError
        For a wrong argument.
    """
    problem = _problem(body, interactions)
    space = Space(problem.ranges)
    if (samples is None) == (points is None):
        raise UsageError(
            "A sweep needs either samples or points.",
            why=f"Given were samples={samples} and points={'None' if points is None else 'an array'}.",
            fix="For example sweep(body, loads, samples=256).",
        )
    if samples is not None:
        _require_samples(samples)
    if points is not None:
        given = _some(space.points(points))
        if isinstance(problem, Checking):
            problem.check_points(given)
        return Plan(problem, space, given, "points", seed)
    own = own_design(problem)
    if isinstance(problem, Designed) and own is not None and (design is None or design == own):
        return Plan(problem, space, _some(space.points(problem.design(samples or 0, seed))), own, seed)
    design = "sobol" if design is None else design
    name = design if isinstance(design, str) else getattr(design, "__name__", type(design).__name__)
    return Plan(problem, space, _some(design_points(design, space, samples or 0, seed)), name, seed)


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


def _require_samples(samples: Any) -> None:
    if isinstance(samples, Integral) and int(samples) >= 1:
        return
    raise UsageError(
        f"A sweep was asked for {samples!r} samples.",
        why="It needs a whole number of them, at least one.",
        fix="For example samples=256.",
    )


def _some(points: np.ndarray) -> np.ndarray:
    if not len(points):
        raise UsageError("A sweep needs at least one point.", why="There is none.", fix="Give some.")
    return points
