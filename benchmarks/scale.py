"""Fits to many rows beside a perceptron and boosted trees: errors, times and memory, each in a process of its own.

python -m benchmarks.scale [--quick] [--json]
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.machine import gigabytes
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table

__all__ = ["CASES", "METHODS", "measured", "tables"]

NOISE = 0.01  # of the outputs' spread
ERROR, SECONDS = 1.2e-2, 60.0
GIGABYTES = {("sixteen", 100_000): 1.0, ("three", 1_000_000): 1.5}
UNSEEN = 20_000


def _waves(X: np.ndarray) -> np.ndarray:
    """Six inputs: products, a square and a bend."""
    y = np.sin(np.pi * X[:, 0] * X[:, 1]) + 2.0 * (X[:, 2] - 0.5) ** 2 + X[:, 3]
    return np.asarray(
        y + 0.5 * X[:, 4] * np.tanh(3.0 * X[:, 5] + X[:, 0]) + np.sin(2.0 * (X[:, 1] + X[:, 3]))
    )


def _crossed(X: np.ndarray) -> np.ndarray:
    """Six inputs, each of which changes what others do."""
    y = np.sin(2.0 * X[:, 0] * X[:, 1]) + np.cos(3.0 * X[:, 2] + X[:, 3]) * X[:, 4]
    return np.asarray(y + np.exp(-2.0 * (X[:, 5] - X[:, 0]) ** 2))


def _three(X: np.ndarray) -> np.ndarray:
    """Three inputs that decide all, and the sum of any others a little."""
    y = np.sin(3.0 * X[:, 0]) + X[:, 1] ** 2 * X[:, 2]
    return np.asarray(y + np.tanh(0.1 * X[:, 3:].sum(axis=1)))


CASES: dict[str, tuple[Callable[[np.ndarray], np.ndarray], int]] = {
    "waves": (_waves, 6),
    "crossed": (_crossed, 6),
    "sixteen": (_three, 16),
    "three": (_three, 3),
}


def _palpate(X: np.ndarray, y: np.ndarray, effort: float) -> tuple[Callable[[np.ndarray], np.ndarray], float]:
    import palpate

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = palpate.fit(X, y, effort=effort)
    return model.predict, model.heldout


def _perceptron(seconds: float) -> Callable[..., tuple[Callable[[np.ndarray], np.ndarray], float]]:
    """Two layers of 64 by Adam, epoch after epoch until so many seconds of the processor are spent."""

    def fit(X: np.ndarray, y: np.ndarray, effort: float) -> tuple[Callable[[np.ndarray], np.ndarray], float]:
        from sklearn.neural_network import MLPRegressor

        centre, spread = y.mean(), y.std()
        model = MLPRegressor(hidden_layer_sizes=(64, 64), random_state=0)
        began = time.process_time()
        while time.process_time() - began < seconds * min(effort, 1.0):
            model.partial_fit(X, (y - centre) / spread)
        return lambda asked: model.predict(asked) * spread + centre, float("nan")

    return fit


def _trees(X: np.ndarray, y: np.ndarray, effort: float) -> tuple[Callable[[np.ndarray], np.ndarray], float]:
    """500 boosted trees of 63 leaves."""
    import lightgbm

    model = lightgbm.LGBMRegressor(n_estimators=round(500 * effort), num_leaves=63, n_jobs=2, verbose=-1)
    model.fit(X, y)
    return lambda asked: np.asarray(model.predict(asked)), float("nan")


METHODS: dict[str, Callable[..., tuple[Callable[[np.ndarray], np.ndarray], float]]] = {
    "palpate": _palpate,
    "MLPRegressor, 4 s": _perceptron(4.0),
    "MLPRegressor, 40 s": _perceptron(40.0),
    "LightGBM": _trees,
}


def measured(case: str, rows: int, method: str, effort: float = 1.0) -> dict[str, Any]:
    """Return error, times and memory of one fit in this process.

    Parameters
    ----------
    case, method : str
        Of `CASES` and `METHODS`.
    rows : int
        Number of rows, whose outputs have noise.
    effort : float
        1, or less to see whether it runs.
    """
    function, inputs = CASES[case]
    rng = np.random.default_rng(0)
    X, asked = rng.uniform(-1, 1, (rows, inputs)), rng.uniform(-1, 1, (UNSEEN, inputs))
    y = function(X)
    spread = float(y.std())
    y += NOISE * spread * rng.normal(size=rows)
    wall, processor = time.monotonic(), time.process_time()
    predict, told = METHODS[method](X, y, effort)
    took = {"wall": time.monotonic() - wall, "processor": time.process_time() - processor}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # names of columns that a rival made up
        error = float(np.sqrt(((predict(asked) - function(asked)) ** 2).mean())) / spread
    row = {"case": case, "inputs": inputs, "rows": rows, "method": method, "error": error, "told": told}
    return {**row, **took, "memory": gigabytes("VmHWM")}


def tables(*, quick: bool = False) -> list[Table]:
    """One table; `quick` takes 12,000 rows with hardly any effort, and the first two methods."""
    rivals = [name for name in METHODS if name != "LightGBM" or importlib.util.find_spec("lightgbm")]
    if quick:
        return [_table([_apart("waves", 12_000, name, 0.005) for name in rivals[:2]], [], " (quick)")]
    rows = [
        _apart(case, count, name)
        for case in ("waves", "crossed")
        for count, names in ((5_000, ["palpate"]), (100_000, rivals))
        for name in names
    ]
    rows += [_apart(*large, name) for large in GIGABYTES for name in rivals if name != "MLPRegressor, 40 s"]
    return [_table(rows, _claims(rows), "")]


def _apart(case: str, rows: int, method: str, effort: float = 1.0) -> dict[str, Any]:
    """Return what `measured` does, of a process of its own: the memory is that of one fit alone."""
    print(f"  {method}: {rows:,} rows of {case} …", file=sys.stderr, flush=True)
    call = f"print(json.dumps(measured({case!r}, {rows}, {method!r}, {effort})))"
    code = f"import json; from benchmarks.scale import measured; {call}"
    alone = os.environ | {"OPENBLAS_NUM_THREADS": "1"}  # small matrices: threads cost more than they bring
    done = subprocess.run([sys.executable, "-c", code], env=alone, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def _claims(rows: list[dict[str, Any]]) -> list[Claim]:
    ours = {(row["case"], row["rows"]): row for row in rows if row["method"] == "palpate"}
    six = ours["waves", 100_000]
    claims = [
        Claim("six inputs, 100,000 rows: error", (six["error"],), ERROR),
        Claim("six inputs, 100,000 rows: processor s", (six["processor"],), SECONDS, ".0f"),
    ]
    for case in ("waves", "crossed"):
        ratio = ours[case, 100_000]["error"] / ours[case, 5_000]["error"]
        claims.append(Claim(f"{case}: error of 100,000 rows over that of 5,000", (ratio,), 1.0, ".2f"))
    for (case, count), most in GIGABYTES.items():
        memory = ours[case, count]["memory"]
        claims.append(Claim(f"{count:,} rows of {CASES[case][1]} inputs: memory, GB", (memory,), most, ".2f"))
    return claims


def _table(rows: list[dict[str, Any]], claims: list[Claim], suffix: str) -> Table:
    columns = [
        Column("case", "case"),
        Column("inputs", "inputs"),
        Column("rows", "rows", ","),
        Column("method", "method"),
        Column("error", "error", ".1e"),
        Column("told", "held-out error", ".1e"),
        Column("processor", "processor s", ".0f"),
        Column("wall", "wall s", ".0f"),
        Column("memory", "peak GB", ".2f"),
    ]
    notes = [
        f"outputs have noise of {NOISE:.0%} of their spread; error: RMSE at {UNSEEN:,} unseen inputs, to outputs "
        "without noise, over the spread; held-out error: as the fit tells it, to outputs with noise",
        "palpate and MLPRegressor use one core, LightGBM two; peak GB: of the whole process, imports and data included",
        "MLPRegressor: two layers of 64, Adam, as many epochs as the time of the processor allows; LightGBM: 500 trees "
        "of 63 leaves",
    ]
    return Table("scale", f"Many rows{suffix}", columns, rows, claims, notes)


if __name__ == "__main__":
    sys.exit(main(only="scale"))
