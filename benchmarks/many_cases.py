"""A sweep of very many small cases: cases per second, and the memory of the process that collects them.

    python -m benchmarks.many_cases [--quick] [--json] [--record]

Each case is a spring whose answer is a product, so that what is measured is the sweep: chains handed out by Dask, a
child process that solves, and parts on disk. The rival is the standard library's process pool with one task for a case,
which keeps nothing, survives no crash and can't go on.
"""

from __future__ import annotations

import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import psutil

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.dataset import Field, Layout
from palpate.sweeps import ExternalProblem, sweep
from palpate.units import Range

__all__ = ["tables"]

WORKERS = 2
CASES = 100_000
WANTED = 300.0  # cases/s
MEGABYTE = 1 << 20


def energy(x: np.ndarray) -> dict[str, float]:
    """Return the energy in J of a spring of 100 N/m, stretched by x (1,) in m."""
    return {"potential_energy": 50.0 * float(x[0]) ** 2}


def tables(*, quick: bool = False) -> list[Table]:
    """Return the table; `quick` takes a hundredth of the cases."""
    cases = CASES // 100 if quick else CASES
    ours, middle, end = _sweep(cases)
    rows = [
        {"what": "palpate sweep, kept on disk", "rate": ours, "middle": middle, "end": end},
        {"what": "concurrent.futures, a task for each case", "rate": _pool(cases)},
    ]
    claims = [
        Claim("s for each case", (1 / ours,), 1 / WANTED, ".2g"),
        Claim("memory at the end over that after a tenth of the cases", (end / middle,), 1.1, ".2f"),
    ]
    columns = [
        Column("what", f"{cases:,} cases on {WORKERS} processes"),
        Column("rate", "cases/s", ".0f"),
        Column("middle", "MB after a tenth", ".0f"),
        Column("end", "MB at the end", ".0f"),
    ]
    title = f"Very many cases{quick_mark(quick)}"
    return [Table("many_cases", title, columns, rows, [] if quick else claims)]


def _sweep(cases: int) -> tuple[float, float, float]:
    """Return cases/s, and the memory in MB of this process after a tenth of the cases and at the end."""
    problem = ExternalProblem(
        ranges=(Range("h", 0.0, 0.01, "m"),),
        layout=Layout(rest=np.zeros((1, 3))),
        schema=(Field("potential_energy", unit="J"),),
        function=energy,
    )
    process, seen = psutil.Process(), list[float]()

    def look(done: int, total: int) -> None:
        if not seen and done >= total // 10:
            seen.append(process.memory_info().rss / MEGABYTE)

    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        path = Path(folder) / "cases.zarr"
        sweep(problem, samples=cases, workers=WORKERS, progress=look, path=path)
        rate = cases / (time.perf_counter() - began)
    return rate, seen[0], process.memory_info().rss / MEGABYTE


def _pool(cases: int) -> float:
    """Return cases/s of the standard library's pool."""
    points = np.random.default_rng(0).uniform(0.0, 0.01, (cases, 1))
    began = time.perf_counter()
    with ProcessPoolExecutor(WORKERS) as pool:
        for _ in pool.map(energy, points):
            pass
    return cases / (time.perf_counter() - began)


if __name__ == "__main__":
    sys.exit(main(only="many_cases"))
