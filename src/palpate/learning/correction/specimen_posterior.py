"""The posterior of θ: a mean and a root of its covariance, changed by measurements.

A measurement of linear rows H, whitened, changes the covariance P = S Sᵀ to S (I + JᵀJ)⁻¹ Sᵀ with J = H S. In roots
that is S L⁻ᵀ, L Lᵀ = I + JᵀJ, or for one row after the other (Potter 1963; Bierman 1977, section II.3)

    φ = Sᵀ h,   β = φᵀφ + 1,   S ← S − S φ φᵀ/(β + √β)

so that P is symmetric and positive whatever rounding does. Rows that change with θ are taken anew at each iterate,
from the same prior (Bell & Cathey 1993: the iterated filter is a Gauss–Newton method); a step that does not lower
½‖u‖² + ½‖r‖², θ = mean + S u, is shortened.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.learning.correction.touches import Touches

__all__ = ["SpecimenPosterior"]

_ITERATIONS = 30
_HALVINGS = 12
_STILL = 1e-8  # a step of so many prior deviations ends the iteration


@dataclass(frozen=True, eq=False)
class SpecimenPosterior:
    """A normal distribution of q numbers: the differences of a specimen from its model.

    Attributes
    ----------
    mean : (q,)
        The most probable θ.
    root : (q, q)
        S; the covariance is S Sᵀ.
    """

    mean: np.ndarray
    root: np.ndarray

    @classmethod
    def standard(cls, size: int) -> SpecimenPosterior:
        """Return independent numbers of mean zero and unit variance: the prior."""
        return cls(np.zeros(size), np.eye(size))

    @property
    def covariance(self) -> np.ndarray:
        """P (q, q)."""
        return np.asarray(self.root @ self.root.T)

    def spread(self, index: int) -> float:
        """Standard deviation of one number."""
        return float(np.linalg.norm(self.root[index]))

    def update(self, rows: np.ndarray, residual: np.ndarray) -> SpecimenPosterior:
        """Return the posterior after linear measurements of unit noise.

        Parameters
        ----------
        rows : (k, q)
            H.
        residual : (k,)
            Measured − predicted by the mean.
        """
        J = rows @ self.root
        u = _newton(J, residual, np.zeros(len(self.mean)))
        return SpecimenPosterior(self.mean + self.root @ u, _shrunk(self.root, J))

    def update_by_touches(self, touches: Touches) -> SpecimenPosterior:
        """Return the posterior after touches: the most probable θ, and the covariance there."""
        u, theta = np.zeros(len(self.mean)), self.mean
        r = touches.residuals(theta).ravel()
        for _ in range(_ITERATIONS):
            J = touches.rows(theta).reshape(-1, len(theta)) @ self.root
            step = _newton(J, r, u) - u
            u, r, moved = _shortened(self, touches, u, step, r)
            theta = self.mean + self.root @ u
            if moved <= _STILL:
                break
        J = touches.rows(theta).reshape(-1, len(theta)) @ self.root
        return SpecimenPosterior(theta, _shrunk(self.root, J))

    def forget(self, share: float) -> SpecimenPosterior:
        """Return the posterior with a share of the standard covariance, which it never exceeds."""
        P = (1.0 - share) * self.covariance + share * np.eye(len(self.mean))
        return SpecimenPosterior(self.mean, np.linalg.cholesky(P))


def _newton(J: np.ndarray, r: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The u' of least ½‖u'‖² + ½‖r − J (u' − u)‖², by the smaller of two systems."""
    target = r + J @ u
    if len(J) < J.shape[1]:
        return np.asarray(J.T @ np.linalg.solve(J @ J.T + np.eye(len(J)), target))
    return np.asarray(np.linalg.solve(J.T @ J + np.eye(J.shape[1]), J.T @ target))


def _shortened(
    posterior: SpecimenPosterior, touches: Touches, u: np.ndarray, step: np.ndarray, r: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """The step, halved until the cost falls: new u, residual, and the size of what was moved (0 if nothing helps)."""
    cost, share = u @ u + r @ r, 1.0
    for _ in range(_HALVINGS):
        new = u + share * step
        residual = touches.residuals(posterior.mean + posterior.root @ new).ravel()
        if new @ new + residual @ residual <= cost:
            return new, residual, share * float(np.linalg.norm(step))
        share /= 2.0
    return u, r, 0.0


def _shrunk(root: np.ndarray, J: np.ndarray) -> np.ndarray:
    """S (I + JᵀJ)^−½ as another root."""
    if len(J) >= J.shape[1]:
        L = np.linalg.cholesky(J.T @ J + np.eye(J.shape[1]))
        return np.asarray(np.linalg.solve(L, root.T).T)
    J = J.copy()
    for i in range(len(J)):
        phi = J[i].copy()
        beta = float(phi @ phi) + 1.0
        gain = phi / (beta + np.sqrt(beta))
        root = root - np.outer(root @ phi, gain)
        J[i + 1 :] -= np.outer(J[i + 1 :] @ phi, gain)
    return root
