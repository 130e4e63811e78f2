"""Covariances of the network's parameters; the update rule says which of them the filter keeps.

Full           one matrix over everything: (m p_t + h (m + p))² numbers (Kadirkamanathan & Niranjan 1993)
Blocks         one block for the tail and one per unit: (m p_t)² + h (m + p)² (Puskorius & Feldkamp 1991, the
               node-decoupled filter). Correlations between units are dropped. The winner rule of EMRAN (Li,
               Sundararajan & Saratchandran 2000) keeps the same blocks, and touches one of them only.
Shared         one matrix over the regressors for all outputs, one over the units' shapes: (p_t + h)² + (h p)².
               With R = r I and an isotropic prior the covariance of the linear parameters is exactly P_φ ⊗ I_m
               while shapes rest: every output has the same regressors. It does not grow with the outputs.
NoCovariance   none, for the gradient rule

Of symmetric matrices only the lower triangle is kept up to date, in the layout that BLAS works on. A rank-q update of
it costs half of the full one and can't lose symmetry; `dsymm` and `dsyr2k` read and write it in place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.linalg.blas import dsymm, dsyr2k

__all__ = [
    "Blocks",
    "Covariance",
    "Full",
    "NoCovariance",
    "Shared",
    "downdate_triangle",
    "symmetric",
    "triangle_product",
]


def symmetric(lower: np.ndarray) -> np.ndarray:
    """The whole matrix (d, d) of a lower triangle."""
    strict = np.tril(lower, -1)
    return np.asarray(strict + strict.T + np.diag(np.diag(lower)))


def triangle_product(lower: np.ndarray, B: np.ndarray) -> np.ndarray:
    """P B (d, q)."""
    if not lower.size:
        return np.zeros_like(B)
    return np.asarray(dsymm(1.0, lower, B, lower=1))


def downdate_triangle(
    lower: np.ndarray, K: np.ndarray, B: np.ndarray, *, growth: float, added: float, donate: bool
) -> np.ndarray:
    """(P − K Bᵀ − B Kᵀ) · growth + added · I; in place where the caller gives its triangle away."""
    if not lower.size:
        return lower
    new = dsyr2k(-growth, K, B, beta=growth, c=lower, lower=1, overwrite_c=int(donate))
    if added:
        new.ravel(order="K")[:: len(new) + 1] += added
    return np.asarray(new)


def _border_triangle(lower: np.ndarray, variances: np.ndarray) -> np.ndarray:
    """The matrix with independent unknowns of these variances (b,) added at its end."""
    d, b = len(lower), variances.size
    new = np.zeros((d + b, d + b), order="F")
    new[:d, :d] = lower
    new[np.arange(d, d + b), np.arange(d, d + b)] = variances
    return new


def _trim_triangle(lower: np.ndarray, start: int, stop: int) -> np.ndarray:
    """The matrix without rows and columns start … stop − 1."""
    keep = np.r_[:start, stop : len(lower)]
    return np.asfortranarray(lower[np.ix_(keep, keep)])


@dataclass(frozen=True, eq=False)
class Full:
    """P over z = [tail, unit by unit (w, θ)]."""

    lower: np.ndarray  # (d, d), its lower triangle; what is above the diagonal means nothing
    tail: int  # number of unknowns of the tail, which come first

    @classmethod
    def prior(cls, tail: int, variance: float) -> Full:
        """Before any unit."""
        return cls(np.asfortranarray(variance * np.eye(tail)), tail)

    @property
    def matrix(self) -> np.ndarray:
        """P (d, d)."""
        return symmetric(self.lower)

    @property
    def numbers(self) -> int:
        """Count of the numbers kept."""
        return self.lower.size

    def add_unit(self, weights: np.ndarray, shape: np.ndarray) -> Full:
        """The covariance with one more unit of prior variances (m,) and (p,)."""
        return Full(_border_triangle(self.lower, np.concatenate([weights, shape])), self.tail)

    def remove_unit(self, unit: int, size: int) -> Full:
        """The covariance without the rows and columns of one unit of `size` unknowns."""
        start = self.tail + unit * size
        return Full(_trim_triangle(self.lower, start, start + size), self.tail)

    def times(self, Ht: np.ndarray) -> np.ndarray:
        """P Hᵀ (d, q)."""
        return triangle_product(self.lower, Ht)

    def downdate(self, K: np.ndarray, B: np.ndarray, *, growth: float, added: float, donate: bool) -> Full:
        """(P − K Bᵀ − B Kᵀ) · growth + added · I for K, B (d, q)."""
        new = downdate_triangle(self.lower, K, B, growth=growth, added=added, donate=donate)
        return Full(new, self.tail)


@dataclass(frozen=True, eq=False)
class Blocks:
    """A block-diagonal P."""

    first: np.ndarray  # (a, a), covariance of the coefficients of the tail
    units: np.ndarray  # (h, b, b), covariance of each unit over (w, θ)

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
        """Count of the numbers kept."""
        return self.first.size + self.units.size

    def add_unit(self, weights: np.ndarray, shape: np.ndarray) -> Blocks:
        """The covariance with one more unit of prior variances (m,) and (p,)."""
        return Blocks(
            self.first, np.concatenate([self.units, np.diag(np.concatenate([weights, shape]))[None]])
        )

    def remove_unit(self, unit: int, size: int) -> Blocks:
        """The covariance without one unit's block."""
        return Blocks(self.first, np.delete(self.units, unit, axis=0))

    def times(self, Ht: np.ndarray) -> np.ndarray:
        """P Hᵀ (d, q)."""
        a, (h, b, _), q = len(self.first), self.units.shape, Ht.shape[1]
        units = (self.units @ Ht[a:].reshape(h, b, q)).reshape(h * b, q)
        return np.vstack([self.first @ Ht[:a], units])

    def downdate(self, K: np.ndarray, B: np.ndarray, *, growth: float, added: float, donate: bool) -> Blocks:
        """Each block of (P − K Bᵀ − B Kᵀ) · growth + added · I."""
        a, (h, b, _), q = len(self.first), self.units.shape, K.shape[1]
        units = _downdated(self.units, K[a:].reshape(h, b, q), B[a:].reshape(h, b, q), growth, added)
        return Blocks(_downdated(self.first, K[:a], B[:a], growth, added), units)

    def of_unit(self, unit: int) -> Blocks:
        """The tail's block and one unit's."""
        return Blocks(self.first, self.units[unit : unit + 1])

    def with_unit_of(self, unit: int, part: Blocks, *, donate: bool) -> Blocks:
        """The covariance with the tail's block and one unit's from another one."""
        units = self.units if donate else self.units.copy()
        units[unit] = part.units[0]
        return Blocks(part.first, units)


