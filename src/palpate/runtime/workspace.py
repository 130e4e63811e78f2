"""A scaling from the hand's few centimetres to the body's travel and back.

Of a body held at a node or a patch the device's centre is the rest position of what is held; of a body pressed
anywhere it is a place of first contact. Solids stand upright: devices have y up and z towards the user, solids z up.
Positions are scaled, forces are not: the hand feels the body's own newtons, at a stiffness that is `scale` times the
body's.
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
    """A uniform scaling about the device's centre, and a quarter turn for bodies with z up.

    Attributes
    ----------
    radius : float
        Sphere that the hand can reach, m.
    scale : float
        Metres of body per metre of hand.
    centre : three floats
        The device's centre in the body's coordinates, m.
    upright : bool
        Whether the body's z is the hand's y: (x, y, z) of the body is (x, −z, y) of the hand.

    Raises
    ------
    UsageError
        If radius or scale is not positive.
    """

    radius: float
    scale: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    upright: bool = False

    def __post_init__(self) -> None:
        if not (0.0 < self.radius < math.inf and 0.0 < self.scale < math.inf):
            raise UsageError(
                f"A workspace of radius {self.radius:g} m at scale {self.scale:g} can't be touched.",
                why="The radius and the model's reach must be positive and finite.",
                fix="Give the device's workspace radius in metres, for example 0.075.",
            )

    @classmethod
    def for_reach(
        cls,
        radius: float,
        reach: float,
        *,
        centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
        upright: bool = False,
    ) -> Workspace:
        """Return the workspace of `radius` (m) whose 80 % is the body's `reach` (m)."""
        scale = reach / (_USED * radius) if radius > 0.0 else math.nan
        return cls(radius, scale, centre, upright)

    def to_body(self, hand: np.ndarray, position: np.ndarray) -> None:
        """Write the body position (3,) of a hand position (3,), both m, into `position`."""
        if not self.upright:
            np.multiply(hand, self.scale, out=position)
            return
        x, y, z = hand.tolist()
        scale, centre = self.scale, self.centre
        position[0] = centre[0] + scale * x
        position[1] = centre[1] - scale * z
        position[2] = centre[2] + scale * y

    def to_hand(self, position: np.ndarray) -> np.ndarray:
        """Return the hand position (3,) of a body position (3,), both m."""
        offset = (np.asarray(position) - self.centre) / self.scale
        return np.array([offset[0], offset[2], -offset[1]]) if self.upright else offset

    def force_on_hand(self, force: np.ndarray, sent: np.ndarray) -> None:
        """Write a force (3,) of the body's axes, N, into `sent`, in the device's."""
        if not self.upright:
            sent[:] = force
            return
        sent[0], sent[1], sent[2] = force[0], force[2], -force[1]

    def felt(self, stiffness: float) -> float:
        """Return the stiffness (N/m) that the hand feels of a body's `stiffness` (N/m)."""
        return stiffness * self.scale
