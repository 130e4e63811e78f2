"""Steps of Levenberg–Marquardt: a Gauss–Newton matrix, damped; units held back.

Damping follows the ratio of gained to predicted descent (Marquardt 1963; Moré 1978). A step's units are held back
one by one: a unit that the data hardly see asks for leaps, and must neither get them nor stop the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas, lapack

from palpate.rbf.forms import Form
from palpate.rbf.refinement.projection import Fit, gauss_newton, project
from palpate.rbf.refinement.rows import Rows

__all__ = [
    "DAMPING",
    "MORE",
    "DampedSystem",
    "LevenbergStep",
    "bounded_step",
    "damped_step",
    "levenberg_step",
    "next_damping",
]

DAMPING = (1e-12, 1e12)  # least and largest damping
MORE = 4.0  # factor of the damping after a step that did not help
_LONGEST = 1.0  # largest change of a log width, or of a centre in units of its width, in one iteration
_FLOOR = 1e-2  # share of the mean curvature: a unit of hardly any weight would else move freely


class DampedSystem:
    """A Gauss–Newton matrix with its diagonal made one, solved for any damping without forming it again."""

    def __init__(self, G: np.ndarray, descent: np.ndarray) -> None:
        curvature = np.diagonal(G).astype(float)
        self._shrink = 1.0 / np.sqrt(curvature + _FLOOR * max(float(curvature.mean()), 1e-300))
        kind = G.dtype.type
        G *= self._shrink.astype(kind)[:, None]
        G *= self._shrink.astype(kind)
        self._G, self._descent, self._kind = G, descent * self._shrink, kind
        single = kind is np.float32
        self._factor, self._solve = (
            (lapack.spotrf, lapack.spotrs) if single else (lapack.dpotrf, lapack.dpotrs)
        )
        self._times = blas.ssymv if single else blas.dsymv

    def step(self, damping: float) -> np.ndarray | None:
        """The damped step (h p,), or None where the matrix is not positive definite to its precision."""
        H = self._G.copy(order="F")
        H[np.diag_indices(len(H))] += self._kind(damping)
        L, info = self._factor(H, lower=1, overwrite_a=1, clean=0)
        if info:
            return None
        step = np.asarray(self._solve(L, self._descent.astype(self._kind), lower=1)[0], float)
        return step * self._shrink if np.isfinite(step).all() else None

    def predicted_gain(self, step: np.ndarray) -> float:
        """The fall of the cost along a step, to second order."""
        s = step / self._shrink
        return float(2.0 * self._descent @ s - s @ self._times(1.0, self._G, s.astype(self._kind), lower=1))


@dataclass(frozen=True, eq=False)
class LevenbergStep:
    """Outcome of one iteration."""

    theta: np.ndarray  # (h, p), units; where they started if no damping helped
    fit: Fit  # the best weights and tail for them
    damping: float  # the next iteration begins with it
    gain: float  # by how much the cost fell through the units' move


def damped_step(
    rows: Rows, theta: np.ndarray, fit: Fit, penalty: float, system: DampedSystem, damping: float
) -> LevenbergStep | None:
    """One step from units θ (h, p) and their fit with that damping; None where it does not lower the cost."""
    step = system.step(damping)
    if step is None:
        return None
    step = bounded_step(rows.regressors.form, theta, step.reshape(theta.shape))
    new = project(rows, theta + step, penalty)
    gain = fit.cost - new.cost
    if not gain > 0:
        return None
    ratio = gain / max(system.predicted_gain(step.ravel()), 1e-300)
    return LevenbergStep(theta + step, new, next_damping(damping, ratio), gain)


def levenberg_step(
    rows: Rows, theta: np.ndarray, penalty: float, *, damping: float = 1e-2, tries: int = 3
) -> LevenbergStep:
    """One bounded iteration of the refinement: all that a stream can afford between two observations.

    From units θ (h, p), with Kaufman's matrix and at most `tries` dampings; its `gain` is relative to the cost with
    the best weights. The work is bounded: one Gauss–Newton matrix of R rows, R (h p)² operations, and for each
    damping tried a factorisation, (h p)³/3, and a projection, 2 R (h + p_t)².
    """
    fit = project(rows, theta, penalty)
    if not len(theta):
        return LevenbergStep(theta, fit, damping, 0.0)
    system = DampedSystem(*gauss_newton(rows, theta, fit))
    for _ in range(tries):
        step = damped_step(rows, theta, fit, penalty, system, damping)
        if step is not None:
            return LevenbergStep(step.theta, step.fit, step.damping, step.gain / fit.cost)
        damping *= MORE
    return LevenbergStep(theta, fit, min(damping, 1e6), 0.0)


def next_damping(damping: float, ratio: float) -> float:
    """Less damping after steps that kept their promise, more after those that did not."""
    factor = 0.2 if ratio > 0.75 else 0.5 if ratio > 0.4 else 1.0 if ratio > 0.2 else 2.0
    return max(damping * factor, DAMPING[0])


def bounded_step(form: Form, theta: np.ndarray, step: np.ndarray) -> np.ndarray:
    """A step (h, p), shortened unit by unit so that no width or centre leaps."""
    if form.stride(theta, step) <= _LONGEST:
        return step
    longest = np.array([form.stride(theta[k : k + 1], step[k : k + 1]) for k in range(len(theta))])
    return np.asarray(step * np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-300))[:, None])
