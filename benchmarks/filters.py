"""What one observation costs each rule, in time and memory, beside the textbook and beside bare BLAS.

    python -m benchmarks.filters [--quick] [--json] [--picture FILE]

Contenders take turns within a round and are timed by their own CPU time; ratios are taken within a round.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg.blas import dsymm, dsyr2k

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table
from palpate.learning import Settings, State, default, initial, step
from palpate.rbf.filter.growth import add_unit
from palpate.rbf.filter.settings import ran_ekf

__all__ = ["picture", "tables"]

# no guards and no growth: what is timed is one linearisation and one update
PLAIN = replace(
    ran_ekf(),
    form="axis-aligned",
    tail="affine",
    widths="log",
    update_on_growth=True,
    noise=1e-2,
    error_min=1e9,
)
LARGE = 0.02  # s: calls that take longer are repeated less


def tables(*, quick: bool = False) -> list[Table]:
    """Two tables: the full filter beside its rivals, and the shared-weight filter over m."""
    return [_full(quick), _shared(quick)]


def _full(quick: bool) -> Table:
    inputs, outputs, units = 3, 10, 60
    state = filled(inputs, outputs, units, PLAIN)
    d = state.vector().size
    contenders = {
        "palpate, one step": stepping(state, PLAIN),
        "palpate, one step with all guards": stepping(
            filled(inputs, outputs, units, default()), replace(default(), units_max=0)
        ),
        "dsymm + dsyr2k": bare_blas(d, outputs),
        "NumPy, Joseph form": textbook(d, outputs),
    }
    rival = filterpy(d, outputs)
    if rival is not None:
        contenders["filterpy"] = rival
    spent = rounds(contenders, 3 if quick else 40)
    ours = spent["palpate, one step"]
    rows = [
        {"who": who, "ms": 1e3 * float(np.median(s)), "ratio": float(np.median(s / ours))}
        for who, s in spent.items()
    ]
    slow = "filterpy" if rival is not None else "NumPy, Joseph form"
    claims = [
        Claim(f"palpate over {slow}", (float(np.median(ours / spent[slow])),), 1 / 30, ".4f"),
        Claim("palpate over bare BLAS", (float(np.median(ours / spent["dsymm + dsyr2k"])),), 1.5, ".2f"),
    ]
    notes = [
        f"{units} axis-aligned units, {inputs} inputs, {outputs} outputs; a step is all that `step` does"
    ]
    if rival is None:
        notes.append("filterpy is not installed; its update is the NumPy line's")
    columns = (
        Column("who", "by"),
        Column("ms", "ms of CPU, median", ".2f"),
        Column("ratio", "over palpate's", ".2f"),
    )
    return Table("filter-full", f"One step of the full filter at {d} states", columns, rows, claims, notes)


def _shared(quick: bool) -> Table:
    units, inputs, modes = 100, 3, 10
    sizes = (100, 1000) if quick else (100, 1000, 3000, 10_000, 30_000)
    settings = replace(PLAIN, update="shared", modes=modes)
    contenders = {}
    states = {}
    for m in sizes:
        V = np.linalg.qr(np.random.default_rng(0).normal(size=(m, modes)))[0]
        states[m] = filled(inputs, m, units, settings, V)
        contenders[str(m)] = stepping(states[m], settings)
    spent = rounds(contenders, 5 if quick else 60)
    rows = []
    for m in sizes:
        full = filled_size(inputs, m, units)
        rows.append(
            {
                "m": m,
                "ms": 1e3 * float(np.median(spent[str(m)])),
                "covariance": 8e-6 * states[m].covariance.numbers,
                "weights": 8e-6 * states[m].coefficients.size,
                "full": 8e-9 * full**2,
            }
        )
    claims = []
    if not quick:
        claims = [
            Claim("10,000 outputs, ms", (1e3 * float(np.median(spent["10000"])),), 5.0, ".2f"),
            Claim(
                "time at 30,000 outputs over three times that at 10,000",
                (float(np.median(spent["30000"] / (3 * spent["10000"]))),),
                1.2,
                ".2f",
            ),
        ]
    columns = (
        Column("m", "outputs"),
        Column("ms", "ms of CPU a step, median", ".2f"),
        Column("covariance", "covariances, MB", ".1f"),
        Column("weights", "weights, MB", ".2f"),
        Column("full", "a full covariance, GB", ".3g"),
    )
    notes = (f"{units} axis-aligned units, {inputs} inputs; shapes driven by {modes} output modes",)
    return Table("filter-shared", "One step of the shared-weight filter", columns, rows, claims, notes)


def filled(
    inputs: int, outputs: int, units: int, settings: Settings, modes: np.ndarray | None = None
) -> State:
    """A state with so many random units."""
    rng = np.random.default_rng(0)
    state = initial(inputs, outputs, settings, modes)
    for _ in range(units):
        state = add_unit(state, rng.uniform(-1, 1, inputs), rng.normal(size=outputs), settings)
    return state


def filled_size(inputs: int, outputs: int, units: int) -> int:
    """States of the full filter, m (1 + n) + h (m + 2n)."""
    return outputs * (1 + inputs) + units * (outputs + 2 * inputs)


def stepping(state: State, settings: Settings) -> Callable[[], Any]:
    """A call that shows the filter one random observation."""
    rng = np.random.default_rng(1)
    Y = rng.normal(size=(8, state.outputs))
    holder = [state]

    def call() -> None:
        x, y = rng.uniform(-1, 1, state.inputs), Y[rng.integers(8)]
        holder[0] = step(holder[0], x, y, settings, donate=True)[0]

    return call


def bare_blas(d: int, m: int) -> Callable[[], Any]:
    """The calls of BLAS that no filter of this kind can do without."""
    rng = np.random.default_rng(2)
    P = np.asfortranarray(np.eye(d))
    Ht, K = (np.asfortranarray(rng.normal(size=(d, m)) * s) for s in (1.0, 1e-6))

    def call() -> None:
        dsymm(1.0, P, Ht, lower=1)
        dsyr2k(-1.0, K, K, beta=1.0, c=P, lower=1, overwrite_c=1)

    return call


def textbook(d: int, m: int) -> Callable[[], Any]:
    """P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ as it is written."""
    rng = np.random.default_rng(3)
    P, H, R, one = np.eye(d), rng.normal(size=(m, d)), 1e-2 * np.eye(m), np.eye(d)

    def call() -> None:
        PH = P @ H.T
        K = PH @ np.linalg.inv(H @ PH + R)
        left = one - K @ H
        left @ P @ left.T + K @ R @ K.T

    return call


def filterpy(d: int, m: int) -> Callable[[], Any] | None:
    """The extended Kalman filter of filterpy, where it is installed."""
    try:
        from filterpy.kalman import ExtendedKalmanFilter
    except ImportError:
        return None
    rng = np.random.default_rng(4)
    H = rng.normal(size=(m, d))
    filter_ = ExtendedKalmanFilter(dim_x=d, dim_z=m)
    filter_.R *= 1e-2

    def call() -> None:
        filter_.update(rng.normal(size=(m, 1)), lambda _: H, lambda x: H @ x)

    return call


def rounds(contenders: dict[str, Callable[[], Any]], count: int) -> dict[str, np.ndarray]:
    """CPU seconds per call (count,) of each contender, in turn; quick ones are called several times a round."""
    times = {who: _calls(call) for who, call in contenders.items()}
    spent: dict[str, list[float]] = {who: [] for who in contenders}
    gc.disable()
    try:
        for _ in range(count):
            for who, call in contenders.items():
                call()  # brings its own data back into the cache
                began = time.thread_time()
                for _ in range(times[who]):
                    call()
                spent[who].append((time.thread_time() - began) / times[who])
    finally:
        gc.enable()
    return {who: np.array(seconds) for who, seconds in spent.items()}


def _calls(call: Callable[[], Any]) -> int:
    call()
    began = time.thread_time()
    call()
    return max(1, int(LARGE / max(time.thread_time() - began, 1e-4)))


def picture(path: Path) -> None:
    """Memory of each rule's covariance over units and over outputs, as kept and as the declared law has it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    colours = {"full": "#1f4e79", "decoupled": "#b5651d", "shared": "#2e7d5b"}
    for axes, key, sizes in ((left, "units", (5, 10, 20, 40, 80)), (right, "outputs", (3, 10, 30, 100, 300))):
        for update, colour in colours.items():
            shapes = [(20, s) if key == "outputs" else (s, 10) for s in sizes]
            dense = np.geomspace(sizes[0], sizes[-1], 50)
            laws = [(20, s) if key == "outputs" else (s, 10) for s in dense]
            kept = [
                8e-6 * filled(3, m, h, replace(PLAIN, update=update)).covariance.numbers
                for h, m in shapes
                if update != "full" or filled_size(3, m, h) < 6000
            ]
            axes.loglog(dense, [8e-6 * law(update, h, m) for h, m in laws], color=colour, lw=1)
            axes.loglog(sizes[: len(kept)], kept, "o", color=colour, ms=5, label=update)
        axes.set_xticks(sizes, [str(s) for s in sizes], minor=False)
        axes.set_xticks([], minor=True)
        axes.set_xlabel("units h, at m = 10" if key == "units" else "outputs m, at h = 20")
        axes.grid(alpha=0.3)
    left.set_ylabel("covariance, MB")
    left.legend(frameon=False)
    figure.suptitle(
        "What the filters remember: kept (dots) and declared (lines); n = 3, axis-aligned", fontsize=10
    )
    figure.savefig(path)


def law(update: str, h: float, m: float, n: int = 3) -> float:
    """Numbers in the covariance of each rule, with p = 2n numbers a shape and an affine tail."""
    p, p_t = 2 * n, 1 + n
    return {
        "full": (m * p_t + h * (m + p)) ** 2,
        "decoupled": (m * p_t) ** 2 + h * (m + p) ** 2,
        "shared": (p_t + h) ** 2 + (h * p) ** 2,
    }[update]


if __name__ == "__main__":
    if "--picture" in sys.argv:
        picture(Path(sys.argv[sys.argv.index("--picture") + 1]))
        sys.exit(0)
    sys.exit(main(only="filters"))
