"""L5, Franke's surface on [0, 1]² (Franke 1982), without noise.

Random training samples, test on a grid of 101 × 101; errors are RMSE over the standard deviation of the test
outputs. No figure of a sequential network is published.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.literature.protocol import (
    COLUMNS,
    Problem,
    Score,
    claim,
    filtered,
    linear,
    ours,
    published,
    refined,
    row,
    scores,
    streamed,
)
from benchmarks.table import Table
from palpate.learning import Settings
from palpate.rbf.filter.settings import emran, mran

__all__ = ["SETTINGS", "franke", "problem", "table"]

_THRESHOLDS = {
    "distance_max": 0.5,
    "distance_min": 0.1,
    "distance_decay": 0.99,
    "overlap": 0.87,
    "error_min": 0.02,
    "error_rms_min": 0.01,
    "noise": 1e-3,
    "process_noise": 1e-5,
    "window": 40,
    "prune_below": 1e-3,
    "prune_after": 200,
    "units_max": 50,
}
SETTINGS: dict[str, Settings] = {
    "MRAN": replace(mran(), **_THRESHOLDS),
    "EMRAN": replace(emran(), **_THRESHOLDS),
}


def franke(X: np.ndarray) -> np.ndarray:
    """Franke's surface (N, 1) at X (N, 2)."""
    x, y = 9.0 * X[:, 0], 9.0 * X[:, 1]
    return np.asarray(
        0.75 * np.exp(-((x - 2.0) ** 2 + (y - 2.0) ** 2) / 4.0)
        + 0.75 * np.exp(-((x + 1.0) ** 2) / 49.0 - (y + 1.0) / 10.0)
        + 0.5 * np.exp(-((x - 7.0) ** 2 + (y - 3.0) ** 2) / 4.0)
        - 0.2 * np.exp(-((x - 4.0) ** 2) - (y - 7.0) ** 2)
    )[:, None]


def problem(seed: int, samples: int, passes: int = 1) -> Problem:
    """One draw of the training samples."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(0.0, 1.0, (samples, 2))
    side = np.linspace(0.0, 1.0, 101)
    X_test = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    Y_test = franke(X_test)
    order = np.concatenate([rng.permutation(samples) for _ in range(passes)])
    return Problem(X, franke(X), X_test, Y_test, order, seed, float(Y_test.std()))


def table(*, quick: bool) -> Table:
    """The filter after one and ten passes, refined, and a spline."""
    draws, fewer, size, passes = (1, 1, 60, 3) if quick else (30, 10, 200, 10)
    one = [problem(s, size) for s in range(draws)]
    ten = [problem(s, size, passes) for s in range(draws)]
    fifty = [problem(s, size, 5 * passes) for s in range(1 if quick else 5)]
    large = [problem(s, 5 * size) for s in range(fewer)]
    mran_by, emran_by = (partial(filtered, settings=SETTINGS[name]) for name in ("MRAN", "EMRAN"))
    once = scores(one[:fewer], partial(ours, passes=1))
    often = scores(one[:fewer], partial(ours, passes=passes))
    once_large = scores(large, partial(ours, passes=1))
    stream = scores(one[:fewer], partial(streamed, every=1))
    best = scores(one[:fewer], partial(refined, units=10 if quick else 40, target=1e-6))
    return Table(
        "literature-franke",
        f"L5 Franke's surface, 200 samples: normalised RMSE, median and range of up to {draws} draws",
        COLUMNS,
        [
            row("linear least squares", scores(one, linear)),
            row("thin-plate spline (SciPy)", scores(one[:fewer], _spline), rerun="0.022"),
            published("Gaussian process", rerun="0.0077"),
            published("greedy kernel, 100 centres", rerun="0.020"),
            row("MRAN, 1 pass", scores(one, mran_by), rerun="0.23"),
            row("MRAN, 10 passes", scores(ten, mran_by), rerun="0.013 / 36–47"),
            row("MRAN, 50 passes", scores(fifty, mran_by), rerun="0.0067 / 36–47"),
            row("EMRAN, 1 pass", scores(one[:fewer], emran_by), rerun="0.47"),
            row("EMRAN, 10 passes", scores(ten[:fewer], emran_by), rerun="0.058"),
            row("MRAN, 1 pass, 1000 samples", scores(large, mran_by)),
            row("palpate, default form, 1 pass", once),
            row("palpate, default form, 10 passes", often),
            row("palpate, default form, 1 pass, 1000 samples", once_large),
            row("palpate, a stream seen once, one refining iteration per sample", stream),
            row("palpate, refined, ≤ 40 units", best, rerun="0.0008 / 40"),
        ],
        [
            claim("default form, 1 pass over 200 samples", once, error=0.05, units=40)[0],
            claim("stream seen once, 200 samples", stream, error=0.05, units=40)[0],
            claim("default form, 1 pass over 1000 samples", once_large, error=0.05, units=40)[0],
            claim("default form, 10 passes over 200 samples", often, error=0.01, units=40)[0],
            *claim("refined", best, error=0.001, units=40),
        ],
    )


def _spline(p: Problem) -> Score:
    from scipy.interpolate import RBFInterpolator

    began = time.process_time()
    predicted = RBFInterpolator(p.X, p.Y)(p.X_test)
    return Score(len(p.X), p.error(predicted), time.process_time() - began)
