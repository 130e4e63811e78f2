"""From a device's own axes to the hand's, and from the hand's few centimetres to the body's travel and back.

`HandFrame` turns what a device reports into x right, y up, z towards the user by one rotation, and keeps the offset
that a clutch leaves: while it is pressed the device moves and the hand in the body doesn't. `Workspace` scales.

Of a body held at a node or a patch the device's centre is the rest position of what is held; of a body pressed
anywhere it is a place of first contact. Solids stand upright: devices have y up and z towards the user, solids z up.
Positions are scaled, forces are not: the hand feels the body's own newtons, at a stiffness that is `scale` times the
body's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.devices.device import PLAIN_AXES, Axes
from palpate.errors import UsageError

__all__ = ["HandFrame", "Workspace"]

_ROUNDING = 1e-9  # largest error of R Rᵀ = 1 in a rotation

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

    def force_on_body(self, sent: np.ndarray, force: np.ndarray) -> None:
        """Write a force (3,) on the hand, N, into `force`, in the body's axes; undoes `force_on_hand`."""
        if not self.upright:
            force[:] = sent
            return
        force[0], force[1], force[2] = sent[0], -sent[2], sent[1]

    def felt(self, stiffness: float) -> float:
        """Return the stiffness (N/m) that the hand feels of a body's `stiffness` (N/m)."""
        return stiffness * self.scale


class HandFrame:
    """A device's own axes and the clutch, which leaves the `offset` (3,), m, that is added to the turned position.

    `axes` (3, 3), row by row, is a rotation that turns a vector of the device into x right, y up, z towards the user; a
    matrix that mirrors, stretches or shears is refused.
    """

    def __init__(self, axes: Axes = PLAIN_AXES) -> None:
        turn = np.array(axes, dtype=np.float64)
        if turn.shape != (3, 3) or not (
            np.abs(turn @ turn.T - np.eye(3)).max() < _ROUNDING and np.linalg.det(turn) > 0.0
        ):
            raise UsageError(
                f"A device's axes can't be {axes}.",
                why="They must be a rotation: orthonormal rows, and a determinant of +1.",
                fix="Give, row by row, where x right, y up and z towards the user lie in the device's own axes.",
            )
        self.offset = np.zeros(3)
        self._plain = axes == PLAIN_AXES
        self._turn, self._back = turn, np.ascontiguousarray(turn.T)
        self._clutched = False

    def to_hand(self, position: np.ndarray, hand: np.ndarray, *, clutched: bool) -> None:
        """Write the hand (3,), m, of a device's position (3,), m, into `hand`; one with a clutch pressed stays."""
        if clutched or self._clutched:
            self._move_offset(position, hand)
            self._clutched = clutched
            return
        if self._plain:
            hand[:] = position
        else:
            np.dot(self._turn, position, out=hand)
        hand += self.offset

    def _move_offset(self, position: np.ndarray, hand: np.ndarray) -> None:
        np.dot(self._turn, position, out=self.offset)
        np.subtract(hand, self.offset, out=self.offset)

    def to_device(self, force: np.ndarray, sent: np.ndarray) -> None:
        """Write a force (3,) on the hand, N, into `sent`, in the device's axes."""
        if self._plain:
            sent[:] = force
        else:
            np.dot(self._back, force, out=sent)
