"""Time and memory of one Newton iteration over the number of unknowns.

python -m benchmarks.touching_cost [--quick] [--json | --markdown]
python -m benchmarks.touching_cost docs/images/touching-cost.png      the picture, and nothing else
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table

__all__ = ["measured", "plot", "tables"]

SIZES = (
    0.010,
    0.0075,
    0.006,
    0.005,
    0.0042,
    0.0037,
)  # m, elements under the probe: up to about 60,000 unknowns
GIGABYTES = 24.0
REPEATS = 3


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` measures one small mesh."""
    forms = ("displacement",) if quick else ("displacement", "mixed")
    rows = [row for form in forms for row in _rows(form, (0.02,) if quick else SIZES)]
    largest = max(rows, key=lambda row: row["unknowns"])
    return [
        Table(
            "touching-cost",
            f"One Newton iteration over the number of unknowns{' (quick)' if quick else ''}",
            (
                Column("form", "form"),
                Column("size", "elements under the probe, mm", ".1f"),
                Column("unknowns", "unknowns"),
                Column("residual", "energy and residual, s", ".3f"),
                Column("tangent", "tangent assembled and factorised, s", ".2f"),
                Column("solve", "back-substitution, s", ".3f"),
                Column("memory", "peak memory, GB", ".2f"),
            ),
            rows,
            claims=(
                Claim(
                    f"peak memory in GB at {largest['unknowns']} unknowns",
                    (largest["memory"],),
                    GIGABYTES,
                    ".1f",
                ),
            ),
            notes=(
                *(_law(rows, form) for form in forms if not quick),
                "CPU times with one thread, each the least of three; memory is the largest resident size of a process "
                "that does nothing else; factorisation without its symbolic part, which is done once",
            ),
        )
    ]


def _law(rows: Sequence[dict[str, Any]], form: str) -> str:
    mine = [row for row in rows if row["form"] == form]
    unknowns = np.log([row["unknowns"] for row in mine])
    slopes = {
        key: float(np.polyfit(unknowns, np.log([row[key] for row in mine]), 1)[0])
        for key in ("residual", "tangent", "memory")
    }
    return (
        f"{form} form: the residual grows as N^{slopes['residual']:.2f}, the tangent as N^{slopes['tangent']:.2f}, "
        f"memory as N^{slopes['memory']:.2f}"
    )


def _rows(form: str, sizes: Sequence[float]) -> list[dict[str, Any]]:
    return [_in_own_process(form, size) for size in sizes]


def _in_own_process(form: str, size: float) -> dict[str, Any]:
    """Memory that one measurement has taken would count for the next."""
    command = [sys.executable, "-m", "benchmarks.touching_cost", "--measure", form, str(size)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return row


def measured(form: str, size: float) -> dict[str, Any]:
    """Times in s and peak memory in GB with elements of `size` m under the probe."""
    from benchmarks.touching import block, probe
    from palpate.physics.solid.opening import open_problem
    from palpate.physics.solid.system import sparse_solver

    poisson = 0.45 if form == "displacement" else 0.499
    problem = block(poisson, form).problem(probe(), element=size)
    model = open_problem(problem, sparse_solver(), 1e-9).model
    system, z = model.system, model.base
    model.set(np.array((0.05, 0.05, 0.06)))
    system.factorise(z)  # the symbolic part is done once, and left out below
    times = [_iteration(system, z) for _ in range(REPEATS)]
    residual, tangent, solve = np.min(times, axis=0)
    return {
        "form": form,
        "size": 1e3 * size,
        "unknowns": z.size,
        "residual": float(residual),
        "tangent": float(tangent),
        "solve": float(solve),
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,  # kB on Linux
    }


def _iteration(system: Any, z: np.ndarray) -> tuple[float, float, float]:
    """CPU seconds of energy and residual, of the tangent with its numeric factorisation, of one back-substitution."""
    began = time.process_time()
    system.potential(z)
    system.residual(z)
    evaluated = time.process_time()
    system.factorise(z)
    factorised = time.process_time()
    system.solve(np.ones(z.size))
    return evaluated - began, factorised - evaluated, time.process_time() - factorised


def plot(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Seconds and memory over unknowns, both axes logarithmic, as a PNG."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for form, marker in (("displacement", "o"), ("mixed", "s")):
        mine = [row for row in rows if row["form"] == form]
        unknowns = [row["unknowns"] for row in mine]
        for key, word, line in (("tangent", "tangent", "-"), ("residual", "residual", ":")):
            left.loglog(unknowns, [row[key] for row in mine], line, marker=marker, label=f"{form}, {word}")
        right.loglog(unknowns, [row["memory"] for row in mine], marker=marker, label=form)
    left.set(xlabel="unknowns", ylabel="CPU seconds, one thread", title="One Newton iteration")
    right.set(xlabel="unknowns", ylabel="GB", title="Peak memory")
    for axes in (left, right):
        axes.grid(visible=True, which="both", alpha=0.3)
        axes.legend()
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def _run(arguments: Sequence[str]) -> int:
    if arguments[:1] == ["--measure"]:
        print(json.dumps(measured(arguments[1], float(arguments[2]))))
        return 0
    if arguments and arguments[0].endswith(".png"):
        plot([row for form in ("displacement", "mixed") for row in _rows(form, SIZES)], Path(arguments[0]))
        return 0
    return main(arguments, only="touching_cost")


if __name__ == "__main__":
    sys.exit(_run(sys.argv[1:]))
