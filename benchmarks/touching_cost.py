"""Time and memory of a solve over the number of unknowns.

python -m benchmarks.touching_cost [--quick] [--json]
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.machine import gigabytes
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from benchmarks.touching import HEIGHT, RADIUS, block, probe
from palpate.physics.solid.solid_model import open_problem
from palpate.physics.solid.solid_system import sparse_solver

__all__ = ["measured", "tables"]

SIZES = {  # m, elements under the probe: up to 60,000 unknowns and more
    "displacement": (0.010, 0.0075, 0.006, 0.0048, 0.0038, 0.003),
    "mixed": (0.010, 0.0075, 0.006, 0.0048, 0.0038),
}
COARSE = 2.5  # size of the elements elsewhere over that
DEPTHS = (0.002, 0.004, 0.006)  # m, of the samples: one column
GIGABYTES = 24.0
REPEATS = 3
FITTED = {"residual": "the residual", "tangent": "the tangent", "sample": "a sample", "memory": "memory"}


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` measures one small mesh."""
    sizes = {"displacement": (0.025,)} if quick else SIZES
    rows = [_in_own_process(form, size, quick) for form, each in sizes.items() for size in each]
    largest = max(rows, key=lambda row: row["unknowns"])
    laws = [_law([row for row in rows if row["form"] == form], form) for form in sizes if not quick]
    return [
        Table(
            "touching-cost",
            f"A solve over the number of unknowns{quick_mark(quick)}",
            (
                Column("form", "form"),
                Column("size", "elements under the probe, mm", ".1f"),
                Column("unknowns", "unknowns"),
                Column("residual", "energy and residual, s", ".3f"),
                Column("tangent", "tangent assembled and factorised, s", ".2f"),
                Column("factor", "of it the factorisation, s", ".2f"),
                Column("solve", "back-substitution, s", ".3f"),
                Column("sample", "a sample, s", ".1f"),
                Column("tangents", "tangents a sample", ".1f"),
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
                Claim("memory swapped out in GB, most", (max(row["swap"] for row in rows),), 0.0, ".1f"),
                Claim(
                    "share of samples that did not converge",
                    (1 - min(row["converged"] for row in rows),),
                    0.0,
                    ".0%",
                ),
            ),
            notes=(
                *laws,
                "CPU times with one thread, of single operations the least of three, factorisation without its "
                "symbolic part, which is done once; a sample: the mean of "
                "2, 4, 6 mm in the middle of the block, one after the other, with the "
                "tangents for the stiffness",
                "memory is the largest resident size of a process that does nothing else; ν = 0.45 in displacement "
                "form, 0.499 in mixed form; the mesh that is fine under all of it, elements elsewhere up to "
                f"{COARSE:g} times as large",
            ),
        )
    ]


def _law(rows: Sequence[dict[str, Any]], form: str) -> str:
    unknowns = np.log([row["unknowns"] for row in rows])
    slopes = {
        word: float(np.polyfit(unknowns, np.log([row[key] for row in rows]), 1)[0])
        for key, word in FITTED.items()
    }
    return f"{form} form, over N unknowns: " + ", ".join(
        f"{word} N^{slope:.2f}" for word, slope in slopes.items()
    )


def _in_own_process(form: str, size: float, quick: bool) -> dict[str, Any]:
    """Memory that one measurement has taken would count for the next."""
    depths = DEPTHS[:1] if quick else DEPTHS
    arguments = ["--measure", form, str(size), *map(str, depths)]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.touching_cost", *arguments],
        check=True,
        capture_output=True,
        text=True,
    )
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return row


def measured(form: str, size: float, depths: Sequence[float]) -> dict[str, Any]:
    """Times in s and peak memory in GB with elements of `size` m under the probe."""
    poisson = 0.45 if form == "displacement" else 0.499
    problem = block(poisson, form, coarse=COARSE * size).problem(probe(), element=size)
    return {
        "form": form,
        "size": 1e3 * size,
        **_operations(problem),
        **_samples(problem, depths),
        "memory": gigabytes("VmHWM"),  # ru_maxrss would count the parent's too, from before the exec
        "swap": gigabytes("VmSwap"),
    }


def _operations(problem: Any) -> dict[str, float]:
    """The least CPU seconds of each operation at rest, the sphere 2 mm deep."""
    model = open_problem(problem, sparse_solver(), 1e-9).model
    system, z = model.system, model.base
    model.set(np.array((0.05, 0.05, HEIGHT + RADIUS - 0.002)))
    system.factorise(z)  # the symbolic part is done once, and left out below
    ones = np.ones(z.size)
    return {
        "unknowns": z.size,
        "residual": _least(lambda: (system.potential(z), system.residual(z))),
        "tangent": _least(lambda: system.factorise(z)),
        "factor": _least(system._inverse.Update),
        "solve": _least(lambda: system.solve(ones)),
    }


def _least(operation: Any) -> float:
    seconds = []
    for _ in range(REPEATS):
        began = time.process_time()
        operation()
        seconds.append(time.process_time() - began)
    return min(seconds)


def _samples(problem: Any, depths: Sequence[float]) -> dict[str, float]:
    solver = problem.open()
    solver.solve((0.05, 0.05, HEIGHT + RADIUS + 0.001))  # off the body: what is done once is left out
    solver.reset()
    began = time.process_time()
    found = [solver.solve((0.05, 0.05, HEIGHT + RADIUS - depth)) for depth in depths]
    return {
        "sample": (time.process_time() - began) / len(depths),
        "tangents": float(np.mean([solution.iterations + 1 for solution in found])),
        "converged": float(np.mean([solution.converged for solution in found])),
    }


def _run(arguments: Sequence[str]) -> int:
    if arguments[:1] == ["--measure"]:
        print(json.dumps(measured(arguments[1], float(arguments[2]), [float(a) for a in arguments[3:]])))
        return 0
    return main(arguments, only="touching_cost")


if __name__ == "__main__":
    sys.exit(_run(sys.argv[1:]))
