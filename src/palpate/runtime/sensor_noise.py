"""Noise of a position sensor, as it shows while a hand moves: what changes from sample to sample as no hand can.

A hand trembles by a tenth of a millimetre at 10 Hz and strokes by centimetres at 2 Hz; neither can be told from noise
by its size. Their sixth differences can: of a motion at ω they leave (2 sin ωT/2)⁶, at 200 Hz 0.1 µm of that tremor and
7 µm of an arm that shakes by 20 mm at 15 Hz, at 1 kHz nothing, while white noise of standard deviation σ grows to
√924 σ, 924 = Σ binomial(6, j)². The mean square over 50 ms is held like a peak and forgotten in a second. A single
sample counts at most nine times the mean, so that a glitch doesn't pass for noise.

Noise below a fifth of the sampling rate is not seen in this way, and steps of an encoder that is hardly moved are rare:
hence each device also states its noise and resolution, and the larger counts. A step h that is passed now and then is
as good as noise of h/√12.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.kernels import part

__all__ = ["NOISE_STATE", "forget_motion", "measure_noise"]

_VARIANCE, _MEAN, _COUNT, _DIFFERENCES = 0, 1, 2, 3
_ORDER = 6
NOISE_STATE = _DIFFERENCES + 3 * _ORDER  # numbers that `measure_noise` remembers
_GAIN = 924.0  # Σ binomial(6, j)²: of the variance of white noise in sixth differences
_WINDOW, _FEWEST = 0.05, 16  # s and samples, of the mean square
_MEMORY = 1.0  # s, in which a level that has passed is forgotten
_OUTLIER = 9.0  # of the mean square: more counts as this
_FLOOR = 1e-6  # m: levels below are as good as none, and from here on a level can grow


@part
def measure_noise(state, position, elapsed) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take a place (3,), m, into `state` (NOISE_STATE,); return the standard deviation along one axis, m."""
    square = 0.0
    for i in range(3):
        change = position[i]
        for order in range(_ORDER):
            k = _DIFFERENCES + 3 * order + i
            before = state[k]
            state[k] = change
            change -= before
        square += change * change
    if state[_COUNT] < _ORDER:
        state[_COUNT] += 1.0
        return math.sqrt(state[_VARIANCE])
    sample = square / (3.0 * _GAIN)
    mean = state[_MEAN]
    sample = min(sample, _OUTLIER * max(mean, _FLOOR * _FLOOR))
    mean += min(elapsed / _WINDOW, 1.0 / _FEWEST) * (sample - mean)
    state[_MEAN] = mean
    state[_VARIANCE] = max(mean, state[_VARIANCE] * max(0.0, 1.0 - elapsed / _MEMORY))
    return math.sqrt(state[_VARIANCE])


def forget_motion(state: np.ndarray) -> None:
    """Note that the next place has nothing to do with the last one; the level stays."""
    state[_COUNT] = 0.0
