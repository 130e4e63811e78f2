"""A body made by formula, in memory and in a file, and shared memory that cleans up after itself."""

from __future__ import annotations

import numpy as np
import pytest

from models import spring_beam
from palpate.runtime.shared import Shared

STIFFNESS = 20.0  # N/m


@pytest.fixture(scope="session")
def spring():
    return spring_beam(STIFFNESS)


@pytest.fixture(scope="session")
def spring_file(spring, tmp_path_factory):
    return spring.save(tmp_path_factory.mktemp("models") / "spring.palpate")


@pytest.fixture
def shared():
    with Shared.create() as blocks:
        yield blocks


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


@pytest.fixture
def plain():
    return PlainModel()
