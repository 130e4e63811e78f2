"""Time of an exported body beside palpate's own compiled evaluator, in the same run.

    python -m benchmarks.export_speed [--quick] [--json]

Force and stiffness of a flat body of 320 units at 20,000 places in contact: the exported C, compiled by gcc and by
clang with -O3 -march=native as Numba compiles for this machine, and with -O2 for any; and a tick of an organ with a
memory over patches and a field of 4,000 nodes through 20 modes.
"""

from __future__ import annotations

import ctypes
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.export import export_c
from palpate.export.compilers import compile_c, find_compiler
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    FieldSurrogate,
    LearntEnergy,
    Surrogate,
    TouchedSurface,
)
from palpate.surrogates.energy_kernels import entry_of
from palpate.surrogates.fields import DepthAmplitude
from palpate.surrogates.memories import Patches, Relaxation
from palpate.units import Quantity, Range, bounds

__all__ = ["tables"]

UNITS, NODES, MODES, PATCHES = 320, 4000, 20, 100
SHARE, TICK = 0.6, 150.0  # of the compiled evaluator's time; µs
RADIUS, DEEPEST = 0.010, 0.008
INPUTS = (
    Range("c_x", -0.02, 0.02, "m"),
    Range("c_y", -0.02, 0.02, "m"),
    Range("c_z", RADIUS - DEEPEST, RADIUS, "m"),
)
BUILDS = (
    ("gcc", ("-O3", "-march=native")),
    ("gcc", ("-O2",)),
    ("clang", ("-O3", "-march=native")),
    ("clang", ("-O2",)),
)


def _surface(side: int) -> TouchedSurface:
    """Return a bowl-shaped hill 100 mm wide, or for one cell a side a plane."""
    x = np.linspace(-0.05, 0.05, side + 1)
    points = np.array([(a, b, -2.0 * (a * a + b * b) if side > 1 else 0.0) for a in x for b in x])
    k = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    low, up = np.stack([k, k + side + 1, k + 1], 1), np.stack([k + 1, k + side + 1, k + side + 2], 1)
    return TouchedSurface.of(points, np.vstack([low, up]), radius=RADIUS)


def _energy(surface: TouchedSurface) -> LearntEnergy:
    rng = np.random.default_rng(1)
    low, high = bounds(INPUTS)
    factors = np.tril(rng.normal(0.0, 0.3, (UNITS, 3, 3)))
    factors[:, np.arange(3), np.arange(3)] = rng.uniform(0.5, 1.5, (UNITS, 3))
    network = Network(
        INPUTS,
        (Quantity("ln U/U0"),),
        factors,
        np.einsum("kij,kj->ki", factors, rng.uniform(-1.2, 1.2, (UNITS, 3))),
        rng.normal(0.0, 0.01, (1, UNITS)),
        np.array([[10.0, 0.0, 0.0, -0.3]]),
        Scaling((low + high) / 2, (high - low) / 2, np.zeros(1), np.ones(1)),
    )
    baseline = ContactBaseline(ContactLaw("series", 1e-3), surface, RADIUS)
    region = TrainedRegion.of(rng.uniform(-1.0, 1.0, (512, 3)))
    return LearntEnergy(network, baseline, region, Continuation.of(INPUTS, deepest=DEEPEST))


def _organ() -> Surrogate:
    rng, surface = np.random.default_rng(2), _surface(12)
    points = np.column_stack([rng.uniform(-0.04, 0.04, (NODES, 2)), np.zeros(NODES)])
    points[:, 2] = -2.0 * (points[:, :2] ** 2).sum(axis=1)
    low, high = bounds(INPUTS)
    modes = np.linalg.qr(rng.normal(size=(NODES * 3, MODES)))[0].T.reshape(MODES, NODES, 3) * np.sqrt(NODES)
    network = Network.axis_aligned(
        INPUTS,
        [Quantity(f"b{k}", "m") for k in range(MODES)],
        centres=rng.uniform(-1, 1, (30, 3)),
        widths=np.ones((30, 3)),
        weights=rng.normal(size=(MODES, 30)),
        tail=rng.normal(size=(MODES, 4)),
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.zeros(MODES), np.full(MODES, 1e-3)),
    )
    field = FieldSurrogate(
        "displacement",
        "m",
        network,
        modes,
        np.zeros((NODES, 3)),
        points,
        np.array([[0, 1, 2]]),
        np.full(NODES, 1.0 / NODES),
        DepthAmplitude("series", DEEPEST, 1e-3),
        surface,
        RADIUS,
    )
    memory = Relaxation(((0.3, 0.05), (0.2, 0.5)), 1e-4, Patches(points[:PATCHES], 0.004, 1e-3, 0.003))
    return Surrogate(_energy(surface), {"displacement": field}, memory, {"name": "organ"})


