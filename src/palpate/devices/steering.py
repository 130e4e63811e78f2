"""Hands that a stick or a puck steers: the control says a place or a velocity, and the hand follows it smoothly.

A control rests beside its zero. A dead zone takes that away, and what is left of its way is stretched over the whole
range, so that nothing jumps at the zone's edge. A low pass of 20 ms hides the control's steps.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["DeadZone", "SteeredHand"]

_SMOOTHING, _LONGEST_STEP = 0.020, 0.050  # s


class DeadZone:
    """One axis of a control: its range, brought to −1 … 1 or 0 … 1, and a zone around rest that counts as rest.

    `flat` is half the zone around rest that its driver states, in units of the range `lowest` to `highest`; `dead` the
    smallest dead zone, as a share of the way. A trigger is `one_sided`: it rests at its lowest value.
    """

    def __init__(
        self, lowest: float, highest: float, flat: float, dead: float, *, one_sided: bool = False
    ) -> None:
        span = max(highest - lowest, 1.0)
        self._rest = lowest if one_sided else (lowest + highest) / 2.0
        self._way = span if one_sided else span / 2.0
        self.dead = min(max(dead, flat / self._way), 0.9)

    def share(self, value: float) -> float:
        """Return where a raw value lies, −1 … 1, without the dead zone."""
        return min(1.0, max(-1.0, (value - self._rest) / self._way))

    def outside(self, size: float) -> float:
        """Return how far a share's size, 0 … 1, is out of the dead zone, 0 … 1."""
        return min(1.0, max(0.0, size - self.dead) / (1.0 - self.dead))

    def __call__(self, value: float) -> float:
        """Return a raw value as −1 … 1, continuous, 0 in the dead zone."""
        share = self.share(value)
        return math.copysign(self.outside(abs(share)), share)


class SteeredHand:
    """The hand in a sphere of `radius`, m, at the place or with the velocity that a control states.

    Its `position` (3,), m from the centre, is renewed in place. A control at its end means a place on the sphere, or a
    velocity of `speed`, m/s; zero makes the control a place.
    """

    def __init__(self, position: np.ndarray, radius: float, speed: float) -> None:
        self._position, self._radius, self._speed = position, radius, speed
        self._target, self._step, self._last = np.zeros(3), np.zeros(3), math.nan

    def move(self, x: float, y: float, z: float, now: float, *, centred: bool) -> None:
        """Move on to `now`, s, as a control at x, y, z, each −1 … 1, says; `centred` heads for the centre."""
        elapsed = now - self._last
        elapsed = min(elapsed, _LONGEST_STEP) if elapsed > 0.0 else 0.0  # none before the first move
        self._last = now
        target, step, radius = self._target, self._step, self._radius
        step[0], step[1], step[2] = x, y, z
        if self._speed > 0.0:
            step *= self._speed * elapsed
            target += step
        else:
            np.multiply(step, radius, out=target)
        if centred:
            target[:] = 0.0
        if (far := math.hypot(*target.tolist())) > radius:
            target *= radius / far
        np.subtract(target, self._position, out=step)
        step *= -math.expm1(-elapsed / _SMOOTHING)
        self._position += step
