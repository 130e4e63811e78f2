"""The founding study's cantilevers: the filter's forms, the refined network, and batch rivals.

python -m benchmarks.cantilever [--quick] [--json]
"""

from __future__ import annotations

import functools
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.cases import BEAMS, FEW, Case, Errors, case
from benchmarks.rivals import RIVALS
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table
from palpate.learning import Settings, default, founding, learn, refined_network
from palpate.network import Network

__all__ = ["refined", "tables"]

PASSES = 5
UNITS_MAX = 6

FORMS: dict[str, Callable[[], Settings]] = {
    "founding form": founding,
    "founding form, thresholds ÷ 10": lambda: tightened(founding()),
    "default form": default,
    "default form, thresholds ÷ 10": lambda: tightened(default()),
}

# for the two forms that have targets: (RMSE by beam, regression, outer against rest)
TARGETS: dict[str, tuple[dict[str, float], float | None, float | None]] = {
    "founding form": ({"copper": 2e-3, "nylon": 2e-3}, None, None),
    "default form": ({"copper": 1e-4, "nylon": 1e-3}, 2.0, 2.0),
    "refined network": ({"copper": 5e-6, "nylon": 5e-6}, None, None),
}


@dataclass(frozen=True)
class Run:
    """One seed: errors on the test loads, units, largest held-out error over its best so far."""

    errors: Errors
    units: int
    regression: float = float("nan")


def tightened(settings: Settings) -> Settings:
    """Growth thresholds divided by ten: what a user does who wants more accuracy."""
    return replace(
        settings,
        error_min=settings.error_min / 10,
        error_rms_min=settings.error_rms_min / 10,
        distance_min=settings.distance_min / 10,
    )


def tables(*, quick: bool = False) -> list[Table]:
    """Both tables; `quick` takes one seed, a coarser grid of loads, and rivals on few solves only."""
    if quick:
        cases = [case(beam, 51) for beam in BEAMS]
        return [_forms(cases, range(1), " (quick)"), _rivals(cases, (FEW,), " (quick)")]
    cases = [case(beam) for beam in BEAMS]
    return [_forms(cases, range(10), ""), _rivals(cases, (), "")]


@functools.cache
def refined(c: Case, solves: int, seed: int) -> tuple[Network, float]:
    """The refined network from `solves` solves, and its CPU seconds.

    The filter that finds its start sees no other solves.
    """
    began = time.process_time()
    X, Y = c.few(solves)
    found = learn(X, Y, c.inputs, c.outputs, passes=PASSES, seed=seed)
    known = found.state.theta
    network = refined_network(X, Y, c.inputs, c.outputs, units_max=UNITS_MAX, seed=seed, filter_units=known)[
        0
    ]
    return network, time.process_time() - began


def _forms(cases: Sequence[Case], seeds: Sequence[int], shape: str) -> Table:
    rows, claims = [], []
    for c in cases:
        for form, settings in FORMS.items():
            runs = [_sequential(c, settings(), seed) for seed in seeds]
            seconds = float("nan") if shape else _seconds(c, settings())
            rows.append(_row(c.name, form, len(c.X), runs, seconds))
            claims += _claims(c.name, form, runs)
        runs = [_refined_run(c, seed) for seed in seeds]
        rows.append(_row(c.name, "refined network", FEW, runs, refined(c, FEW, 0)[1]))
        claims += _claims(c.name, "refined network", runs)
    return Table(
        "cantilever-forms",
        f"Filter and refined network on the founding cantilevers, median / worst of {len(seeds)} seeds{shape}",
        (
            Column("beam", "beam"),
            Column("form", "form"),
            Column("solves", "solves"),
            Column("rmse", "RMSE / full scale"),
            Column("largest", "largest error"),
            Column("units", "units"),
            Column("regression", "regression"),
            Column("outer", "outer / rest"),
            Column("seconds", "CPU s", ".1f"),
        ),
        rows,
        claims,
        (
            "regression: largest held-out error over its best so far, over all observations of five shuffled passes",
            "outer / rest: RMSE in the outer 10 % of the range (5 % at each end) over RMSE in the rest",
            "CPU s: one learning run, without the held-out evaluation after every observation",
        ),
    )


def _sequential(c: Case, settings: Settings, seed: int) -> Run:
    found = learn(
        *(c.X, c.Y, c.inputs, c.outputs),
        settings=settings,
        passes=PASSES,
        seed=seed,
        heldout=(c.X_test, c.Y_test),
    )
    return Run(c.errors(found.network.predict(c.X_test)), found.network.units, found.history.regression)


