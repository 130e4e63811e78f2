"""A body held at one node that remembers, as the 1 kHz loop takes it.

Such a body lies elsewhere after each touch. Two things follow for the hand:

- It takes hold of the node where that is, and the node follows the hand's motion from there on. Led to the hand's own
  place, a rod that stays bent would be bent back within a tick.
- A hand that lets go is no hand: the body goes to where nothing pulls, and creeps on from there. One that could not be
  believed for a tick takes hold anew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.surrogates.plastic import HeldBody
from palpate.surrogates.plastic.held_evaluator import HeldEvaluator
from palpate.units import Range

__all__ = ["RememberingBody", "RememberingEvaluator"]


@dataclass(frozen=True, eq=False)
class RememberingBody:
    """A held body in the loop.

    Attributes
    ----------
    body : HeldBody
    """

    body: HeldBody

    @property
    def name(self) -> str:
        """Of the body."""
        return self.body.name

    @property
    def meta(self) -> Mapping[str, Any]:
        """The body's training record."""
        return self.body.meta

    @property
    def reach(self) -> float:
        """Largest trained displacement of the held node, m."""
        return self.body.reach

    @property
    def stiffness_max(self) -> float:
        """Largest stiffness that the hand can meet, N/m."""
        return self.body.stiffness_max

    @property
    def parameters(self) -> tuple[Range, ...]:
        """Inputs that the hand doesn't supply: none."""
        return ()

    def evaluator(self) -> RememberingEvaluator:
        """The allocation-free evaluator of the 1 kHz path, of a virgin body."""
        return RememberingEvaluator(self.body.evaluator(), self.body.directions[0])


class RememberingEvaluator:
    """Answers a hand that takes hold and lets go; nothing is allocated.

    Attributes
    ----------
    force : (3,)
        On the hand, N.
    contact : (3,)
        Where the held node is, offset from its rest position, m.
    loads : (2,)
        w in m and P in N, input of `HeldBody.displacement`.
    inside : bool
        Within the trained range.
    mirrored : bool
        Never.
    elapsed : float
        Since the call before, s, to be set ahead of each call.
    """

    def __init__(self, body: HeldEvaluator, direction: np.ndarray) -> None:
        self._body, self._direction = body, np.array(direction, dtype=float)
        self.force, self.contact, self.loads = body.force, body.contact, body.loads
        self.inside, self.mirrored, self.elapsed = True, False, 0.0
        self._held, self._grip = False, 0.0  # m along the load: from the hand to the node

    def place(self, position: np.ndarray, *, holding: bool, believed: bool) -> None:
        """Turn the hand's place (3,), m, into that of the node that it holds; without a hand the node lies still."""
        if not (holding and believed):
            self._held = False
            position[:] = self.contact
            return
        along = float(self._direction @ position)
        if not self._held:
            self._held, self._grip = True, float(self.loads[0]) - along
        for i in range(3):
            position[i] += self._grip * self._direction[i]

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        """Renew the attributes for a node led to `position` (3,), m, or for one that nobody holds."""
        body = self._body
        good = body.step(position, self.elapsed) if self._held else body.release(self.elapsed)
        self.inside = body.inside
        if not good:
            self.force[:] = math.nan  # the loop makes a fault of it