_LOOP = """
#include "body.h"
void many(const double *X, int32_t count, double *out);
void many(const double *X, int32_t count, double *out) {
  int32_t i;
  for (i = 0; i < count; i++) body_force_jacobian(X + 3 * i, 0, out + 12 * i, out + 12 * i + 3);
}
"""
_TICKS = """
#include "organ.h"
void many(const double *X, int32_t count, double *out);
void many(const double *X, int32_t count, double *out) {
  static organ_state state;
  static organ_touch touch;
  static double values[organ_NODES * organ_COMPONENTS];
  int32_t i;
  organ_start(&state);
  for (i = 0; i < count; i++) {
    organ_step(&state, X + 3 * i, 0, 1e-3, out + 3 * i);
    organ_touched(X + 3 * i, 0, &touch);
    organ_shape(&touch, 0, organ_NODES, values);
  }
}
"""


def _compiled(
    thing: Surrogate, name: str, loop: str, compiler: str, options: tuple[str, ...], folder: Path
) -> Callable[[np.ndarray, int], None]:
    """Return a function that asks an exported body at places (N, 3), with so many numbers in each answer."""
    done = export_c(thing, folder, name=name, check=False)
    (folder / "loop.c").write_text(loop, "utf-8")
    path = find_compiler(compiler)
    assert path is not None
    more = (*options[1:], "-shared", "-fPIC")
    library = ctypes.CDLL(
        str(
            compile_c(
                path,
                [folder / "loop.c", *done.sources],
                folder / "body.so",
                options=more,
                optimise=options[0],
            )
        )
    )

    def ask(X: np.ndarray, width: int) -> None:
        out = np.empty((len(X), width))
        library.many(
            X.ctypes.data_as(ctypes.c_void_p), ctypes.c_int32(len(X)), out.ctypes.data_as(ctypes.c_void_p)
        )

    return ask


def _least(works: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Return the least time in s of each work, over rounds of all: another load of the machine strikes them alike."""
    times = np.full((rounds, len(works)), np.inf)
    for work in works:
        work()
    for row in times:
        for k, work in enumerate(works):
            start = time.perf_counter()
            work()
            row[k] = time.perf_counter() - start
    return [float(least) for least in times.min(axis=0)]


def tables(*, quick: bool) -> list[Table]:
    """Return the table of times."""
    count, rounds = (500, 2) if quick else (20_000, 15)
    low, high = bounds(INPUTS)
    X = np.random.default_rng(3).uniform(low, high, (count, 3))
    flat = Surrogate(_energy(_surface(1)), meta={"name": "body"})
    answers, inside = np.empty((count, 19)), np.empty(count, dtype=np.bool_)
    kernel, arguments = entry_of(flat.energy.baseline.compiled()).rows, flat.energy.compiled()
    ticks = X[: count // 10].copy()
    ticks[:, 2] -= 2.0 * (ticks[:, :2] ** 2).sum(axis=1)
    with tempfile.TemporaryDirectory() as folder:
        asked = _builds(flat, "body", _LOOP, Path(folder) / "body")
        works = [partial(kernel, X, answers, inside, *arguments)]
        works += [partial(ask, X, 12) for ask in asked.values()]
        own, *times = _least(works, rounds)
        touched = _builds(_organ(), "organ", _TICKS, Path(folder) / "organ")
        organ = _least([partial(ask, ticks, 3) for ask in touched.values()], rounds)
    rows: list[dict[str, object]] = [
        {"what": "force and stiffness, 320 units: Numba", "time": 1e6 * own / count, "share": 1.0}
    ]
    claims = []
    for words, each in zip(asked, times, strict=True):
        rows.append({"what": f"the same: {words}", "time": 1e6 * each / count, "share": each / own})
        claims.append(Claim(f"{words}, share of Numba's time", (each / own,), SHARE, ".2f"))
    for words, each in zip(touched, organ, strict=True):
        tick = 1e6 * each / len(ticks)
        rows.append({"what": f"tick of an organ: {words}", "time": tick})
        claims.append(Claim(f"tick of an organ, {words}, µs", (tick,), TICK, ".0f"))
    columns = (
        Column("what", "answer"),
        Column("time", "µs", ".1f"),
        Column("share", "of Numba's time", ".2f"),
    )
    notes = (
        "Numba compiles for the machine on which it runs, as -march=native does",
        "an organ: curved surface, 320 units, memory over 100 patches, and the field of 4,000 nodes through 20 modes",
    )
    name = f"An exported body in C99{quick_mark(quick)}"
    return [Table("export_speed", name, columns, rows, [] if quick else claims, notes)]


def _builds(
    thing: Surrogate, name: str, loop: str, folder: Path
) -> dict[str, Callable[[np.ndarray, int], None]]:
    """Return what asks an exported body, by the compiler and its options."""
    folder.mkdir()
    return {
        f"{compiler} {' '.join(options)}": _compiled(thing, name, loop, compiler, options, folder / str(k))
        for k, (compiler, options) in enumerate(BUILDS)
    }


if __name__ == "__main__":
    sys.exit(main(only="export_speed"))
