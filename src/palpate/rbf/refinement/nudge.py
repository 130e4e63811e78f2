"""One bounded iteration of the refinement: what a stream can afford between two observations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.rbf.refinement.marquardt import Scaled, held_back, next_damping
from palpate.rbf.refinement.projection import Fit, gauss_newton, project
from palpate.rbf.refinement.rows import Rows

__all__ = ["Nudge", "nudged"]


@dataclass(frozen=True, eq=False)
class Nudge:
    """Outcome of one iteration.

    Attributes
    ----------
    theta : (h, p)
        Units; where they started if no damping helped.
    fit : Fit
        The best weights and tail for them.
    damping : float
        To begin the next iteration with.
    gain : float
        By how much the cost fell through the units' move, relative to what it was with the best weights.
    """

    theta: np.ndarray
    fit: Fit
    damping: float
    gain: float


def nudged(rows: Rows, theta: np.ndarray, penalty: float, *, damping: float = 1e-2, tries: int = 3) -> Nudge:
    """One Levenberg–Marquardt iteration from units θ (h, p), Kaufman's matrix, at most `tries` dampings.

    The cost is bounded: one Gauss–Newton matrix of R rows, R (h p)² operations, and for each damping tried a
    factorisation, (h p)³/3, and a projection, 2 R (h + p_t)².
    """
    fit = project(rows, theta, penalty)
    if not len(theta):
        return Nudge(theta, fit, damping, 0.0)
    G, descent = gauss_newton(rows, theta, fit)
    system = Scaled(G, descent)
    for _ in range(tries):
        step = system.step(damping)
        if step is not None:
            step = held_back(rows.regressors.form, theta, step.reshape(theta.shape))
            new = project(rows, theta + step, penalty)
            gain = fit.cost - new.cost
            if gain > 0:
                ratio = gain / max(system.predicted(step.ravel()), 1e-300)
                return Nudge(theta + step, new, next_damping(damping, ratio), gain / fit.cost)
        damping *= 4.0
    return Nudge(theta, fit, min(damping, 1e6), 0.0)
