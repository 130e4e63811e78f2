"""What networks miss of solves that were really left out: refined again without them, fold by fold.

The closed form by which a search goes (`palpate.rbf.refinement.leave_one_out`) counts units as unknowns of a
linearised problem. It costs next to nothing, but with few solves a unit that is left without its own could go
anywhere in that problem: errors come out several times too large, and the order of networks is lost. Refining again
from the units as they are is what cross-validation means (Stone 1974), and takes a few iterations for each fold. Units
that have seen a solve remember it, though, so that of very few solves this says too little: networks are chosen by
the geometric mean of both.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from palpate.learning.energy.average import Average
from palpate.learning.energy.search import LeftOut, Problem, Search
from palpate.rbf.refinement.refine import Refined

__all__ = ["folds", "judged", "left_out_again", "restored"]

_FOLDS = 8
_ITERATIONS = 20  # with 60 of ten solves the errors are up to 1.8 times larger, and order networks no better
_MOST = 24  # networks: what a third of a minute is enough for with 40 solves
_SEED = 0  # one for all networks, which are compared over the same folds


def judged(search: Search, deadline: float) -> list[Average]:
    """The search's networks, best by the closed form first, while there is time (`time.monotonic`): at least one."""
    order = sorted(search.found, key=lambda one: one.error)[:_MOST]
    found: list[Average] = []
    for one in order:
        again = left_out_again(one.network, search.problem)
        closed = replace(again, errors=one.errors, together=again.rows.groups)
        found.append(Average((one.network,), again, closed))
        if time.monotonic() >= deadline:
            break
    return found


def restored(problem: Problem, network: Refined, again: np.ndarray, closed: np.ndarray) -> Average:
    """A network that was judged elsewhere, of the errors (R, 1) of every row both ways."""
    rows, fit = problem.fitted(network)
    fold = folds(rows.groups)
    together = rows.groups if fold.max() == 0 else fold
    return Average((network,), LeftOut(rows, fit, again, together), LeftOut(rows, fit, closed, rows.groups))


def left_out_again(network: Refined, problem: Problem) -> LeftOut:
    """Errors of every row by a network that was refined again without the row's fold."""
    rows, fit = problem.fitted(network)
    fold = folds(rows.groups)
    if fold.max() == 0:
        return problem.missed(network)  # a single group can't be left out
    of_row, missed = fold[rows.samples], np.empty_like(rows.targets)
    for k in range(fold.max() + 1):
        kept = problem.of(fold != k)
        again = kept.refined(network.theta, network.regressors, iterations=_ITERATIONS)
        # in the modes of all rows: one output has one, which may only change its sign
        answers = rows.matrix(again.theta)[: len(missed)] @ again.coefficients @ rows.modes.T
        missed[of_row == k] = (rows.targets - answers)[of_row == k]
    return LeftOut(rows, fit, missed, fold)


def folds(groups: np.ndarray) -> np.ndarray:
    """Folds (N,) of samples whose groups are 0, 1, …: groups stay whole, and are dealt out at random."""
    order = np.random.default_rng(_SEED).permutation(int(groups.max()) + 1)
    return np.asarray(order[groups] % _FOLDS)
