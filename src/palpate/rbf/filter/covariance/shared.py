"""All outputs share one covariance over weights and tail; the units' shapes have one of their own.

With R = r I and an isotropic prior the covariance of the linear parameters is exactly P_φ ⊗ I_m while shapes
rest: every output has the same regressors. Nothing here grows with the number of outputs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from palpate.rbf.filter.covariance import triangle

__all__ = ["Shared"]


@dataclass(frozen=True, eq=False)
class Shared:
    """Two triangles.

    Attributes
    ----------
    regressors : (p_t + h, p_t + h)
        P_φ, lower triangle.
    shapes : (h p, h p)
        P_θ, lower triangle.
    """

    regressors: np.ndarray
    shapes: np.ndarray

    @classmethod
    def prior(cls, tail: int, variance: float) -> Shared:
        """Before any unit; `tail` is p_t."""
        return cls(np.asfortranarray(variance * np.eye(tail)), np.zeros((0, 0), order="F"))

    @property
    def matrix(self) -> np.ndarray:
        """The two side by side, (p_t + h + h p) square."""
        parts = [triangle.symmetric(P) for P in (self.regressors, self.shapes) if P.size]
        return np.asarray(block_diag(*parts)) if parts else np.zeros((0, 0))

    @property
    def numbers(self) -> int:
        """How many numbers are kept."""
        return self.regressors.size + self.shapes.size

    def grown(self, weights: np.ndarray, shape: np.ndarray) -> Shared:
        """With one more unit of prior variances (any,), all equal, and (p,)."""
        return Shared(triangle.bordered(self.regressors, weights[:1]), triangle.bordered(self.shapes, shape))

    def without(self, unit: int, size: int) -> Shared:
        """Without one unit of `size` = p numbers."""
        h = len(self.shapes) // size
        place = len(self.regressors) - h + unit
        return Shared(
            triangle.without(self.regressors, place, place + 1),
            triangle.without(self.shapes, unit * size, (unit + 1) * size),
        )
