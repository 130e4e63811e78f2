"""L1, the Hermite function: y = 1.1 (1 − x + 2 x²) exp(−x²/2), x in [−4, 4].

40 random training samples, presented 25 times in an order shuffled anew; 200 evenly spread test points. Data and
the RAN, RAN-EKF and MRAN figures: Lu, Sundararajan & Saratchandran 1997; orthogonal least squares (Chen, Cowan &
Grant 1991) and D-FNN: Wu & Er 2000.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.literature.protocol import (
    COLUMNS,
    Problem,
    claim,
    filtered,
    linear,
    ours,
    published,
    refined,
    row,
    scores,
    within,
)
from benchmarks.table import Table
from palpate.learning import Settings
from palpate.rbf.filter.settings import mran, ran, ran_ekf

__all__ = ["SETTINGS", "problem", "table"]

_THRESHOLDS = {
    "distance_max": 2.0,
    "distance_min": 0.2,
    "distance_decay": 0.977,
    "error_min": 0.02,
    "overlap": 0.87,
    "noise": 1.0,
    "process_noise": 0.02,
}
SETTINGS: dict[str, Settings] = {
    "RAN": replace(ran(), **_THRESHOLDS, learning_rate=0.05),
    "RAN-EKF": replace(ran_ekf(), **_THRESHOLDS),
    "MRAN": replace(mran(), **_THRESHOLDS, window=25, error_rms_min=0.4, prune_after=25, prune_below=0.01),
}


def problem(seed: int, passes: int = 25) -> Problem:
    """One draw of the 40 training samples, and of their order."""
    rng = np.random.default_rng(seed)
    X, X_test = rng.uniform(-4.0, 4.0, (40, 1)), np.linspace(-4.0, 4.0, 200)[:, None]
    order = np.concatenate([rng.permutation(40) for _ in range(passes)])
    return Problem(X, _hermite(X), X_test, _hermite(X_test), order, seed)


def table(*, quick: bool) -> Table:
    """Ours beside the published figures."""
    passes = 5 if quick else 25
    problems = [problem(s, passes) for s in range(1 if quick else 30)]
    found = {name: scores(problems, partial(filtered, settings=s)) for name, s in SETTINGS.items()}
    also = replace(SETTINGS["MRAN"], update_on_growth=True)
    return Table(
        "literature-hermite",
        f"L1 Hermite function: RMSE, median and range of {len(problems)} draws, 25 passes over 40 samples",
        COLUMNS,
        [
            row("linear least squares", scores(problems, linear)),
            row("RAN", found["RAN"], "– / 18", "0.055 / 20"),
            row("RAN-EKF", found["RAN-EKF"], "– / 13", "0.014 / 17"),
            row("MRAN", found["MRAN"], "0.009 / 7", "0.0103 / 7"),
            row("MRAN, updating after growth too", scores(problems, partial(filtered, settings=also))),
            published("orthogonal least squares", "0.0095 / 7"),
            published("D-FNN", "0.0056 / 6"),
            row("palpate, default form, 25 passes", scores(problems[:10], partial(ours, passes=passes))),
            row("palpate, refined, ≤ 6 units", scores(problems, partial(refined, units=6))),
        ],
        [within("MRAN", found["MRAN"], 6, 8), claim("MRAN", found["MRAN"], error=0.015, units=8)[0]],
    )


def _hermite(x: np.ndarray) -> np.ndarray:
    return np.asarray(1.1 * (1.0 - x + 2.0 * x * x) * np.exp(-0.5 * x * x))
