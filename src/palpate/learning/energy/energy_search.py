"""The search for an energy's network: kinds of units, growth of the best two, random starts, and a mean of the best.

Every kind of unit is tried at one size, and one of them with few units and none; the best three grow while more units
gain; then random starts of about the best size race by successive halving. The best networks are judged by refining
them again without some of the solves, and the mean of those that together miss least is the result.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import cast

import numpy as np

from palpate.learning.energy.energy_problem import EnergyProblem, LeftOut, mean_error
from palpate.learning.ensemble import Ensemble, ScoredNetwork, select_members
from palpate.learning.pool import Pool
from palpate.learning.search import Budget, Candidate, Search, Trial, sizes
from palpate.learning.starts import random_units
from palpate.network.radial import RadialFunction
from palpate.options import EnergyOptions, takes
from palpate.rbf.regressors import Regressors

__all__ = ["STEPS", "EnergyEnsemble", "best_mean", "score", "search_energy"]

_FORMS = ("rotated", "axis-aligned", "rank-2")  # the last for more inputs than the position
_RADIALS: tuple[RadialFunction, ...] = ("inverse-multiquadric", "matern-5/2", "gaussian")
_KIND_UNITS, _KIND_STARTS, _KIND_ITERATIONS = 6, 2, 60  # of the networks by which kinds are compared
# beside none; of 40 solves at eight places of an uneven body six units miss several times as much as none
_FEW_UNITS = (1, 2, 3)
_FEW_SEED = 1000  # added to the seed, so that all other starts stay as they are
_WIDTHS, _WIDE = (
    (0.2, 1.0),
    (1.0, 4.0),
)  # of random units, in scaled inputs; wide ones bend ℓ a little all over
_GROWN_KINDS, _GROWTH_ITERATIONS = 3, 120
_PATIENCE = 3  # sizes without a gain, after which growth ends
_FEW_SOLVES = 40  # can't tell more networks apart; of more solves counts grow with the root of their number
_RANDOM_STARTS = 24  # of few solves
_ROUNDS = (50, 100)  # iterations of random starts, the better half going on
_SAME_KIND = 0.5  # share of random starts of the best one's kind, so that a mean has some to choose from
_RELATIVE_SIZES = (0.7, 1.5)  # of random starts, over the units of the best network
_CROSS_VALIDATED = 20  # networks that are refined again without a fold, of few solves
_MEAN_UNITS = 320  # of a mean, images counted: a query costs about 25 ns for each
_SCATTER = 0.05  # of random units about the solves, in scaled inputs
_SEARCH_SHARE = 0.65  # of a limit on time; the rest is for judging


@dataclass(frozen=True, eq=False)
class EnergyEnsemble(Ensemble):
    """The networks of an energy, and what their mean misses of solves left out."""

    # by networks that were each refined again without a fold; rows and fit are the best one's
    left_out: LeftOut
    error: float  # geometric mean over solves of what is missed by refining again and by the closed form


STEPS = ("kinds of networks", "more units", "random starts", "judging")
"""The steps of the search, in words."""


@takes(EnergyOptions)
def search_energy(
    problem: EnergyProblem,
    *,
    options: EnergyOptions,
    budget: Budget | None = None,
    on_step: Callable[[str], None] = lambda _: None,
) -> tuple[EnergyEnsemble, tuple[Trial, ...]]:
    """Return the mean of the best networks, and the records of all that were tried; `on_step` gets each of `STEPS`."""
    budget, pool = budget or Budget(), Pool(options.workers)
    search = Search(problem, budget.part(_SEARCH_SHARE), pool)
    _search_structure(search, options, on_step)
    on_step(STEPS[3])
    order = sorted(search.tried, key=lambda one: one.error)[
        : budget.count(_CROSS_VALIDATED * _worthwhile(problem), 2)
    ]
    scored = pool.map(partial(_score_in_time, problem, budget.deadline), list(enumerate(order)))
    ensemble = best_mean(problem, [one for one in scored if one is not None], options.networks)
    return ensemble, search.trials


def best_mean(
    problem: EnergyProblem, scored: Sequence[ScoredNetwork], most: int, units: int = _MEAN_UNITS
) -> EnergyEnsemble:
    """Return the mean of at most so many scored networks, of no more than so many units, that misses least."""
    rows = problem.fitted(scored[0].network)[0]

    def error(misses: tuple[np.ndarray, ...]) -> float:
        return math.sqrt(math.prod(mean_error(rows, miss) for miss in misses))

    members, misses = select_members(scored, error, most=most, units=units)
    best = members[0].network
    rows, fit = problem.fitted(best)
    left_out = LeftOut(rows, fit, misses[0], problem.folds(rows.groups))
    return EnergyEnsemble(tuple(one.network for one in members), left_out, error(misses))


def score(problem: EnergyProblem, candidate: Candidate, seconds: float | None = None) -> ScoredNetwork:
    """Return a candidate's network with what it misses: refined again without each fold, and by the closed form."""
    assert candidate.network is not None
    again = problem.cross_validate(candidate.network, seconds=seconds)
    return ScoredNetwork(candidate.network, (again.errors, candidate.detail))


