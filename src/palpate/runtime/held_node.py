"""Beams and rods in the loop: bodies held at one node, whose answer is learnt by loads and not as an energy of a place.

A beam answers with the loads that hold it. A rod with a memory lies elsewhere after each touch: a hand that lets go is
no hand, and the rod goes to where nothing pulls, and creeps on from there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.runtime.hand_evaluator import HandEvaluator
from palpate.runtime.touchable import Touchable
from palpate.surrogates import TouchEvaluator
from palpate.surrogates.plastic.held_evaluator import HeldEvaluator

__all__ = ["BeamTouchable", "RodTouchable"]

LEAD = 9  # places on the way to an end


@dataclass(frozen=True, eq=False, repr=False)
class BeamTouchable(Touchable):
    """A body held at one node, drawn as a line; `energy` is the `TouchModel` itself."""

    @property
    def holds(self) -> bool:
        """The hand holds the node."""
        return True

    @property
    def surface(self) -> None:
        """No probe touches the body."""
        return

    @property
    def radius_parameter(self) -> None:
        """No probe touches the body."""
        return

    @property
    def upright(self) -> bool:
        """The body lies in the x–y plane, y up."""
        return False

    @property
    def is_line(self) -> bool:
        """The body is drawn as a line."""
        return True

    @property
    def stays(self) -> bool:
        """True for a body that lies elsewhere after a touch, so that there is no swing back to rest."""
        return False

    @property
    def radius(self) -> float:
        """Half the height of the section, for drawing, m."""
        return float(self.energy.radius)

    @property
    def reach(self) -> float:
        """Largest trained displacement of the held node, m."""
        return float(self.energy.reach)

    @property
    def deepest(self) -> float:
        """Largest trained displacement of the held node, m."""
        return self.reach

    @property
    def stiffness_max(self) -> float:
        """Largest stiffness that the hand can meet, N/m."""
        return float(self.energy.stiffness_max)

    @property
    def force_max(self) -> float:
        """Largest trained load at the held node, N."""
        loads = [self.inputs[i] for i in self.energy.touched]
        return float(np.linalg.norm([max(abs(r.low), abs(r.high)) for r in loads]))

    def evaluator(self) -> HandEvaluator:
        """Return the allocation-free evaluator of the 1 kHz path."""
        return HandEvaluator(_BeamAnswer(self.energy), holds=True)

    @cached_property
    def travel(self) -> np.ndarray:
        """Lower and upper corner (2, 3) of the box of the held node's offsets, m; rest is in it.

        The box is taken over both ends and the middle of every load's range: bodies bend farthest at the ends, and
        reach farthest along their axis near the middle of a range of both signs. A body that mirrors goes as far
        against its load.
        """
        model = self.energy
        levels = [(r.low, (r.low + r.high) / 2, r.high) for r in model.inputs]
        lattice = np.array(list(itertools.product(*levels)))
        columns = slice(2 * model.touch_node, 2 * model.touch_node + 2)
        offsets = np.zeros((len(lattice) + 1, 3))  # the last one is rest
        offsets[:-1, :2] = model.networks["field"].predict(lattice)[:, columns]
        if model.mirrors:
            along = offsets @ model.directions[0]
            offsets = np.vstack([offsets, offsets - 2.0 * np.outer(along, model.directions[0])])
        return np.array([offsets.min(axis=0), offsets.max(axis=0)])


class RodTouchable(BeamTouchable):
    """A body held at one node that remembers; `energy` is the `HeldBody` itself."""

    @property
    def stays(self) -> bool:
        """The body remembers."""
        return True

    @property
    def force_max(self) -> float:
        """Largest load of the trained range, N."""
        return max(abs(self.inputs[1].low), abs(self.inputs[1].high))

    def evaluator(self) -> HandEvaluator:
        """Return the allocation-free evaluator of the 1 kHz path, of a virgin body."""
        direction = np.ascontiguousarray(self.energy.directions[:1], dtype=float)
        answer = _RodAnswer(self.energy.evaluator(), direction[0])
        return HandEvaluator(answer, answer, holds=True, directions=direction)

    @cached_property
    def travel(self) -> np.ndarray:
        """Lower and upper corner (2, 3) of the box of the held node's offsets, m.

        The node is led from rest to both ends of what the body was trained on, and let go there.
        """
        body = self.energy
        hand, ends = body.evaluator(), body.inputs[0]
        offsets = [np.zeros(3)]
        for end in (ends.low, ends.high):
            for w in np.linspace(hand.loads[0], end, LEAD):
                hand.step(w * body.directions[0], 0.0)
                offsets.append(hand.contact.copy())
            hand.release(0.0)
            offsets.append(hand.contact.copy())
        return np.array([np.min(offsets, axis=0), np.max(offsets, axis=0)])


class _BeamAnswer(TouchEvaluator):
    """A touch model's evaluator; it knows force and place, but neither energy nor stiffness."""

    amplitude, depth = 0.0, 0.0
    stiffness, slope = np.zeros((3, 3)), np.zeros(3)


class _RodAnswer:
    """A held body's evaluator, in the loop at once the elastic answer and the memory.

    Attributes
    ----------
    force, contact, loads, inside :
        As of `HeldEvaluator`.
    lies : (3,)
        Where the held node is along the load, m.
    """

    amplitude, depth, mirrored = 0.0, 0.0, False
    stiffness, slope = np.zeros((3, 3)), np.zeros(3)

    def __init__(self, body: HeldEvaluator, direction: np.ndarray) -> None:
        self._body, self._direction = body, direction
        self.force, self.contact, self.loads = body.force, body.contact, body.loads
        self.inside, self.lies = True, np.zeros(3)

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        """Leave the answer to `step`."""

    def step(self, position: np.ndarray, amplitude: float, slope: np.ndarray, dt: float) -> bool:
        """Lead the node to a position (3,), m, within dt seconds; False if that can't be answered."""
        return self._renewed(self._body.step(position, dt))

    def release(self, dt: float, parameters: np.ndarray) -> bool:
        """Let go of the node for dt seconds."""
        return self._renewed(self._body.release(dt))

    def _renewed(self, good: bool) -> bool:
        self.inside = self._body.inside
        np.multiply(self._direction, self.loads[0], out=self.lies)
        return good
