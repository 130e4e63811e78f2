"""Displacement of the touched body's surface: ours beside POD and interpolation of the coefficients."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.surrogate_cases import Case
from benchmarks.surrogate_rivals import Predictor, cubic_rbf
from benchmarks.table import Claim, Column, Table
from palpate.learning.fields import learn_field
from palpate.units import bounds

__all__ = ["field_table"]

MISSED = 1e-8  # of the snapshots' energy: what the rival's modes leave out
MEAN, MOST = 1e-4, 3e-4  # m: what an eye sees, a pixel's third and one


def field_table(case: Case, size: int, effort: float, mark: str) -> list[Table]:
    """Distances of nodes at a number of solves; nothing where the file holds no fields."""
    # solves of a round body are turned about its axis, their fields are not
    if "displacement_mm" not in case.arrays or case.study.symmetry == "round":
        return []
    u = 1e-3 * case.arrays["displacement_mm"].astype(float)
    known = np.isfinite(u).all(axis=(1, 2))
    train, test = (rows[known[rows]] for rows in (case.training_rows(size), case.rows("test")))
    if not (len(train) and len(test)):
        return []
    X, truth = case.arrays["inputs"], u[test]
    rows = []
    columns = case.arrays["column"][train]
    methods: dict[str, Callable[[], Predictor]] = {
        "palpate": lambda: _ours(case, X[train], u[train], columns, effort),
        "POD + cubic RBF": lambda: _pod(case, X[train], u[train]),
    }
    for name, learnt in methods.items():
        begun = time.process_time()
        answer = learnt()(X[test])
        distance = np.linalg.norm(answer - truth, axis=2)
        rows.append(
            {
                "method": name,
                "mean": 1e3 * float(distance.mean()),
                "p95": 1e3 * float(np.quantile(distance.max(axis=1), 0.95)),
                "max": 1e3 * float(distance.max()),
                "learning": time.process_time() - begun,
            }
        )
    ours: dict[str, Any] = rows[0]
    return [
        Table(
            f"surrogates-{case.name}-field",
            f"{case.name}: displacement of the surface from {len(train)} solves{mark}",
            (
                Column("method", "method"),
                Column("mean", "mean distance, mm", ".3f"),
                Column("p95", "largest of a solve, p95, mm", ".3f"),
                Column("max", "largest of all, mm", ".3f"),
                Column("learning", "learning, CPU s", ".1f"),
            ),
            rows,
            (
                Claim("mean distance in mm", (ours["mean"],), 1e3 * MEAN, ".3f"),
                Claim("largest distance in mm", (ours["max"],), 1e3 * MOST, ".3f"),
            ),
            (
                f"{len(test)} unseen solves, {u.shape[1]} nodes spread evenly over the surface; largest displacement "
                f"{1e3 * np.linalg.norm(truth, axis=2).max():.1f} mm; without images, which fields do not use",
            ),
        )
    ]


def _ours(case: Case, X: np.ndarray, u: np.ndarray, columns: np.ndarray, effort: float) -> Predictor:
    points = case.arrays["nodes"]
    return learn_field(
        X,
        u,
        inputs=case.inputs,
        points=points,
        # the nodes kept are spread evenly, so that each counts alike
        triangles=np.array([[0, 1, 2]]),
        mass=np.full(len(points), 1.0 / len(points)),
        surface=case.surface,
        radius=case.radius,
        groups=columns,
        effort=effort,
    ).field.values


def _pod(case: Case, X: np.ndarray, u: np.ndarray) -> Predictor:
    """Modes by singular values, coefficients by cubic radial basis functions."""
    low, high = bounds(case.inputs)
    flat = u.reshape(len(u), -1)
    _, s, V = np.linalg.svd(flat, full_matrices=False)
    rest = 1 - np.cumsum(s**2) / (s**2).sum()
    V = V[: int(np.argmax(rest < MISSED)) + 1]
    size = float(s[0] / np.sqrt(len(u)))
    predict = cubic_rbf(2 * (X - low) / (high - low) - 1, flat @ V.T / size)
    return lambda q: (size * predict(2 * (q - low) / (high - low) - 1) @ V).reshape(len(q), -1, 3)
