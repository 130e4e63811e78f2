"""Which contact law lets a small network explain the touches best, and at which length it crosses over."""

from __future__ import annotations

import time

import numpy as np

from palpate.learning.energy.samples import EnergySamples
from palpate.learning.energy.search import EnergyTrial, Problem, Search
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import ContactLaw

__all__ = ["chosen_law"]

_UNITS, _ITERATIONS = 3, 40
_BETTER = 0.8
_FACTORS = (1.0, 0.3, 3.0, 0.1, 10.0)


def chosen_law(
    samples: EnergySamples, images: Images | None, guess: float, *, resolved: float, seconds: float, seed: int
) -> tuple[ContactLaw, tuple[EnergyTrial, ...]]:
    """The law of least leave-one-solve-out error with a network of three units.

    Tried are the pure powers, and the series of pad and body that cross at the guess (m), and at 0.1 to 10 times it.
    All begin with the same units, and are judged in the same relative errors of energy, force and stiffness. The
    guess is kept unless another law misses a fifth less: small networks judge coarsely.
    """
    laws = [ContactLaw("series", f * guess) for f in _FACTORS]
    laws += [ContactLaw("hertz"), ContactLaw("pad"), ContactLaw("square")]
    deadline, errors, trials = time.monotonic() + seconds, [], []
    for law in laws:
        problem = Problem(samples.scaled, samples.rows(law, resolved=resolved), images, str(law))
        search = Search(problem, deadline, seed)
        regressors = problem.regressors("rotated", "inverse-multiquadric")
        count = min(_UNITS, problem.room(regressors))
        errors.append(search.tried(search.random(regressors, count), regressors, "law", _ITERATIONS)[1])
        trials += search.trials
    least = int(np.argmin(errors))
    return laws[least if errors[least] < _BETTER * errors[0] else 0], tuple(trials)
