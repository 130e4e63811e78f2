"""Round trips a second of the loop with a simulated Haply service, in lock step: one answer for each command.

python -m benchmarks.device_round_trips [--quick] [--json]
"""

from __future__ import annotations

import multiprocessing
import sys
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from benchmarks.cases import touch_model
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.runtime import LoopProcess

__all__ = ["tables"]

SECONDS = 60.0
RATES = (1000.0, 1200.0)  # Hz of the loop
WANTED = 1000.0  # round trips a second


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` takes one rate and half a second."""
    seconds, rates = (0.5, RATES[:1]) if quick else (SECONDS, RATES)
    rows = [_run(rate, seconds, quick=quick) for rate in rates]
    most = max(row["answers_per_second"] for row in rows)
    return [
        Table(
            "device-round-trips",
            f"The loop and a simulated Haply service for {seconds:g} s{' (quick)' if quick else ''}",
            (
                Column("rate", "loop, Hz", ".0f"),
                Column("ticks", "ticks"),
                Column("answers", "commands answered"),
                Column("answers_per_second", "a second", ".0f"),
                Column("work_p50", "CPU of a tick, µs, median", ".0f"),
                Column("work_p99", "p99", ".0f"),
                Column("faults", "faults"),
            ),
            rows,
            [Claim("wanted round trips over the most reached", (WANTED / most,), 1.0, ".3f")],
            (
                "a tick sends one command and takes one answer; the service is a process of its own, on websockets",
                "the CPU of a tick includes the device's transport",
            ),
        )
    ]


def _run(rate: float, seconds: float, *, quick: bool) -> dict[str, Any]:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    service = context.Process(target=_serve, args=(theirs,), daemon=True)
    service.start()
    device = ours.recv()
    with tempfile.TemporaryDirectory() as folder:
        model = touch_model("nylon", quick=quick).save(Path(folder) / "beam.palpate")
        with LoopProcess(model, device=device, rate=rate) as loop:
            begun, first = time.perf_counter(), _answers(ours)
            ticks = loop.read().tick
            time.sleep(seconds)
            answers, spent = _answers(ours) - first, time.perf_counter() - begun
            ticks = loop.read().tick - ticks
        report = loop.report()
    ours.send(None)
    service.join(10)
    return {
        "rate": rate,
        "ticks": ticks,
        "answers": answers,
        "answers_per_second": answers / spent,
        "work_p50": 1e6 * report.work_p50,
        "work_p99": 1e6 * report.work_p99,
        "faults": ", ".join(f"{n} × {name}" for name, n in report.faults.items()) or "none",
    }


def _answers(line: Connection) -> int:
    line.send("answers")
    return int(line.recv())


def _serve(line: Connection) -> None:
    """Run the service until None comes; answer everything else with the number of commands so far."""
    with HaplySimulator(SimulatorSettings(port=0, events=0)) as service:
        line.send(f"haply:ws://localhost:{service.port},events={service.events_port}")
        while line.recv() is not None:
            line.send(service.received)


if __name__ == "__main__":
    sys.exit(main(only="device_round_trips"))
