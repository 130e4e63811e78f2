"""A study of CalculiX from its solves to a page and an FMU: errors, beside other libraries, and what each step costs.

    python -m benchmarks.bracket [--quick] [--json]

`bracket_study` writes the study, `palpate sweep` runs CalculiX for 60 solves to learn from and 40 to judge by; the
folder of the environment variable PALPATE_BRACKET keeps them for a later run. Then a scalar field of 20,000 nodes
through 20 modes is timed, and 60 made-up solves of as many nodes are learnt by a process of its own. Times are those of
the processor, whatever else the machine does.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.bracket_study import write_bracket
from benchmarks.field_rows import COLUMNS, field_rows, missing_note
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.export import export_fmu
from palpate.learning.dataset_answers import DatasetAnswers
from palpate.learning.fields import learn_modes
from palpate.viewer.file_page import export_html

__all__ = ["tables"]

NODES, MODES, CASES = 20_000, 20, 60
_LEARN = """
import json, re, sys, time
import palpate as pp
data = pp.Dataset.open(sys.argv[1])
began = time.process_time()
pp.learn(data)
peak = 1024 * int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])  # since this program began
print(json.dumps({"seconds": time.process_time() - began, "bytes": peak}))
"""


def tables(*, quick: bool = False) -> list[Table]:
    """Return errors of the bracket, and what its steps cost; without CalculiX the latter alone."""
    found = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(os.environ.get("PALPATE_BRACKET") or scratch)
        surrogate = None
        if shutil.which("ccx"):
            data, unseen = _solved(folder, quick)
            found.append(_errors(data, unseen, quick))
            surrogate, _ = pp.learn(data, name="bracket")
        found.append(_costs(surrogate, Path(scratch), quick))
    return found


def _solved(folder: Path, quick: bool) -> tuple[pp.Dataset, pp.Dataset]:
    samples, unseen = (20, 3) if quick else (60, 40)
    study, _ = write_bracket(folder, size=12.0 if quick else 4.2, samples=samples, unseen=unseen)
    subprocess.run([sys.executable, "-m", "palpate", "sweep", str(study)], check=True, capture_output=True)
    return pp.Dataset.open(folder / "bracket.zarr"), pp.Dataset.open(folder / "bracket-random.zarr")


def _errors(data: pp.Dataset, unseen: pp.Dataset, quick: bool) -> Table:
    solves, judged = DatasetAnswers.of(data), DatasetAnswers.of(unseen, to_learn=False)
    rows: list[dict[str, Any]] = []
    for name, part in solves.fields.items():
        truth = judged.fields[name].values
        given = (name, part.unit, solves.inputs, part.places, (solves.X, part.values), (judged.X, truth))
        rows += field_rows(*given, rivals=not quick)
    own = max(row["p95"] for row in rows if row["by"] == "palpate")
    claims = [Claim("the larger error at the 95th percentile", (own,), 0.01, ".2e")]
    title = (
        f"A bracket in CalculiX, {len(data.rest):,} nodes, {len(judged.X)} unseen solves{quick_mark(quick)}"
    )
    return Table("bracket", title, COLUMNS, rows, [] if quick else claims, () if quick else missing_note())


def _costs(surrogate: pp.Surrogate | None, scratch: Path, quick: bool) -> Table:
    """Return times, sizes and differences, each beside what was wanted."""
    rows: list[dict[str, Any]] = []

    def add(what: str, value: float, unit: str, wanted: float) -> None:
        rows.append({"what": what, "value": value, "unit": unit, "wanted": wanted})

    data = _made_up(2_000 if quick else NODES)
    path = scratch / "made-up.zarr"
    data.save(path)
    done = subprocess.run(
        [sys.executable, "-c", _LEARN, str(path)], check=True, capture_output=True, text=True
    )
    told = json.loads(done.stdout.splitlines()[-1])
    solves = DatasetAnswers.of(data)
    part = solves.fields["temperature"]
    given = {"inputs": solves.inputs, "places": part.places, "name": part.name, "modes_max": MODES}
    shown = learn_modes(solves.X, part.values, **given).field
    x = solves.X[3].copy()
    words = f"{len(part.places):,} nodes"
    add(f"a field, {words} through {len(shown.modes)} modes", _micros(shown.evaluator(), x), "µs", 100.0)
    add("its coefficients, as quantities", _micros(shown.network.evaluator(), x), "µs", 5.0)
    add(f"palpate learn, {CASES} cases of {words}", told["seconds"], "s", 30.0)
    add("its memory at most", told["bytes"] / 1e9, "GB", 1.0)
    if surrogate is not None:
        page = export_html(surrogate, scratch / "bracket.html")
        add("HTML of the bracket", page.file.stat().st_size / 1e6, "MB", 5.0)
        with contextlib.suppress(ImportError):
            import fmpy  # noqa: F401  # which runs the FMU

            fmu = export_fmu(surrogate, scratch / "bracket.fmu")
            assert fmu.comparison is not None
            worst = max(part.relative for part in fmu.comparison.parts.values())
            add("FMU of the bracket in FMPy, difference", worst, "of the largest", 1e-9)
    columns = [Column("what", "what"), Column("value", "measured", ".2g"), Column("unit", "unit")]
    columns.append(Column("wanted", "wanted at most", "g"))
    claims = [Claim(row["what"], (row["value"],), row["wanted"], ".2g") for row in rows]
    title = f"What fields and quantities cost{quick_mark(quick)}"
    return Table("answer_costs", title, columns, rows, [] if quick else claims, ())


def _micros(evaluator: Any, x: np.ndarray, repeats: int = 7) -> float:
    """Return the time of a call in µs, the least of some repetitions."""
    evaluator(x)
    return min(_timed(evaluator, x) for _ in range(repeats))


def _timed(evaluator: Any, x: np.ndarray, calls: int = 300) -> float:
    began = time.thread_time()
    for _ in range(calls):
        evaluator(x)
    return 1e6 * (time.thread_time() - began) / calls


def _made_up(nodes: int) -> pp.Dataset:
    """Return solves of four inputs whose temperature has many modes, and their mean."""
    from palpate.dataset import Field, Layout
    from palpate.sweeps import ExternalProblem, Space, sobol

    names = ("a", "b", "c", "d")
    ranges = tuple(pp.Range(name, 1.0, 2.0) for name in names)
    side = int(np.sqrt(nodes / 2))
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(0, 2, 2 * side), np.linspace(0, 1, side)))
    problem = ExternalProblem(
        ranges,
        Layout(np.column_stack([x, y, 0 * x]), triangles=np.array([[0, 1, 2 * side]])),
        (Field("temperature", ("node",), (len(x),), "K"), Field("mean", unit="K")),
        _Temperature(x, y),
        {"body": {"type": "made-up"}},
    )
    space = Space(ranges)
    return pp.sweep(problem, points=sobol(space, CASES, 0), workers=1, progress=False)


class _Temperature:
    """A hot spot whose place, width and height follow the inputs."""

    def __init__(self, x: np.ndarray, y: np.ndarray) -> None:
        self.x, self.y = x, y

    def __call__(self, inputs: np.ndarray) -> dict[str, Any]:
        a, b, c, d = inputs
        field = d * np.exp(-((self.x - 0.4 * a) ** 2 + (self.y - 0.3 * b) ** 2) / (0.4 * c) ** 2)
        return {"temperature": field, "mean": field.mean()}


if __name__ == "__main__":
    sys.exit(main(only="bracket"))
