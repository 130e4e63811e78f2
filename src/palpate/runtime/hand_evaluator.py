"""The answer of a learnt body to a hand, tick by tick and without allocation: what the loop calls.

One evaluator serves every body and asks what it can do. A hand either moves a free probe, whose centre is the hand's
own place, or holds a patch or a node of the body, whose displacement from rest it gives.

- *A free probe* that nobody holds is kept in the air. Farther inside than the distance to the touched surface is
  known, and where it turns back behind the body, the body lets go: no force, until the probe has been in the air. An
  energy can't end there without pulling the hand in; ending so loses energy and makes none. A probe that comes from
  behind meets nothing until it was in front.
- *A held body* without memory returns to rest when nobody holds it. One whose memory lets it lie elsewhere is taken
  hold of where it is and follows the hand's motion from there on: led to the hand's own place, a rod that stays bent
  would be bent back within a tick. A hand that can't be believed for a tick takes hold anew.
- *A body that was released*, because of a fault or a stop, lets go of the hand: no force, and nothing is remembered,
  until the hand is where the body holds no energy: a probe outside it, a held place at rest. One that lies elsewhere
  after a touch is taken hold of anew where it lies.
- *A memory* walks the elastic energy; what it answers is the force. It never gives back more than it was given.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from palpate.kernels import for_rows, kernel
from palpate.surrogates.memories import Carry
from palpate.surrogates.moving_rest import MovingRest
from palpate.units import Range

__all__ = ["HandEvaluator", "Model", "stiffness_along"]

# slope of d: 1 for a distance, measured 1.0004 at most where five bodies are pressed; behind flat ones it is 6 at s = 0
_STEEP = 1.2


class Model(Protocol):
    """A learnt body as the loop asks for it; `palpate.runtime.touchable.Touchable` is one."""

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs that the hand doesn't supply."""
        ...

    @property
    def start(self) -> np.ndarray:
        """Values (p,) of `parameters` with which a loop begins."""
        ...

    @property
    def tool_axis(self) -> np.ndarray:
        """The axis (3,) of the tool that the hand moves, a unit vector; z of any other body."""
        ...

    def evaluator(self) -> HandEvaluator:
        """Return the allocation-free evaluator."""
        ...


