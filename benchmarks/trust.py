"""Errors and intervals that `palpate.fit` states, against new rows; its accuracy beside other surrogates.

python -m benchmarks --only trust [--quick] [--json] [--record]

Rivals and tables are those of the packages that are installed; the extra ``bench`` has all.
About half an hour on one core.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.table import Claim, Column, Table, quick_mark
from benchmarks.trust_data import STANDARDS, RealTable, correlated, real_tables
from benchmarks.trust_rivals import RIVALS
from palpate.errors import FitWarning

__all__ = ["tables"]

LEVEL = 0.9
SEEDS, DIABETES_SEEDS, RANK_SEEDS = 5, 10, 3
INSIDE = (0.85, 0.97)
RATIO = (0.8, 1.3)


def tables(*, quick: bool = False) -> list[Table]:
    """Return the tables; `quick` takes one seed of a few cases, with little effort."""
    return [_coverage(quick), _diabetes(quick), _ranks(quick)]


@dataclass(frozen=True, eq=False)
class Split:
    """Rows of one case to learn from, and new ones."""

    X: np.ndarray
    y: np.ndarray
    new: np.ndarray
    truth: np.ndarray


def _split(table: RealTable, seed: int, quick: bool) -> Split:
    """Return a split of a table; `quick` learns from a hundred of its rows."""
    X, y, new, truth = table.split(seed)
    rows = slice(100 if quick else None)
    return Split(X[rows], y[rows], new, truth)


def _coverage(quick: bool) -> Table:
    rows, outside, off = [], [], []
    for name, splits in _cases(quick):
        measured = [_measured(split, quick) for split in splits]
        print(f"  {name}", file=sys.stderr, flush=True)
        inside, theirs, ratio, worst = (
            np.array([getattr(one, key) for one in measured])
            for key in ("inside", "theirs", "ratio", "worst")
        )
        rows.append(
            {
                "case": name,
                "rows": len(splits[0].y),
                "inside": 100 * float(np.median(inside)),
                "low": 100 * float(inside.min()),
                "high": 100 * float(inside.max()),
                "theirs": 100 * float(np.median(theirs)),
                "ratio": float(np.median(ratio)),
                "worst": float(worst.max()),
            }
        )
        outside.append(float(max(INSIDE[0] - np.median(inside), np.median(inside) - INSIDE[1])))
        off.append(float(max(RATIO[0] - np.median(ratio), np.median(ratio) - RATIO[1])))
    return Table(
        "trust_coverage",
        f"Intervals of {LEVEL:.0%} and held-out errors of palpate.fit against new rows, {SEEDS} seeds"
        f"{quick_mark(quick)}",
        [
            Column("case", "data"),
            Column("rows", "rows", ",d"),
            Column("inside", "inside, %, median", ".0f"),
            Column("low", "least", ".0f"),
            Column("high", "most", ".0f"),
            Column("theirs", "Gaussian process inside, %", ".0f"),
            Column("ratio", "error stated / true", ".2f"),
            Column("worst", "worst trusted row, deviations", ".1f"),
        ],
        rows,
        [
            Claim("median coverage outside 85 to 97 %, by", (max(outside),), 0.0, ".3f"),
            Claim("median of stated over true error outside 0.8 to 1.3, by", (max(off),), 0.0, ".3f"),
        ],
    )


def _cases(quick: bool) -> Iterator[tuple[str, list[Split]]]:
    seeds = range(1 if quick else SEEDS)
    for table in real_tables()[: 1 if quick else None]:
        yield table.name, [_split(table, seed, quick) for seed in seeds]
    noisy = [standard for standard in STANDARDS if standard.noise]
    for standard in noisy[: 1 if quick else None]:
        for count in (100,) if quick else (100, 300, 600):
            splits = []
            for seed in seeds:
                new, truth = standard.asked(2000)
                noise = standard.noise * np.random.default_rng([seed, 7]).normal(size=len(truth))
                splits.append(Split(*standard.samples(count, seed), new, truth + noise))
            yield f"{standard.name}, noise", splits
    for correlation in (0.95,) if quick else (0.0, 0.95):
        for count in (200,) if quick else (300, 600):
            splits = []
            for seed in seeds:
                X, y = correlated(count + 2000, correlation, seed)
                splits.append(Split(X[:count], y[:count], X[count:], y[count:]))
            yield f"five inputs correlated at {correlation:g}, noise", splits


@dataclass(frozen=True)
class Measured:
    """Share inside, of palpate and of the Gaussian process; stated over true error; worst trusted row, deviations."""

    inside: float
    theirs: float
    ratio: float
    worst: float


def _fit(X: np.ndarray, y: np.ndarray, quick: bool, seed: int = 0) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FitWarning)
        return pp.fit(X, y, effort=0.02 if quick else 1.0, level=LEVEL, seed=seed)


def _measured(split: Split, quick: bool) -> Measured:
    model = _fit(split.X, split.y, quick)
    low, high = model.interval(split.new)
    missed = model.predict(split.new) - split.truth
    trusted = model.trusted(split.new)
    true = float(np.sqrt((missed**2).mean())) / split.y.std()
    mean, deviation = RIVALS["Gaussian process"](split.X, split.y).with_deviation(split.new)
    theirs = np.abs(mean - split.truth) <= 1.6449 * deviation
    off = np.abs(missed) / model.deviation(split.new)
    return Measured(
        float(((low <= split.truth) & (split.truth <= high)).mean()),
        float(theirs.mean()),
        model.heldout / true,
        float(off[trusted].max(initial=0.0)),
    )


def _diabetes(quick: bool) -> Table:
    table, rows = real_tables()[0], []
    for seed in range(1 if quick else DIABETES_SEEDS):
        split = _split(table, seed, quick)
        one = _measured(split, quick)
        rows.append({"seed": seed, "inside": 100 * one.inside, "ratio": one.ratio, "worst": one.worst})
    return Table(
        "trust_diabetes",
        f"scikit-learn's diabetes, one split a seed{quick_mark(quick)}",
        [
            Column("seed", "seed", "d"),
            Column("inside", "inside, %", ".0f"),
            Column("ratio", "error stated / true", ".2f"),
            Column("worst", "worst trusted row, deviations", ".1f"),
        ],
        rows,
        [Claim("worst trusted row, deviations", tuple(row["worst"] for row in rows), 5.0, ".1f")],
    )


def _ranks(quick: bool) -> Table:
    rows, ranks, seconds = [], [], []
    rivals = list(RIVALS)[: 2 if quick else None]
    for standard in STANDARDS[: 1 if quick else None]:
        for count in (100,) if quick else (100, 300):
            errors: dict[str, list[float]] = {}
            own = []
            for seed in range(1 if quick else RANK_SEEDS):
                X, y = standard.samples(count, seed)
                new, truth = standard.asked()

                def error(
                    predict: Callable[[np.ndarray], np.ndarray], new: Any = new, truth: Any = truth
                ) -> float:
                    return float(np.sqrt(((predict(new) - truth) ** 2).mean()) / truth.std())

                began = time.process_time()
                model = _fit(X, y, quick, seed)
                seconds.append(time.process_time() - began)
                results = {"palpate": error(model.predict)}
                results |= {name: error(RIVALS[name](X, y).predict) for name in rivals}
                for name, value in results.items():
                    errors.setdefault(name, []).append(value)
                own.append(1.0 + sum(value < results["palpate"] for value in results.values()))
            ranks += own
            rows.append(
                {"case": standard.name, "rows": count, "rank": float(np.mean(own))}
                | {name: float(np.median(values)) for name, values in errors.items()}
            )
    return Table(
        "trust_ranks",
        f"Error on 4,000 new places over the answers' spread, median of {RANK_SEEDS} seeds{quick_mark(quick)}",
        [
            Column("case", "standard"),
            Column("rows", "rows", "d"),
            Column("palpate", "palpate", ".2g"),
            *(Column(name, name, ".2g") for name in RIVALS),
            Column("rank", "palpate's rank, mean", ".1f"),
        ],
        rows,
        [
            Claim("mean rank of palpate", (float(np.mean(ranks)),), 2.0, ".2f"),
            Claim("processor time of one palpate.fit, s", (max(seconds),), 60.0, ".1f"),
        ],
    )
