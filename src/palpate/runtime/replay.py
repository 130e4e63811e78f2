"""A recorded touch, felt again: the same loop, on the recorded samples and times, with the same or another body.

`Replay` builds the loop as it was recorded (device, axes, workspace, limits, stiffness limit), puts back what it
remembered as the recording began, and passes through the recorded ticks. On the same body every force comes out the
same to the last bit, on the processor and with the versions that recorded it; `Replayed` says so, or from which tick
on and by how much the forces differ.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.devices.device import NO_TORQUE, Sample, Traits
from palpate.devices.tick_record import BITS
from palpate.devices.trace_file import Trace, TraceWriter
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError, FileFormatError, UsageError
from palpate.runtime.loop import Loop
from palpate.runtime.recorder import machine_facts, model_facts
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared, now
from palpate.runtime.snapshot import restore
from palpate.runtime.swap import Swap, swap_between
from palpate.runtime.touchable import Touchable, load_touchable
from palpate.runtime.workspace import Workspace

__all__ = ["Replay", "ReplayDevice", "Replayed", "is_recorded_model", "loop_facts", "play"]

_CHUNK = 1000  # ticks that are written at once
# s before a replay that is looked at begins, and between two looks for a command at its end
_LEAD, _IDLE = 0.2, 0.02

_ERRORS: dict[int, type[DeviceError]] = {
    Fault.DEVICE_LOST: DeviceLostError,
    Fault.DEVICE_STOPPED: DeviceStopError,
}
_NEEDED = ("holds", "traits", "workspace", "body_stiffness", "limits", "rate", "override", "control",
           "dead_man", "parameters", "inputs")  # fmt: skip


def loop_facts(model: Touchable, loop: Loop, limits: Limits) -> dict[str, Any]:
    """Return what a replay must know of a loop before its first tick to build it anew, as JSON takes it."""
    traits, space = loop.device.traits, loop.workspace
    return {
        "name": model.name,
        "holds": model.holds,
        "parameters": [r.name for r in model.parameters],
        "friction": _coefficients(model),
        "inputs": [[r.name, r.low, r.high, r.unit] for r in model.inputs],
        "rate": loop.bounds.rate,
        "body_stiffness": loop.coupling.hardest,
        "override": loop.bounds.override,
        "control": loop.controlled or traits.damping is None,
        "dead_man": loop.dead_man,
        "limits": _stated(asdict(limits)),
        "workspace": asdict(space),
        "traits": _stated(asdict(traits)),
    }


def _stated(figures: dict[str, Any]) -> dict[str, Any]:
    """Leave out limits that nobody states: they are infinite, which JSON can't say, and so by default."""
    return {name: value for name, value in figures.items() if value != math.inf}


class ReplayDevice:
    """A device that says what a recorded one, of the same traits, said in the tick `row` of dtype `TICK`.

    `dead_man` tells whether a dead-man button was asked for; `sent` (3,) is the latest force, N, and `turned` (3,) the
    latest torque, N m, in the device's axes.
    """

    def __init__(self, traits: Traits, *, dead_man: bool = False) -> None:
        self.traits, self.row, self.dead_man = traits, None, dead_man
        self.sample, self.sent, self.turned = Sample(), np.zeros(3), np.zeros(3)

    row: Any

    def read(self, now: float) -> Sample:
        """Return the recorded sample; raise a DeviceError where the recorded driver failed."""
        row, sample = self.row, self.sample
        flags = int(row["flags"])
        if flags & BITS["read_failed"]:
            raise _ERRORS.get(int(row["fault"]), DeviceError)("The recorded device failed here.")
        sample.position[:] = row["sample_position"]
        if self.traits.orients:
            sample.orientation[:] = row["sample_orientation"]
        sample.time, sample.patience = float(row["sample_time"]), float(row["patience"])
        sample.holding = bool(flags & BITS["holding"])
        sample.clutched = bool(flags & BITS["clutched"])
        sample.asleep = bool(flags & BITS["asleep"])
        sample.buttons = 1 if self.dead_man and not flags & BITS["released"] else 0
        return sample

    def write(self, force: np.ndarray, torque: np.ndarray = NO_TORQUE) -> None:
        """Remember force (3,), N, and torque (3,), N m; raise a DeviceError where the recorded driver failed."""
        self.sent[:] = force
        self.turned[:] = torque
        if self.row is not None and int(self.row["flags"]) & BITS["write_failed"]:
            raise _ERRORS.get(int(self.row["fault"]), DeviceError)("The recorded device failed here.")

    def close(self) -> None:
        """Let go."""
        self.sent[:] = 0.0


