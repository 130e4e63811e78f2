"""Errors and intervals that `palpate.fit` states of 25, 40 and 80 clean rows, beside a Gaussian process.

python -m benchmarks --only few_rows [--quick] [--json] [--record]

Needs scikit-learn. Some minutes on one core.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.table import Claim, Column, Table, quick_mark
from benchmarks.trust_data import STANDARDS, Standard
from benchmarks.trust_rivals import gaussian_process
from palpate.errors import FitWarning

__all__ = ["tables"]

COUNTS, DESIGNS, ASKED = (25, 40, 80), 8, 3000
INSIDE, RATIO, BEHIND = (0.80, 0.97), (0.7, 1.5), 1.15


def _franke(X: np.ndarray) -> np.ndarray:
    x, y = 9 * X.T
    hills = 0.75 * np.exp(-((x - 2) ** 2 + (y - 2) ** 2) / 4) + 0.75 * np.exp(
        -((x + 1) ** 2) / 49 - (y + 1) / 10
    )
    return np.asarray(
        hills
        + 0.5 * np.exp(-((x - 7) ** 2 + (y - 3) ** 2) / 4)
        - 0.2 * np.exp(-((x - 4) ** 2) - (y - 7) ** 2)
    )


def _branin(X: np.ndarray) -> np.ndarray:
    a, b = X.T
    valley = (b - 5.1 / (4 * np.pi**2) * a * a + 5 / np.pi * a - 6) ** 2
    return np.asarray(valley + 10 * (1 - 1 / (8 * np.pi)) * np.cos(a) + 10)


def _camel(X: np.ndarray) -> np.ndarray:
    x, y = X.T
    return np.asarray((4 - 2.1 * x * x + x**4 / 3) * x * x + x * y + (4 * y * y - 4) * y * y)


def _cantilever(X: np.ndarray) -> np.ndarray:
    force, length, modulus, width, height = X.T
    return np.asarray(4 * force * length**3 / (modulus * width * height**3))


_KNOWN = {standard.name: standard for standard in STANDARDS}
_FRIEDMAN = _KNOWN["Friedman 5"]
CASES = (
    Standard("Franke", (0, 0), (1, 1), _franke),
    Standard("Branin", (-5, 0), (10, 15), _branin),
    Standard("six-hump camel", (-2, -1), (2, 1), _camel),
    Standard("cantilever", (10, 0.8, 1e9, 0.01, 0.02), (100, 1.2, 3e9, 0.02, 0.03), _cantilever),
    Standard("Friedman 5, clean", _FRIEDMAN.low, _FRIEDMAN.high, _FRIEDMAN.function),
    *(_KNOWN[name] for name in ("Ishigami", "OTL circuit", "piston", "borehole", "wing weight")),
)


def tables(*, quick: bool = False) -> list[Table]:
    """Return the table; `quick` takes two designs of 25 rows of two cases."""
    rows, claims = [], []
    for count in COUNTS[: 1 if quick else None]:
        own = [_row(case, count, 2 if quick else DESIGNS) for case in CASES[: 2 if quick else None]]
        print(f"  {count} rows", file=sys.stderr, flush=True)
        rows += own
        for what, key, low, high in (
            ("mean coverage outside 80 to 97 %", "inside", 100 * INSIDE[0], 100 * INSIDE[1]),
            ("median of stated over true error outside 0.7 to 1.5", "ratio", *RATIO),
            ("median error above 1.15 of the Gaussian process's", "behind", 0.0, BEHIND),
        ):
            outside = sum(not low <= row[key] <= high for row in own)
            claims.append(Claim(f"{count} rows: cases with {what}", (float(outside),), 1.0, ".0f"))
    columns = [
        Column("case", "function"),
        Column("rows", "rows", "d"),
        Column("inside", "inside, %, mean", ".0f"),
        Column("least", "least", ".0f"),
        Column("theirs", "Gaussian process inside, %", ".0f"),
        Column("ratio", "error stated / true", ".2f"),
        Column("lowest", "least", ".2f"),
        Column("highest", "most", ".2f"),
        Column("error", "error", ".2g"),
        Column("behind", "over the Gaussian process's", ".2f"),
        Column("worst", "most", ".2f"),
    ]
    title = (
        f"Intervals of 90% and errors of palpate.fit on few clean rows, {DESIGNS} designs{quick_mark(quick)}"
    )
    return [Table("few_rows", title, columns, rows, claims)]


def _row(case: Standard, count: int, designs: int) -> dict[str, Any]:
    measured = [_measured(case, count, seed) for seed in range(designs)]
    inside, theirs, ratio, error, behind = (np.array(values) for values in zip(*measured, strict=True))
    return {
        "case": case.name,
        "rows": count,
        "inside": 100 * float(inside.mean()),
        "least": 100 * float(inside.min()),
        "theirs": 100 * float(theirs.mean()),
        "ratio": float(np.median(ratio)),
        "lowest": float(ratio.min()),
        "highest": float(ratio.max()),
        "error": float(np.median(error)),
        "behind": float(np.median(behind)),
        "worst": float(behind.max()),
    }


def _measured(case: Standard, count: int, seed: int) -> tuple[float, float, float, float, float]:
    """Return both coverages, stated over true error, the error over the spread, and that over the rival's."""
    X, _ = case.samples(count, seed)
    y = case.function(X)
    asked, truth = case.asked(ASKED)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FitWarning)
        model = pp.fit(X, y, effort=1.0, seed=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs, deviation = gaussian_process(X, y).with_deviation(asked)
    low, high = model.interval(asked)
    error, their_error = (
        float(np.sqrt(((answers - truth) ** 2).mean())) for answers in (model.predict(asked), theirs)
    )
    return (
        float(((low <= truth) & (truth <= high)).mean()),
        float((np.abs(theirs - truth) <= 1.645 * deviation).mean()),
        float(model.heldout * y.std() / error),
        error / float(truth.std()),
        error / their_error,
    )
