"""Which contact law lets a small network explain the touches best, and at which length it crosses over."""

from __future__ import annotations

import numpy as np

from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.samples import EnergySamples
from palpate.learning.search import Budget, Candidate, Search, Trial
from palpate.learning.starts import random_units
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import ContactLaw

__all__ = ["chosen_law"]

_UNITS, _ITERATIONS = 3, 40
_BETTER = 0.8
_FACTORS = (1.0, 0.3, 3.0, 0.1, 10.0)


def chosen_law(
    samples: EnergySamples, images: Images | None, guess: float, *, resolved: float, budget: Budget, seed: int
) -> tuple[ContactLaw, tuple[Trial, ...]]:
    """The law of least leave-one-solve-out error with a network of three units.

    Tried are the pure powers, and the series of pad and body that cross at the guess (m), and at 0.1 to 10 times it.
    All begin with the same units, and are judged in the same relative errors of energy, force and stiffness. The
    guess is kept unless another law misses a fifth less: small networks judge coarsely.
    """
    laws = [ContactLaw("series", f * guess) for f in _FACTORS]
    laws += [ContactLaw("hertz"), ContactLaw("pad"), ContactLaw("square")]
    errors: list[float] = []
    trials: list[Trial] = []
    for law in laws:
        problem = EnergyProblem(samples.scaled, samples.rows(law, resolved=resolved), images)
        regressors = problem.regressors("rotated", "inverse-multiquadric")
        count = min(_UNITS, problem.room(regressors))
        units = random_units(regressors.form, problem.X, count, np.random.default_rng(seed))
        search = Search(problem, budget)
        search.try_all([Candidate(regressors, units, f"law {law}")], budget.count(_ITERATIONS, 10))
        errors.append(search.best.error)
        trials += search.trials
    least = int(np.argmin(errors))
    return laws[least if errors[least] < _BETTER * errors[0] else 0], tuple(trials)
