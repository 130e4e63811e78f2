"""A course of trials on simulated people: how often its intervals hold the truth, and how far its estimates lie off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from palpate.experiments.course import Course, Progress
from palpate.experiments.observers import Observer
from palpate.experiments.placement import Staircase

__all__ = ["Simulated", "simulate_course", "simulate_people"]


@dataclass(frozen=True)
class Simulated:
    """Estimates of a course of simulated people, beside what is true of them; of the form ``correct`` JND stands for σ.

    Attributes
    ----------
    people, trials : int
        Number of people, and of trials of each.
    location_coverage, spread_coverage : float
        Shares of the people whose 95 % interval of μ, and of the JND, holds the truth.
    location_bias : float
        Mean error of μ, in the unit of the levels.
    bias : float
        Bias of the geometric mean of the JND, as a share.
    scatter : float
        Standard deviation of ln JND.
    width : float
        Mean ln(upper/lower) of the JND's interval.
    caught : float, optional
        Share of the catch trials that were answered rightly; None without any.
    reversals_bias : float, optional
        Bias of a staircase's mean reversal, as a share, of the form ``correct`` of what the levels are logarithms of;
        None of another placement.
    """

    people: int
    trials: int
    location_coverage: float
    spread_coverage: float
    location_bias: float
    bias: float
    scatter: float
    width: float
    caught: float | None
    reversals_bias: float | None

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as data for a program."""
        return asdict(self)

    def __str__(self) -> str:
        lines = [
            f"{self.people} simulated people, {self.trials} trials each",
            f"  95 % interval holds the point of equality {self.location_coverage:.1%}, "
            f"the JND {self.spread_coverage:.1%}",
            f"  bias of the JND {self.bias:+.1%}, of the point of equality {self.location_bias:+.4f}",
            f"  scatter of ln JND {self.scatter:.3f}; its interval spans a factor {np.exp(self.width):.2f}",
        ]
        if self.caught is not None:
            lines.append(f"  catch trials answered rightly {self.caught:.1%}")
        if self.reversals_bias is not None:
            lines.append(
                f"  the mean of its reversals is off by {self.reversals_bias:+.1%}: only for a quick look"
            )
        return "\n".join(lines)


def simulate_people(
    course: Course,
    observer: Observer,
    people: int,
    rng: np.random.Generator,
    location: np.ndarray | float | None = None,
    spread: np.ndarray | float | None = None,
) -> Progress:
    """Let so many simulated people go through a course; `location` and `spread` (N,) where they differ."""
    state = course.begin(people, rng)
    for t in range(course.total):
        stimulus = course.next(state)
        p = observer.probability(
            course.function, stimulus.level, stimulus.order, t / max(course.total - 1, 1), location, spread
        )
        course.answer(state, stimulus, rng.random(people) < p)
    return state


def simulate_course(
    course: Course,
    observer: Observer,
    people: int = 1000,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Simulated:
    """Return how a course does on simulated people of one kind.

    Parameters
    ----------
    course : Course
        Trials of one condition.
    observer : Observer
        The person who answers.
    people : int
        Number of simulated people.
    seed : int
        Seed of courses and answers.
    progress : callable, optional
        Takes a line when all have answered.
    """
    rng = np.random.default_rng(seed)
    state = simulate_people(course, observer, people, rng)
    if progress is not None:
        progress(f"{people} people answered {course.total} trials each; their functions are fitted …")
    estimate = course.function.estimate(course.counts(state))
    signed = course.function.form == "signed"
    truth = observer.jnd if signed else observer.spread
    off = np.log(estimate.spread[:, 1] / truth)
    return Simulated(
        people=people,
        trials=course.total,
        location_coverage=_coverage(estimate.location, observer.location),
        spread_coverage=_coverage(estimate.spread, truth),
        location_bias=float((estimate.location[:, 1] - observer.location).mean()),
        bias=float(np.expm1(off.mean())),
        scatter=float(off.std()),
        width=float(np.log(estimate.spread[:, 2] / estimate.spread[:, 0]).mean()),
        caught=float(np.nanmean(course.caught(state))) if course.catch else None,
        reversals_bias=_reversals_bias(course, state, observer),
    )


def _coverage(interval: np.ndarray, truth: float) -> float:
    return float(((interval[:, 0] <= truth) & (truth <= interval[:, 2])).mean())


def _reversals_bias(course: Course, state: Progress, observer: Observer) -> float | None:
    """Return the bias of the mean reversal, against the level that a staircase heads for."""
    stairs = course.placement
    if not isinstance(stairs, Staircase):
        return None
    guess = 0.5 if course.function.form == "signed" else float(np.mean(course.function.guess))
    reached = stairs.threshold(state.placed)
    if course.function.form == "signed":  # with no bias, p correct = Φ(|x|/σ)
        return float(np.nanmean(reached) / (observer.spread * float(ndtri(stairs.target))) - 1.0)
    true = observer.location + observer.spread * float(ndtri((stairs.target - guess) / (1.0 - guess)))
    return float(np.expm1(np.nanmean(reached) - true))  # levels are logarithms: their ratio has no meaning
