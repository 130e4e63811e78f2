"""Several networks of one form, averaged into one network: what each got wrong by chance cancels.

The squared error of the average is the average squared error less the members' spread about it (Krogh & Vedelsby
1995, eq. 6). The spread needs no outputs, so what a committee would gain is known before it is believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.learning.choosing.race import Split
from palpate.rbf.refinement.refine import Refined, refine

__all__ = ["Member", "averaged", "expected_error", "refitted"]

_RIDGES = tuple(10.0**k for k in range(-13, -2))


@dataclass(frozen=True, eq=False)
class Member:
    """A refined network whose weights were fitted to all samples, and its error on the ones it was judged by.

    Attributes
    ----------
    found : Refined
    heldout : float
        Error per scaled output before the weights saw the held-out samples.
    before : Refined, optional
        The same before the weights saw them.
    split : Split, optional
        Which samples these are.
    """

    found: Refined
    heldout: float
    before: Refined | None = None
    split: Split | None = None


def refitted(found: Refined, X: np.ndarray, Y: np.ndarray, ridge: float) -> Refined:
    """The same units with weights from all samples; the ridge by leave-one-out error, `ridge` at least."""

    def fit(penalty: float) -> Refined:
        return refine(X, Y, found.theta, found.regressors, ridge=penalty, iterations=0)

    best = fit(ridge)
    for penalty in (r for r in _RIDGES if r > ridge):
        other = fit(penalty)
        if not other.loo < best.loo:  # as many unknowns as samples judge nothing: both are infinite
            break
        best = other
    return best


def expected_error(members: Sequence[Member], X: np.ndarray) -> float:
    """Error per scaled output to expect of the members' average, from their spread between the samples X (N, n).

    At the samples themselves they agree more than elsewhere; so the columns of X are shuffled.
    """
    X = np.random.default_rng(0).permuted(X, axis=0)
    answers = np.array([member.found.predict(X) for member in members])
    spread = float(((answers - answers.mean(axis=0)) ** 2).mean())
    single = float(np.mean([member.heldout**2 for member in members]))
    # members judged on different samples agree only on average: no gain beyond √K is believed
    return float(np.sqrt(max(single - spread, single / len(members))))


def averaged(members: Sequence[Member]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Factors (h, r, n), shifts (h, r), weights (h, k) and tail (p_t, k) of the average as one network."""
    count = len(members)
    parts = [member.found.regressors.form.factors(member.found.theta) for member in members]
    return (
        np.concatenate([A for A, _ in parts]),
        np.concatenate([b for _, b in parts]),
        np.concatenate([member.found.weights for member in members]) / count,
        np.mean([member.found.tail for member in members], axis=0),
    )
