"""L2, the Mackey–Glass series 50 steps ahead.

    x(t+1) = ((2−b) x(t) + a (g(x(t+1−τ)) + g(x(t−τ))))/(2+b),   g(v) = v/(1+v¹⁰),   a 0.2, b 0.1, τ 17

and x = 0.3 for t ≤ 0 (Mackey & Glass 1977, by the trapezoidal rule). Inputs x(t), x(t−6), x(t−12), x(t−18),
target x(t+50); t ≤ 4000 once and in order for training, the next 500 for the test. RAN, RAN-EKF, MRAN and GGAP
figures: Huang, Saratchandran & Sundararajan 2005; OS-ELM: Liang, Huang, Saratchandran & Sundararajan 2006.
The papers do not tell e_min and e'_min, so the curve over them is drawn; the rows above it are points of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.literature.protocol import (
    COLUMNS,
    Problem,
    Score,
    filtered,
    linear,
    ours,
    published,
    refined,
    row,
)
from benchmarks.table import Claim, Column, Table
from palpate.learning import Settings
from palpate.rbf.filter.settings import emran, ggap, mran, ran, ran_ekf

__all__ = ["SETTINGS", "problem", "tables"]

_THRESHOLDS = {
    "distance_max": 0.7,
    "distance_min": 0.07,
    "distance_decay": 0.999,
    "overlap": 0.87,
    "noise": 1.0,
    "process_noise": 2e-4,
    "window": 90,
    "prune_below": 1e-4,
    "prune_after": 90,
}
SETTINGS: dict[str, Settings] = {
    "RAN": replace(ran(), **{**_THRESHOLDS, "prune_after": 0}, learning_rate=0.05, error_min=0.1),
    "RAN-EKF": replace(ran_ekf(), **{**_THRESHOLDS, "prune_after": 0}, error_min=0.0975),
    "MRAN": replace(mran(), **_THRESHOLDS, error_min=0.09, error_rms_min=0.054),
    "EMRAN": replace(emran(), **_THRESHOLDS, error_min=0.09, error_rms_min=0.054),
    "GGAP": replace(ggap(), **_THRESHOLDS, error_min=0.02),
}
_ERRORS = (0.05, 0.06, 0.07, 0.08, 0.09, 0.0975, 0.11, 0.12, 0.15)
_SIGNIFICANT = (0.001, 0.003, 0.01, 0.015, 0.02, 0.03, 0.04)


def problem(train: int = 4000) -> Problem:
    """The series, which leaves nothing to chance."""
    x = _series(train + 550)
    t = np.arange(1, train + 501)
    X = np.stack([x[_AT0 + np.maximum(t - d, 0)] for d in (0, 6, 12, 18)], axis=1)
    Y = x[_AT0 + t + 50][:, None]
    return Problem(X[:train], Y[:train], X[train:], Y[train:], np.arange(train))


def tables(*, quick: bool) -> list[Table]:
    """Ours beside the published figures, and size against error."""
    p = problem(200 if quick else 4000)
    found = {name: filtered(p, s) for name, s in SETTINGS.items()}
    persistence = Score(0, p.error(p.X_test[:, :1]), 0.0)
    rows = [
        row("persistence", [persistence]),
        row("linear least squares", [linear(p)]),
        row("RAN", [found["RAN"]], "0.0466 / 39"),
        row("RAN-EKF", [found["RAN-EKF"]], "0.0240 / 23", "0.0255 / 24"),
        row("MRAN", [found["MRAN"]], "0.0337 / 16", "0.0339 / 13"),
        row("EMRAN", [found["EMRAN"]], "–", "0.031–0.034 / 22–48"),
        row("GGAP-RBF", [found["GGAP"]], "0.0368 / 13", "not reached"),
        published("OS-ELM", "0.0183 / 120"),
        row("palpate, default form, 1 pass", [ours(p, passes=1)]),
        row("palpate, refined, ≤ 16 units", [refined(p, 16, iterations=30)]),
    ]
    curves, best = _curves(p, quick=quick)
    first = Table(
        "literature-mackey-glass",
        f"L2 Mackey–Glass, 50 steps ahead: RMSE on 500 samples after one pass over {len(p.X)}",
        COLUMNS,
        rows,
        [
            Claim("MRAN, least error of its curve with ≤ 18 units", (best("MRAN", 18),), 0.037, ".4f"),
            Claim("RAN-EKF, least error of its curve with ≤ 26 units", (best("RAN-EKF", 26),), 0.028, ".4f"),
        ],
    )
    return [first, *curves]


def _curves(p: Problem, *, quick: bool) -> tuple[list[Table], Callable[[str, int], float]]:
    """Size against error, and the least error of a rule's curve with at most so many units."""
    errors, significant = (_ERRORS[5:6], _SIGNIFICANT[4:5]) if quick else (_ERRORS, _SIGNIFICANT)
    by_error = {
        rule: [filtered(p, _with(SETTINGS[rule], e)) for e in errors]
        for rule in ("RAN", "RAN-EKF", "MRAN", "EMRAN")
    }
    by_significance = {"GGAP": [filtered(p, _with(SETTINGS["GGAP"], e)) for e in significant]}

    def best(rule: str, units: int) -> float:
        return min((s.error for s in by_error[rule] if s.units <= units), default=float("nan"))

    title = "L2 Mackey–Glass: error / units as the thresholds move"
    return [
        _table("literature-mackey-glass-curve", f"{title} (e'_min = 0.6 e_min)", errors, by_error),
        _table("literature-mackey-glass-significance", title, significant, by_significance),
    ], best


def _with(s: Settings, error_min: float) -> Settings:
    return replace(s, error_min=error_min, error_rms_min=0.6 * error_min if s.error_rms_min else 0.0)


def _table(name: str, title: str, points: Sequence[float], curves: dict[str, list[Score]]) -> Table:
    columns = (Column("rule", "rule"), *(Column(f"{e:g}", f"e_min = {e:g}") for e in points))
    rows = [
        {"rule": rule, **{f"{e:g}": f"{s.error:.4f} / {s.units}" for e, s in zip(points, found, strict=True)}}
        for rule, found in curves.items()
    ]
    return Table(name, title, columns, rows)


_AT0 = 18  # index of t = 0


def _series(last: int) -> np.ndarray:
    """x(t) for t = −18 … last."""
    a, b, tau = 0.2, 0.1, 17
    x = np.full(_AT0 + last + 1, 0.3)
    g = x / (1.0 + x**10)
    for i in range(_AT0, _AT0 + last):
        x[i + 1] = ((2.0 - b) * x[i] + a * (g[i + 1 - tau] + g[i - tau])) / (2.0 + b)
        g[i + 1] = x[i + 1] / (1.0 + x[i + 1] ** 10)
    return x
