"""The automatic choice of a network beside other surrogates, on five maps given by formula.

    python -m benchmarks.peers [--quick] [--json]

Everyone learns the same samples in this process on one thread, and is asked the same question in turn. Fit seconds
include all tuning.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import peer_data
from benchmarks.latency import interleaved
from benchmarks.peer_rivals import MISSING, RIVALS
from benchmarks.plain import PlainNetwork
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.learning.arrays.fit import fit
from palpate.network import Network
from palpate.units import Quantity, Range

__all__ = ["SETS", "PeerSet", "tables"]

OURS, NUMPY = "palpate", "palpate's network in plain NumPy"
_MARKS = {"data1": 4e-3, "data2": 5e-4}
_QUICK = ("RBFInterpolator (SciPy)", "POD + RBFInterpolator")


@dataclass(frozen=True, eq=False)
class PeerSet:
    """Training and test samples: X (N, n), Y (N, m)."""

    name: str
    X: np.ndarray
    Y: np.ndarray
    X_test: np.ndarray
    Y_test: np.ndarray

    def error(self, predicted: np.ndarray) -> float:
        """‖predicted − Y_test‖ over ‖Y_test − training mean‖."""
        miss, size = predicted - self.Y_test, self.Y_test - self.Y.mean(axis=0)
        return float(np.linalg.norm(miss) / np.linalg.norm(size))


SETS: dict[str, Callable[..., peer_data.Samples]] = {
    "data1": peer_data.data1,
    "data2": peer_data.data2,
    **{kind: partial(peer_data.control, kind) for kind in ("quadratics", "gaussians", "bumps")},
}
"""A set by name; each takes a seed."""


def tables(*, quick: bool = False) -> list[Table]:
    """One table for all sets; `quick` takes the smallest set, two rivals and little effort."""
    rows: list[dict[str, Any]] = []
    claims: list[Claim] = []
    ratios = {}
    for name in list(SETS)[: 1 if quick else None]:
        data = PeerSet(name, *SETS[name]())
        found = _set_rows(data, quick)
        rows += found
        ours = found[0]
        ratios[name] = ours["error"] / min(row["error"] for row in found[2:])
        claims += _claims(data, ours, found[1], ratios[name])
    if not quick:
        ahead = sorted(ratios[name] for name in ("quadratics", "gaussians", "bumps"))[1]
        claims.append(Claim("clearly ahead on two controls: second best ratio", (ahead,), 0.8, ".2f"))
    return [
        Table(
            "peers",
            f"Five maps: error, one query, model and fit of each surrogate{quick_mark(quick)}",
            (
                Column("set", "set"),
                Column("who", "by"),
                Column("error", "relative RMSE", ".2e"),
                Column("microseconds", "µs, one query", ".1f"),
                Column("ratio", "time over palpate's", ".1f"),
                Column("kilobytes", "kB", ".0f"),
                Column("seconds", "fit, s", ".1f"),
                Column("chosen", "chosen"),
            ),
            rows,
            claims,
            (
                "relative RMSE: ‖error‖/‖test outputs − training mean‖",
                "kB: the network's file, or what a rival keeps, pickled",
                "perceptron: 2,000 to 10,000 steps of L-BFGS, a training budget rather than its end; "
                "the ONNX row is the same perceptron, and shares its training",
                *(f"not installed: {name}" for name in MISSING),
            ),
        )
    ]


def _claims(data: PeerSet, ours: dict[str, Any], plain: dict[str, Any], ratio: float) -> list[Claim]:
    name = data.name
    error = (
        Claim(f"{name}: relative RMSE", (ours["error"],), _MARKS[name])
        if name in _MARKS
        else Claim(f"{name}: error over the best rival's", (ratio,), 1.2, ".2f")
    )
    return [
        error,
        Claim(f"{name}: fit, s", (ours["seconds"],), 30.0, ".1f"),
        Claim(f"{name}: query over plain NumPy", (1.0 / plain["ratio"],), 0.8, ".2f"),
    ]


def _set_rows(data: PeerSet, quick: bool) -> list[dict[str, Any]]:
    """A row for each contender; ours first, then the same network in plain NumPy."""
    inputs = [Range(f"x{i}", -1.0, 1.0) for i in range(data.X.shape[1])]
    outputs = [Quantity(f"y{i}") for i in range(data.Y.shape[1])]
    began = time.perf_counter()
    ours = fit(data.X, data.Y, inputs, outputs, effort=0.02 if quick else 1.0)
    spent = time.perf_counter() - began
    network, evaluator, plain = ours.network, ours.network.evaluator(), PlainNetwork(ours.network)
    x = np.ascontiguousarray(data.X_test[0])
    np.testing.assert_allclose(plain(x), evaluator(x), rtol=0, atol=1e-7 * float(np.abs(data.Y).max()))
    label = f"{ours.units} units, {ours.form}, {ours.radial}"
    rows = [_row(data, OURS, network.predict(data.X_test), _file_size(network), spent, label)]
    rows.append({"set": data.name, "who": NUMPY, "chosen": "the same"})
    queries = {OURS: lambda: evaluator(x), NUMPY: lambda: plain(x)}
    centre, scale = data.Y.mean(axis=0), float(np.sqrt(((data.Y - data.Y.mean(axis=0)) ** 2).mean()))
    for name in _QUICK if quick else RIVALS:
        began = time.perf_counter()
        model = RIVALS[name](data.X, (data.Y - centre) / scale)
        spent = time.perf_counter() - began
        predicted = centre + scale * model.predict(data.X_test)
        rows.append(_row(data, name, predicted, model.size, spent, model.chosen))
        queries[name] = lambda model=model: centre + scale * model.predict(x[None])[0]
    times = interleaved(queries, 5 if quick else 200)
    for row in rows:
        row["microseconds"] = 1e6 * float(np.median(times[row["who"]]))
        row["ratio"] = float(np.median(times[row["who"]] / times[OURS]))
    return rows


def _row(
    data: PeerSet, who: str, predicted: np.ndarray, size: int, seconds: float, chosen: str
) -> dict[str, Any]:
    return {
        "set": data.name,
        "who": who,
        "error": data.error(predicted),
        "kilobytes": size / 1000,
        "seconds": seconds,
        "chosen": chosen,
    }


def _file_size(network: Network) -> int:
    with tempfile.TemporaryDirectory() as folder:
        return os.path.getsize(network.save(Path(folder) / "peer.palpate"))


if __name__ == "__main__":
    sys.exit(main(only="peers"))
