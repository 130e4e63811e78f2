"""A group of people: their mean with random effects, equivalence by two one-sided tests, and the power of a plan.

Each person is estimated first. The mean over people is that of a random-effects model: people differ by τ, and each
estimate has an error of its own (Paule & Mandel 1982 for τ; interval by Knapp & Hartung 2003, with Student's t).

Equivalence is shown where both one-sided tests reject at the level α (Schuirmann 1987): that the shift of the point of
equality is below −m JND, and that it is above m JND. They are t-tests of μ + m JND and μ − m JND over people, each with
the person's own JND: so the margin is a share of a JND without one that is assumed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from scipy.stats import t as student

from palpate import checks
from palpate.errors import UsageError
from palpate.experiments.course import Course
from palpate.experiments.observers import Observer
from palpate.experiments.simulation import simulate_people

__all__ = [
    "Equivalence",
    "GroupMean",
    "Population",
    "deviation_of",
    "equivalence",
    "group_mean",
    "power_curve",
]

_LARGEST = 1e6  # τ² over the largest variance: beyond all that data show


@dataclass(frozen=True)
class GroupMean:
    """The mean over people, its 95 % interval, and how much people differ; all in the unit of the estimates.

    Attributes
    ----------
    mean, low, high : float
        The random-effects mean, and the lower and upper end of its interval.
    between : float
        Standard deviation τ of the people about the mean.
    people : int
        Number of people.
    """

    mean: float
    low: float
    high: float
    between: float
    people: int


@dataclass(frozen=True)
class Equivalence:
    """The two one-sided tests of equivalence.

    Attributes
    ----------
    shift : float
        Mean of μ/JND over people.
    margin : float
        Largest shift that counts as equivalent, in JNDs.
    p : float
        The larger of the two p-values.
    people : int
        Number of people.
    """

    shift: float
    margin: float
    p: float
    people: int

    def holds(self, level: float = 0.05) -> bool:
        """Return whether equivalence is shown at a level."""
        return self.p < level


@dataclass(frozen=True)
class Population:
    """A population of observers: one in the middle, and standard deviations of μ and of ln σ about it.

    Attributes
    ----------
    middle : Observer
        The person in the middle.
    location_spread : float
        Standard deviation of μ over people, in the unit of the levels.
    log_spread : float
        Standard deviation of ln σ over people.
    """

    middle: Observer
    location_spread: float = 0.05
    log_spread: float = 0.3

    def draw(self, people: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Return μ and σ (N,) of so many people."""
        mu = self.middle.location + self.location_spread * rng.standard_normal(people)
        return mu, self.middle.spread * np.exp(self.log_spread * rng.standard_normal(people))


def group_mean(estimate: np.ndarray, deviation: np.ndarray) -> GroupMean:
    """Return the random-effects mean of estimates (N,) with standard deviations (N,), of two people or more.

    Raises
    ------
    UsageError
        If there are fewer than two people, or a deviation is not above zero.
    """
    y = checks.shape("The estimates", estimate, (None,))
    v = checks.shape("Their deviations", deviation, (len(y),)) ** 2
    if len(y) < 2 or not (v > 0).all():
        raise UsageError(
            "A mean over people can't be given.",
            why="It needs two people or more, each with a deviation above zero.",
            fix="Run more sittings.",
        )

    def excess(between: float) -> float:
        w = 1.0 / (v + between)
        return float((w * (y - (w * y).sum() / w.sum()) ** 2).sum() - (len(y) - 1))

    low, high = 0.0, _LARGEST * float(v.max() + y.var())
    if excess(0.0) <= 0.0:
        high = 0.0
    for _ in range(100):
        middle = (low + high) / 2.0
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    w = 1.0 / (v + high)
    mean = float((w * y).sum() / w.sum())
    error = math.sqrt(float((w * (y - mean) ** 2).sum()) / ((len(y) - 1) * float(w.sum())))
    half = float(student.ppf(0.975, len(y) - 1)) * error
    return GroupMean(mean, mean - half, mean + half, math.sqrt(high), len(y))


def equivalence(location: np.ndarray, jnd: np.ndarray, margin: float) -> Equivalence:
    """Return the two one-sided tests of points of equality (N,) and JNDs (N,) of people, for a margin in JNDs.

    Raises
    ------
    UsageError
        If there are fewer than two people, or the margin is not above zero.
    """
    checks.positive("The margin of equivalence", margin)
    mu, own = checks.shape("The points of equality", location, (None,)), np.asarray(jnd, float)
    if len(mu) < 2:
        raise UsageError("Equivalence over people needs two people or more.", fix="Run more sittings.")
    p = float(_tost(mu[None], own[None], margin)[0])
    return Equivalence(float((mu / own).mean()), margin, p, len(mu))


def _tost(mu: np.ndarray, jnd: np.ndarray, margin: float) -> np.ndarray:
    """Return the larger p-value (G,) of the two tests of groups (G, N)."""
    n = mu.shape[1]

    def p_above(values: np.ndarray) -> np.ndarray:
        error = values.std(axis=1, ddof=1) / math.sqrt(n)
        return np.asarray(student.sf(values.mean(axis=1) / np.maximum(error, 1e-300), n - 1))

    return np.asarray(np.maximum(p_above(mu + margin * jnd), p_above(margin * jnd - mu)))


def power_curve(
    course: Course,
    population: Population,
    sizes: np.ndarray,
    *,
    margin: float = 0.5,
    level: float = 0.05,
    people: int = 600,
    groups: int = 2000,
    seed: int = 0,
) -> np.ndarray:
    """Return the share of groups of each size (S,) that show equivalence: its power, by simulated people.

    People are simulated once, and groups are drawn from them.

    Parameters
    ----------
    course : Course
        Trials of one condition, through which each person goes.
    population : Population
        The people from whom the simulated ones are drawn.
    sizes : (S,) array of int
        Numbers of people in a group.
    margin : float
        Largest shift that counts as equivalent, in JNDs; half of one by default.
    level : float
        Level of the test, 0.05 by default.
    people : int
        Number of simulated people.
    groups : int
        Number of groups of each size.
    seed : int
        Seed of people, answers and groups.
    """
    rng = np.random.default_rng(seed)
    location, spread = population.draw(people, rng)
    state = simulate_people(course, population.middle, people, rng, location, spread)
    estimate = course.function.estimate(course.counts(state))
    mu, jnd = estimate.location[:, 1], estimate.spread[:, 1]
    shares = []
    for size in np.asarray(sizes, int):
        drawn = rng.integers(people, size=(groups, size))
        shares.append(float((_tost(mu[drawn], jnd[drawn], margin) < level).mean()))
    return np.array(shares)


def deviation_of(interval: np.ndarray) -> np.ndarray:
    """Return standard deviations (N,) of 95 % intervals (N, 3), as of a normal distribution."""
    return np.asarray((interval[:, 2] - interval[:, 0]) / (2.0 * float(ndtri(0.975))))
