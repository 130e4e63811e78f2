"""Networks of one kind from several starts and folds, and what their mean is expected to miss.

The squared error of a mean is the mean squared error less the members' spread about it (Krogh & Vedelsby 1995, eq. 6).
The spread needs no outputs, so what a mean would gain is known before it is believed.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.arrays.held_out import RIDGE, HeldOut, carry
from palpate.learning.search import Candidate
from palpate.rbf.refinement.projection import project
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.refinement.rows import Rows

__all__ = ["ROWS", "Fresh", "Member", "expected_error", "refit_weights"]

ROWS = 4000
"""Samples by which a ridge is chosen and a covariance is made; more would say the same and take longer."""

LOOK_SAMPLES = 1000
"""Samples from which a start is refined before it sees all of them."""

_RIDGES = tuple(10.0**k for k in range(-13, -2))


@dataclass(frozen=True, eq=False)
class Member:
    """A refined network whose weights were fitted to all samples, and its error on the ones it was judged by.

    Attributes
    ----------
    network : Refined
        In scaled inputs and latent outputs.
    error : float
        Per scaled output on the held-out samples, before the weights saw them.
    before : Refined, optional
        The same before the weights saw them.
    split : HeldOut, optional
        Which samples these are.
    """

    network: Refined
    error: float
    before: Refined | None = None
    split: HeldOut | None = None


def refit_weights(network: Refined, X: np.ndarray, Y: np.ndarray, ridge: float = RIDGE) -> Refined:
    """Return the same units with weights from all samples; the ridge by leave-one-out error, `ridge` at least."""
    some = X, Y
    if len(X) > ROWS:
        rows = np.sort(np.random.default_rng(0).choice(len(X), ROWS, replace=False))
        some = X[rows], Y[rows]

    def fit(penalty: float) -> Refined:
        return refine(*some, network.theta, network.regressors, ridge=penalty, iterations=0)

    best, chosen = fit(ridge), ridge
    for penalty in (r for r in _RIDGES if r > ridge):
        other = fit(penalty)
        if not other.loo < best.loo:  # as many unknowns as samples judge nothing: both are infinite
            break
        best, chosen = other, penalty
    if len(X) <= ROWS:
        return best
    problem = Rows.of(network.regressors, X, Y)
    solution = project(problem, network.theta, chosen * problem.total)
    return replace(best, coefficients=solution.coefficients @ problem.modes)


def expected_error(members: Sequence[Member], X: np.ndarray) -> float:
    """Return the error per scaled output to expect of the members' mean, from their spread between the samples X.

    At the samples themselves they agree more than elsewhere; so the columns of X (N, n) are shuffled.
    """
    X = np.random.default_rng(0).permuted(X[:ROWS], axis=0)
    answers = np.array([member.network.predict(X) for member in members])
    spread = float(((answers - answers.mean(axis=0)) ** 2).mean())
    single = float(np.mean([member.error**2 for member in members]))
    # members judged on different samples agree only on average: no gain beyond √K is believed
    return float(np.sqrt(max(single - spread, single / len(members))))


@dataclass(frozen=True, eq=False)
class Fresh:
    """The recipe of another network like one that was found, from another start.

    Attributes
    ----------
    like : Candidate
        The network that was found: its kind and its number of units are taken.
    scales : (n,) array
        Of first units.
    deadline : float
        Of `time.monotonic`.
    """

    like: Candidate
    scales: np.ndarray
    deadline: float

    def refined(self, where: tuple[HeldOut, int]) -> Candidate | None:
        """Return the network refined on a split from a start of a seed; nothing where the time does not suffice."""
        split, seed = where
        regressors = self.like.regressors
        fresh = split.enter(regressors.form.name, self.like.theta.size, self.scales, seed)
        for problem, iterations in ((split.first(LOOK_SAMPLES), 15), (split, max(30, self.like.iterations))):
            left = self.deadline - time.monotonic()
            if left <= 0:
                return None
            fresh = problem.evaluate(fresh, iterations, None if np.isinf(left) else left)
            if problem.partial:
                fresh = carry(fresh, regressors.radial)
        return fresh

    def work(self, split: HeldOut) -> float:
        """Return the multiplications that a refinement and the fit of its weights take at most."""
        columns, samples = len(self.like.theta), len(split.X) + len(split.unseen[0])
        first = 15 * split.first(LOOK_SAMPLES).work(self.like)
        return first + max(30, self.like.iterations) * split.work(self.like) + 4.0 * samples * columns**2
