"""The answers of a sweep as arrays, filled chunk by chunk."""

from __future__ import annotations

import time

import numpy as np

from palpate.sweeps.problem import Answer, Problem

__all__ = ["Columns", "empty", "failed_row", "put", "solve_chunk"]

Columns = dict[str, np.ndarray]
"""An array for each answer of a dataset, samples first."""


def empty(count: int, nodes: int) -> Columns:
    """Rows that hold no answer yet: NaN, not converged."""
    return {
        "displacement": np.full((count, nodes, 3), np.nan),
        "root_reaction": np.full((count, 3), np.nan),
        "strain_energy": np.full(count, np.nan),
        "potential_energy": np.full(count, np.nan),
        "largest_strain": np.full(count, np.nan),
        "converged": np.zeros(count, dtype=bool),
        "iterations": np.zeros(count, dtype=np.int64),
        "residual": np.full(count, np.nan),
        "message": np.full(count, "not solved", dtype=object),
        "solve_seconds": np.full(count, np.nan),
    }


def put(columns: Columns, rows: np.ndarray, part: Columns) -> None:
    """Write the rows of `part` at `rows` of `columns`."""
    for name, values in columns.items():
        values[rows] = part[name]


def failed_row(nodes: int, message: str) -> Columns:
    """One row that says why it has no answer."""
    row = empty(1, nodes)
    row["message"][0] = message
    return row


def solve_chunk(problem: Problem, points: np.ndarray) -> Columns:
    """Solve at each of the points (N, n) in turn: the task that a worker runs."""
    columns = empty(len(points), len(problem.rest))
    solver = problem.open()
    for row, x in enumerate(points):
        begun = time.perf_counter()
        answer = solver.solve(x)
        columns["solve_seconds"][row] = time.perf_counter() - begun
        _record(columns, row, answer)
    return columns


def _record(columns: Columns, row: int, answer: Answer) -> None:
    columns["converged"][row] = answer.converged
    columns["message"][row] = answer.message
    columns["iterations"][row] = answer.iterations
    columns["residual"][row] = answer.residual
    if answer.converged:  # the fields of a failed solve stay NaN
        columns["displacement"][row] = answer.displacement
        columns["root_reaction"][row] = answer.root_reaction
        columns["strain_energy"][row] = answer.strain_energy
        columns["potential_energy"][row] = answer.potential_energy
        # a problem of the caller's own may know of no strain
        columns["largest_strain"][row] = getattr(answer, "largest_strain", np.nan)
