"""Learning a stream with bounded refinement beside refining all of it at once, with as many units.

python -m benchmarks.online [--quick] [--json]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks import peer_data
from benchmarks.cases import BEAMS, case
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.learning import Settings, default, refine
from palpate.learning.stream.learner import Learner
from palpate.learning.stream.refining import Refining
from palpate.network import Scaling
from palpate.rbf.filter.settings import shared
from palpate.rbf.output_modes import output_modes
from palpate.units import Quantity, Range

__all__ = ["Stream", "at_once", "streamed", "streams", "tables"]

RATIO = 3.0
STARTS = 4  # of the batch refinement


@dataclass(frozen=True, eq=False)
class Stream:
    """A data set, and how it is shown.

    Attributes
    ----------
    name : str
    data : X (N, n), Y (N, m), X_test, Y_test
    inputs, outputs : ranges and quantities
    settings : Settings
    refining : Refining
    passes : int
        Over the training samples, each in another order.
    basis : int or None
        Output modes learnt in.
    """

    name: str
    data: peer_data.Samples
    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    settings: Settings
    refining: Refining
    passes: int
    basis: int | None = None

    def error(self, predict: Callable[[np.ndarray], np.ndarray]) -> float:
        """Relative RMSE on the test samples, outputs centred by the training mean."""
        _, Y, X_test, Y_test = self.data
        return float(np.linalg.norm(predict(X_test) - Y_test) / np.linalg.norm(Y_test - Y.mean(axis=0)))


def tables(*, quick: bool = False) -> list[Table]:
    """One table; `quick` takes one beam, coarsely."""
    seeds = range(1 if quick else 3)
    rows, claims = [], []
    for stream in streams(quick=quick):
        runs = [streamed(stream, seed) for seed in seeds]
        units = round(statistics.median(r[1] for r in runs))
        batch, spent = at_once(stream, units, seeds)
        errors = [r[0] for r in runs]
        times = 1e3 * np.concatenate([r[2] for r in runs])
        rows.append(
            {
                "name": stream.name,
                "units": units,
                "shown": len(runs[0][2]),
                "every": stream.refining.every,
                "kept": stream.refining.samples,
                "rmse": f"{statistics.median(errors):.1e} / {max(errors):.1e}",
                "batch": f"{statistics.median(batch):.1e} / {max(batch):.1e}",
                "ratio": statistics.median(errors) / statistics.median(batch),
                "median": float(np.median(times)),
                "p99": float(np.percentile(times, 99)),
                "most": float(times.max()),
                "megabytes": max(r[3] for r in runs) * 8 / 1e6,
                "seconds": statistics.median(float(r[2].sum()) for r in runs),
                "batch_seconds": spent,
                "rmse_all": errors,
                "batch_all": batch,
            }
        )
        if not quick:
            ratios = tuple(e / statistics.median(batch) for e in errors)
            claims.append(Claim(f"{stream.name}, error over the batch refinement's", ratios, RATIO, ".2f"))
    return [_table(rows, claims, len(seeds), quick_mark(quick))]


def streams(*, quick: bool = False) -> list[Stream]:
    """Both cantilevers, `data1` and `data2`; `quick` has one of the beams, coarsely."""
    found = []
    for beam in BEAMS[1:] if quick else BEAMS:
        c = case(beam, 51 if quick else 501)
        settings = replace(default(), units_max=4, error_rms_min=1e-7)
        refining = Refining(samples=251, every=5)
        found.append(
            Stream(beam, (c.X, c.Y, c.X_test, c.Y_test), c.inputs, c.outputs, settings, refining, passes=3)
        )
    if quick:
        return found
    tight = replace(shared(), error_rms_min=1e-7)
    found.append(
        _peer(
            *("data1", peer_data.data1()),
            settings=replace(tight, form="rotated", radial="inverse-multiquadric", units_max=50),
            refining=Refining(samples=500, every=5),
            passes=3,
        )
    )
    found.append(
        _peer(
            *("data2", peer_data.data2()),
            settings=replace(tight, form="rank-1", radial="matern-5/2", units_max=100),
            refining=Refining(samples=2000, every=20),
            passes=1,
            basis=40,
        )
    )
    return found


def _peer(
    name: str,
    data: peer_data.Samples,
    *,
    settings: Settings,
    refining: Refining,
    passes: int,
    basis: int | None = None,
) -> Stream:
    n, m = data[0].shape[1], data[1].shape[1]
    inputs = tuple(Range(f"x{i}", -1.0, 1.0) for i in range(n))
    outputs = tuple(Quantity(f"y{j}") for j in range(m))
    return Stream(name, data, inputs, outputs, settings, refining, passes, basis)


def streamed(stream: Stream, seed: int) -> tuple[float, int, np.ndarray, int]:
    """Error at the end, units, seconds of every observation, and numbers kept."""
    X, Y, _, _ = stream.data
    learner = Learner(
        *(stream.inputs, stream.outputs),
        settings=stream.settings,
        refining=stream.refining,
        basis=stream.basis,
        seed=seed,
    )
    rng, spent = np.random.default_rng(seed), []
    for _ in range(stream.passes):
        for i in rng.permutation(len(X)):
            began = time.perf_counter()
            learner.observe(X[i], Y[i])
            spent.append(time.perf_counter() - began)
    network = learner.network
    return stream.error(network.predict), network.units, np.array(spent), learner.numbers


def at_once(stream: Stream, units: int, seeds: Sequence[int]) -> tuple[list[float], float]:
    """Errors of the refinement of all training samples, best of some starts by leave-one-out, and CPU seconds."""
    X, Y, _, _ = stream.data
    scaling = Scaling.of(stream.inputs, Y)
    x, y = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    V = None if stream.basis is None else output_modes(y, stream.basis)
    latent = y if V is None else y @ V
    of = stream.settings.regressors(x.shape[1])
    errors, began = [], time.process_time()
    for seed in seeds:
        rng, found = np.random.default_rng(seed), []
        for _ in range(STARTS):
            width = 3.0 / units ** (1.0 / x.shape[1])
            rows = rng.choice(len(x), units, replace=False)
            start = np.array([of.form.unit(p, width, seed=int(rng.integers(2**31))) for p in x[rows]])
            start += rng.normal(0.0, 0.05, start.shape)
            found.append(refine(x, latent, start, of, iterations=60))
        best = min(found, key=lambda r: r.loo)

        def predict(P: np.ndarray, best: Any = best) -> np.ndarray:
            eta = best.predict(scaling.scale_inputs(P))
            return (eta if V is None else eta @ V.T) * scaling.output_scale + scaling.output_centre

        errors.append(stream.error(predict))
    return errors, (time.process_time() - began) / len(seeds)


def _table(rows: list[dict[str, Any]], claims: list[Claim], seeds: int, shape: str) -> Table:
    return Table(
        "online",
        f"A stream with bounded refinement beside refining all at once, {seeds} orders of presentation{shape}",
        (
            Column("name", "data"),
            Column("units", "units"),
            Column("shown", "observations"),
            Column("kept", "retained"),
            Column("every", "one iteration every"),
            Column("rmse", "relative RMSE, median / worst"),
            Column("batch", "all at once, median / worst"),
            Column("ratio", "ratio", ".2f"),
            Column("median", "ms an observation, median", ".2f"),
            Column("p99", "99 %", ".0f"),
            Column("most", "most", ".0f"),
            Column("seconds", "s in all", ".1f"),
            Column("megabytes", "MB kept", ".2f"),
            Column("batch_seconds", "CPU s at once", ".1f"),
        ),
        rows,
        claims,
        (
            f"all at once: `refine` on all training samples, 60 iterations, best of {STARTS} random starts by "
            "leave-one-out error; a fifth of the retained samples only judges trials in the stream",
        ),
    )


if __name__ == "__main__":
    sys.exit(main(only="online"))
