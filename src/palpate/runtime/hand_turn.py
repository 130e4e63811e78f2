"""The turn of the hand: from what a device says of its handle to the inputs that turn a tool, and back as a torque.

A tool turns with the hand from where it was when the hand took hold. So it never leaps, and a hand that lets go and
takes hold again turns it on, as a clutch does. A turn that the tool was not trained for stays at the border of its
range.

    R_tool = R_hand R_hand(at hold)ᵀ R_tool(at hold)        w = log R_tool, beside the tool's fixed rotation

Where two components of w are inputs, w is the rotation about an axis in the body's x–y plane that brings the tool's own
axis where R_tool does.

Torques are those of a body that is drawn 1/scale times as large, as the force's arms are: τ/scale on the hand. Four
laws hold on every tick as they do for the force, see `safety`: limit, slew, ramp, and zero at once where the gate is
closed. A turn through an angle θ counts as a way of 50 mm · θ, and so the passivity controller and the watch on
oscillations are those of the force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from palpate.devices.device import Axes, Traits
from palpate.runtime.oscillation import OscillationWatch
from palpate.runtime.passivity import PassivityController
from palpate.runtime.safety import Limits, Safety
from palpate.surrogates.learnt_torque import TURNS
from palpate.tools.rotations import rotation_matrix, rotation_vector, swing_vector
from palpate.units import Range

__all__ = ["HandTurn", "TorqueOnHand", "rotation_of"]

LEVER = 0.05  # m from the handle's axis to the fingers: a turn counts as the way there
_NORM = 0.01  # by how much the length of a quaternion may differ from 1
_FASTEST, _LONGEST = 30.0, 0.01  # rad/s: no wrist turns faster; s of still samples that a leap may have
_SHORTEST = 1e-3  # s between two samples
_STILL = [0.0, 0.0, 0.0]
# cosine of how far from w = 0 a hand turns the tool, at most: beyond half a turn w would leap to the other side
_FARTHEST = math.cos(3.0)
_PATIENCE = 3  # impossible orientations in a row that are a fault
_UPRIGHT = np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
)  # hand's axes to those of a body with z up


def rotation_of(quaternion: np.ndarray, matrix: np.ndarray) -> bool:
    """Fill the rotation (3, 3) of a quaternion w, x, y, z; return whether it is one."""
    w, x, y, z = quaternion.tolist()
    size = w * w + x * x + y * y + z * z
    if not abs(size - 1.0) <= 2.0 * _NORM:  # not-a-number neither
        return False
    s = 2.0 / size
    matrix[0, 0], matrix[0, 1], matrix[0, 2] = (
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
    )
    matrix[1, 0], matrix[1, 1], matrix[1, 2] = (
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
    )
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = (
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    )
    return True


class HandTurn:
    """Orientation of the hand in the body's axes, checked; and the inputs by which it turns a tool.

    `angle` (3,), rad, sums the small turns of the hand since it took hold. `fault` says that the device reports
    impossible orientations, three in a row.
    """

    def __init__(self, axes: Axes, upright: bool, parameters: Sequence[Range], axis: np.ndarray) -> None:
        self.fault, self._doubts, self._since = False, 0, 0.0
        self.angle, self.tool = np.zeros(3), np.eye(3)
        turn = np.array(axes, dtype=np.float64)
        self._to_body = np.ascontiguousarray(_UPRIGHT @ turn if upright else turn)
        self._hand, self._new, self._held = np.eye(3), np.eye(3), False
        names = [r.name for r in parameters]
        self._inputs = [(names.index(name), k) for k, name in enumerate(TURNS) if name in names]
        self._ranges = [(parameters[i].low, parameters[i].high) for i, _ in self._inputs]
        self._axis = axis

    @classmethod
    def on(
        cls, traits: Traits, upright: bool, parameters: Sequence[Range], axis: np.ndarray
    ) -> HandTurn | None:
        """Return the turn of a hand on a device; None where that tells no turn."""
        if not traits.orients:
            return None
        return cls(traits.axes, upright, parameters, axis)

    @property
    def turns_tool(self) -> bool:
        """True where further inputs of the body turn its tool."""
        return bool(self._inputs)

    def see(self, quaternion: np.ndarray, elapsed: float, *, holding: bool) -> None:
        """Take an orientation w, x, y, z in the device's axes, `elapsed` s after the one before."""
        P = self._to_body
        self._since += elapsed
        whole = rotation_of(quaternion, self._new)
        new = P @ self._new @ P.T if whole else self._hand
        change, span = new @ self._hand.T, min(max(self._since, _SHORTEST), _LONGEST)
        step = rotation_vector(change)
        if not whole or (self._held and math.hypot(*step) > _FASTEST * span):
            self._doubts += 1
            self.fault = self._doubts >= _PATIENCE
            self._held = self._held and not self.fault
        else:
            self._doubts, self.fault = 0, False
            if self._held and holding:
                self.angle += step
                self._turn_tool(change)
            self._held = holding
        if self._doubts == 0 or (whole and self.fault):  # after a fault the newest one is believed again
            self._since = self._since if step == _STILL else 0.0
            self._hand[:] = new

    def _turn_tool(self, change: np.ndarray) -> None:
        """Turn the tool by a rotation (3, 3); not on beyond where its rotation vector is one and the same."""
        turned = change @ self.tool
        whole = len(self._inputs) == 3
        cosine = 0.5 * (float(turned.trace()) - 1.0) if whole else float(self._axis @ turned @ self._axis)
        if cosine > _FARTHEST:
            self.tool = turned

    def into(self, parameters: np.ndarray) -> None:
        """Put the turn into the further inputs (p,) that turn the tool; where nobody holds it, begin from them."""
        if not self._inputs:
            return
        if not self._held:
            w = [0.0, 0.0, 0.0]
            for number, k in self._inputs:
                w[k] = float(parameters[number])
            self.tool = rotation_matrix(np.array(w))
            return
        w = (
            rotation_vector(self.tool)
            if len(self._inputs) == 3
            else swing_vector(self._axis, self.tool @ self._axis)
        )
        for (number, k), (low, high) in zip(self._inputs, self._ranges, strict=True):
            parameters[number] = min(max(w[k], low), high)

    def torque_to_device(self, torque: np.ndarray, sent: np.ndarray) -> None:
        """Write a torque (3,) in the body's axes into `sent`, in the device's."""
        np.dot(self._to_body.T, torque, out=sent)


