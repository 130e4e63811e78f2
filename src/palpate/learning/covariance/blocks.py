"""A block-diagonal covariance, one block per unit (Puskorius & Feldkamp 1991, node-decoupled filter).

Correlations between units are dropped. The winner rule of EMRAN (Li, Sundararajan & Saratchandran 2000) keeps
the same blocks, and touches one of them only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

__all__ = ["Blocks"]


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of P.

    Attributes
    ----------
    first : (a, a)
        The tail's.
    units : (h, b, b)
        Each unit's, over (w, θ).
    """

    first: np.ndarray
    units: np.ndarray

    @classmethod
    def prior(cls, tail: int, variance: float, size: int) -> Blocks:
        """Before any unit; units will have `size` unknowns."""
        return cls(variance * np.eye(tail), np.zeros((0, size, size)))

    @property
    def matrix(self) -> np.ndarray:
        """P (d, d), zero between blocks."""
        parts = ([self.first] if self.first.size else []) + list(self.units)
        return np.asarray(block_diag(*parts)) if parts else np.zeros((0, 0))

    @property
    def numbers(self) -> int:
        """How many numbers are kept."""
        return self.first.size + self.units.size

    def grown(self, weights: np.ndarray, shape: np.ndarray) -> Blocks:
        """With one more unit of prior variances (m,) and (p,)."""
        return Blocks(
            self.first, np.concatenate([self.units, np.diag(np.concatenate([weights, shape]))[None]])
        )

    def without(self, unit: int, size: int) -> Blocks:
        """Without one unit's block."""
        return Blocks(self.first, np.delete(self.units, unit, axis=0))

    def times(self, Ht: np.ndarray, unit: int | None = None) -> np.ndarray:
        """P Hᵀ (d, q); with a winning unit, zero for all others."""
        a, (h, b, _), q = len(self.first), self.units.shape, Ht.shape[1]
        out = np.zeros_like(Ht)
        out[:a] = self.first @ Ht[:a]
        if unit is None:
            out[a:] = (self.units @ Ht[a:].reshape(h, b, q)).reshape(h * b, q)
        else:
            rows = slice(a + unit * b, a + (unit + 1) * b)
            out[rows] = self.units[unit] @ Ht[rows]
        return out

    def reduced(
        self,
        K: np.ndarray,
        B: np.ndarray,
        *,
        growth: float,
        added: float,
        donate: bool,
        unit: int | None = None,
    ) -> Blocks:
        """Each block of (P − K Bᵀ − B Kᵀ) · growth + added · I; with a winning unit, its own and the tail's."""
        a, (h, b, _), q = len(self.first), self.units.shape, K.shape[1]
        first = _downdated(self.first, K[:a], B[:a], growth, added)
        if unit is None:
            return Blocks(
                first, _downdated(self.units, K[a:].reshape(h, b, q), B[a:].reshape(h, b, q), growth, added)
            )
        units = self.units if donate else self.units.copy()
        rows = slice(a + unit * b, a + (unit + 1) * b)
        units[unit] = _downdated(units[unit], K[rows], B[rows], growth, added)
        return Blocks(first, units)


def _downdated(P: np.ndarray, K: np.ndarray, B: np.ndarray, growth: float, added: float) -> np.ndarray:
    G = K @ B.swapaxes(-1, -2)
    new = (P - (G + G.swapaxes(-1, -2))) * growth
    if added:
        new[..., np.arange(P.shape[-1]), np.arange(P.shape[-1])] += added
    return np.asarray(new)
