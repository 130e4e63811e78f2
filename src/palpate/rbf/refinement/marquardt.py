"""One step of Levenberg–Marquardt: a Gauss–Newton matrix, damped; units held back.

Damping follows the ratio of gained to predicted descent (Marquardt 1963; Moré 1978). A step's units are held back
one by one: a unit that the data hardly see asks for leaps, and must neither get them nor stop the others.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from palpate.rbf.units.forms import Form

__all__ = ["DAMPING", "Scaled", "held_back", "next_damping"]

DAMPING = (1e-12, 1e12)
_LONGEST = 1.0  # largest change of a log width, or of a centre in units of its width, in one iteration
_FLOOR = 1e-2  # of the mean curvature: a unit of hardly any weight would else move freely


class Scaled:
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
        L, failed = self._factor(H, lower=1, overwrite_a=1, clean=0)
        if failed:
            return None
        found = np.asarray(self._solve(L, self._descent.astype(self._kind), lower=1)[0], float)
        return found * self._shrink if np.isfinite(found).all() else None

    def predicted(self, step: np.ndarray) -> float:
        """How much the cost falls along a step, to second order."""
        s = step / self._shrink
        return float(2.0 * self._descent @ s - s @ self._times(1.0, self._G, s.astype(self._kind), lower=1))


def next_damping(damping: float, ratio: float) -> float:
    """Less damping after steps that kept their promise, more after those that did not."""
    factor = 0.2 if ratio > 0.75 else 0.5 if ratio > 0.4 else 1.0 if ratio > 0.2 else 2.0
    return max(damping * factor, DAMPING[0])


def held_back(form: Form, theta: np.ndarray, step: np.ndarray) -> np.ndarray:
    """A step (h, p), shortened unit by unit so that no width or centre leaps."""
    if form.stride(theta, step) <= _LONGEST:
        return step
    longest = np.array([form.stride(theta[k : k + 1], step[k : k + 1]) for k in range(len(theta))])
    return np.asarray(step * np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-300))[:, None])
