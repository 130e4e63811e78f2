"""The answers of a sweep as arrays, filled chain by chain."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.dataset import Field
from palpate.dataset.fields import BOOKKEEPING
from palpate.errors import UsageError
from palpate.sweeps.problem import Answer, Problem, Resettable, Solver

__all__ = ["Columns", "empty", "failed_row", "put", "solve_chain"]

Columns = dict[str, np.ndarray]
"""An array for each answer of a dataset, samples first."""

_SAID = {field.name for field in BOOKKEEPING}


def empty(count: int, schema: Sequence[Field]) -> Columns:
    """Rows that hold no answer yet: NaN, not converged."""
    return {field.name: field.empty(count) for field in schema}


def put(columns: Columns, rows: np.ndarray, part: Columns) -> None:
    """Write the rows of `part` at `rows` of `columns`."""
    for name, values in columns.items():
        values[rows] = part[name]


def failed_row(schema: Sequence[Field], message: str) -> Columns:
    """One row that says why it has no answer."""
    row = empty(1, schema)
    row["message"][0] = message
    return row


def solve_chain(problem: Problem, identity: str, schema: Sequence[Field], points: np.ndarray) -> Columns:
    """Solve at each of the points (N, n) in turn: the task that a worker runs.

    `identity` stands for the problem: a worker that has the same one open opens no other.
    """
    columns = empty(len(points), schema)
    solver = _take_solver(problem, identity)
    for row, x in enumerate(points):
        begun = time.perf_counter()
        answer = solver.solve(x)
        columns["solve_seconds"][row] = time.perf_counter() - begun
        _record(columns, schema, row, answer)
    _kept.last = (identity, solver)
    return columns


class _Kept(threading.local):
    """The solver opened last, in each thread its own: meshing and opening cost seconds."""

    last: tuple[str, Solver] | None = None


_kept = _Kept()


def _take_solver(problem: Problem, identity: str) -> Solver:
    """The solver of this problem that is open here, reset, or a new one.

    It is taken away while a chain is solved, so that none is kept which an error has left in the midst of a
    solve. One is kept at most: an opened solid takes hundreds of megabytes.
    """
    last, _kept.last = _kept.last, None
    if last is not None and isinstance(last[1], Resettable) and last[0] == identity:
        last[1].reset()
        return last[1]
    del last
    return problem.open()


def _record(columns: Columns, schema: Sequence[Field], row: int, answer: Answer) -> None:
    columns["converged"][row] = answer.converged
    columns["message"][row] = answer.message
    columns["iterations"][row] = answer.iterations
    columns["residual"][row] = answer.residual
    if not answer.converged:  # the fields of a failed solve stay NaN
        return
    for field in schema:
        if field.name not in _SAID:
            columns[field.name][row] = _value(answer, field)


def _value(answer: Answer, field: Field) -> Any:
    if not hasattr(answer, field.name):
        if field.optional:
            return field.fill
        raise UsageError(
            f"The answer of a solve lacks {field.name!r}.",
            why="The problem's schema promises it.",
            fix="Answer it, or mark the field as optional.",
        )
    value = getattr(answer, field.name)
    if np.shape(value) != field.shape:
        raise UsageError(
            f"The answer {field.name!r} of a solve has the shape {np.shape(value)}.",
            why=f"The problem's schema promises {field.shape}.",
            fix="Make the schema and the answers fit.",
        )
    return value
