"""A simulated hand on every device's profile, on four bodies: energy, force, rest; beside the loop without its control.

    python -m benchmarks.hand_drives [--quick] [--json | --markdown]

Each run is the loop as it is, from the encoder to the force sent, for a minute of its own time, computed as fast as it
goes. The hand moves at random, or so as to shake, or goes after a recorded hand; then it presses and stays. The rival
is the same loop without the passivity controller, and without the limit of the felt stiffness.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import touch_model
from benchmarks.runner import main
from benchmarks.surrogate_cases import Case
from benchmarks.surrogate_measure import learnt
from benchmarks.table import Claim, Column, Table
from palpate.runtime.devices.profiles import PROFILES, DeviceProfile
from palpate.runtime.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.runtime.loop import Loop
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import Touchable, touchable
from palpate.runtime.trace_file import TraceWriter
from palpate.surrogates import Surrogate

__all__ = ["Drive", "tables"]

SECONDS = 60.0
PACES = ((1000.0, 0.0), (200.0, 0.005))  # Hz, s of delay
SHAPES = ("random", "adversarial", "recorded")
RECORDED = 20.0  # s of the recorded touch, which is gone through over and over
PRESS = 2.0  # s: the second one counts
STEP = 1e-5  # m, of the encoder
CALM = 1e-3  # m/s, rms, of a hand at rest
DEVICES = tuple({(p.radius, p.max_force): p for p in reversed(PROFILES.values())}.values())[::-1]


@dataclass(frozen=True)
class Drive:
    """What one run showed.

    Attributes
    ----------
    below : float
        How far the observed energy went below its bound, J; 0 where it never did.
    lowest : float
        The lowest observed energy, J.
    given : float
        Work of the force on the handle less what the device's own damping took, J: positive where the loop drives it.
    force : float
        Largest, over the profile's.
    speed : float
        Rms of the last half, m/s.
    felt : float
        The largest stiffness that the hand feels, N/m.
    faults : int
        Ticks with one.
    """

    below: float
    lowest: float
    given: float
    force: float
    speed: float
    felt: float
    faults: int

    @classmethod
    def of(
        cls,
        body: Touchable,
        device: DeviceProfile,
        pace: tuple[float, float],
        shape: str,
        seconds: float,
        *,
        file: str = "",
        controlled: bool = True,
    ) -> Drive:
        """Run the loop for so many seconds of its own time."""
        rate, delay = pace
        space = body.workspace(device.radius)
        settings: dict[str, Any] = body.stroke(space.scale) or {"amplitude": 0.4 * device.radius}
        hand = SimulatedHand(
            SimulatedSettings(
                **settings,
                shape="sine" if file else shape,
                file=file,
                delay=delay,
                step=STEP,
                seed=7,
                profile=device.name,
            )
        )
        loop = Loop(
            *(body, hand, Shared.private(), space, Limits(device.max_force)),
            rate=rate,
            stiffness=body.stiffness_max,
            override=not controlled,
            control=controlled,
        )
        force, faults, own, before = 0.0, 0, 0.0, hand.place.copy()
        squares = np.zeros(round(seconds * rate))
        for k in range(len(squares)):
            loop.tick(k / rate)
            force = max(force, math.hypot(*loop.out.force))
            faults += loop.fault is not Fault.NONE
            own += hand.traits.damping * float(((hand.place - before) ** 2).sum()) * rate
            before[:] = hand.place
            squares[k] = hand.velocity @ hand.velocity
        bound = -loop.bounds.felt * loop.passivity.leak
        lowest = loop.passivity.lowest
        return cls(
            below=max(0.0, bound - lowest),
            lowest=lowest,
            given=hand.work - own,
            force=force / device.max_force,
            speed=math.sqrt(squares[len(squares) // 2 :].mean()),
            felt=loop.bounds.felt,
            faults=faults,
        )


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` takes one body, two devices and a second."""
    seconds = 1.0 if quick else SECONDS
    bodies = {name: touchable(make(quick)) for name, make in list(BODIES.items())[: 1 if quick else None]}
    devices = DEVICES[:2] if quick else DEVICES
    with tempfile.TemporaryDirectory() as folder:
        file = _recording(next(iter(bodies.values())), Path(folder), 1.0 if quick else RECORDED)
        rows = [
            _row(name, body, pace, devices, seconds, file) for name, body in bodies.items() for pace in PACES
        ]
    return [_table(rows, devices, seconds, quick=quick)]


