"""L6, a surface with a needle and a curved ridge (Singla, Subbarao & Junkins 2007).

    10/((x₂−x₁²)² + (1−x₁)² + 1) + 5/((x₂−8)² + (5−x₁)² + 1) + 5/((x₂−8)² + (8−x₁)² + 1)   on [0, 10]²

10,201 random samples once; test on a grid of 101 × 101; errors are RMSE over the standard deviation of the test
outputs. What counts is how many units either form needs for the same error, so size is drawn against error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.literature.protocol import Problem, Score, filtered, refined
from benchmarks.table import Claim, Column, Table
from palpate.learning import Settings
from palpate.rbf.filter.settings import rotated_mran

__all__ = ["FORMS", "SETTINGS", "problem", "tables"]

FORMS = ("axis-aligned", "rotated")
SETTINGS: Settings = replace(
    rotated_mran(),
    distance_max=5.0,
    distance_decay=0.998,
    overlap=0.87,
    error_min=0.1,
    error_rms_min=0.1,
    noise=0.1,
    process_noise=1e-5,
    window=100,
    prune_below=1e-3,
    prune_after=1000,
)
_DISTANCES = (3.0, 2.0, 1.5, 1.0)
_SIZES = (5, 10, 15, 20, 30, 40)
_LEVEL = 0.1  # error at which sizes are compared
_MOST = 0.7  # share of the axis-aligned units that rotated ones may need

Curve = list[tuple[float, float]]  # units and error


def surface(X: np.ndarray) -> np.ndarray:
    """The surface (N, 1) at X (N, 2)."""
    a, b = X[:, 0], X[:, 1]
    needle = 10.0 / ((b - a * a) ** 2 + (1.0 - a) ** 2 + 1.0)
    hills = [5.0 / ((b - 8.0) ** 2 + (at - a) ** 2 + 1.0) for at in (5.0, 8.0)]
    return np.asarray(needle + hills[0] + hills[1])[:, None]


def problem(seed: int, samples: int = 10201) -> Problem:
    """One draw of the training samples."""
    X = np.random.default_rng(seed).uniform(0.0, 10.0, (samples, 2))
    side = np.linspace(0.0, 10.0, 101)
    X_test = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    Y_test = surface(X_test)
    return Problem(X, surface(X), X_test, Y_test, np.arange(samples), seed, float(Y_test.std()))


def tables(*, quick: bool) -> list[Table]:
    """Size against error for both forms, by the filter and refined."""
    draws = range(1 if quick else 3)
    few, many = (
        [problem(s, 200 if quick else 2000) for s in draws],
        [problem(s, 300 if quick else 10201) for s in draws],
    )
    distances, sizes = (_DISTANCES[:2], _SIZES[:2]) if quick else (_DISTANCES, _SIZES)
    by_filter = {
        f: _curve(many, [partial(filtered, settings=_settings(f, d)) for d in distances]) for f in FORMS
    }
    by_refinement = {
        f: _curve(few, [partial(refined, units=h, kind=f, iterations=40) for h in sizes]) for f in FORMS
    }
    return [
        _table("filter", f"L6, one pass of the filter over {len(many[0].X)} samples", distances, by_filter),
        _table("refined", "L6, refined on 2000 samples", sizes, by_refinement),
    ]


def _settings(form: str, distance: float) -> Settings:
    return replace(SETTINGS, form=form, distance_min=distance)


def _curve(problems: Sequence[Problem], ways: Sequence[Callable[[Problem], Score]]) -> Curve:
    """Medians over the draws, one point per way."""
    found = [[way(p) for p in problems] for way in ways]
    return [
        (float(np.median([s.units for s in scores])), float(np.median([s.error for s in scores])))
        for scores in found
    ]


def _table(kind: str, title: str, points: Sequence[float], curves: dict[str, Curve]) -> Table:
    head = "ε_min" if kind == "filter" else "units ≤"
    rows: list[dict[str, Any]] = [
        {"form": name, **{f"{p:g}": f"{e:.3f} / {h:g}" for p, (h, e) in zip(points, curve, strict=True)}}
        for name, curve in curves.items()
    ]
    needed = {name: _needed(curve) for name, curve in curves.items()}
    ratio = needed["rotated"] / needed["axis-aligned"]
    return Table(
        f"literature-directions-{kind}",
        f"{title}: error / units",
        (Column("form", "form of the units"), *(Column(f"{p:g}", f"{head} {p:g}") for p in points)),
        rows,
        [
            Claim(
                f"rotated units needed for an error of {_LEVEL:g}, over axis-aligned", (ratio,), _MOST, ".2f"
            )
        ],
        [
            f"units needed for {_LEVEL:g}, on the line through the logarithms of the curve's points: "
            + ", ".join(f"{name} {count:.0f}" for name, count in needed.items())
        ],
    )


def _needed(curve: Curve) -> float:
    """Units for the error level, by the least-squares line of log units over log error."""
    units, errors = np.log(np.array(curve)).T
    slope, offset = np.polyfit(errors, units, 1)
    return float(np.exp(offset + slope * np.log(_LEVEL)))
