"""Faults put on purpose between hand, device, body and clock, and what the loop makes of each.

`FaultInjector` runs a loop under its own clock, with a simulated hand that presses the body again and again. In the
midst of a touch it injects one fault of `FAULTS` for a while, and watches what the device feels: how soon there is no
force, whether the fault was recorded with its time, whether the force stayed away until the hand was where the body
holds no energy, and when it came back. The device has a watchdog of its own, as hardware has: a force that isn't
renewed for 20 ms lapses.

A body that is to answer with faults, too, is made by `with_switch`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.devices.device import HARDWARE_PATIENCE, Sample, Traits
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError, UsageError
from palpate.runtime.loop import EDGE, Loop
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import Touchable

__all__ = ["FAULTS", "FaultInjector", "FaultyDevice", "Outcome", "with_switch"]


@dataclass(frozen=True)
class _Kind:
    """The fault that the loop is to record, and how long it is injected, s."""

    fault: Fault
    shortest: float = 0.001
    longest: float = 0.1


FAULTS: dict[str, _Kind] = {
    "position no number": _Kind(Fault.INPUT_NOT_FINITE),
    "position infinite": _Kind(Fault.INPUT_NOT_FINITE),
    "position missing": _Kind(Fault.DEVICE_ERROR),
    "source silent": _Kind(Fault.INPUT_STALLED, 0.025, 0.3),
    "source asleep": _Kind(Fault.INPUT_STALLED),
    "driver error": _Kind(Fault.DEVICE_ERROR),
    "force refused": _Kind(Fault.DEVICE_ERROR),
    "cable out": _Kind(Fault.DEVICE_LOST),
    "connection reset": _Kind(Fault.DEVICE_LOST),
    "safety event": _Kind(Fault.DEVICE_STOPPED),
    "out of reach": _Kind(Fault.IMPOSSIBLE_PLACE, 0.004),
    "leap": _Kind(Fault.IMPOSSIBLE_PLACE, 0.004),
    "to and fro": _Kind(Fault.IMPOSSIBLE_PLACE, 0.013, 0.05),
    "outside": _Kind(Fault.OUT_OF_REGION, 0.1, 0.2),
    "clock ahead": _Kind(Fault.CLOCK_JUMP, 0.001, 0.001),
    "clock back": _Kind(Fault.CLOCK_JUMP, 0.001, 0.001),
    "answer no number": _Kind(Fault.OUTPUT_NOT_FINITE),
    "answer fails": _Kind(Fault.EVALUATOR_ERROR),
    "answer shakes": _Kind(Fault.UNSTABLE, 0.3, 0.4),
    "stop command": _Kind(Fault.STOPPED),
    "stop switch": _Kind(Fault.STOPPED),
    "parent gone": _Kind(Fault.PARENT_GONE),
}
"""Kinds of fault by name. ``outside`` needs a body that is held: one that is pressed has let go by then."""

_RAISED: dict[str, Exception] = {
    "driver error": DeviceError("The driver failed, as asked."),
    "cable out": DeviceLostError("The cable is out, as asked."),
    "connection reset": ConnectionResetError("reset, as asked"),
    "safety event": DeviceStopError("The brake is on, as asked."),
}
_WATCHDOG = HARDWARE_PATIENCE - 1e-6  # s after which the device drops a force that isn't renewed
_LEAP = np.array([0.04, 0.0, 0.0])  # m, within the reach of the device
_ALTERNATION = np.array([0.004, 0.0, 0.0])  # m, from sample to sample
_FAR = np.array([0.0, 0.0, 0.9])  # m, beyond it
_DRIFT = 2.0  # m/s, along the hand's stroke: a motion that is possible
_FELT = 0.02  # N from which on the hand is in a touch
_SHAKEN, _HALF_SWING = 6.0, 10  # N and ticks, of an answer that shakes
_LONGEST = 20.0  # s of the injector's clock for a touch to begin, or a force to come back


class FaultyDevice:
    """A simulated hand whose driver can be made to fail by a `fault` of `FAULTS`, on a device with a watchdog."""

    def __init__(self, hand: SimulatedHand) -> None:
        self.hand, self.fault, self._turned = hand, "", False
        self.sample, self._place = Sample(), np.zeros(3)
        self.sample.holding = True
        self._now, self._written, self._since = -math.inf, -math.inf, 0.0

    @property
    def traits(self) -> Traits:
        """The hand's own."""
        return self.hand.traits

    def read(self, now: float) -> Sample:
        """Return the hand's sample, or what the fault makes of it."""
        fault, sample = self.fault, self.sample
        self._since = self._since + max(0.0, now - self._now) if fault else 0.0
        self._now = now
        if now - self._written >= _WATCHDOG:
            self.hand.write(np.zeros(3))  # the device's own watchdog
        true = self.hand.read(now)
        sample.asleep, sample.stop = fault == "source asleep", fault == "stop switch"
        if fault in _RAISED:
            raise _RAISED[fault]
        if fault == "source silent":
            return sample
        self._place[:] = true.position
        sample.position, sample.time = self._place, true.time
        if fault == "position no number":
            self._place[1] = math.nan
        elif fault == "position infinite":
            self._place[1] = -math.inf
        elif fault == "position missing":
            sample.position = None  # type: ignore[assignment]
        elif fault == "out of reach":
            self._place += _FAR
        elif fault == "leap":
            self._place += _LEAP
        elif fault == "to and fro":
            self._turned = not self._turned
            self._place += _ALTERNATION * self._turned
        elif fault == "outside":
            self._place[1] -= _DRIFT * self._since
        return sample

    def write(self, force: np.ndarray) -> None:
        """Push on the hand, unless the fault refuses it: then the last force stays, until the watchdog drops it."""
        if self.fault == "force refused":
            raise OSError("no room in the pipe, as asked")
        self._written = self._now
        self.hand.write(force)

    def push(self, now: float) -> float:
        """Return the force that the device exerts at `now`, N."""
        return 0.0 if now - self._written >= _WATCHDOG else float(np.linalg.norm(self.hand.push))

    def close(self) -> None:
        """Let go."""
        self.hand.close()


