"""The last word on every force: how large, how sudden, and whether at all.

Inside the loop nothing raises: a fault is a value (`Fault`), and the force is zero. Three laws hold on every tick,
whatever the model says:

- *limit*: ‖F‖ ≤ F_max; a larger force is shortened, never turned;
- *slew*: while the gate is open, ‖F_k − F_{k−1}‖ ≤ s T, T being the tick;
- *ramp-in*: after the gate opens (a grab, a start, the end of a fault) the force grows from zero over at
  least 50 ms, counted in ticks, so that a late tick can't shorten it.

A closed gate means zero at once: letting go of the motors is the safe direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from palpate.errors import UsageError

__all__ = ["HARDWARE_PATIENCE", "Fault", "Limits", "Safety", "stalled"]


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

    @property
    def meaning(self) -> str:
        """The fault in words, one line for people."""
        return _MEANINGS[self]


_MEANINGS = {
    Fault.NONE: "no fault",
    Fault.INPUT_NOT_FINITE: "the device reported a position that is not a finite number",
    Fault.OUTPUT_NOT_FINITE: "the model answered with a number that is not finite",
    Fault.INPUT_STALLED: "the input is older than its device allows, or the page is hidden",
    Fault.CLOCK_JUMP: "the clock jumped, or the process was suspended",
    Fault.DEVICE_ERROR: "the device driver reported an error",
    Fault.EVALUATOR_ERROR: "the model could not be evaluated",
    Fault.PARENT_GONE: "the process that started the loop has ended",
}


HARDWARE_PATIENCE = 0.020  # s without a fresh sample after which a motorised device gets zero force
_SHORTEST_RAMP = 0.050  # s
_RISE = 0.020  # s from zero to full force where no slew is given: a tenth of a reaction time


@dataclass(frozen=True)
class Limits:
    """Limits that protect a device and its user.

    Attributes
    ----------
    max_force : float
        Largest ‖F‖, N.
    slew : float
        Largest rate of change of the force, N/s; 0 chooses full force in 20 ms.
    ramp : float
        Time in which the force grows after a grab, s, at least 0.05.

    Raises
    ------
    UsageError
        If a limit is not a positive number, or the ramp too short.
    """

    max_force: float
    slew: float = 0.0
    ramp: float = _SHORTEST_RAMP

    def __post_init__(self) -> None:
        if not (0.0 < self.max_force < math.inf and 0.0 <= self.slew < math.inf):
            raise UsageError(
                f"A force limit of {self.max_force:g} N and a slew of {self.slew:g} N/s protect nobody.",
                fix="Give positive, finite limits.",
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
    """Applies the three laws, one tick at a time.

    Attributes
    ----------
    force : (3,)
        What may be sent, N; the array given, overwritten by each `apply`.
    clamped : bool
        Whether the force limit acted on the latest tick.
    """

    def __init__(self, limits: Limits, period: float, force: np.ndarray) -> None:
        self.force = force
        self.clamped = False
        self._max, self._step = limits.max_force, limits.slew * period
        self._rise = period / limits.ramp
        self._gain = 0.0
        self._was = (0.0, 0.0, 0.0)

    def apply(self, wanted: np.ndarray, *, gate: bool) -> None:
        """Turn the wanted force (3,), finite, N, into the one that may be sent; a closed gate sends zero."""
        if not gate:
            self.stop()
            return
        x, y, z = wanted.tolist()
        norm = math.hypot(x, y, z)
        self.clamped = norm > self._max
        share = self._gain * (self._max / norm if self.clamped else 1.0)
        self._gain = min(1.0, self._gain + self._rise)
        u, v, w = self._was
        dx, dy, dz = share * x - u, share * y - v, share * z - w
        change = math.hypot(dx, dy, dz)
        part = self._step / change if change > self._step else 1.0
        # both ends lie in the ball of radius F_max, and so does every point between them
        self._was = (u + part * dx, v + part * dy, w + part * dz)
        self.force[0], self.force[1], self.force[2] = self._was

    def stop(self) -> None:
        """Zero force now; the next open gate ramps in again."""
        self.force[:] = 0.0
        self.clamped = False
        self._gain = 0.0
        self._was = (0.0, 0.0, 0.0)


def stalled(now: float, seen: float, patience: float) -> bool:
    """Return whether an input last heard of at `seen` (s) is older than `patience` (s); true if a time is NaN."""
    return not now - seen <= patience
