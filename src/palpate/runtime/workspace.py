"""From the hand's few centimetres to the body's travel and back.

The device's centre is the touched node's rest position and the axes are parallel. Positions are scaled,
forces are not: the hand feels the body's own newtons, at a stiffness that is `scale` times the body's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Workspace"]

_USED = 0.8  # share of the radius that the trained reach takes: the rest shows that the range has an end


@dataclass(frozen=True)
class Workspace:
    """A uniform scaling about the device's centre.

    Attributes
    ----------
    radius : float
        Sphere that the hand can reach, m.
    scale : float
        Metres of body per metre of hand.

    Raises
    ------
    UsageError
        If either is not positive.
    """

    radius: float
    scale: float

    def __post_init__(self) -> None:
        if not (0.0 < self.radius < math.inf and 0.0 < self.scale < math.inf):
            raise UsageError(
                f"A workspace of radius {self.radius:g} m at scale {self.scale:g} can't be touched.",
                why="The radius and the model's reach must be positive and finite.",
                fix="Give the device's workspace radius in metres, for example 0.075.",
            )

    @classmethod
    def for_reach(cls, radius: float, reach: float) -> Workspace:
        """Workspace of `radius` (m) whose 80 % is the model's `reach` (m)."""
        return cls(radius, reach / (_USED * radius) if radius > 0.0 else math.nan)

    def to_body(self, hand: np.ndarray, position: np.ndarray) -> None:
        """Write the body offset (3,) of a hand position (3,), both m, into `position`."""
        np.multiply(hand, self.scale, out=position)

    def to_hand(self, position: np.ndarray) -> np.ndarray:
        """Hand position (3,) of a body offset (3,), both m."""
        return np.asarray(position) / self.scale

    def felt(self, stiffness: float) -> float:
        """Stiffness (N/m) that the hand feels of a body's `stiffness` (N/m)."""
        return stiffness * self.scale
