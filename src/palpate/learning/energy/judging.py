"""What networks miss of solves that were really left out: refined again without them, fold by fold.

The closed form by which a search goes (`palpate.learning.refinement.leave_one_out`) counts units as unknowns of a
linearised problem. It costs next to nothing, but with few solves a unit that is left without its own could go
anywhere in that problem: errors come out several times too large, and the order of networks is lost. Refining again
from the units as they are is what cross-validation means (Stone 1974), and takes a few iterations for each fold. Units
that have seen a solve remember it, though, so that of very few solves this says too little: networks are chosen by
the geometric mean of both.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.energy.search import LeftOut, Problem, Search
from palpate.learning.refinement.refine import Refined

__all__ = ["Judged", "folds", "judged", "left_out_again"]

_FOLDS = 8
_ITERATIONS = 20  # with 30 the errors are the same within a tenth
_MOST = 24  # networks: what the closed form puts behind these is never the best


@dataclass(frozen=True, eq=False)
class Judged:
    """A network, or a mean of some, with what it misses of solves that are left out.

    Attributes
    ----------
    networks : tuple of Refined
    left_out : LeftOut
        Refined again without them.
    closed : LeftOut
        By the closed form.
    """

    networks: tuple[Refined, ...]
    left_out: LeftOut
    closed: LeftOut

    @property
    def error(self) -> float:
        """Geometric mean of both means over solves."""
        return math.sqrt(self.left_out.mean * self.closed.mean)

    @property
    def units(self) -> int:
        """Of the networks, images counted."""
        return sum(one.regressors.copies * len(one.theta) for one in self.networks)

    def with_one(self, other: Judged) -> Judged:
        """The mean of these networks and one more."""
        count = len(self.networks)

        def mean(own: LeftOut, new: LeftOut) -> LeftOut:
            return replace(own, errors=(count * own.errors + new.errors) / (count + 1))

        networks = (*self.networks, *other.networks)
        return Judged(networks, mean(self.left_out, other.left_out), mean(self.closed, other.closed))


def judged(search: Search, deadline: float, seed: int = 0) -> list[Judged]:
    """The search's networks, best by the closed form first, while there is time (`time.monotonic`): at least one."""
    order = sorted(search.found, key=lambda one: one.error)[:_MOST]
    found: list[Judged] = []
    for one in order:
        again = left_out_again(one.network, search.problem, seed)
        found.append(Judged((one.network,), again, replace(again, errors=one.errors)))
        if time.monotonic() >= deadline:
            break
    return found


def left_out_again(network: Refined, problem: Problem, seed: int = 0) -> LeftOut:
    """Errors of every row by a network that was refined again without the row's fold."""
    rows, fit = problem.fitted(network)
    fold = folds(rows.groups, seed)
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


def folds(groups: np.ndarray, seed: int = 0) -> np.ndarray:
    """Folds (N,) of samples whose groups are 0, 1, …: groups stay whole, and are dealt out at random."""
    order = np.random.default_rng(seed).permutation(int(groups.max()) + 1)
    return np.asarray(order[groups] % _FOLDS)
