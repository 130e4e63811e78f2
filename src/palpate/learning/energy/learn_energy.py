"""From solves of a body to its energy: the baseline chosen, the network found, and what it is trusted with."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.format import share
from palpate.learning.energy.energy_export import export_network, trained_region, training_meta
from palpate.learning.energy.energy_images import images_of
from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.energy.energy_search import search_energy
from palpate.learning.energy.suspect_solves import SuspectSolve, suspect_solves
from palpate.learning.energy.trust import trust_of
from palpate.learning.search import Budget, Candidate, Search, Trial
from palpate.learning.starts import random_units
from palpate.options import EnergyOptions, takes
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import Baseline, Continuation, LearntEnergy, Solves

__all__ = ["EnergyHistory", "learn_energy"]

_CHOICE_SHARE = 0.15  # of a limit on time
_CHOICE_UNITS, _CHOICE_ITERATIONS = 3, 40
_BETTER = 0.8  # of the error, for another baseline than the one kept in doubt
_GOOD = 0.02  # error with an affine factor alone, at which no other form of a baseline is made
_NEARLY = 0.9  # of the wanted depth: depth series are shifted at random and end just before it


@dataclass(frozen=True, eq=False)
class EnergyHistory:
    """Record of the search for an energy."""

    trials: tuple[Trial, ...]  # all networks that were tried, in order
    errors: np.ndarray  # (N,), relative force error of each solve in contact when it is left out
    # of the mean of networks chosen: what it misses of solves left out, by closed form and refined again
    # without them, as a geometric mean
    loo: float
    meta: dict[str, Any]  # what the body's record tells of the training
    # solves that contradict their neighbours; they were learnt from like all others
    suspects: tuple[SuspectSolve, ...] = ()

    def renumber(self, rows: np.ndarray) -> EnergyHistory:
        """Return the history whose suspects have the numbers `rows` (N,) of their solves; negative ones are dropped."""
        named = [replace(one, solve=int(rows[one.solve])) for one in self.suspects]
        return replace(self, suspects=tuple(one for one in named if one.solve >= 0))

    def __str__(self) -> str:
        median, p95 = (share(float(np.quantile(self.errors, q))) for q in (0.5, 0.95))
        words = "".join(f"; {one}" for one in self.suspects)
        return (
            f"{self.meta['solves']} solves, {len(self.trials)} networks of the energy tried; a solve left out is "
            f"missed by {median} of its force (median), {p95} (95th percentile){words}"
        )

    __repr__ = __str__


@takes(EnergyOptions)
def learn_energy(
    solves: Solves,
    baseline: Baseline,
    *,
    rivals: Callable[[], Sequence[Baseline]] | None = None,
    on_step: Callable[[str], None] = lambda _: None,
    options: EnergyOptions,
) -> tuple[LearntEnergy, EnergyHistory]:
    """Learn the energy of a body from solves.

    Parameters
    ----------
    solves : Solves
        Inputs, energies, forces and stiffnesses, and the body's symmetry.
    baseline : Baseline
        What of the energy is known beforehand.
    rivals : callable, optional
        Gives other forms of it, one of which takes its place where solves that are left out are missed less by an
        affine factor alone. Asked only where the factor on `baseline` misses more than 2 %.
    on_step : callable
        Told each step of the search that begins, in words; by default nobody is.

    Returns
    -------
    LearntEnergy
        The energy with its trained region, continuation and posterior.
    EnergyHistory
        How it was found.

    Raises
    ------
    UsageError
        If solves, symmetry or options do not fit.
    """
    budget = Budget.of(options.effort, options.seconds)
    samples, images = EnergySamples.of(solves, baseline), images_of(solves, baseline)

    problem_of = partial(_problem, samples, images, options)
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        trials: tuple[Trial, ...] = ()
        if options.choose and rivals is not None:
            baseline, trials = _choose_form(baseline, rivals, problem_of, budget.part(_CHOICE_SHARE))
        if options.choose and len(baseline.candidates()) > 1:
            part = budget.part(_CHOICE_SHARE)
            baseline, more = _choose_baseline(baseline.candidates(), problem_of, part, options.seed)
            trials = (*trials, *more)
        problem = problem_of(baseline)
        ensemble, further = search_energy(problem, options=options, budget=budget, on_step=on_step)
        trust = trust_of(ensemble, samples)
        suspects = suspect_solves(samples, baseline, images)
    meta = training_meta(samples, ensemble, trust.errors)
    network, root = export_network(ensemble, trust.root, samples, meta)
    energy = LearntEnergy(
        network,
        baseline,
        region=trained_region(samples, images),
        continuation=Continuation.of(
            solves.inputs,
            deepest=_reached(samples.depth, options.deepest),
            share=baseline.share,
            felt=len(baseline.directions),
        ),
        root=root,
    )
    return energy, EnergyHistory((*trials, *further), trust.errors, ensemble.error, meta, suspects)


def _problem(
    samples: EnergySamples, images: Images | None, options: EnergyOptions, baseline: Baseline
) -> EnergyProblem:
    finest = baseline.finest(samples.inputs)
    return EnergyProblem(
        samples.scaled,
        samples.rows(baseline),
        images,
        ridge=baseline.ridge if options.ridge is None else options.ridge,
        finest=None if finest is None else finest / samples.half,
        tolerance=options.tolerance,
    )


def _choose_form(
    baseline: Baseline,
    rivals: Callable[[], Sequence[Baseline]],
    problem_of: Callable[[Baseline], EnergyProblem],
    budget: Budget,
) -> tuple[Baseline, tuple[Trial, ...]]:
    """Return the form of a baseline of least leave-one-solve-out error with an affine factor and no units.

    The one to begin with is kept unless another misses a fifth less, or if it misses next to nothing.
    """

    def judge(form: Baseline) -> Search:
        problem = problem_of(form)
        regressors = problem.regressors("rotated", "inverse-multiquadric")
        search = Search(problem, budget)
        search.try_all([Candidate(regressors, np.zeros((0, regressors.form.size)), f"{form}")], 0)
        return search

    searches = [judge(baseline)]
    if searches[0].best.error <= _GOOD:
        return baseline, tuple(searches[0].trials)
    forms = [baseline, *rivals()]
    searches += [judge(form) for form in forms[1:]]
    errors = [search.best.error for search in searches]
    least = int(np.argmin(errors))
    trials = tuple(trial for search in searches for trial in search.trials)
    return forms[least if errors[least] < _BETTER * errors[0] else 0], trials


def _choose_baseline(
    candidates: Sequence[Baseline],
    problem_of: Callable[[Baseline], EnergyProblem],
    budget: Budget,
    seed: int,
) -> tuple[Baseline, tuple[Trial, ...]]:
    """Return the baseline of least leave-one-solve-out error with three units or none.

    All begin with the same units, and are judged in the same relative errors of energy, force and stiffness. The first
    is kept unless another misses a fifth less: small networks judge coarsely. Of few depth series three units go wild,
    an affine factor does not.
    """
    errors: list[float] = []
    trials: list[Trial] = []
    for baseline in candidates:
        problem = problem_of(baseline)
        regressors = problem.regressors("rotated", "inverse-multiquadric")
        count = min(_CHOICE_UNITS, problem.room(regressors))
        units = random_units(regressors.form, problem.X, count, np.random.default_rng(seed))
        search = Search(problem, budget)
        starts = [Candidate(regressors, some, f"{baseline}") for some in (units[:0], units)]
        search.try_all(starts, budget.count(_CHOICE_ITERATIONS, 10))
        errors.append(search.best.error)
        trials += search.trials
    least = int(np.argmin(errors))
    return candidates[least if errors[least] < _BETTER * errors[0] else 0], tuple(trials)


def _reached(depths: np.ndarray, wanted: float | None) -> float:
    """Return the depth to which samples at `depths` (N,) teach; spread to the wanted one, they end just before it."""
    if wanted is None:
        return math.inf
    own = float(depths.max())
    return wanted if _NEARLY * wanted <= own <= wanted else own
