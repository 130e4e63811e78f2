"""One covariance over all parameters of the network (Kadirkamanathan & Niranjan 1993)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.rbf.filter.covariance import triangle

__all__ = ["Full"]


@dataclass(frozen=True, eq=False)
class Full:
    """P over z = [tail, unit by unit (w, θ)].

    Attributes
    ----------
    lower : (d, d)
        Its lower triangle; what is above the diagonal means nothing.
    tail : int
        Unknowns of the tail, which come first.
    """

    lower: np.ndarray
    tail: int

    @classmethod
    def prior(cls, tail: int, variance: float) -> Full:
        """Before any unit."""
        return cls(np.asfortranarray(variance * np.eye(tail)), tail)

    @property
    def matrix(self) -> np.ndarray:
        """P (d, d)."""
        return triangle.symmetric(self.lower)

    @property
    def numbers(self) -> int:
        """How many numbers are kept."""
        return self.lower.size

    def grown(self, weights: np.ndarray, shape: np.ndarray) -> Full:
        """With one more unit of prior variances (m,) and (p,)."""
        return Full(triangle.bordered(self.lower, np.concatenate([weights, shape])), self.tail)

    def without(self, unit: int, size: int) -> Full:
        """Without the rows and columns of one unit of `size` unknowns."""
        start = self.tail + unit * size
        return Full(triangle.without(self.lower, start, start + size), self.tail)

    def times(self, Ht: np.ndarray) -> np.ndarray:
        """P Hᵀ (d, q)."""
        return triangle.product(self.lower, Ht)

    def reduced(self, K: np.ndarray, B: np.ndarray, *, growth: float, added: float, donate: bool) -> Full:
        """(P − K Bᵀ − B Kᵀ) · growth + added · I for K, B (d, q)."""
        new = triangle.reduced(self.lower, K, B, growth=growth, added=added, donate=donate)
        return Full(new, self.tail)
