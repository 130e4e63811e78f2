"""Does the pure filter regress? Both cantilevers, many orders of presentation, thresholds over two decades.

python -m benchmarks.stability [--quick] [--json]
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from typing import Any

from benchmarks.cases import BEAMS, Case, case
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.learning import Settings, default, learn

__all__ = ["run", "scaled", "tables"]

PASSES = 5
SEEDS = 100
WORKERS = 2
FACTORS = (0.1, 0.316, 1.0, 3.16, 10.0)  # on the growth thresholds e_min, e'_min and ε_min
REGRESSION = 2.0
RMSE = {"copper": 1e-4, "nylon": 1e-3}
UNITS = 10


@dataclass(frozen=True)
class Run:
    """One order of presentation: held-out RMSE over full scale, its largest ratio to its best so far, units."""

    rmse: float
    regression: float
    units: int


def tables(*, quick: bool = False) -> list[Table]:
    """One table; `quick` takes two seeds, three thresholds and a coarse grid of loads."""
    seeds, factors = (range(2), FACTORS[::2]) if quick else (range(SEEDS), FACTORS)
    cases = [case(beam, 51 if quick else 501) for beam in BEAMS]
    jobs = [(c, factor, seed) for c in cases for factor in factors for seed in seeds]
    if quick:
        runs = [run(*job) for job in jobs]
    else:
        # each run computes on one thread anyway
        with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
            runs = list(pool.map(run, *zip(*jobs, strict=True)))
    rows, claims = [], []
    for c in cases:
        for factor in factors:
            some = [r for r, (d, f, _) in zip(runs, jobs, strict=True) if d is c and f == factor]
            rows.append(_row(c.name, factor, some))
            claims += _claims(c.name, factor, some, quick=quick)
    return [_table(rows, claims, len(seeds), quick_mark(quick))]


def run(c: Case, factor: float, seed: int) -> Run:
    """Learn once, judged on the test loads after every observation."""
    found = learn(
        *(c.X, c.Y, c.inputs, c.outputs),
        settings=scaled(factor),
        passes=PASSES,
        seed=seed,
        heldout=(c.X_test, c.Y_test),
    )
    return Run(float(found.history.heldout[-1]), found.history.regression, found.network.units)


def scaled(factor: float) -> Settings:
    """The default settings with their growth thresholds multiplied, ε_min up to ε_max."""
    s = default()
    return replace(
        s,
        error_min=factor * s.error_min,
        error_rms_min=factor * s.error_rms_min,
        distance_min=min(factor * s.distance_min, s.distance_max),
    )


def _row(beam: str, factor: float, runs: Sequence[Run]) -> dict[str, Any]:
    regressions = [r.regression for r in runs]
    errors, units = [r.rmse for r in runs], [r.units for r in runs]
    return {
        "beam": beam,
        "factor": factor,
        "regression": statistics.median(regressions),
        "worst": max(regressions),
        "over": sum(r > REGRESSION for r in regressions),
        "rmse": statistics.median(errors),
        "rmse_worst": max(errors),
        "units": f"{statistics.median(units):.0f} / {max(units)}",
        "regression_all": regressions,
        "rmse_all": errors,
        "units_all": units,
    }


def _claims(beam: str, factor: float, runs: Sequence[Run], *, quick: bool) -> list[Claim]:
    found = [
        Claim(
            f"{beam}, thresholds × {factor:g}, regression",
            tuple(r.regression for r in runs),
            REGRESSION,
            ".2f",
        )
    ]
    if factor == 1.0 and not quick:
        found.append(Claim(f"{beam}, RMSE / full scale", tuple(r.rmse for r in runs), RMSE[beam]))
        found.append(Claim(f"{beam}, units", tuple(float(r.units) for r in runs), UNITS, ".0f"))
    return found


def _table(rows: list[dict[str, Any]], claims: list[Claim], seeds: int, shape: str) -> Table:
    return Table(
        "stability",
        f"The pure filter over {seeds} orders of presentation and thresholds over two decades{shape}",
        (
            Column("beam", "beam"),
            Column("factor", "thresholds ×", "g"),
            Column("regression", "regression, median", ".2f"),
            Column("worst", "worst", ".2f"),
            Column("over", f"above {REGRESSION:g}", "d"),
            Column("rmse", "RMSE / full scale, median", ".1e"),
            Column("rmse_worst", "worst", ".1e"),
            Column("units", "units, median / most"),
        ),
        rows,
        claims,
        (
            "regression: largest held-out error over its best so far, over all observations of five shuffled passes",
            "thresholds: e_min, e'_min and ε_min of the default settings",
        ),
    )


if __name__ == "__main__":
    sys.exit(main(only="stability"))
