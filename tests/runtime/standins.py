"""The smallest body behind the loop's protocols: an isotropic spring that can be told to misbehave."""

from __future__ import annotations

import numpy as np

STIFFNESS = 20.0  # N/m


class PlainEvaluator:
    """F = −k x in every direction, with switches to misbehave."""

    def __init__(self, parameters):
        self.force, self.contact, self.loads = np.zeros(3), np.zeros(3), np.zeros(1)
        self.inside, self.mirrored = True, False
        self.stiffness, self.poison, self.error = STIFFNESS, 0.0, None
        self.seen = np.full(parameters, np.nan)

    def __call__(self, position, parameters):
        if self.error is not None:
            raise self.error
        np.multiply(position, -self.stiffness, out=self.force)
        self.contact[:] = position
        self.force[0] += self.poison
        self.seen[:] = parameters


class PlainModel:
    """An isotropic spring behind the loop's `Model` protocol."""

    reach = 0.25

    def __init__(self, parameters=()):
        self.parameters = tuple(parameters)
        self.answer = PlainEvaluator(len(self.parameters))

    def evaluator(self):
        return self.answer
