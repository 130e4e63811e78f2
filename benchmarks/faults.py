"""A thousand faults of every kind in the midst of a touch: how soon there is no force, and how it comes back.

python -m benchmarks.faults [--quick] [--json]
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import formula_block, formula_pad
from benchmarks.fault_injection import FAULTS, FaultInjector, Outcome
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.errors import DeviceError
from palpate.runtime import LoopProcess
from palpate.runtime.touchable import touchable
from palpate.surrogates.memories import Relaxation

__all__ = ["tables"]

COUNT, KILLS = 1000, 10
SILENCE = 0.020  # s after which the double drops a force that isn't renewed, as Force Dimension's firmware is asked to


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` injects one fault of each kind and kills nothing."""
    count = len(FAULTS) if quick else COUNT
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    bodies = {
        "pad": formula_pad(),
        "block": formula_block(),
        "relaxing block": formula_block(Relaxation(((0.4, 0.1),))),
    }
    injectors = {name: FaultInjector(touchable(body), seed=7) for name, body in bodies.items()}
    names = list(injectors)
    for k in range(count):
        kind = list(FAULTS)[k % len(FAULTS)]
        held = kind == "outside"  # a pressed body has let go by then
        name = "pad" if held else names[(k // len(FAULTS)) % len(names)]
        outcomes[kind].append(injectors[name].inject(kind))
    if not quick:
        outcomes["process killed"] = list(_killed(KILLS))
    rows = [_row(kind, found) for kind, found in outcomes.items() if found]
    every = [outcome for found in outcomes.values() for outcome in found]
    injected = [outcome for outcome in every if outcome.kind != "process killed"]
    killed = [1e3 * (outcome.silence - SILENCE) for outcome in outcomes["process killed"]]
    longest = round(1e3 * max(o.silence for o in injected), 6)  # ms; a sum of ticks is rounded
    claims = [
        Claim("longest time with a force, ms", (longest,), 20.0, ".1f"),
        Claim("after a kill, beyond the device's own 20 ms, ms", (max(killed, default=0.0),), 1.0, ".1f"),
        Claim("faults without a record", (sum(not o.recorded for o in every),), 0, ".0f"),
        Claim("forces given back too early", (sum(not o.withheld for o in every),), 0, ".0f"),
        Claim("faults that nothing heals", (sum(not np.isfinite(o.back) for o in every),), 0, ".0f"),
    ]
    columns = (
        Column("kind", "fault"),
        Column("count", "injected"),
        Column("silence", "no force after at most, ms", ".1f"),
        Column("recorded", "recorded"),
        Column("withheld", "withheld until no energy"),
        Column("back", "felt again after, median, s", ".2f"),
        Column("healed", "healed by"),
    )
    title = f"{len(every)} faults in the midst of a touch{' (quick)' if quick else ''}"
    notes = (
        f"under a clock of its own, 1 kHz, a simulated hand on {', '.join(names)}; the device drops a force that "
        f"isn't renewed for {1e3 * SILENCE:.0f} ms; killed processes are real, on a double of Haply's service",
    )
    return [Table("faults", title, columns, rows, claims, notes)]


def _killed(count: int) -> Iterator[Outcome]:
    """Kill the real-time process in the midst of a touch, and start it again."""
    settings = SimulatorSettings(port=0, events=0, silence=SILENCE, frequency=1.0)
    with tempfile.TemporaryDirectory() as folder, HaplySimulator(settings) as service:
        path = formula_block().save(Path(folder) / "block.palpate")
        device = f"haply:ws://127.0.0.1:{service.port},events={service.events_port}"
        for _ in range(count):
            with LoopProcess(path, device=device) as loop:
                _until(lambda: service.force().any())
                os.kill(loop.pid, signal.SIGKILL)
                killed = time.monotonic()
                _until(lambda: not loop.alive)
                silence = service.lapses_at() - killed
                recorded = _ended(loop)
            ended = time.monotonic()
            with LoopProcess(path, device=device):
                _until(lambda: service.force().any())
                back = time.monotonic() - ended
            yield Outcome("process killed", silence, recorded, withheld=True, back=back, restarted=True)


def _ended(loop: LoopProcess) -> bool:
    """Whether the handle says that its process has ended."""
    try:
        loop.read()
    except DeviceError:
        return True
    return False


def _until(condition: Any) -> None:
    end = time.monotonic() + 30.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.0002)


def _row(kind: str, found: list[Outcome]) -> dict[str, Any]:
    return {
        "kind": kind,
        "count": len(found),
        "silence": 1e3 * max(o.silence for o in found),
        "recorded": sum(o.recorded for o in found),
        "withheld": sum(o.withheld for o in found),
        "back": float(np.median([o.back for o in found])),
        "healed": "restart" if found[0].restarted else "recovery",
    }


if __name__ == "__main__":
    sys.exit(main(only="faults"))
