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

    def times(self, Ht: np.ndarray) -> np.ndarray:
        """P Hᵀ (d, q)."""
        a, (h, b, _), q = len(self.first), self.units.shape, Ht.shape[1]
        units = (self.units @ Ht[a:].reshape(h, b, q)).reshape(h * b, q)
        return np.vstack([self.first @ Ht[:a], units])

    def reduced(self, K: np.ndarray, B: np.ndarray, *, growth: float, added: float, donate: bool) -> Blocks:
        """Each block of (P − K Bᵀ − B Kᵀ) · growth + added · I."""
        a, (h, b, _), q = len(self.first), self.units.shape, K.shape[1]
        units = _downdated(self.units, K[a:].reshape(h, b, q), B[a:].reshape(h, b, q), growth, added)
        return Blocks(_downdated(self.first, K[:a], B[:a], growth, added), units)

    def only(self, unit: int) -> Blocks:
        """The tail's block and one unit's."""
        return Blocks(self.first, self.units[unit : unit + 1])

    def renewed(self, unit: int, part: Blocks, *, donate: bool) -> Blocks:
        """With the tail's block and one unit's from another covariance."""
        units = self.units if donate else self.units.copy()
        units[unit] = part.units[0]
        return Blocks(part.first, units)


def _downdated(P: np.ndarray, K: np.ndarray, B: np.ndarray, growth: float, added: float) -> np.ndarray:
    G = K @ B.swapaxes(-1, -2)
    new = (P - (G + G.swapaxes(-1, -2))) * growth
    if added:
        new[..., np.arange(P.shape[-1]), np.arange(P.shape[-1])] += added
    return np.asarray(new)