class HandEvaluator:
    """Answers a hand on any body; nothing is allocated.

    The `elastic` answer is a `palpate.surrogates.SurrogateEvaluator`, or has what that has: force, stiffness, energy,
    amplitude, slope, depth and `inside`, renewed by each call.
    The hand moves a free probe, or, where it `holds`, a patch or a node, whose place the `node` tells of a body drawn
    by its nodes. A `memory` has ``force`` and ``step(position, amplitude, slope, dt)`` as
    `palpate.surrogates.memories.MemoryState` has them; one with ``release(dt)`` moves the rest of what nobody holds,
    and needs a single felt direction; one with ``now`` keeps indentations. `directions` (k, 3) are those that are felt,
    unit vectors, x, y and z unless given; `normal` (3,) is the outer normal of the surface where a probe usually
    touches; `inner` is how far inside it the probe's centre may go, m, infinite for a body that never lets go; `radius`
    is the probe's, m, unless it is the further input of number `radius_input`; `places` are those further inputs that a
    hand which holds can't change: they say where it has taken hold. `further` is the number of further inputs of a body
    under a tool with friction; one more after them is its coefficient. One for a `few` places interprets kernels. Of a
    tool that tells its torque, `torque_at` is as `palpate.surrogates.Surrogate.torque_evaluator` gives it.

    Its answer: `force` (3,), N, on the hand; `torque` (3,), N m, on the tool about its place, zero where none is told;
    `contact` (3,), m, the probe's centre or the offset of the held place from its rest; `loads` (n,), the inputs of
    the field at its nodes there, such as loads, N; `inside` the trained region or not; `let_go` where the body has let
    go of a probe that is still in it; `stiffness`, −F·(∂F/∂x)F/‖F‖², N/m, along the force of the elastic answer, zero
    without force or where it isn't known; `depth`, m, of the rigid probe in the surface at rest, negative without
    contact and zero for a probe that was let go or that a released body waits for, or how far the hand has displaced a
    held body; `indentation` (n,), √J, the amplitude of the print at each place that keeps one.

    To be set: `elapsed`, s since the call before, ahead of each call where the body has a memory; `away` (3,), m, where
    a probe or a patch is that nobody holds; `waiting`, that the body was released and waits for a hand that is where it
    holds no energy, and `rest_zone`, m, how deep a probe or how far from rest what is held may be for that.
    """

    def __init__(
        self,
        elastic: Any,
        memory: Any = None,
        *,
        holds: bool,
        directions: np.ndarray | None = None,
        away: np.ndarray | None = None,
        normal: np.ndarray | None = None,
        inner: float = math.inf,
        radius: float = 0.0,
        radius_input: int | None = None,
        node: Any = None,
        places: tuple[int, ...] = (),
        further: int | None = None,
        torque_at: Any = None,
        few: bool = False,
    ) -> None:
        self._torque_at = torque_at
        self.torque: np.ndarray = np.zeros(3) if torque_at is None else torque_at.torque
        self._elastic, self._memory, self._holds = elastic, memory, holds
        self.away = np.zeros(3) if away is None else away
        self._normal = np.array([0.0, 0.0, 1.0]) if normal is None else normal
        self._inner, self._radius, self._radius_input = inner, radius, radius_input
        self._places, self._taken = places, np.zeros(0)
        self._further = further if hasattr(memory, "rub") else None
        felt = np.eye(3) if directions is None else np.ascontiguousarray(directions, dtype=np.float64)
        self._stays: Any = None
        if hasattr(memory, "release"):
            self._stays = MovingRest(elastic, memory, felt[0])
        own = getattr(memory, "of_body", memory)
        self._indentation = own if hasattr(own, "now") else None
        self.indentation = np.zeros(0) if self._indentation is None else self._indentation.now
        self.force: np.ndarray = elastic.force if memory is None else memory.force
        self._node, self._place = node, np.zeros(3)
        self.contact: np.ndarray = self._place if node is None else node.value
        self.loads: np.ndarray = np.zeros(0) if node is None else node.inputs
        self._grip, self._held = np.zeros(3), False
        self._onto = np.ascontiguousarray(felt.T @ felt)
        self._felt: list[list[float]] = self._onto.tolist()
        self.inside, self.let_go = True, False
        self.waiting, self.rest_zone = False, 0.0
        self.depth, self.stiffness, self.elapsed = -math.inf, 0.0, 0.0
        kernels = (stiffness_along, _behind, _project)
        self._stiffness_along, self._behind, self._project = (
            for_rows(own, 1) if few else own for own in kernels
        )
        self._stiffness_along(elastic.force, elastic.stiffness)  # compile now, not in the loop
        self._behind(self._normal, self._normal)
        self._project(self._place, self._onto, self._place.copy())

    def place(self, position: np.ndarray, *, holding: bool, believed: bool) -> None:
        """Turn the hand's place (3,), m, in place into that of the probe or of what it holds.

        A probe that nobody holds is kept `away`: a way back to the centre could lead through the body. A place that is
        not `believed` is answered by no force.
        """
        stays, took = self._stays, self._held
        self._held = holding and believed
        if stays is None:
            if not holding:
                position[:] = self.away
            return
        if not self._held:
            position[:] = stays.lies
            return
        x, y, z = position.tolist()
        for i in range(3):
            if not took:
                row = self._felt[i]
                self._grip[i] = stays.lies[i] - (row[0] * x + row[1] * y + row[2] * z)
            position[i] += self._grip[i]

    def release(self) -> None:
        """Let go of the hand until it is where the body holds no energy."""
        self.waiting = True

    @property
    def holds(self) -> bool:
        """True where the hand holds a patch or a node, and doesn't move a free probe."""
        return self._holds

    @property
    def remembers(self) -> bool:
        """True for a body with a memory, which each call takes further."""
        return self._memory is not None

    @property
    def tangent(self) -> np.ndarray:
        """∂F/∂x (3, 3) of the elastic answer at the last call, N/m; zero where it isn't known."""
        return self._elastic.stiffness  # type: ignore[no-any-return]

    @property
    def stored(self) -> float:
        """Energy, J, that the body holds at the last call: the most that it can give back."""
        if self._memory is not None:
            return float(self._memory.stored)
        return 0.0 if self.let_go or self.waiting else float(self._elastic.energy)

    @property
    def grew(self) -> bool:
        """True where the last call made an indentation grow."""
        return self._indentation is not None and self._indentation.lost_in_step > 0.0

    def take_over(self, other: HandEvaluator, carry: Carry | None = None) -> None:
        """Go on where the evaluator of another surrogate of the same body is: in the same hand, and with its memory.

        `carry` hands that memory on, see `palpate.surrogates.memories.Memory.carry_from`.
        """
        self.let_go, self.waiting, self.rest_zone = other.let_go, other.waiting, other.rest_zone
        self._held, self._taken = other._held, other._taken.copy()
        self._grip[:] = other._grip
        if carry is not None:
            carry(other._memory, self._memory)
        if self._stays is not None:
            self._stays.lies[:] = other._stays.lies

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        """Renew the attributes for a probe or a held place at `position` (3,), m, and the further inputs (p,)."""
        elastic, memory = self._elastic, self._memory
        if self._further is not None and len(parameters) > self._further:
            memory.rub(float(parameters[self._further]))
            parameters = parameters[: self._further]
        if self._places:
            parameters = self._where_taken(parameters)
        if self._stays is not None and not self._held:
            self.waiting = False
            good = self._stays.release(self.elapsed, parameters)
        else:
            elastic(position, parameters)
            amplitude = elastic.amplitude
            if not self._holds:
                self._hold_or_let_go(elastic.depth, parameters)
            if self.waiting:
                self._await_rest(elastic.depth)
            if self.let_go or self.waiting:
                amplitude *= 0.0  # what is no number stays none, and is seen
                elastic.force *= 0.0
            good = memory is None or memory.step(position, amplitude, elastic.slope, self.elapsed)
        stays = self._stays
        self._project(position if stays is None or self._held else stays.lies, self._onto, self._place)
        if stays is not None:
            stays.lies[:] = self._place
        if self._node is not None:
            self._node(self._place, self.force, parameters)
        self.inside = elastic.inside and not self.let_go
        untouched = self.let_go or (self.waiting and not self._holds)
        self.depth = 0.0 if untouched else elastic.depth
        self.stiffness = self._stiffness_along(elastic.force, elastic.stiffness)
        if self._torque_at is not None:
            self._torque_at(position, parameters, self.force)
        if not good:
            self.force[:] = math.nan  # the loop makes a fault of it

    def _await_rest(self, depth: float) -> None:
        """End the wait of a released body where the hand presses or displaces it by next to nothing.

        A body that lies elsewhere after a touch was taken hold of anew, and nothing pulls there.
        """
        if depth <= self.rest_zone or self._stays is not None:
            self.waiting = False

    def _where_taken(self, parameters: np.ndarray) -> np.ndarray:
        """The further inputs (p,), those of the place as they were when the hand took hold.

        To move the place of a body that is held would change its energy by no work of the hand.
        """
        if len(self._taken) != len(parameters):
            self._taken = parameters.copy()  # at the first call
        for i in range(len(parameters)):
            if not (self._held and i in self._places):
                self._taken[i] = parameters[i]
        return self._taken

    def _hold_or_let_go(self, depth: float, parameters: np.ndarray) -> None:
        own = self._radius_input
        radius = self._radius if own is None else parameters[own]
        if depth <= 0.0:
            self.let_go = False
        elif depth > self._inner + radius or self._behind(self._elastic.outward, self._normal):
            self.let_go = True


@kernel
def _project(position, onto, place) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the part of a position along the felt directions into `place`."""
    for i in range(3):
        place[i] = onto[i, 0] * position[0] + onto[i, 1] * position[1] + onto[i, 2] * position[2]


@kernel
def stiffness_along(force, stiffness) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """−F·(∂F/∂x)F/‖F‖², N/m, of a force (3,), N, and ∂F/∂x (3, 3), N/m; 0 without a force."""
    size, total = 0.0, 0.0
    for i in range(3):
        size += force[i] * force[i]
        for j in range(3):
            total -= force[i] * stiffness[i, j] * force[j]
    return total / size if size > 0.0 else 0.0


@kernel
def _behind(slope, normal) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Return whether d climbs towards the back, and faster than a distance does."""
    square, out = 0.0, 0.0
    for i in range(3):
        square += slope[i] * slope[i]
        out += slope[i] * normal[i]
    return out < 0.0 and square > _STEEP * _STEEP