def _downdated(P: np.ndarray, K: np.ndarray, B: np.ndarray, growth: float, added: float) -> np.ndarray:
    G = K @ B.swapaxes(-1, -2)
    new = (P - (G + G.swapaxes(-1, -2))) * growth
    if added:
        new[..., np.arange(P.shape[-1]), np.arange(P.shape[-1])] += added
    return np.asarray(new)


@dataclass(frozen=True, eq=False)
class Shared:
    """One covariance of all outputs' coefficients and one of the shapes, as triangles."""

    regressors: np.ndarray  # (p_t + h, p_t + h), lower triangle of P_φ
    shapes: np.ndarray  # (h p, h p), lower triangle of P_θ

    @classmethod
    def prior(cls, tail: int, variance: float) -> Shared:
        """Before any unit; `tail` is p_t."""
        return cls(np.asfortranarray(variance * np.eye(tail)), np.zeros((0, 0), order="F"))

    @property
    def matrix(self) -> np.ndarray:
        """The two side by side, (p_t + h + h p) square."""
        parts = [symmetric(P) for P in (self.regressors, self.shapes) if P.size]
        return np.asarray(block_diag(*parts)) if parts else np.zeros((0, 0))

    @property
    def numbers(self) -> int:
        """Count of the numbers kept."""
        return self.regressors.size + self.shapes.size

    def add_unit(self, weights: np.ndarray, shape: np.ndarray) -> Shared:
        """The covariance with one more unit of prior variances (any,), all equal, and (p,)."""
        return Shared(_border_triangle(self.regressors, weights[:1]), _border_triangle(self.shapes, shape))

    def remove_unit(self, unit: int, size: int) -> Shared:
        """The covariance without one unit of `size` = p numbers."""
        h = len(self.shapes) // size
        place = len(self.regressors) - h + unit
        return Shared(
            _trim_triangle(self.regressors, place, place + 1),
            _trim_triangle(self.shapes, unit * size, (unit + 1) * size),
        )


@dataclass(frozen=True)
class NoCovariance:
    """A stand-in where a rule keeps no covariance."""

    @property
    def matrix(self) -> np.ndarray:
        """An empty matrix."""
        return np.zeros((0, 0))

    @property
    def numbers(self) -> int:
        """None are kept."""
        return 0

    def add_unit(self, weights: np.ndarray, shape: np.ndarray) -> NoCovariance:
        """Itself."""
        return self

    def remove_unit(self, unit: int, size: int) -> NoCovariance:
        """Itself."""
        return self


Covariance = Full | Blocks | Shared | NoCovariance
