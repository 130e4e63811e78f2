"""What refinement reaches in how much time, and what the trained region costs per query.

python -m benchmarks.refinement [--quick] [--json]
"""

from __future__ import annotations

import sys
import time
import timeit
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks import peer_data
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table
from palpate.learning import refine
from palpate.network import TrainedRegion
from palpate.network.radial import RadialFunction
from palpate.rbf.forms import unit_form
from palpate.rbf.regressors import Regressors

__all__ = ["tables"]

RIDGE = 1e-9
STOPPING = 100  # unseen samples that say when to stop; the error is that on the others
TIMES = (0.5, 2.0, 20.0)  # s


@dataclass(frozen=True)
class Setting:
    """One network to be refined, from units at random samples."""

    data: str
    form: str
    radial: RadialFunction
    units: int
    width: float


SETTINGS = (
    Setting("data1", "rotated", "inverse-multiquadric", 100, 1.0),
    Setting("data1", "rotated", "inverse-multiquadric", 50, 1.0),
    Setting("data2", "rank-1", "matern-5/2", 200, 1.2),
)


def tables(*, quick: bool = False) -> list[Table]:
    """Error over time, and microseconds per query."""
    if quick:
        return [_refinement((Setting("data1", "rotated", "gaussian", 12, 1.0),), (0.05, 0.2)), _region(200)]
    return [_refinement(SETTINGS, TIMES), _region(20_000)]


def _refinement(settings: Sequence[Setting], times: Sequence[float]) -> Table:
    rows = [row for setting in settings for row in _rows(setting, times)]
    claims = []
    if times == TIMES:
        at = {row["limit"]: row["error"] for row in rows[: len(times)]}
        what = "data1, 100 rotated units, error after 2 s over that after 20 s"
        claims.append(Claim(what, (at[2.0] / at[20.0],), 1.05, ".3f"))
    return Table(
        "refinement",
        "Refinement by variable projection, from units at random samples",
        (
            Column("data", "data"),
            Column("network", "network"),
            Column("limit", "limit s", "g"),
            Column("cpu", "CPU s", ".2f"),
            Column("iterations", "iterations"),
            Column("training", "training error", ".1e"),
            Column("error", "error on unseen samples", ".2e"),
        ),
        rows,
        claims,
        (
            f"all training samples are fitted; {STOPPING} unseen ones choose the iterate, the others judge it",
            "errors are relative to the root mean square deviation from the mean",
            "the training error falls on for as long as one waits: with so many numbers to 500 samples that is "
            "overfitting, and the choice of the iterate is what ends it",
        ),
    )


def _rows(setting: Setting, times: Sequence[float]) -> list[dict[str, Any]]:
    X, Y, unseen, answers = getattr(peer_data, setting.data)()
    centre = Y.mean(axis=0)
    scale = np.sqrt(((Y - centre) ** 2).mean())
    Y, answers = (Y - centre) / scale, (answers - centre) / scale
    r = Regressors(unit_form(setting.form, X.shape[1]), setting.radial)
    places = X[np.random.default_rng(0).choice(len(X), setting.units, replace=False)]
    start = np.array([r.form.unit(x, setting.width, seed=i) for i, x in enumerate(places)])
    refine(X[:50], Y[:50], start[:5], r, iterations=1)  # compiles
    rows = []
    for limit in times:
        began = time.process_time()
        found = refine(
            *(X, Y, start, r),
            ridge=RIDGE,
            seconds=limit,
            iterations=1_000_000,
            heldout=(unseen[:STOPPING], answers[:STOPPING]),
            patience=1_000_000,
        )
        spent = time.process_time() - began
        missed = found.predict(unseen[STOPPING:]) - answers[STOPPING:]
        rows.append(
            {
                "data": setting.data,
                "network": f"{setting.units} {setting.form} {setting.radial}",
                "limit": limit,
                "cpu": spent,
                "iterations": found.iterations,
                "training": found.rms,
                "error": float(np.linalg.norm(missed) / np.linalg.norm(answers[STOPPING:])),
            }
        )
    return rows


def _region(count: int) -> Table:
    rows = []
    for n in (1, 3, 6):
        for samples in (100, 5000):
            region = TrainedRegion.of(np.random.default_rng(0).uniform(-1, 1, (samples, n)))
            x = np.zeros(n)
            region.inside(x)
            spent = min(timeit.repeat(lambda r=region, x=x: r.inside(x), number=count, repeat=5)) / count
            rows.append({"inputs": n, "samples": samples, "kept": len(region.points), "time": 1e6 * spent})
    return Table(
        "region",
        "Is an input inside the trained region? Best of five rounds, called from Python",
        (
            Column("inputs", "inputs"),
            Column("samples", "samples"),
            Column("kept", "kept"),
            Column("time", "µs", ".2f"),
        ),
        rows,
        (Claim("slowest query, µs", (max(row["time"] for row in rows),), 10.0, ".1f"),),
    )


if __name__ == "__main__":
    sys.exit(main(only="refinement"))
