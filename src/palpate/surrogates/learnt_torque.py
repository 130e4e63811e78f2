"""Torque on a tool about its place, in N m.

The energy of a tool whose orientation stays does not tell its torque. It is learnt beside the energy, as the torque
per newton of force, a = τ/‖F‖ in m: this arm stays smooth where contact begins and both are zero, and no arm is longer
than the tool is wide. Beyond the trained ranges the arm stays that of their border.

The energy of a tool whose orientation is an input tells it. With the rotation vector w, which turns the tool after its
fixed rotation, a small turn φ of the tool is J(w) δw, J the left Jacobian of the rotations. So Jᵀ τ = −∂U/∂w. Where two
components of w are inputs, the torque about the tool's own axis is taken to be zero, as it is for a tool of revolution.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import for_rows, kernel
from palpate.network.network_kernels import point_into
from palpate.surrogates.arguments import rows_of
from palpate.surrogates.energy import LearntEnergy
from palpate.surrogates.learnt_quantities import LearntQuantities
from palpate.tools.rotations import SERIES
from palpate.units import Range, bounds

__all__ = [
    "ARM",
    "TURNS",
    "TorqueEvaluator",
    "TurnEvaluator",
    "torque_evaluator",
    "torque_of_slopes",
    "torques",
    "turn_inputs",
]

ARM = "arm"
"""Name of the learnt quantities that hold the torque per newton, m."""
TURNS = ("tip_rx", "tip_ry", "tip_rz")
"""Inputs that are components of the rotation vector by which a tool is turned, rad."""
_Three: TypeAlias = tuple[float, float, float]
STEP = 1e-4  # rad; the energy's third derivative by it leaves 1e-8 of the torque, its rounding 1e-12 of the energy


def turn_inputs(inputs: Sequence[Range]) -> tuple[int, ...]:
    """Return the numbers of the inputs that turn a tool, of tip_rx, tip_ry and tip_rz those that are there."""
    names = [r.name for r in inputs]
    return tuple(names.index(name) for name in TURNS if name in names)


def torques(energy: LearntEnergy, evaluator: Any, X: np.ndarray, name: str) -> np.ndarray:
    """Return τ (N, 3) in N m by an evaluator, at inputs X (N, n) of a tool; a body of that name without is refused."""
    if evaluator is None:
        raise UsageError(
            f"{name!r} tells no torque.",
            why="It was learnt from solves without one, such as those under a ball.",
            fix="Sweep under a pp.SurfaceTool, and learn from 20 solves or more.",
        )
    rows, found = rows_of(X, energy.inputs, "learnt body"), np.zeros((len(X), 3))
    for x, force, torque in zip(rows, energy.force(X), found, strict=True):
        evaluator(x[:3], x[3:], force)
        torque[:] = evaluator.torque
    return found


class TorqueEvaluator:
    """Torque by a learnt arm, one place at a time and without allocation: `torque` (3,), N m, is renewed by a call.

    One for a `few` places interprets the kernel.
    """

    def __init__(self, arm: LearntQuantities, *, few: bool = False) -> None:
        self.torque = np.zeros(3)
        self._ends, self._x = np.array(bounds(arm.inputs)), np.zeros(len(arm.inputs))
        self._network = arm.network.compiled()
        self._kernel = for_rows(_torque_into, 1) if few else _torque_into
        self(self._x[:3].copy(), self._x[3:].copy(), np.ones(3))  # compile now, not in the loop
        self.torque[:] = 0.0

    def __call__(self, position: np.ndarray, parameters: np.ndarray, force: np.ndarray) -> None:
        """Renew the torque at a place (3,) in m and further inputs (p,), where the tool feels a force (3,) in N."""
        self._kernel(position, parameters, force, self._ends, self._x, self.torque, self._network)


@kernel
def _torque_into(position, parameters, force, ends, x, torque, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill ‖F‖ a (3,) at a place (3,) and further inputs (p,), each within its `ends` (2, n); x (n,) is scratch."""
    size = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    if size == 0.0:
        for i in range(3):
            torque[i] = 0.0
        return
    for i in range(len(x)):
        value = position[i] if i < 3 else parameters[i - 3]
        x[i] = min(max(value, ends[0, i]), ends[1, i])
    point_into(x, torque, *net)
    for i in range(3):
        torque[i] *= size


