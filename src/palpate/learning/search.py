"""The search for a network's structure: form of units, radial function, number of units, and the start to refine from.

The search knows neither what is learnt nor how well: a problem evaluates candidates, which is to refine their units by
some more iterations and to say what they miss of samples left out. On this stand

    `Search.try_all`   candidates that are independent of each other, by several processes
    `Search.halve`     successive halving (Jamieson & Talwalkar 2016): all get some iterations, the best go on
    `Search.grow`      sizes upwards, each from the best one's units and more, until more units gain nothing

Work is counted in candidates, units and iterations, so a seed decides the result on any machine, with any number of
processes. A limit on time only ends a search early.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from palpate.learning.pool import Pool
from palpate.options import SearchOptions
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.regressors import Regressors

__all__ = [
    "Budget",
    "Candidate",
    "Search",
    "Searchable",
    "Trial",
    "Work",
    "evaluate_all",
    "iteration_work",
    "sizes",
]

_STEP = 1.34  # growth of the number of units from one size to the next, beyond six
_PACE = 1e10  # multiplications in a second, before any were timed
_PRIOR = 0.5  # s that count as timed at that pace
_FUNCTIONS = 60  # multiplications that an entry of the derivatives takes as long as
_CALLS = 1e7  # and an iteration of nothing
_LEAST = 0.1  # s that a refinement gets when time is over and nothing was found yet


@dataclass(frozen=True)
class Budget:
    """The work and the time that a search may take."""

    effort: float = 1.0  # multiplies the counts of candidates, iterations and sizes; 0.1 is a quick look
    deadline: float = math.inf  # of `time.monotonic`; infinite without a limit on time

    @classmethod
    def of(cls, effort: float = 1.0, seconds: float | None = None) -> Budget:
        """Return a budget that begins now; `seconds` limits its time."""
        SearchOptions(effort=effort, seconds=seconds)  # refuses what limits no work
        return cls(effort, math.inf if seconds is None else time.monotonic() + seconds)

    @property
    def left(self) -> float:
        """Seconds left."""
        return self.deadline - time.monotonic()

    @property
    def over(self) -> bool:
        """True once the limit on time has passed."""
        return self.left <= 0

    def count(self, number: float, least: int = 1) -> int:
        """Return how many at this effort of what are `number` at the default one, at least `least`."""
        return max(least, round(number * self.effort))

    def part(self, share: float) -> Budget:
        """Return the same effort with a share of the time that is left."""
        return (
            self
            if math.isinf(self.deadline)
            else replace(self, deadline=time.monotonic() + share * self.left)
        )


class Work:
    """The multiplications that a search has left, by which it decides what it still begins.

    Under a limit on time, the `deadline` of `time.monotonic`, they are no more than what can be done until then at the
    pace so far, so that a step that would last too long is not begun. Without one no clock is asked.
    """

    def __init__(self, total: float, deadline: float = math.inf) -> None:
        self._total, self._deadline, self._began = total, deadline, time.monotonic()
        self.spent = 0.0

    @property
    def left(self) -> float:
        """Multiplications left."""
        counted = self._total - self.spent
        if math.isinf(self._deadline):
            return counted
        now = time.monotonic()
        pace = max(self.spent, _PACE * _PRIOR) / max(now - self._began, _PRIOR)
        return min(counted, max(self._deadline - now, 0.0) * pace)

    def extended(self, more: float, deadline: float) -> Work:
        """Return the work left and so much more, under another limit on time at the pace so far."""
        other = Work(self._total + more, deadline)
        other.spent, other._began = self.spent, self._began
        return other

    def spend(self, work: float) -> None:
        """Count multiplications that were done."""
        self.spent += work


def iteration_work(rows: int, numbers: int, units: int, modes: int = 1) -> float:
    """Return the multiplications of one iteration of a refinement, or what takes as long.

    Rows are samples with their slopes and curvatures; `numbers` are the unknowns θ of the units, `modes` the outputs.
    """
    matrices = rows * numbers**2 + numbers**3 / 3 + 4 * rows * units**2 + 2 * rows * units * modes
    return matrices + _FUNCTIONS * rows * numbers + _CALLS


@dataclass(frozen=True)
class Trial:
    """The record of one network that was tried.

    Attributes
    ----------
    start : str
        Where its units came from: "kind", "grown", "random", "at solves", ….
    form, radial : str
        Form and radial function of its units.
    units : int
        Number of units; with a symmetry, of orbits.
    error : float
        What it misses of samples left out, in the measure of its problem.
    seconds : float
        How long it took.
    """

    start: str
    form: str
    radial: str
    units: int
    error: float
    seconds: float = 0.0

    @property
    def name(self) -> str:
        """Number of units, form and radial function."""
        return f"{self.units} {self.form} {self.radial}"


@dataclass(frozen=True, eq=False)
class Candidate:
    """Units to refine from, or the network that was refined from them."""

    regressors: Regressors  # kind of the units, and the tail
    theta: np.ndarray  # (h, p), the units now
    start: str  # where they came from
    error: float = math.inf  # by which candidates are compared
    network: Refined | None = None  # None before the candidate was evaluated
    iterations: int = 0  # spent so far
    seconds: float = 0.0  # spent so far
    # what the problem wants to remember of the evaluation, such as the error of every sample
    detail: Any = None

    @property
    def kind(self) -> tuple[str, str]:
        """Form and radial function of the units."""
        return self.regressors.form.name, self.regressors.radial

    @property
    def name(self) -> str:
        """Number of units, form and radial function."""
        return f"{len(self.theta)} {self.regressors.form.name} {self.regressors.radial}"

    @property
    def trial(self) -> Trial:
        """The record of this candidate."""
        return Trial(self.start, *self.kind, len(self.theta), self.error, self.seconds)


class Searchable(Protocol):
    """A problem whose networks are searched. It is pickled for other processes, and must not change."""

    def evaluate(self, candidate: Candidate, iterations: int, seconds: float | None) -> Candidate:
        """Return the candidate after so many more iterations, with its network, units and error."""


@dataclass(eq=False)
class Search:
    """A search, and all that it has tried."""

    problem: Searchable  # evaluates candidates
    budget: Budget = field(default_factory=Budget)
    pool: Pool | None = None  # processes that evaluate candidates; None for this one alone
    tried: list[Candidate] = field(default_factory=list)  # in order, each with as many iterations as it got

    @property
    def best(self) -> Candidate:
        """The candidate of least error so far."""
        return min(self.tried, key=_error)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The records of all that were tried, in order."""
        return tuple(candidate.trial for candidate in self.tried)

    def try_all(self, candidates: Iterable[Candidate], iterations: int) -> list[Candidate]:
        """Return the candidates evaluated, in order; those that time did not suffice for are missing.

        The first candidate of a search is evaluated even if no time is left.
        """
        waiting = list(candidates)
        done: list[Candidate] = []
        if not self.tried and waiting and self.budget.over:
            first = _evaluated(self.problem, iterations, -math.inf, waiting[0], _LEAST)
            done, waiting = [] if first is None else [first], []
        evaluated = evaluate_all(self.problem, waiting, iterations, self.budget.deadline, self.pool)
        done += [one for one in evaluated if one is not None]
        self.tried += done
        return done

    def halve(
        self, candidates: Iterable[Candidate], iterations: Sequence[int], *, keep: float = 0.5
    ) -> list[Candidate]:
        """Return what is left of the candidates, best first, after rounds of so many more iterations each.

        From one round to the next the share `keep` of the candidates goes on, one at least.
        """
        left = sorted(self.try_all(candidates, iterations[0]), key=_error)
        for more in iterations[1:]:
            chosen = left[: max(1, round(keep * len(left)))]
            if self.budget.over:
                break
            again = self.try_all(chosen, more)
            for old in chosen[: len(again)]:
                self.tried.remove(old)
            left = sorted([*again, *chosen[len(again) :]], key=_error)
        return left

    def grow(
        self,
        starts: Callable[[int, Candidate | None], Iterable[Candidate]],
        ladder: Iterable[int],
        iterations: int,
        *,
        begin: Candidate | None = None,
        target: float = 0.0,
        patience: int | None = None,
        gain: float = 1.0,
        judge: Callable[[Candidate], Candidate] | None = None,
    ) -> Candidate | None:
        """Return the best network of sizes upwards.

        For each number of units of the ladder `starts` gives candidates, from the best network so far; `begin` is the
        best before the first size. It ends at the error `target`, or after so many sizes in a row as `patience` without
        a gain: an error below `gain` times the best. `judge` measures the winner of each size anew, by what sizes are
        then compared.
        """
        best = begin
        idle = 0
        for units in ladder:
            if best is not None and (
                best.error <= target or self.budget.over or (patience is not None and idle >= patience)
            ):
                break
            results = self.try_all(starts(units, best), iterations)
            if not results:
                break
            winner = min(results, key=_error)
            if judge is not None:
                self.tried = [one for one in self.tried if one not in results]
                winner = judge(winner)
                self.tried.append(winner)
            idle = 0 if best is None or winner.error < gain * best.error else idle + 1
            best = winner if best is None or winner.error < best.error else best
        return best


