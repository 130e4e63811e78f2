"""Solves per second: what warm starts and workers buy, and what starting the workers costs.

python -m benchmarks.sweep [--quick] [--json]
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np

import palpate
from benchmarks.runner import main
from benchmarks.table import Column, Table, quick_mark
from palpate.physics.beam.beam_presets import Preset, preset

__all__ = ["tables"]

WORKERS = 2
ROUNDS = 3
FINE = 200  # elements: about ten times the work of a solve


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` sweeps one beam with few solves, once."""
    nylon, three = preset("beam-nylon"), preset("beam-three-loads")
    fine = replace(
        nylon, name=f"beam-nylon, {FINE} elements", body=replace(nylon.body, elements=FINE), samples=201
    )
    sweeps = [replace(nylon, samples=51)] if quick else [nylon, three, fine]
    rounds = 1 if quick else ROUNDS
    return [
        Table(
            "sweep",
            f"Solves per second{quick_mark(quick)}",
            (
                Column("preset", "preset"),
                Column("how", "how"),
                Column("solves", "solves"),
                Column("seconds", "seconds", ".2f"),
                Column("rate", "solves / s", ".0f"),
                Column("ratio", "over the plain loop", ".2f"),
            ),
            [row for p in sweeps for row in _rows(p, rounds)],
            notes=(
                f"elapsed time, the shortest of {rounds} interleaved rounds: whatever else runs on the machine "
                "can only lengthen it",
                "cold: every solve from the undeformed beam; warm: from the last one's answer, in the order of "
                "the design; the elements are built once",
                "sweep: neighbours in one chunk, failures and provenance kept, answers labelled",
            ),
        )
    ]


def _rows(p: Preset, rounds: int) -> list[dict[str, Any]]:
    points = _points(p, p.samples)
    p.problem().solve(points[0])  # imports NGSolve: no part of either loop
    tried = [_round(p, points) for _ in range(rounds)]
    seconds = {how: min(t[how] for t in tried) for how in tried[0]}
    plain = next(iter(seconds.values()))
    return [
        {
            "preset": p.name,
            "how": how,
            "solves": len(points),
            "seconds": spent,
            "rate": len(points) / spent,
            "ratio": plain / spent,
        }
        for how, spent in seconds.items()
    ]


def _round(p: Preset, points: np.ndarray) -> dict[str, float]:
    """Seconds of each way, one after the other."""
    seconds = {
        "plain loop, cold": _serial(p, points, warm=False),
        "plain loop, warm": _serial(p, points, warm=True),
    }
    began = time.perf_counter()
    with palpate.local_cluster(WORKERS) as cluster:
        _swept(p, points, cluster)
        ready = time.perf_counter()
        _swept(p, points, cluster)
        running = time.perf_counter() - ready
    seconds[f"sweep, {WORKERS} workers, their start included"] = ready - began
    seconds[f"sweep, {WORKERS} running workers"] = running
    return seconds


def _points(p: Preset, solves: int) -> np.ndarray:
    """The preset's kind of design, of another size."""
    from palpate.sweeps import Space
    from palpate.sweeps.space import design_points

    return design_points(p.design, Space(p.problem().ranges), solves, 0)


def _serial(p: Preset, points: np.ndarray, *, warm: bool) -> float:
    began = time.perf_counter()
    solver = p.problem().open()
    for x in points:
        if not warm:
            solver.reset()
        if not solver.solve(x).converged:
            raise RuntimeError(f"{p.name} did not converge at {x}")
    return time.perf_counter() - began


def _swept(p: Preset, points: np.ndarray, cluster: Any) -> None:
    data = palpate.sweep(p.body, p.loads, points=points, cluster=cluster, progress=False)
    if not data.converged.all():
        raise RuntimeError(f"a solve of {p.name} did not converge")


if __name__ == "__main__":
    sys.exit(main(only="sweep"))
