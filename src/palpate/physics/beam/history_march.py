"""Following a body that remembers from one load to the next, in steps that keep their error.

The load changes evenly on the way. Each step is taken once whole and once in two halves; their difference is the error
that the step is judged by (Hairer, Nørsett & Wanner 1993, Solving Ordinary Differential Equations I, II.4), and the
halves are what is kept. A step that errs too much, finds no equilibrium or leads far away is taken again, shorter:
since every moment is a value, going back is forgetting.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from palpate.physics.stop import Stop

__all__ = ["Failure", "Moment", "SteppedBody", "march"]

# Shares of the way between two loads: a body that finds no equilibrium in so short a step has none, while the first
# moments of a long creep may need a very short one
SMALLEST_FAILED, SMALLEST_STEP = 2.0**-10, 2.0**-40
# largest and smallest factor of the next step, and the share of the step that the error allows which is taken
GROWTH, SHRINKAGE, SAFETY = 4.0, 0.2, 0.8
WASTE_LIMIT = 600  # iterations of steps that found nothing: bounds the time that a pointless load costs


@dataclass(frozen=True, eq=False)
class Moment:
    """A moment of a history: all that the body's future depends on, and the cost of finding it."""

    time: float  # s; for a body that knows no time, any number that does not fall
    load: np.ndarray  # (dof,) load vector
    z: np.ndarray  # (dof,) unknowns
    internal: Any  # internal variables of the sections
    dissipated: float = 0.0  # J lost for good so far
    reach: float = 0.0  # m, the largest displacement so far
    iterations: int = 0  # Newton iterations spent on the way here
    residual: float = 0.0  # relative error in the energy norm


@dataclass(frozen=True, eq=False)
class Failure:
    """The reason for which a march ended without reaching its load."""

    stop: Stop
    moment: Moment  # the last good one
    z: np.ndarray  # (dof,) unknowns at which the search gave up
    iterations: int  # Newton iterations spent in all
    share: float = 0.0  # share of its way that the load had come


class SteppedBody(Protocol):
    """The methods that a march needs of a body."""

    def take(self, start: Moment, time: float, load: np.ndarray, guess: np.ndarray) -> Moment | Failure:
        """Take one step to a time and load, from a guess of the unknowns (dof,)."""

    def error(self, whole: Moment, halves: Moment) -> float:
        """Return the difference of the two outcomes of a step, in units of what is tolerated."""


@dataclass(frozen=True, eq=False)
class _Way:
    """An even way from a moment to a time and a load."""

    start: Moment
    time: float
    load: np.ndarray

    def at(self, share: float) -> tuple[float, np.ndarray]:
        """Return time and load at a share between 0 and 1; the end is met to the last digit."""
        if share == 1.0:
            return self.time, self.load
        begun = self.start
        return begun.time + share * (self.time - begun.time), begun.load + share * (self.load - begun.load)


def march(body: SteppedBody, start: Moment, time: float, load: np.ndarray) -> Moment | Failure:
    """March from a moment to a time in s and a load (dof,); the time of the start means a load put on at once.

    What comes back has the iterations of all steps; for want of an equilibrium it is a `Failure`, nothing is raised.
    """
    way, moment, done, step, spent, wasted = _Way(start, time, load), start, 0.0, 1.0, 0, 0
    slope = np.zeros_like(start.z)
    while True:
        end = 1.0 if done + step > 1.0 - SMALLEST_STEP / 2 else done + step
        tried, error, cost = _try(body, way, moment, (done, end), moment.z + (end - done) * slope)
        spent += cost
        if isinstance(tried, Moment) and error <= 1.0:
            if end == 1.0:
                return replace(tried, iterations=spent)
            slope = (tried.z - moment.z) / (end - done)
            moment, done, step = tried, end, (end - done) * _factor(error)
            continue
        step = (end - done) * min(_factor(error), 0.5)
        wasted += cost if isinstance(tried, Failure) else 0
        smallest = SMALLEST_FAILED if isinstance(tried, Failure) else SMALLEST_STEP
        if step < smallest or wasted > WASTE_LIMIT:
            return _given_up(tried, moment, spent, done)


def _try(
    body: SteppedBody, way: _Way, moment: Moment, shares: tuple[float, float], guess: np.ndarray
) -> tuple[Moment | Failure, float, int]:
    """Take a step whole and in halves; return the halves' outcome or the failure, its error and its iterations."""
    done, end = shares
    whole = body.take(moment, *way.at(end), guess)
    if isinstance(whole, Failure):
        return whole, np.inf, whole.iterations
    first = body.take(moment, *way.at((done + end) / 2), (moment.z + whole.z) / 2)
    if isinstance(first, Failure):
        return first, np.inf, whole.iterations + first.iterations
    second = body.take(first, *way.at(end), whole.z)
    spent = whole.iterations + first.iterations + second.iterations
    return second, np.inf if isinstance(second, Failure) else body.error(whole, second), spent


def _factor(error: float) -> float:
    """Return the factor by which the next step is longer: the error of a smooth step goes with its third power."""
    if not np.isfinite(error):
        return 0.5
    return float(np.clip(SAFETY * max(error, 1e-9) ** (-1 / 3), SHRINKAGE, GROWTH))


def _given_up(tried: Moment | Failure, moment: Moment, spent: int, done: float) -> Failure:
    """Return the failure of a whole march; what a step was cut back for is not the reason for its end."""
    if isinstance(tried, Moment) or tried.stop is Stop.ITERATION_LIMIT:
        return Failure(Stop.STEP_TOO_SMALL, moment, tried.z, spent, done)
    return Failure(tried.stop, moment, tried.z, spent, done)