class TorqueOnHand:
    """The torque that a device renders: limited, ramped, passive, and zero with the gate closed.

    `torque` (3,), N m in the body's axes, is what is sent. Of a body whose energy changes with the turn (it `shares`
    it), what a hand puts in by one of force and torque may come back by the other: `work` and `way_work`, J, are what
    it has put in by turns and by ways, and each ledger compares itself with the energy less what went in by the
    other.
    """

    def __init__(self, max_torque: float, period: float, scale: float, mass: float, *, shares: bool) -> None:
        self.torque = np.zeros(3)
        self.work = self.way_work = 0.0
        self.shares = shares
        self._hand = np.zeros(3)
        self._scale = scale
        self._safety = Safety(Limits(max_torque), period, self.torque)
        self.passivity = PassivityController(period, max_force=max_torque / LEVER, mass=mass)
        self._watch = OscillationWatch(period, max_torque)
        self._place, self._force, self._wanted = np.zeros(3), np.zeros(3), np.zeros(3)
        self._last = np.zeros(3)

    @classmethod
    def by(
        cls, turn: HandTurn | None, max_torque: float, period: float, scale: float, mass: float
    ) -> TorqueOnHand | None:
        """Return the torque of a device whose hand's turn is known; None where it renders none."""
        if turn is None or not max_torque > 0.0:
            return None
        return cls(max_torque, period, scale, mass, shares=turn.turns_tool)

    def count_way(self, force: np.ndarray, hand: np.ndarray) -> None:
        """Count the work on the way to a hand's place (3,), m, of the force (3,), N, that was sent before."""
        a, b, c = force.tolist()
        x, y, z = (hand - self._hand).tolist()
        self.way_work -= a * x + b * y + c * z
        self._hand[:] = hand

    def send(
        self, wanted: np.ndarray, angle: np.ndarray, elapsed: float, stored: float, *, gate: bool, free: bool
    ) -> bool:
        """Renew `torque` from that of the tool (3,), N m, at the hand's `angle` (3,), rad; return False if it swings.

        `stored` is the energy that the body holds, J; that of one that does not change with the turn gives none back.
        """
        np.divide(wanted, self._scale, out=self._wanted)
        x, y, z = (angle - self._last).tolist()
        a, b, c = self.torque.tolist()
        self.work -= a * x + b * y + c * z
        self._last[:] = angle
        if not gate or not math.isfinite(self._wanted.sum()):
            self.stop()
            return True
        self._safety.apply(self._wanted, gate=True)
        np.multiply(angle, LEVER, out=self._place)
        np.divide(self.torque, LEVER, out=self._force)
        # one that states no energy is in debt by whatever it gives
        clamped, left = self.shares and self._safety.clamped, stored - self.way_work if self.shares else 0.0
        self.passivity.apply(self._place, self._force, elapsed, stored=left, clamped=clamped, free=free)
        if self.passivity.damping > 0.0:
            np.multiply(self._force, LEVER, out=self.torque)
        if self._safety.slew():
            np.divide(self.torque, LEVER, out=self._force)
            self.passivity.amend(self._force)
        if self._watch.see(self.torque, 0.0):
            self.stop()
            return False
        return True

    def stop(self) -> None:
        """Zero torque now; the next open gate ramps in again."""
        self._safety.stop()
        self.passivity.interrupt()
        self._watch.reset()