@dataclass
class _Switch:
    """A switch of what a body answers: itself where empty, or a fault of `FAULTS`."""

    fault: str = ""


class _SwitchedAnswer:
    """An elastic answer that fails as its switch says."""

    def __init__(self, answer: Any, switch: _Switch) -> None:
        self._answer, self._switch = answer, switch
        self.force, self.slope = answer.force, answer.slope
        self._calls = 0

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        if self._switch.fault == "answer fails":
            raise ValueError("as asked")
        self._answer(position, parameters)
        if self._switch.fault == "answer no number":
            self.force[0] = self.slope[0] = math.nan
        if self._switch.fault == "answer shakes":
            self._calls += 1
            self.force[1] = _SHAKEN * (-1.0) ** (self._calls // _HALF_SWING)

    @property
    def amplitude(self) -> float:
        """The answer's own, or no number."""
        return math.nan if self._switch.fault == "answer no number" else float(self._answer.amplitude)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._answer, name)


class _SwitchedEnergy:
    """A learnt energy whose answers in the loop fail as a switch says."""

    def __init__(self, energy: Any, switch: _Switch) -> None:
        self._energy, self._switch = energy, switch

    def evaluator(self, *, few: bool = False) -> _SwitchedAnswer:
        return _SwitchedAnswer(self._energy.evaluator(few=few), self._switch)

    def __getattr__(self, name: str) -> Any:
        if name in {"_energy", "_switch"}:
            raise AttributeError(name)
        return getattr(self._energy, name)


def with_switch(body: Touchable) -> tuple[Touchable, _Switch]:
    """Return a body that answers with faults where the switch beside it says so."""
    switch = _Switch()
    return replace(body, energy=_SwitchedEnergy(body.energy, switch)), switch


@dataclass(frozen=True)
class Outcome:
    """The outcome of one fault."""

    kind: str  # of `FAULTS`
    silence: float  # s from the onset until the device exerts no force
    recorded: bool  # the fault was counted, with its time
    withheld: bool  # the force stayed away until the body held no energy, and began there from zero
    back: float  # s from the end of the fault until the hand felt the body again; infinite where it never did
    restarted: bool = False  # that took a new loop

    @property
    def good(self) -> bool:
        """True where there was no force within 20 ms, a record, and a way back only from where nothing is stored."""
        soon = self.silence <= HARDWARE_PATIENCE + 1e-9  # a sum of ticks is rounded
        return soon and self.recorded and self.withheld and math.isfinite(self.back)


