"""Symmetric matrices of which only the lower triangle is kept up to date, in the layout that BLAS works on.

A rank-q update of the triangle costs half of the full one and can't lose symmetry; `dsymm` and `dsyr2k` read and
write it in place.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dsymm, dsyr2k

__all__ = ["bordered", "product", "reduced", "symmetric", "without"]


def symmetric(lower: np.ndarray) -> np.ndarray:
    """The whole matrix (d, d) of a lower triangle."""
    strict = np.tril(lower, -1)
    return np.asarray(strict + strict.T + np.diag(np.diag(lower)))


def product(lower: np.ndarray, B: np.ndarray) -> np.ndarray:
    """P B (d, q)."""
    if not lower.size:
        return np.zeros_like(B)
    return np.asarray(dsymm(1.0, lower, B, lower=1))


def reduced(
    lower: np.ndarray, K: np.ndarray, B: np.ndarray, *, growth: float, added: float, donate: bool
) -> np.ndarray:
    """(P − K Bᵀ − B Kᵀ) · growth + added · I; in place where the caller gives its triangle away."""
    if not lower.size:
        return lower
    new = dsyr2k(-growth, K, B, beta=growth, c=lower, lower=1, overwrite_c=int(donate))
    if added:
        new.ravel(order="K")[:: len(new) + 1] += added
    return np.asarray(new)


def bordered(lower: np.ndarray, variances: np.ndarray) -> np.ndarray:
    """The matrix with independent unknowns of these variances (b,) added at its end."""
    d, b = len(lower), variances.size
    new = np.zeros((d + b, d + b), order="F")
    new[:d, :d] = lower
    new[np.arange(d, d + b), np.arange(d, d + b)] = variances
    return new


def without(lower: np.ndarray, start: int, stop: int) -> np.ndarray:
    """The matrix without rows and columns start … stop − 1."""
    keep = np.r_[:start, stop : len(lower)]
    return np.asfortranarray(lower[np.ix_(keep, keep)])