class TurnEvaluator:
    """Torque by the energy's slopes along the turns: `torque` (3,), N m, is renewed by a call.

    The energy is asked by `energy`, a function of a place (3,) in m and further inputs (p,) that returns U in J;
    `turns` are the numbers of the further inputs that turn the tool, `rotation` (3, 3) its fixed rotation.
    """

    def __init__(
        self,
        energy: Callable[[np.ndarray, np.ndarray], float],
        turns: Sequence[int],
        names: Sequence[str],
        rotation: np.ndarray,
    ) -> None:
        self.torque = np.zeros(3)
        self._energy, self._turns = energy, tuple(turns)
        self._axes = [TURNS.index(name) for name in names]
        self._down = rotation[:, 2]
        self._w = np.zeros(3)

    def __call__(self, position: np.ndarray, parameters: np.ndarray, force: np.ndarray) -> None:
        """Renew the torque at a place (3,) in m and further inputs (p,), where the tool feels a force (3,) in N."""
        if not force.any():
            self.torque[:] = 0.0
            return
        slope, moved = np.zeros(3), parameters.copy()
        for number, axis in zip(self._turns, self._axes, strict=True):
            self._w[axis] = parameters[number]
            moved[number] = parameters[number] + STEP
            above = self._energy(position, moved)
            moved[number] = parameters[number] - STEP
            slope[axis] = (self._energy(position, moved) - above) / (2.0 * STEP)
            moved[number] = parameters[number]
        self.torque[:] = torque_of_slopes(slope, self._w, self._axes, self._down)


def torque_of_slopes(slope: np.ndarray, w: np.ndarray, axes: Sequence[int], down: np.ndarray) -> np.ndarray:
    """Return τ (3,) in N m of slopes −∂U/∂w (3,), those of `axes` being known, at a rotation vector w (3,).

    `down` (3,) is the tool's own axis before w turns it. Plain numbers take a quarter of an array's time in a tick.
    """
    a, b, c = w.tolist()
    square = a * a + b * b + c * c
    angle = math.sqrt(square)
    half = 0.5 * angle
    second = 0.5 * (math.sin(half) / half) ** 2 if half > 1e-8 else 0.5
    third = (angle - math.sin(angle)) / (square * angle) if angle >= SERIES else 1 / 6 - square / 120
    rest = 1.0 - third * square
    x = (rest + third * a * a, third * a * b + second * c, third * a * c - second * b)
    y = (third * a * b - second * c, rest + third * b * b, third * b * c + second * a)
    z = (third * a * c + second * b, third * b * c - second * a, rest + third * c * c)
    u, v, s = slope.tolist()
    if len(axes) < 3:
        i, j, k = down.tolist()
        first = math.sin(angle) / angle if angle > 1e-8 else 1.0
        stays, along = 1.0 - second * square, second * (a * i + b * j + c * k)
        z = (
            stays * i + first * (b * k - c * j) + along * a,
            stays * j + first * (c * i - a * k) + along * b,
            stays * k + first * (a * j - b * i) + along * c,
        )
        s = 0.0
    yz, zx, xy = _cross(y, z), _cross(z, x), _cross(x, y)
    size = x[0] * yz[0] + x[1] * yz[1] + x[2] * yz[2]
    return np.array([(u * yz[n] + v * zx[n] + s * xy[n]) / size for n in range(3)])


def _cross(p: _Three, q: _Three) -> _Three:
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def torque_evaluator(energy: LearntEnergy, arm: LearntQuantities | None, *, few: bool = False) -> Any:
    """Return the evaluator of an energy's torque: by a learnt arm, by turns among its inputs, or None of neither.

    One for a `few` places waits for no compiler.
    """
    if arm is not None:
        return TorqueEvaluator(arm, few=few)
    felt = len(energy.inputs) - len(energy.parameters)
    turns = turn_inputs(energy.inputs)
    tool = getattr(energy.baseline, "posed_tool", None)
    if len(turns) < 2 or tool is None:
        return None
    own = energy.evaluator(few=few)

    def ask(position: np.ndarray, parameters: np.ndarray) -> float:
        own(position, parameters)
        return own.energy

    names = [energy.inputs[i].name for i in turns]
    rotation = np.eye(3) if tool.turn is None else tool.turn
    return TurnEvaluator(ask, [i - felt for i in turns], names, rotation)