def _table(
    rows: list[dict[str, Any]], devices: tuple[DeviceProfile, ...], seconds: float, *, quick: bool
) -> Table:
    return Table(
        "hand-drives",
        f"A simulated hand on {len(devices)} devices, {seconds:g} s each{' (quick)' if quick else ''}",
        (
            Column("body", "body"),
            Column("pace", "rate, delay"),
            Column("stiffness", "stiffest touch, N/m", ".0f"),
            Column("felt", "felt, N/m", ".0f"),
            Column("lowest", "lowest E, mJ", ".2g"),
            Column("below", "below its bound, mJ", ".1g"),
            Column("given", "given to the handle, mJ", ".0f"),
            Column("force", "largest force over the limit", ".3f"),
            Column("speed", "rms speed at rest, mm/s", ".2g"),
            Column("bare_given", "without control: given, mJ", ".0f"),
            Column("bare_speed", "rms speed at rest, mm/s", ".2g"),
        ),
        rows,
        _claims(rows),
        (
            "the worst of all devices and of the drives "
            + ", ".join(SHAPES)
            + "; at rest: a press, last half",
            "given: work of the loop's force on the handle, less what the device's own damping took",
            "devices: " + ", ".join(d.name for d in devices) + f"; the encoder's step is {1e6 * STEP:.0f} µm",
            "without control: no limit of the felt stiffness, no passivity controller",
        ),
    )


def _recording(body: Touchable, folder: Path, seconds: float) -> str:
    """Record a hand that moves at random on the first body, at 1 kHz, and return the file."""
    path = folder / "hand.trace"
    hand = SimulatedHand(SimulatedSettings(shape="random", seed=11, step=STEP, amplitude=0.02))
    recorder = TickRecorder(Ring.private())
    space = body.workspace(hand.traits.radius)
    loop = Loop(
        *(body, hand, Shared.private(), space, Limits(hand.traits.max_force)),
        stiffness=body.stiffness_max,
        recorder=recorder,
    )
    recorder.ring.asked[()] = 1
    writer = TraceWriter(path, {})
    for k in range(round(seconds / loop.period)):
        loop.tick(k * loop.period)
        if k % 1000 == 999:
            writer.add_ticks(recorder.ring.take())
    writer.close({})
    return str(path)


def _row(
    name: str,
    body: Touchable,
    pace: tuple[float, float],
    devices: tuple[DeviceProfile, ...],
    seconds: float,
    file: str,
) -> dict[str, Any]:
    runs = {
        controlled: [
            Drive.of(
                *(body, device, pace, shape, seconds),
                controlled=controlled,
                file=file if shape == "recorded" else "",
            )
            for device in devices
            for shape in SHAPES
        ]
        for controlled in (True, False)
    }
    rests = {
        controlled: [
            Drive.of(body, device, pace, "press", PRESS, controlled=controlled) for device in devices
        ]
        for controlled in (True, False)
    }
    ours, bare = runs[True], runs[False]
    print(f"{name}, {pace[0]:g} Hz: done", file=sys.stderr, flush=True)
    return {
        "body": name,
        "pace": f"{pace[0]:g} Hz, {1e3 * pace[1]:g} ms",
        "stiffness": max(body.workspace(d.radius).felt(body.stiffness_max) for d in devices),
        "felt": max(r.felt for r in ours),
        "lowest": 1e3 * min(r.lowest for r in ours),
        "below": 1e3 * max(r.below for r in ours),
        "given": 1e3 * max(r.given for r in ours),
        "force": max(r.force for r in [*ours, *rests[True]]),
        "speed": 1e3 * max(r.speed for r in rests[True]),
        "faults": sum(r.faults for r in [*ours, *rests[True]]),
        "bare_given": 1e3 * max(r.given for r in bare),
        "bare_speed": 1e3 * max(r.speed for r in rests[False]),
    }


def _claims(rows: list[dict[str, Any]]) -> list[Claim]:
    def worst(key: str) -> float:
        return float(max(r[key] for r in rows))

    return [
        Claim("energy below its bound, mJ", (worst("below"),), 1e-6),
        Claim("energy given to the handle, mJ", (worst("given"),), 0.0, ".0f"),
        Claim("largest force over the profile's", (worst("force"),), 1.0 + 1e-12, ".3f"),
        Claim("rms speed at rest, mm/s", (worst("speed"),), 1e3 * CALM, ".2g"),
        Claim("ticks with a fault", (worst("faults"),), 0.0, ".0f"),
    ]


def _pressed(name: str, solves: int) -> Callable[[bool], Surrogate]:
    def make(quick: bool) -> Surrogate:
        case = Case.load(name)
        assert case is not None
        return learnt(case, 10 if quick else solves, 0.2 if quick else 1.0)

    return make


BODIES: dict[str, Callable[[bool], Surrogate]] = {
    "block": _pressed("block", 40),
    "layered": _pressed("layered", 40),
    "liver": _pressed("liver", 80),
    "nylon beam": lambda quick: touch_model("nylon", quick=quick),
}


if __name__ == "__main__":
    sys.exit(main(only="hand_drives"))