def _refined_run(c: Case, seed: int) -> Run:
    network, _ = refined(c, FEW, seed)
    return Run(c.errors(network.predict(c.X_test)), network.units)


def _seconds(c: Case, settings: Settings) -> float:
    """CPU time of one run that is not judged while it learns."""
    began = time.process_time()
    learn(c.X, c.Y, c.inputs, c.outputs, settings=settings, passes=PASSES)
    return time.process_time() - began


def _row(beam: str, form: str, solves: int, runs: Sequence[Run], seconds: float) -> dict[str, Any]:
    figures = {
        "rmse": ([r.errors.rmse for r in runs], ".1e"),
        "largest": ([r.errors.largest for r in runs], ".1e"),
        "units": ([r.units for r in runs], ".0f"),
        "regression": ([r.regression for r in runs], ".2f"),
        "outer": ([r.errors.outer / r.errors.rest for r in runs], ".2f"),
    }
    row: dict[str, Any] = {"beam": beam, "form": form, "solves": solves, "seconds": seconds}
    for key, (values, form_) in figures.items():
        median, worst = statistics.median(values), max(values)
        row[key] = None if np.isnan(median) else f"{median:{form_}} / {worst:{form_}}"
        row[f"{key}_all"] = values
    return row


def _claims(beam: str, form: str, runs: Sequence[Run]) -> list[Claim]:
    if form not in TARGETS:
        return []
    rmse, regression, outer = TARGETS[form]
    what = f"{beam}, {form}"
    found = [Claim(f"{what}, RMSE / full scale", tuple(r.errors.rmse for r in runs), rmse[beam])]
    if regression:
        found.append(Claim(f"{what}, regression", tuple(r.regression for r in runs), regression, ".2f"))
    if outer:
        ratios = tuple(r.errors.outer / r.errors.rest for r in runs)
        found.append(Claim(f"{what}, outer / rest", ratios, outer, ".2f"))
    if form == "refined network":
        found.append(Claim(f"{what}, units", tuple(float(r.units) for r in runs), UNITS_MAX, ".0f"))
    return found


def _rivals(cases: Sequence[Case], counts: Sequence[int], shape: str) -> Table:
    rows = []
    for c in cases:
        own = c.errors(refined(c, FEW, 0)[0].predict(c.X_test)).rmse
        for solves in counts or (FEW, len(c.X)):
            network, spent = refined(c, solves, 0)
            name = f"palpate, refined, {network.units} unit{'s' * (network.units != 1)}"
            rows.append(_rival_row(c, name, solves, network.predict(c.X_test), own, spent))
            for rival, fit in RIVALS.items():
                predicted, spent = _batch(c, fit, solves)
                rows.append(_rival_row(c, rival, solves, predicted, own, spent))
    return Table(
        "cantilever-rivals",
        f"Batch rivals on the same solves{shape}",
        (
            Column("beam", "beam"),
            Column("method", "method"),
            Column("solves", "solves"),
            Column("rmse", "RMSE / full scale", ".1e"),
            Column("largest", "largest error", ".1e"),
            Column("ratio", f"RMSE over palpate's from {FEW}", ".2g"),
            Column("seconds", "CPU s", ".2f"),
        ),
        rows,
        notes=("CPU s: fitting, with the choice of kernel, degree or layers by hold-out",),
    )


def _batch(c: Case, fit: Callable[..., Any], solves: int) -> tuple[np.ndarray, float]:
    """A rival's predictions at the test loads, and what it cost to fit."""
    X, Y = c.few(solves)
    low, high = c.inputs[0].low, c.inputs[0].high
    size = float(np.abs(Y).max())
    began = time.process_time()
    predictor = fit(2 * (X[:, 0] - low) / (high - low) - 1, Y / size)
    spent = time.process_time() - began
    return size * predictor(2 * (c.X_test[:, 0] - low) / (high - low) - 1), spent


def _rival_row(
    c: Case, method: str, solves: int, predicted: np.ndarray, own: float, seconds: float
) -> dict[str, Any]:
    errors = c.errors(predicted)
    return {
        "beam": c.name,
        "method": method,
        "solves": solves,
        "rmse": errors.rmse,
        "largest": errors.largest,
        "ratio": errors.rmse / own,
        "seconds": seconds,
    }


if __name__ == "__main__":
    sys.exit(main(only="cantilever"))
