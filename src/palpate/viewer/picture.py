"""From a published tick to what is drawn, including the way back to rest after the hand lets go.

While a hand holds the body, the drawn shape is the field network's under the loads that the loop published:
the picture and the force belong to one state. Released, the body feels no hand and the *force is zero*; the
loop knows no inertia, so the swing back is a drawing, not a result: the loads decay from their last value as
a lightly damped oscillator of one degree of freedom,

    s(t) = e^(−ζωt) (cos ω_d t + ζω/ω_d sin ω_d t),   ω_d = ω √(1 − ζ²),

and each drawn shape is the body's static shape under s(t) times the last loads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.surrogates import TouchModel

__all__ = ["Picture", "Shape", "swing"]

FREQUENCY = 2.0  # Hz, a pace that the eye can follow; the model's file holds no mass
DAMPING = 0.25  # of critical: at rest again within two seconds
STILL = 1e-3  # share of the last shape below which the body counts as at rest


def swing(elapsed: float) -> float:
    """Share s of the last loads, `elapsed` seconds after release: 1 at first with zero slope, 0 at last."""
    w = 2.0 * math.pi * FREQUENCY
    envelope = math.exp(-DAMPING * w * elapsed)
    if envelope < STILL:
        return 0.0
    root = math.sqrt(1.0 - DAMPING**2)
    return envelope * (math.cos(root * w * elapsed) + DAMPING / root * math.sin(root * w * elapsed))


@dataclass(frozen=True, eq=False)
class Shape:
    """A drawn shape.

    Attributes
    ----------
    displacement : (N, 3)
        m, of every node.
    contact : (3,)
        m, where the held node is drawn.
    """

    displacement: np.ndarray
    contact: np.ndarray


class Picture:
    """Remembers the last held state, and draws."""

    def __init__(self, model: TouchModel) -> None:
        self._model = model
        self._touched = np.array(model.touched, dtype=np.int64)
        self._low, self._high = bounds(model.inputs)
        self._loads = np.zeros(len(model.inputs))
        self._mirrored = False
        self._released = -math.inf

    def held(self, loads: np.ndarray, mirrored: bool, contact: np.ndarray, at: float) -> Shape:
        """The shape under the published loads (n,) at time `at` (s), while a hand holds the body."""
        self._loads, self._mirrored, self._released = loads.copy(), mirrored, at
        return Shape(self._model.displacement(loads, mirrored=mirrored), contact)

    def free(self, parameters: np.ndarray, at: float) -> Shape:
        """The shape at time `at` (s) without a hand, under the untouched loads (p,) alone."""
        share = swing(at - self._released)
        loads, mirrored = self._loads.copy(), self._mirrored
        loads[self._others()] = parameters
        if share < 0.0 and self._model.mirrors:
            share, mirrored = -share, not mirrored
        # a one-sided load of a body that doesn't mirror stops at its end of the range
        driven = np.clip(share * loads, np.minimum(self._low, 0.0), self._high)
        loads[self._touched] = driven[self._touched]
        displacement = self._model.displacement(loads, mirrored=mirrored)
        return Shape(displacement, displacement[self._model.touch_node])

    def _others(self) -> np.ndarray:
        return np.setdiff1d(np.arange(self._low.size), self._touched)