def evaluate_all(
    problem: Searchable, candidates: Sequence[Candidate], iterations: int, deadline: float, pool: Pool | None
) -> list[Candidate | None]:
    """Return each candidate after so many more iterations; nothing for those that time does not suffice for."""
    evaluate = partial(_evaluated, problem, iterations, deadline)
    return list(map(evaluate, candidates)) if pool is None else pool.map(evaluate, candidates)


def sizes(first: int, most: int) -> list[int]:
    """Return numbers of units from `first` to `most`: every one up to six, then a third more each time, and `most`."""
    ladder, h = [], first
    while h < most:
        ladder.append(h)
        h = h + 1 if h < 6 else round(_STEP * h)
    return [*ladder, most] if most >= first else []


def _evaluated(
    problem: Searchable, iterations: int, deadline: float, candidate: Candidate, least: float = 0.0
) -> Candidate | None:
    """Return the candidate after more iterations; nothing where the time is over."""
    began = time.monotonic()
    left = max(deadline - began, least)
    if left <= 0:
        return None
    seconds = least if least else None if math.isinf(left) else left
    result = problem.evaluate(candidate, iterations, seconds)
    return replace(result, seconds=candidate.seconds + time.monotonic() - began)


def _error(candidate: Candidate) -> float:
    return candidate.error
