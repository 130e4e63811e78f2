"""The 1 kHz loop in its own process: moved by a scripted hand, and at rest where nobody touches.

python -m benchmarks.runtime [--quick] [--json]
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.cases import BEAMS, formula_block, touch_model
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.runtime import LoopProcess, LoopReport
from palpate.runtime.loop_report import percentile
from palpate.runtime.shared_state import now

__all__ = ["tables"]

DEVICE = "stroke:amplitude=0.06,frequency=1"  # m and Hz: most of the workspace, to both sides


def tables(*, quick: bool = False) -> list[Table]:
    """The tables; `quick` runs one beam for half a second."""
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
        ),
        _resting(2.0 if quick else 5.0, " (quick)" * quick),
    ]


def _resting(seconds: float, quick: str) -> Table:
    """CPU time of a loop that nobody touches, and its punctuality once a hand has come."""
    air = "simulated:shape=press,amplitude=0.05,y=1"  # 50 mm above the body
    with tempfile.TemporaryDirectory() as folder:
        model = formula_block().save(Path(folder) / "block.palpate")
        rows = [_rest("page", "page", model, seconds), _rest("simulated hand", air, model, seconds)]
        hand = SimulatorSettings(port=0, events=0, amplitude=-0.06, frequency=0.02)  # slowly up into the air
        with HaplySimulator(hand) as service:
            device = f"haply:ws://127.0.0.1:{service.port},events={service.events_port}"
            rows.append(_rest("Haply, double", device, model, seconds, settle=6.0))
    claims = [
        Claim(
            f"{row['device']}, share of a core at rest, %",
            (row["rest"],),
            10 if "double" in row["device"] else 5,
            ".1f",
        )
        for row in rows
    ]
    columns = (
        Column("device", "device"),
        Column("rate", "beats at rest, Hz", ".0f"),
        Column("rest", "share of a core at rest, %", ".1f"),
        Column("touched", "and touched, %", ".1f"),
        Column("late_p50", "lateness after rest, median, µs"),
        Column("late_p99", "p99, µs"),
        Column("first", "first force after the grab, ms", ".0f"),
    )
    notes = (
        "the loop's process alone, by the system's own account of its CPU time; a hand 50 mm above the body",
    )
    return Table("resting", f"The loop at rest, {seconds:g} s{quick}", columns, rows, claims, notes)


def _rest(name: str, device: str, model: Path, seconds: float, settle: float = 1.5) -> dict[str, Any]:
    with LoopProcess(model, device=device) as loop:
        time.sleep(settle)
        row: dict[str, Any] = {"device": name, "rest": _share(loop, seconds), "rate": loop.read().rate}
        row |= dict.fromkeys(("touched", "first"), float("nan")) | dict.fromkeys(("late_p50", "late_p99"), "")
        if device == "page":
            before, grabbed = loop.read().histogram, now()
            loop.shared.write_command(beat=grabbed + 60.0, grabbed=True, target=(0.0, -0.02, 0.0))
            while not (state := loop.read()).force.any():
                time.sleep(0.0005)
            row["first"] = 1e3 * (state.time - grabbed)
            row["touched"] = _share(loop, seconds)
            late = loop.read().histogram - before
            row["late_p50"], row["late_p99"] = _late(percentile(late, 0.5)), _late(percentile(late, 0.99))
        return row


def _share(loop: LoopProcess, seconds: float) -> float:
    """Share of a core that the loop's process takes for a while, %."""
    used, began = _used(loop.pid), now()
    time.sleep(seconds)
    return 100.0 * (_used(loop.pid) - used) / (now() - began)


def _used(pid: int) -> float:
    """CPU time of a process so far, s; Linux."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


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