class Replay:
    """A loop that goes through a recorded touch of at least one tick, with the recorded body or another.

    The recorded body (`same`) has its state put back, and the surrogates that took its place in the recording do so
    again: `successor` returns one for an event of the trace, or None; by default it is read from its recorded file,
    where that was or beside the trace. Another body lies as the recorded one did, so that the same motion reaches the
    same places, or with `own_workspace` as it would by itself. Ticks are published in `shared`, by default for nobody;
    commands of others are not heard. `loop` stands between two ticks; `device` is where it finds the hand. A body that
    is held where the recorded one was pressed is refused; a FileFormatError says that the recorded state doesn't fit
    the body, or that the trace doesn't say what its loop was.
    """

    def __init__(
        self,
        trace: Trace,
        model: Touchable,
        shared: Shared | None = None,
        *,
        same: bool = True,
        own_workspace: bool = False,
        successor: Callable[[Mapping[str, Any]], Touchable | None] | None = None,
    ) -> None:
        if not len(trace):
            raise UsageError(f"{trace.path.name} holds no tick.", why=" ".join(trace.notes))
        header = trace.header
        _require_loop(trace, model)
        if same:
            model = _rubbed(model, header)
        self.trace, self.model, self.same = trace, model, same
        traits = header["traits"]
        known = Traits(**traits | {"axes": _axes(traits["axes"])})
        self.device = ReplayDevice(known, dead_man=bool(header["dead_man"]))
        space = header["workspace"]
        workspace = Workspace(**space | {"centre": tuple(space["centre"])})
        if own_workspace:
            workspace = model.workspace(space["radius"])
        stiffness = float(header["body_stiffness"])
        self._commands = Shared.private()
        seen = shared or self._commands
        blocks: Any = SimpleNamespace(
            state=seen.state, indentation=seen.indentation, command=self._commands.command
        )
        self._orphaned, ring = False, Ring.private()
        ring.asked[()] = ring.begun[()] = 1  # what is recorded is compared with what was
        self._recorder = TickRecorder(ring)
        self.loop = Loop(
            model,
            self.device,
            blocks,
            workspace,
            Limits(**header["limits"]),
            rate=float(header["rate"]),
            stiffness=stiffness if same or not stiffness else model.stiffness_max,
            override=bool(header["override"]),
            control=bool(header["control"]),
            dead_man=bool(header["dead_man"]),
            orphaned=lambda: self._orphaned,
            recorder=self._recorder,
        )
        if same and trace.state is not None:
            restore(self.loop, trace.state)
        self._swaps: list[tuple[int, Swap]] = []
        self._missing: list[str] = []
        if same:
            self._prepare_swaps(successor or (lambda event: _recorded_successor(trace, event)))
        self._columns = _columns(header["parameters"], model)
        self._set = np.full(len(model.parameters), np.nan)

    def _prepare_swaps(self, successor: Callable[[Mapping[str, Any]], Touchable | None]) -> None:
        """Make the swaps that were recorded; where a surrogate is missing, it and those after it are left out."""
        body, first = self.model, int(self.trace.ticks["tick"][0])
        for event in self.trace.events:
            if event.get("kind") != "swap" or int(event.get("loop_tick", 0)) < first:
                continue
            new = None if self._missing else successor(event)
            if new is None:
                name = event.get("model", {}).get("file", "another surrogate")
                self._missing.append(
                    f"{name} answers from tick {event.get('loop_tick')} on, and is not there"
                )
                continue
            new = _rubbed(new, self.trace.header)
            stiffness = new.stiffness_max if self.loop.motors else 0.0
            swap = swap_between(body, new, seconds=float(event["seconds"]), stiffness=stiffness)
            self._swaps.append((int(event["loop_tick"]), swap))
            body = new

    def tick(self, k: int) -> None:
        """Pass through tick `k` of the trace."""
        row = self.device.row = self.trace.ticks[k]
        if self._swaps and self.loop.swap is None and int(row["tick"]) >= self._swaps[0][0]:
            self.loop.swap = self._swaps.pop(0)[1]
        for i, j in self._columns:
            self._set[i] = row["parameters"][j]
        known = self._commands.command.record["parameters"][: self._set.size]
        if not np.array_equal(self._set, known):
            self._commands.write_command(parameters=self._set)
        stopped = bool(int(row["flags"]) & BITS["stopped"])
        if stopped != self.loop.stop.stopped:
            self._commands.write_command(stop=stopped, resume=not stopped)
        fault = int(row["fault"])
        self._orphaned = fault == Fault.PARENT_GONE
        self.loop.tick(float(row["time"]), float(row["lateness"]), jumped=fault == Fault.CLOCK_JUMP)

    def run(self) -> Replayed:
        """Pass through all ticks, as fast as they can be computed, and compare them with the recorded ones."""
        ticks = self.trace.ticks.copy()
        for k in range(len(ticks)):
            self.tick(k)
            ticks[k] = self._recorder.record
        ticks["tick"] = self.trace.ticks["tick"]  # the replay counts its own
        return Replayed(self.trace, ticks, self.model.name, self.same, tuple(self._missing))


