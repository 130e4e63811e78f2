"""Watch on a force that alternates faster than a hand can: the sign of a loop that has become unstable.

A hand presses and lets go at most six times a second, and its tremor, which is small, ends near 12 Hz: a force that
swings to and fro faster comes from the loop. What counts is the part of the force that changes faster than 10 Hz. Each
time it has turned round is a reversal, which weighs its size over a fifth of the device's largest force, from ½ to 4/3.
The weights are summed, and the sum is forgotten in 0.2 s. Four are too many: swings of a tenth of the largest force at
20 Hz, of a fifth at 10 Hz, of more at 7.5 Hz, or a few full ones in a row.

What a body answers to the noise of the sensor is no oscillation, up to six standard deviations, and at most half the
largest force.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["OscillationWatch"]

_CUTOFF = 10.0  # Hz: slower changes of the force are the hand's
_MEMORY = 0.2  # s in which the sum of the weights is forgotten
# shares of the device's largest force: the smallest swing that counts, and the one that weighs 1
_SMALLEST, _UNIT = 0.1, 0.2
# largest weight of one reversal, and sum of weights that is an oscillation
_HEAVIEST, _TOO_MANY = 4.0 / 3.0, 4.0
# a body's answer to noise counts as none up to so many standard deviations, and up to this share of the largest force
_PEAK, _MOST = 6.0, 0.5


class OscillationWatch:
    """Counts the reversals of the force that is sent, by weight; `count` forgets them in 0.2 s.

    `period` is the time of a tick, s, and `max_force` the largest ‖F‖ of the device, N.
    """

    def __init__(self, period: float, max_force: float) -> None:
        self.count = 0.0
        self._max = max_force
        self._share = period / (period + 1.0 / (2.0 * math.pi * _CUTOFF))
        self._keep = math.exp(-period / _MEMORY)
        self._slow = (0.0, 0.0, 0.0)
        self._swing = (0.0, 0.0, 0.0)

    def reset(self) -> None:
        """Begin anew, at zero force."""
        self.count = 0.0
        self._slow = self._swing = (0.0, 0.0, 0.0)

    def see(self, force: np.ndarray, answer: float) -> bool:
        """Take the force (3,), N, that a tick sent; return whether it oscillates.

        `answer` is the standard deviation of what the body answers to the sensor's noise, N.
        """
        x, y, z = force.tolist()
        a, b, c = self._slow
        share = self._share
        a, b, c = a + share * (x - a), b + share * (y - b), c + share * (z - c)
        self._slow = (a, b, c)
        x, y, z = x - a, y - b, z - c
        self.count *= self._keep
        size = math.hypot(x, y, z)
        if size >= max(_SMALLEST * self._max, min(_PEAK * answer, _MOST * self._max)):
            u, v, w = self._swing
            if x * u + y * v + z * w < 0.0:
                self.count += min(size / (_UNIT * self._max), _HEAVIEST)
            self._swing = (x, y, z)
        return self.count >= _TOO_MANY