def _score_in_time(
    problem: EnergyProblem, deadline: float, numbered: tuple[int, Candidate]
) -> ScoredNetwork | None:
    """Return a candidate's network with its errors; None where the time is over, but for the first."""
    number, candidate = numbered
    if math.isinf(deadline):
        return score(problem, candidate)
    left = deadline - time.monotonic()
    return score(problem, candidate, max(left, 0.1)) if left > 0 or number == 0 else None


def _search_structure(search: Search, options: EnergyOptions, on_step: Callable[[str], None]) -> None:
    """Try every kind of unit at one size, grow the best, and try random starts about the best size."""
    problem, budget = search.problem, search.budget
    assert isinstance(problem, EnergyProblem)
    starts = _Starts(problem, options.units_max, options.seed)
    on_step(STEPS[0])
    kinds = [problem.regressors(*kind) for kind in _kinds(options, problem.X.shape[1])]
    best_of_kinds = search.try_all(
        (starts.random(kind, _KIND_UNITS, "kind") for kind in kinds for _ in range(_KIND_STARTS)),
        budget.count(_KIND_ITERATIONS, 10),
    )
    best_of_kinds += search.try_all(
        _few_units(problem, kinds[0], options), budget.count(_KIND_ITERATIONS, 10)
    )
    best_of_kinds.sort(key=lambda one: one.error)
    best_of_kinds = list({one.kind: one for one in reversed(best_of_kinds)}.values())[::-1]
    on_step(STEPS[1])
    iterations = budget.count(_GROWTH_ITERATIONS, 10)
    for one in best_of_kinds[:_GROWN_KINDS]:
        ladder = sizes(max(len(one.theta), 2), starts.most(one.regressors))
        search.grow(
            partial(starts.grown, one.regressors),
            ladder,
            iterations,
            begin=one,
            target=options.target,
            patience=_PATIENCE,
        )
    best = search.best
    if best.error <= options.target or not len(best.theta):
        return
    rng = np.random.default_rng([options.seed, len(best_of_kinds)])
    further = []
    for _ in range(budget.count(_RANDOM_STARTS * _worthwhile(problem), 0)):
        another = best_of_kinds[int(rng.integers(min(3, len(best_of_kinds))))]
        regressors = (best if rng.random() < _SAME_KIND else another).regressors
        units = max(1, round(len(best.theta) * rng.uniform(*_RELATIVE_SIZES)))
        further.append(starts.random(regressors, units, "random"))
    if further:
        on_step(STEPS[2])
        search.halve(further, [budget.count(k, 5) for k in _ROUNDS])


def _few_units(problem: EnergyProblem, kind: Regressors, options: EnergyOptions) -> list[Candidate]:
    """Return the affine factor alone, and networks of few units, usual and wide ones."""
    candidates = [Candidate(kind, np.zeros((0, kind.form.size)), "few")]
    for widths in (_WIDTHS, _WIDE):
        starts = _Starts(problem, options.units_max, options.seed + _FEW_SEED, widths)
        candidates += [starts.random(kind, units, "few") for units in _FEW_UNITS]
    return candidates


@dataclass(eq=False)
class _Starts:
    """Units to begin with, drawn by a seed."""

    problem: EnergyProblem
    units_max: int
    seed: int
    widths: tuple[float, float] = _WIDTHS
    drawn: int = 0

    def most(self, regressors: Regressors) -> int:
        """Return the largest number of units of a kind."""
        return min(self.units_max // regressors.copies, self.problem.room(regressors))

    def random(self, regressors: Regressors, units: int, start: str) -> Candidate:
        return Candidate(regressors, self._units(regressors, min(units, self.most(regressors))), start)

    def grown(self, regressors: Regressors, units: int, best: Candidate | None) -> Iterator[Candidate]:
        """Yield the best network's units and more, and random ones."""
        if best is not None and 0 < len(best.theta) < units:
            more = self._units(regressors, units - len(best.theta))
            yield Candidate(regressors, np.vstack([best.theta, more]), "grown")
        yield self.random(regressors, units, "random")

    def _units(self, regressors: Regressors, count: int) -> np.ndarray:
        self.drawn += 1
        rng = np.random.default_rng([self.seed, self.drawn])
        return random_units(
            regressors.form, self.problem.X, max(count, 0), rng, widths=self.widths, scatter=_SCATTER
        )


def _worthwhile(problem: EnergyProblem) -> float:
    """Return how many times more networks are worth trying than of few solves, which can't tell them apart."""
    return max(1.0, math.sqrt(len(problem.X) / _FEW_SOLVES))


def _kinds(options: EnergyOptions, inputs: int) -> list[tuple[str, RadialFunction]]:
    """Return forms and radial functions to try: the first of each list with all of the other."""
    forms = [f for f in _FORMS if f != "rank-2" or inputs > 3] if options.form == "auto" else [options.form]
    radials = list(_RADIALS) if options.radial == "auto" else [cast(RadialFunction, options.radial)]
    return [(forms[0], r) for r in radials] + [(f, r) for f in forms[1:] for r in radials[:2]]