@dataclass(frozen=True, eq=False)
class Replayed:
    """The outcome of a replay."""

    trace: Trace  # what was recorded
    ticks: np.ndarray  # (N,) of dtype `TICK`, of the replay
    name: str  # of the body that answered in the replay
    same: bool = True  # that is the recorded one
    # surrogates, in words, that took over in the recording but not in the replay
    missing: tuple[str, ...] = ()

    @property
    def differing(self) -> np.ndarray:
        """Indices of the ticks whose force, force in the device's axes or fault has other bits."""
        old, new = self.trace.ticks, self.ticks
        other = new["fault"] != old["fault"]
        for name in ("force", "sent", "torque", "sent_torque"):
            other |= (
                np.ascontiguousarray(new[name]).view(np.int64)
                != np.ascontiguousarray(old[name]).view(np.int64)
            ).any(axis=1)
        return np.flatnonzero(other)

    @property
    def identical(self) -> bool:
        """True where every force is the recorded one to the last bit."""
        return not self.differing.size

    @property
    def largest(self) -> float:
        """Largest ‖ΔF‖, N."""
        return float(np.linalg.norm(self.ticks["force"] - self.trace.ticks["force"], axis=1).max(initial=0.0))

    @property
    def causes(self) -> tuple[str, ...]:
        """Reasons, in words, for which forces may differ: what is not as it was recorded."""
        header, here = self.trace.header, machine_facts()
        causes = [
            f"recorded with {name} {header[name]}, replayed with {here[name]}"
            for name in here
            if header.get(name) not in {None, here[name]}
        ]
        causes += self.missing
        if self.trace.lost:
            causes.append(f"the recording is without {self.trace.lost} ticks")
        if self.trace.state is None:
            causes.append("the recording doesn't hold what the loop remembered as it began")
        return tuple(causes)

    def __str__(self) -> str:
        count = len(self.ticks)
        if self.identical:
            return f"{count} ticks replayed on {self.name}: every force is the recorded one, to the last bit"
        first = int(self.differing[0])
        because = "".join(f"\n  {cause}" for cause in self.causes)
        return (
            f"{count} ticks replayed on {self.name}: {self.differing.size} forces differ, the first at tick "
            f"{int(self.ticks['tick'][first])} ({self.trace.time[first]:.3f} s), by up to {self.largest:.3g} N{because}"
        )

    def save(self, path: str | os.PathLike[str], model: str | os.PathLike[str]) -> None:
        """Write the replay as a trace of its own, a new file; `model` is the file of the body that answered."""
        header = dict(self.trace.header) | machine_facts()
        header |= {"name": self.name, "model": model_facts(model), "replay_of": self.trace.path.name}
        writer = TraceWriter(path, header)
        if self.same and self.trace.state is not None:
            writer.add_state(self.trace.state)
        for start in range(0, len(self.ticks), _CHUNK):
            writer.add_ticks(self.ticks[start : start + _CHUNK])
        writer.close({"ticks": len(self.ticks), "lost": self.trace.lost})

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as data for a program."""
        first = int(self.differing[0]) if self.differing.size else None
        return {
            "ticks": len(self.ticks),
            "identical": self.identical,
            "differing": int(self.differing.size),
            "first": first,
            "first_time": None if first is None else float(self.trace.time[first]),
            "largest_difference": self.largest,
            "causes": list(self.causes),
        }


def is_recorded_model(trace: Trace, model: str | os.PathLike[str]) -> bool:
    """Return whether a model's file is the one that was touched, by its checksum."""
    known = trace.header.get("model", {}).get("sha256")
    return bool(known) and known == model_facts(model)["sha256"]