class FaultInjector:
    """A hand that presses a body again and again, and faults in the midst of it.

    The loop ticks at `rate`, Hz; `now` is the time of the injector's clock, s. The seed is that of the moments,
    durations and sizes of the faults. By default the hand presses the body once a second, to three quarters of its
    trained depth.
    """

    def __init__(
        self,
        body: Touchable,
        *,
        rate: float = 1000.0,
        seed: int = 0,
        settings: SimulatedSettings | None = None,
    ) -> None:
        self.body, self._switch = with_switch(body)
        radius = SimulatedHand.traits.radius
        self._workspace = body.workspace(radius)
        stroke = replace(SimulatedSettings(frequency=1.0), **body.stroke(self._workspace.scale))  # type: ignore[arg-type]
        self._settings = settings or stroke
        self._rate, self._period, self._edge = rate, 1.0 / rate, EDGE * radius
        self._rng = np.random.default_rng(seed)
        self.now, self._orphaned, self._opened, self._leaked = 100.0, False, False, False
        self._start()

    def _start(self) -> None:
        """Begin a loop, as a restart would."""
        self._orphaned, self._switch.fault = False, ""
        self.device, self._shared = FaultyDevice(SimulatedHand(self._settings)), Shared.private()
        self.loop = Loop(
            self.body,
            self.device,
            self._shared,
            self._workspace,
            Limits(self.device.traits.max_force),
            rate=self._rate,
            stiffness=self.body.stiffness_max,
            orphaned=lambda: self._orphaned,
        )

    def inject(self, kind: str) -> Outcome:
        """Wait for a touch, inject one fault, and wait until the hand feels the body again."""
        if kind not in FAULTS:
            raise UsageError(
                f"There is no fault {kind!r} to inject.", fix=f"Choose one of {', '.join(FAULTS)}."
            )
        known = FAULTS[kind]
        self._touch()
        self._idle(self._rng.uniform(0.0, 0.1))
        if not self.device.push(self.now) > _FELT:
            self._touch()
        before = self._shared.read_state().fault_counts[known.fault]
        self._set(kind)
        onset = self.now
        silence = self._pass_through(onset + self._rng.uniform(known.shortest, known.longest))
        self._clear(kind)
        state = self._shared.read_state()
        seen = any(fault is known.fault and time >= onset for time, fault in state.onsets)
        recorded = bool(state.fault_counts[known.fault] == before + 1 and seen)
        if kind == "parent gone":
            self._start()
        ended = self.now
        withheld = self._until_open()
        back = self._touch() - ended
        return Outcome(kind, silence, recorded, withheld, back, kind == "parent gone")

    def _set(self, kind: str) -> None:
        self.device.fault = self._switch.fault = kind
        if kind == "clock ahead":
            self.now += self._rng.uniform(0.021, 2.0)
        elif kind == "clock back":
            self.now -= self._rng.uniform(0.002, 2.0)
        elif kind == "stop command":
            self._shared.write_command(stop=True)
        self._orphaned = kind == "parent gone"

    def _clear(self, kind: str) -> None:
        self.device.fault = self._switch.fault = ""
        if FAULTS[kind].fault in {Fault.STOPPED, Fault.UNSTABLE}:
            self._shared.write_command(resume=True)

    def _tick(self) -> None:
        self.now += self._period
        self.loop.tick(self.now)

    def _idle(self, seconds: float) -> None:
        for _ in range(round(seconds * self._rate)):
            self._tick()

    def _pass_through(self, end: float) -> float:
        """Tick to the end of the fault; return how long the device still exerted a force, s.

        Between the onset and the first tick behind it no loop can act: a device holds its force for that long.
        """
        onset, silence = self.now, math.inf
        self._opened, self._leaked = False, False
        while self.now < end or self.now == onset:
            self._tick()
            if self._harmless:
                onset = self.now
            elif math.isinf(silence):
                gone = self.device.push(self.now) == 0.0 and not self.loop.open
                silence = self.now - onset if gone else math.inf
            else:
                self._watch()
        if math.isinf(silence):  # a refused force is taken back by the first that is not refused
            self.device.fault = ""
            self._tick()
            silence = self.now - onset if self.device.push(self.now) == 0.0 else math.inf
        return silence

    @property
    def _harmless(self) -> bool:
        """True where the fault has not begun yet: the hand isn't outside, and nothing has swung to and fro."""
        if self.device.fault == "outside":
            return bool(np.linalg.norm(self.loop.out.hand) <= self._edge)
        return self.device.fault == "answer shakes" and not self.loop.stop.stopped

    def _watch(self) -> None:
        """Note whether there is a force before the body may give one again, and where the hand is then."""
        push = self.device.push(self.now)
        if self.loop.open and not self._opened:
            self._opened, answer = True, self.loop.evaluator
            self._leaked |= answer.depth > answer.rest_zone or push > _FELT
        self._leaked |= push > 0.0 and not self._opened

    def _until_open(self) -> bool:
        """Wait for a force that may come back; return whether there was none before, and none stored then."""
        end = self.now + _LONGEST
        while self.now < end and not self._opened:
            self._tick()
            self._watch()
        return self._opened and not self._leaked

    def _touch(self) -> float:
        """Tick until the hand feels the body; return when, s; infinite where it never does."""
        end = self.now + _LONGEST
        while self.now < end:
            self._tick()
            if self.device.push(self.now) > _FELT:
                return self.now
        return math.inf
