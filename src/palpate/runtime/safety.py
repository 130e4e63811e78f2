"""The last word on every force: how large, how sudden, and whether at all.

Inside the loop nothing raises: a fault is a value (`Fault`), and the force is zero. Four laws hold on every tick,
whatever the model says:

- *limit*: ‖F‖ ≤ F_max; a larger force is shortened, never turned;
- *slew*: while the gate is open, ‖F_k − F_{k−1}‖ ≤ s T, T being the tick and F the force as sent, with all damping;
- *ramp-in*: after the gate opens (a grab, a start, the end of a fault) the force grows from zero over at
  least 50 ms, counted in ticks, so that a late tick can't shorten it;
- *heat*: where the device states a continuous force, the mean of ‖F‖² over ten seconds doesn't exceed its square;
  F is the force as sent, and `Safety.bearable_force` bounds damping, too.

The passivity controller adds its damping to `Safety.force` between `Safety.apply`, which limits what the body wants,
and `Safety.slew`, which bounds the change of all that is sent and so comes last.

A closed gate means zero at once: letting go of the motors is the safe direction. After a fault it opens again only
where the body holds no energy (`HandEvaluator.release`), and after a stop only when a person says so (`Stop`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from palpate.devices.hand_kind import HandKind
from palpate.errors import UsageError

__all__ = ["Fault", "Limits", "PlaceCheck", "Safety", "Stop", "stalled"]


class Fault(IntEnum):
    """Why the force is zero on this tick, or `NONE`.

    The numbers travel through the shared memory and the viewer's messages: append, never renumber.
    """

    NONE = 0
    INPUT_NOT_FINITE = 1
    OUTPUT_NOT_FINITE = 2
    INPUT_STALLED = 3
    CLOCK_JUMP = 4
    DEVICE_ERROR = 5
    EVALUATOR_ERROR = 6
    PARENT_GONE = 7
    OUT_OF_REGION = 8
    IMPOSSIBLE_PLACE = 9
    DEVICE_STOPPED = 10
    DEVICE_LOST = 11
    STOPPED = 12
    UNSTABLE = 13

    @property
    def meaning(self) -> str:
        """The fault in words, one line for people."""
        return _MEANINGS[self]

    def meaning_for(self, hand: HandKind) -> str:
        """Return the fault in words for whoever moves the hand."""
        return hand.silence if self is Fault.INPUT_STALLED else self.meaning


_MEANINGS = {
    Fault.NONE: "no fault",
    Fault.INPUT_NOT_FINITE: "the device reported a position that is not a finite number",
    Fault.OUTPUT_NOT_FINITE: "the model answered with a number that is not finite",
    Fault.INPUT_STALLED: "nothing was heard of the hand for longer than it may be silent",
    Fault.CLOCK_JUMP: "the clock jumped, or the process was suspended",
    Fault.DEVICE_ERROR: "the device driver reported an error",
    Fault.EVALUATOR_ERROR: "the model could not be evaluated",
    Fault.PARENT_GONE: "the process that started the loop has ended",
    Fault.OUT_OF_REGION: "the hand presses the body from outside the workspace",
    Fault.IMPOSSIBLE_PLACE: "the device reports places that its arm can't be at, or can't reach so fast",
    Fault.DEVICE_STOPPED: "the device's own safety has stopped it",
    Fault.DEVICE_LOST: "the device is no longer there",
    Fault.STOPPED: "stopped by a person",
    Fault.UNSTABLE: "the force swung to and fro faster than a hand moves: body, device and delay don't go together",
}


_SHORTEST_RAMP = 0.050  # s
_WARMING = 10.0  # s over which motors average the force; windings take longer, which is on the safe side
_WARM = 0.8  # share of the continuous force's square from which on the limit comes down
# count of impossible samples, and time of them, s, from which on they are a fault
_DOUBTS, _DOUBTFUL = 3, 0.015
# taken off the count for each believed sample: a line that spoils more than one sample in ten is broken
_LEAK = 0.1
_ACCELERATION = 150.0  # m/s²: fast hands stay below 100, and 12 N on a bare handle of 0.1 kg make 120
_NOISE = 3e-4  # m rms along each axis that every sensor is granted: several times that of any that is sold
_OUTLIER = 4.5  # times the rms along each axis: of the three axes together one in ten thousand is larger
_RISE = 0.020  # s from zero to full force where no slew is given: a tenth of a reaction time


@dataclass(frozen=True)
class Limits:
    """Limits that protect a device and its user."""

    max_force: float  # N, largest ‖F‖
    slew: float = 0.0  # N/s, largest rate of change of the force; 0 chooses full force in 20 ms
    ramp: float = _SHORTEST_RAMP  # s in which the force grows after a grab, at least 0.05
    # N, largest force that the motors bear for long; infinite where the device states none
    continuous: float = math.inf
    max_torque: float = math.inf  # N m, largest ‖τ‖ of a device that renders one, beside its own

    def __post_init__(self) -> None:
        positive = self.max_force > 0.0 and self.continuous > 0.0
        if not (positive and self.max_force < math.inf and 0.0 <= self.slew < math.inf):
            raise UsageError(
                f"A force limit of {self.max_force:g} N and a slew of {self.slew:g} N/s protect nobody.",
                fix="Give positive, finite limits.",
            )
        if not self.max_torque > 0.0:
            raise UsageError(
                f"A torque limit of {self.max_torque:g} N m is none.",
                fix="Give a positive one, or leave it out.",
            )
        if not _SHORTEST_RAMP <= self.ramp < math.inf:
            raise UsageError(
                f"A ramp-in of {self.ramp:g} s is too short.",
                why="A force that starts at once jerks the hand.",
                fix=f"Give at least {_SHORTEST_RAMP:g} s.",
            )
        if self.slew == 0.0:
            object.__setattr__(self, "slew", self.max_force / _RISE)


class Safety:
    """Applies the four laws, one tick at a time.

    `force` (3,), N, is what may be sent: the array given, overwritten by `apply` and, once damping was added, by
    `slew`. `clamped` says whether the force limit acted on the latest tick.
    """

    def __init__(self, limits: Limits, period: float, force: np.ndarray) -> None:
        self.force = force
        self.clamped = False
        self._max, self._step = limits.max_force, limits.slew * period
        self._rise = period / limits.ramp
        self._allowed, self._continuous = limits.max_force, limits.continuous
        self._cooling, self._heat = period / _WARMING, 0.0
        self._gain = 0.0
        self._was = (0.0, 0.0, 0.0)

    def apply(self, wanted: np.ndarray, *, gate: bool) -> None:
        """Turn the wanted force (3,), finite, N, into one within limit and ramp; a closed gate sends zero."""
        if self._continuous < self._max:
            self._warm()
        if not gate:
            self.stop()
            return
        x, y, z = wanted.tolist()
        norm = math.hypot(x, y, z)
        self.clamped = norm > self._allowed
        share = self._gain * (self._allowed / norm if self.clamped else 1.0)
        self._gain = min(1.0, self._gain + self._rise)
        self.force[0], self.force[1], self.force[2] = share * x, share * y, share * z

    def slew(self) -> bool:
        """Keep `force` within the slew of what was sent before; return whether it was changed by that."""
        x, y, z = self.force.tolist()
        u, v, w = self._was
        dx, dy, dz = x - u, y - v, z - w
        change = math.hypot(dx, dy, dz)
        if change <= self._step:
            self._was = (x, y, z)
            return False
        part = self._step / change
        # both ends lie in the ball of radius F_max, and so does every point between them
        self._was = (u + part * dx, v + part * dy, w + part * dz)
        self.force[0], self.force[1], self.force[2] = self._was
        return True

    @property
    def bearable_force(self) -> float:
        """Largest ‖F‖ that the device bears at the latest tick, N: less while its motors are warm."""
        return self._allowed

    def _warm(self) -> None:
        """Bring the limit down towards the continuous force as the motors get warm."""
        u, v, w = self.force.tolist()  # as sent
        self._heat += self._cooling * (u * u + v * v + w * w - self._heat)
        bearable = self._continuous**2
        spare = (bearable - self._heat) / ((1.0 - _WARM) * bearable)
        share = min(1.0, max(0.0, spare))
        self._allowed = self._continuous + share * (self._max - self._continuous)

    def stop(self) -> None:
        """Zero force now; the next open gate ramps in again."""
        self.force[:] = 0.0
        self.clamped = False
        self._gain = 0.0
        self._was = (0.0, 0.0, 0.0)


def stalled(now: float, seen: float, patience: float) -> bool:
    """Return whether an input last heard of at `seen` (s) is older than `patience` (s); true if a time is NaN."""
    return not now - seen <= patience


class PlaceCheck:
    """Doubts places that are finite but impossible: out of the arm's reach, too far from the last one, too sudden.

    A place is too sudden where it misses the place to which the motion so far leads by more than the acceleration of
    any hand explains, and more than the noise of a sensor does. So 4 mm to and fro from sample to sample are impossible
    at 1 kHz and at 200 Hz; noise of 0.3 mm rms and steps of 0.1 mm are not.

    A single bad sample is passed over. After a doubt, a place that is merely sudden is believed: a handle that hits its
    end stop is that once. Each doubt counts 1, each believed sample takes a tenth of one away, and a count of three is
    a fault: three bad samples in a row, or nine to and fro, and never one in eleven. 15 ms of doubts are a fault too.
    After three in a row the newest place is what the next one is compared with, so that an arm which was moved while
    nobody looked is believed again.

    No place is farther from the centre than `reach`, m, no handle faster than `speed`, m/s, and no two samples closer
    than `period`, s; every sensor is granted noise of 0.3 mm rms along each axis, or a larger `noise`, m. `doubts`
    counts the impossible samples in a row, 0 where the latest is believed; `fault` says whether they are too many.
    """

    def __init__(self, reach: float, speed: float, period: float, noise: float = 0.0) -> None:
        self.doubts, self.fault = 0, False
        self._reach, self._speed, self._period = reach, speed, period
        self._slack = _OUTLIER * max(noise, _NOISE)
        self.forget()

    def forget(self) -> None:
        """Begin anew: nobody holds the device."""
        self.doubts, self.fault, self._count = 0, False, 0.0
        self._last = self._velocity = (math.nan, math.nan, math.nan)
        # of the last sample; of the last believed one; from when on the hand may have been under way
        self._time = self._believed = self._near = -math.inf
        self._span, self._since = math.nan, 0.0  # s between the last two believed samples; when doubts began

    def see(self, x: float, y: float, z: float, time: float, now: float) -> None:
        """Take a finite place, m, of the time (s) that its sample bears, in the tick that began at `now`, s."""
        if time == self._time:  # the sample of the tick before
            self.fault = self.fault or (self.doubts > 0 and now - self._since > _DOUBTFUL)
            return
        u, v, w = self._last
        longest = self._speed * max(self._period, time - self._near)
        span = max(self._period, time - self._believed)
        self._time = time
        # no way is known from the first place
        far = math.hypot(x - u, y - v, z - w) > longest or math.hypot(x, y, z) > self._reach
        if far or (self.doubts == 0 and self._is_sudden(x, y, z, span)):
            self._near = time if far else self._near
            self._doubt(now)
            if self.doubts < _DOUBTS and not self.fault:
                return
            self._velocity = (math.nan, math.nan, math.nan)  # of a leap it says nothing
        else:
            self.doubts, self._count = 0, max(0.0, self._count - _LEAK)
            self.fault = self._count >= _DOUBTS
            self._velocity = ((x - u) / span, (y - v) / span, (z - w) / span)
        self._last, self._span = (x, y, z), span
        self._believed = self._near = time

    def _doubt(self, now: float) -> None:
        if not self.doubts:
            self._since = now
        self.doubts += 1
        self._count = min(self._count + 1.0, _DOUBTS + 1.0)
        self.fault = self.fault or self._count >= _DOUBTS or now - self._since > _DOUBTFUL

    def _is_sudden(self, x: float, y: float, z: float, span: float) -> bool:
        """Return whether a place, m, misses the one to which the last motion leads in `span`, s, by too much."""
        (u, v, w), (a, b, c) = self._last, self._velocity
        missed = math.hypot(x - u - span * a, y - v - span * b, z - w - span * c)
        ratio = span / self._span
        # of independent noise in the three samples that the miss is made of
        spread = math.sqrt(1.0 + (1.0 + ratio) ** 2 + ratio * ratio)
        return missed > _ACCELERATION * span * (span + self._span) / 2.0 + self._slack * spread


class Stop:
    """A person's stop: the force stays zero until the person resumes."""

    def __init__(self) -> None:
        self.stopped = False
        self._stops = self._resumes = 0

    def heed(self, stops: int, resumes: int, *, pressed: bool) -> None:
        """Take the counts of the commands so far, and whether a stop button of the device is pressed.

        Of a stop and a resume that arrive in one tick the stop counts: their order isn't known.
        """
        if pressed or stops != self._stops:
            self.stopped = True
        elif resumes != self._resumes:
            self.stopped = False
        self._stops, self._resumes = stops, resumes
