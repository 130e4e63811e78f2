"""The smallest body behind the loop's protocols: an isotropic spring that can be told to misbehave."""

from __future__ import annotations

import numpy as np

from palpate.runtime.hand_evaluator import HandEvaluator

STIFFNESS = 20.0  # N/m


class PlainAnswer:
    """F = −k x in every direction, with switches to misbehave."""

    amplitude, inside = 0.0, True

    def __init__(self, parameters):
        self.force = np.zeros(3)
        self.stiffness, self.slope = np.zeros((3, 3)), np.zeros(3)
        self.spring, self.poison, self.error = STIFFNESS, 0.0, None
        self.seen, self.depth, self.energy = np.full(parameters, np.nan), 0.0, 0.0

    def __call__(self, position, parameters):
        if self.error is not None:
            raise self.error
        np.multiply(position, -self.spring, out=self.force)
        self.force[0] += self.poison
        self.depth = float(np.linalg.norm(position))
        self.energy = 0.5 * self.spring * self.depth**2
        self.seen[:] = parameters


class PlainModel:
    """An isotropic spring behind the loop's `Model` protocol."""

    def __init__(self, parameters=()):
        self.parameters = tuple(parameters)
        self.answer = PlainAnswer(len(self.parameters))
        self.start = np.array([(each.low + each.high) / 2.0 for each in self.parameters])

    def evaluator(self):
        return HandEvaluator(self.answer, holds=True)
