"""A simulated hand on every device's profile, on four bodies: energy, force, rest; beside the loop without its control.

    python -m benchmarks.hand_drives [--quick] [--json]

Each run is the loop as it is, from the encoder to the force sent, for a minute of its own time, computed as fast as it
goes. The hand moves at random, or so as to shake, or goes after a recorded hand; then it presses and stays. The rival
is the same loop without the passivity controller, and without the limit of the felt stiffness. A second table has
sensors as they are: steps, noise, and samples that are older than their time says.
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
from palpate.devices.profiles import PROFILES, DeviceProfile
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.devices.trace_file import TraceWriter
from palpate.runtime.loop import Loop
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import Touchable, touchable
from palpate.surrogates import Surrogate

__all__ = ["Drive", "tables"]

SECONDS = 60.0
PACES = ((1000.0, 0.0), (200.0, 0.005))  # Hz, s of delay
SHAPES = ("random", "adversarial", "recorded")
RECORDED = 20.0  # s of the recorded touch, which is gone through over and over
PRESS = 2.0  # s: the second one counts
STEP = 1e-5  # m, of the encoder
CALM = 1e-3  # m/s, rms, of a hand at rest
SENSORS: dict[str, dict[str, float]] = {
    "steps of 10 µm": {"step": 1e-5},
    "steps of 55 µm": {"step": 5.5e-5},
    "steps of 100 µm": {"step": 1e-4},
    "noise of 5 µm": {"noise": 5e-6},
    "noise of 20 µm": {"noise": 2e-5},
    "noise of 50 µm": {"noise": 5e-5},
    "noise of 300 µm": {"noise": 3e-4},
    "jitter of 1 ms": {"noise": 5e-6, "jitter": 1e-3},
}
SENSED = 8.0  # s of each motion under a sensor
SPEED = 0.2  # m/s, more than this hand's: what a jitter makes an error of place
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
    sensed = [
        _sensed_row(name, body, pace, quick=quick)
        for name, body in bodies.items()
        if not body.holds
        for pace in (PACES[:1] if quick else ((1000.0, 0.0), (200.0, 0.0), (200.0, 0.005)))
    ]
    return [_table(rows, devices, seconds, quick=quick), _sensor_table(sensed, quick=quick)]


@dataclass(frozen=True)
class Sensed:
    """What a hand feels through a sensor as it is.

    Attributes
    ----------
    change : float
        Largest change of the force from tick to tick after the first second, N.
    air : float
        Largest force out of the body, N.
    stored, given : float
        The most that the hand had put in, and what it was given on balance, J.
    felt : float
        The largest stiffness that the hand feels, N/m.
    faults : int
        Ticks with a fault.
    """

    change: float
    air: float
    stored: float
    given: float
    felt: float
    faults: int

    @classmethod
    def of(
        cls,
        body: Touchable,
        pace: tuple[float, float],
        shape: str,
        seconds: float,
        sensor: dict[str, float],
        *,
        controlled: bool = True,
    ) -> Sensed:
        """Run the loop on a light device of 3 N for so many seconds of its own time."""
        rate, delay = pace
        space = body.workspace(0.1)
        stroke: dict[str, Any] = body.stroke(space.scale) or {}
        settings = SimulatedSettings(
            **{**stroke, "mass": 0.1, "grip_damping": 3.0, "frequency": 0.5, "shape": shape, "delay": delay, **sensor}
        )  # fmt: skip
        hand = SimulatedHand(settings)
        loop = Loop(
            *(body, hand, Shared.private(), space, Limits(3.0)),
            rate=rate,
            stiffness=body.stiffness_max,
            control=controlled,
        )
        inwards, reach = np.array([settings.x, settings.y, settings.z]), 0.1 * settings.amplitude
        before, change, air, lowest, faults = np.zeros(3), 0.0, 0.0, 0.0, 0
        for k in range(round(seconds * rate)):
            loop.tick(k / rate)
            faults += loop.fault is not Fault.NONE
            force = loop.out.force.copy()
            if k > rate:
                change = max(change, float(np.linalg.norm(force - before)))
            if hand.place @ inwards < -reach:
                air = max(air, float(np.linalg.norm(force)))
            before, lowest = force, min(lowest, hand.work)
        return cls(change, air, -lowest, hand.work, loop.bounds.felt, faults)


def _sensed_row(name: str, body: Touchable, pace: tuple[float, float], *, quick: bool) -> dict[str, Any]:
    seconds = 2.0 if quick else SENSED
    sensors = dict(list(SENSORS.items())[:2]) if quick else SENSORS
    shares, airs, given = [], [], []
    for shape in ("press", "sine"):
        clean = Sensed.of(body, pace, shape, seconds, {})
        for sensor in sensors.values():
            run = Sensed.of(body, pace, shape, seconds, sensor)
            error = max(sensor.get("noise", 0.0), sensor.get("step", 0.0), SPEED * sensor.get("jitter", 0.0))
            shares.append((run.change - clean.change) / (12.0 * run.felt * error))
            airs.append(run.air)
            given.append(run.given / (0.01 * run.stored + 1e-4))
    bare = Sensed.of(body, pace, "sine", seconds, {}, controlled=False)
    return {
        "body": name,
        "pace": f"{pace[0]:g} Hz, {1e3 * pace[1]:g} ms",
        "change": max(shares),
        "air": max(airs),
        "given": max(given),
        "bare": bare.given / (0.01 * bare.stored + 1e-4),
    }


def _sensor_table(rows: list[dict[str, Any]], *, quick: bool) -> Table:
    return Table(
        "hand-sensors",
        f"Sensors as they are, {len(SENSORS)} of them{' (quick: two)' if quick else ''}, held still and moving",
        (
            Column("body", "body"),
            Column("pace", "rate, delay"),
            Column("change", "change of the force beyond the clean run's, over 12 K σ", ".2f"),
            Column("air", "largest force in the air, N", ".1g"),
            Column("given", "energy given, over 1 % of what was put in + 0.1 mJ", ".2f"),
            Column("bare", "without the controller: the same", ".2f"),
        ),
        rows,
        [
            Claim("change of the force over 12 K σ", (max(r["change"] for r in rows),), 1.0, ".2f"),
            Claim("force in the air, N", (max(r["air"] for r in rows),), 1e-3, ".1g"),
            Claim("energy given over its bound", (max(r["given"] for r in rows),), 1.0, ".2f"),
        ],
        (
            "the worst of " + ", ".join(SENSORS),
            "σ is the larger of noise and step, K the stiffest touch in the hand; a device of 0.1 kg and 3 N",
            "a negative energy was taken from the hand",
        ),
    )


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
