"""The 1 kHz loop in its own process, moved by a scripted hand.

python -m benchmarks.runtime [--quick] [--json | --markdown]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.cases import BEAMS, touch_model
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.runtime import LoopProcess, LoopReport

__all__ = ["tables"]

DEVICE = "stroke:amplitude=0.06,frequency=1"  # m and Hz: most of the workspace, to both sides


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` runs one beam for half a second."""
    seconds, beams = (0.5, ("nylon",)) if quick else (3.0, BEAMS)
    reports = {beam: _run(beam, seconds, quick=quick) for beam in beams}
    claims = [
        Claim(f"{b}, CPU time of a tick, µs, median", (1e6 * r.work_p50,), 50, ".0f")
        for b, r in reports.items()
    ]
    return [
        Table(
            "runtime",
            f"Real-time process at 1 kHz for {seconds:g} s{quick_mark(quick)}, µs",
            (
                Column("beam", "beam"),
                Column("ticks", "ticks"),
                Column("work_p50", "CPU of a tick, median", ".0f"),
                Column("work_p99", "p99", ".0f"),
                Column("late_p50", "lateness, median"),
                Column("late_p99", "p99"),
                Column("late_p999", "p99.9"),
                Column("late_max", "largest"),
                Column("faults", "faults"),
            ),
            [_row(beam, report) for beam, report in reports.items()],
            claims,
            (
                f"device {DEVICE}; a tick is device → network → safety → device → shared memory",
                "granted by the system: "
                + ", ".join(f"{k} {v}" for k, v in next(iter(reports.values())).obtained.items()),
            ),
        )
    ]


def _run(beam: str, seconds: float, *, quick: bool) -> LoopReport:
    with tempfile.TemporaryDirectory() as folder:
        model = touch_model(beam, quick=quick).save(Path(folder) / f"{beam}.palpate")
        with LoopProcess(model, device=DEVICE) as loop:
            time.sleep(seconds)
        return loop.report()


def _row(beam: str, report: LoopReport) -> dict[str, Any]:
    return {
        "beam": beam,
        "ticks": report.ticks,
        "work_p50": 1e6 * report.work_p50,
        "work_p99": 1e6 * report.work_p99,
        "late_p50": _late(report.lateness_p50),
        "late_p99": _late(report.lateness_p99),
        "late_p999": _late(report.lateness_p999),
        "late_max": _late(report.lateness_max),
        "faults": ", ".join(f"{n} × {name}" for name, n in report.faults.items()) or "none",
    }


def _late(seconds: float) -> str:
    """In µs; the loop's histogram begins at 1 µs."""
    return f"{1e6 * seconds:.0f}" if seconds >= 1e-6 else "< 1"


if __name__ == "__main__":
    sys.exit(main(only="runtime"))