def play(
    trace: Trace, model: Touchable, shared: Shared, orphaned: Callable[[], bool], *, same: bool = True
) -> None:
    """Go through a recorded touch at the pace at which it was recorded, for those who look at the shared memory.

    At its end nothing is held any more, and the last tick stands until a command ends it: of the commands only ``quit``
    is heard. `orphaned` returns whether the process that wanted the replay has ended; `same` says that the body is the
    recorded one.
    """
    replay = Replay(trace, model, shared, same=same)
    out, times, start = replay.loop.out, trace.time, now() + _LEAD
    out.offset = start - float(trace.ticks["time"][0])

    def wanted() -> bool:
        shared.command.fetch()
        return not (shared.command.record["quit"] or orphaned())

    for k in range(len(trace)):
        # in short sleeps: a recording may have a gap of hours, and the wish to quit is heard within it
        while (rest := start + float(times[k]) - now()) > 0.0 and wanted():
            time.sleep(min(rest, _IDLE))
        if not wanted():
            break
        replay.tick(k)
    replay.loop.end()
    while wanted():
        out.stay(now())
        time.sleep(_IDLE)


def _require_loop(trace: Trace, model: Touchable) -> None:
    """Refuse a trace that doesn't say what its loop was, or whose hand can't touch this body."""
    header = trace.header
    if missing := [name for name in _NEEDED if name not in header]:
        raise FileFormatError(
            f"{trace.path.name} can't be replayed.",
            why=f"It doesn't say {', '.join(missing)}: its loop had not begun, or another program wrote it.",
            fix="Record it anew.",
        )
    if bool(header["holds"]) != model.holds:
        how = "held" if header["holds"] else "pressed"
        raise UsageError(
            f"{model.name} can't be touched by this hand.",
            why=f"The recorded body was {how}, this one is {'held' if model.holds else 'pressed'}.",
            fix="Take a model of the same kind.",
        )


def _recorded_successor(trace: Trace, event: Mapping[str, Any]) -> Touchable | None:
    """Return the surrogate that took over, from its file, by its checksum; None where that is not there."""
    known = event.get("model", {})
    for place in (Path(known.get("path", "")), trace.path.parent / known.get("file", "")):
        if place.is_file() and model_facts(place)["sha256"] == known.get("sha256"):
            return load_touchable(place)
    return None


def _coefficients(model: Touchable) -> list[float] | None:
    """Return μ_k and μ_s of the tool on a body, zero without friction; None of one that is held."""
    law = model.friction
    if model.holds:
        return None
    return [0.0, 0.0] if law is None else [law.kinetic, law.static]


def _rubbed(model: Touchable, header: Mapping[str, Any]) -> Touchable:
    """Return a recorded body with the friction that its loop was asked for."""
    return model if header.get("friction") is None else model.with_friction(*header["friction"])


def _axes(rows: Any) -> Any:
    return tuple(tuple(float(value) for value in row) for row in rows)


def _columns(names: list[str], model: Touchable) -> tuple[tuple[int, int], ...]:
    """Return, for the model's further inputs that the recording has too, their place here and there."""
    return tuple((i, names.index(r.name)) for i, r in enumerate(model.parameters) if r.name in names)
