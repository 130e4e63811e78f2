"""Variable projection: the cost once weights and tail are the best there are, and its Gauss–Newton matrix.

With regressors Φ = Q R of augmented rows (the ridge's rows below the data's), P = I − Q Qᵀ, residual
E = P Y, weights W and D the derivatives ∂φ_k/∂θ_k (Golub & Pereyra 1973), J'J is

    (Dᵀ P D) ∘ (W Wᵀ)                             Kaufman 1975
    (Dᵀ P D) ∘ (W Wᵀ) + (S Sᵀ) ∘ (ΦᵀΦ)⁻¹,  S = Dᵀ E     Golub & Pereyra, in full

and the gradient is −Dᵀ E Wᵀ, unit by unit, in either: the columns of the second term are orthogonal to E.
Neither grows with the number of outputs but by the products that it is made of.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import blas, lapack

from palpate.rbf.refinement.rows import Rows

__all__ = ["Fit", "Solver", "gauss_newton", "leverage_of_units", "project", "span_of_units"]

Solver = Literal["kaufman", "full"]

_TAIL_PENALTY = 1e-24  # penalty of round-off's size, so that duplicate samples can't make R singular


@dataclass(frozen=True, eq=False)
class Fit:
    """Least-squares solution for one θ."""

    coefficients: np.ndarray  # (c, k), of the tail, then of the units, per mode
    residual: np.ndarray  # (R, k), weighted targets less the fit, per mode
    cost: float  # ‖residual‖² + penalty ‖weights‖²
    reflectors: np.ndarray  # (R + c, c), Q as LAPACK keeps it, with R in the upper triangle
    tau: np.ndarray  # (c,), factors of the Householder reflectors

    @property
    def R(self) -> np.ndarray:
        """Upper triangular (c, c) with RᵀR = ΦᵀΦ + the penalties."""
        return np.triu(self.reflectors[: len(self.tau)])

    @property
    def Q(self) -> np.ndarray:
        """The data's rows (R, c) of the orthonormal basis."""
        return np.asarray(lapack.dorgqr(self.reflectors, self.tau)[0])[: len(self.residual)]

    @property
    def inverse(self) -> np.ndarray:
        """(ΦᵀΦ + penalties)⁻¹ (c, c)."""
        root = lapack.dtrtri(self.R)[0]
        return np.asarray(root @ root.T)


def project(rows: Rows, theta: np.ndarray, penalty: float) -> Fit:
    """The best weights and tail for given units θ (h, p)."""
    h, p_t = len(theta), rows.regressors.tail_size
    c, R = h + p_t, len(rows.targets)
    F = rows.matrix(theta, below=c)
    F[R + np.arange(c), np.arange(c)] = np.sqrt(np.r_[np.full(p_t, _TAIL_PENALTY), np.full(h, penalty)])
    if not c:
        residual = rows.targets
        return Fit(np.zeros((0, residual.shape[1])), residual, float((residual**2).sum()), F, np.zeros(0))
    reflectors, tau, _, _ = lapack.dgeqrf(F)
    k = rows.targets.shape[1]
    lifted = np.zeros((R + c, k), order="F")
    lifted[:R] = rows.targets
    lifted = lapack.dormqr("L", "T", reflectors, tau, lifted, max(1, 64 * (k + 64)), overwrite_c=1)[0]
    coefficients = lapack.dtrtrs(reflectors[:c], lifted[:c])[0]
    residual = rows.targets - F[:R] @ coefficients
    cost = float((residual**2).sum() + penalty * (coefficients[p_t:] ** 2).sum())
    return Fit(np.asarray(coefficients), residual, cost if np.isfinite(cost) else np.inf, reflectors, tau)


def gauss_newton(
    rows: Rows, theta: np.ndarray, fit: Fit, solver: Solver = "kaufman", *, single: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Gauss–Newton matrix (h p, h p), lower triangle, and the descent direction's right-hand side (h p,).

    `single` forms the matrix in single precision; the right-hand side is always double.
    """
    h, p, R, c = *theta.shape, len(rows.targets), len(fit.tau)
    W = fit.coefficients[c - h :]
    D = rows.derivatives(theta, below=c)
    descent = np.einsum("nk,nkp->kp", fit.residual @ W.T, D[:R].reshape(R, h, p)).ravel()
    S = D[:R].T @ fit.residual if solver == "full" else None
    G = _outside(fit, D, single)
    blocks = G.T.reshape(h, p, h, p)
    blocks *= (W @ W.T).astype(G.dtype)[:, None, :, None]
    if S is not None:
        extra = blas.dsyrk(1.0, S, lower=1)
        extra.T.reshape(h, p, h, p)[:] *= fit.inverse[c - h :, c - h :][:, None, :, None]
        G += extra
    return G, descent


def leverage_of_units(rows: Rows, theta: np.ndarray, fit: Fit, *, work: float = 4e9) -> np.ndarray:
    """Leverage (R, k) of each row on its own value, mode by mode, through the units' numbers.

    The diagonal of their part of the hat matrix of the linearised problem; it sums to h p. Modes of large weights
    take most of it. Beyond `work` multiplications the lesser modes get their share spread evenly over the rows.
    """
    (h, p), (R, k) = theta.shape, rows.targets.shape
    W = fit.coefficients[len(fit.tau) - h :]
    D = rows.derivatives(theta, below=len(fit.tau))
    strict = np.tril(_outside(fit, D.copy(), False), -1)
    D = D[:R]
    D -= fit.Q @ (fit.Q.T @ D)
    G = strict + strict.T + np.diag(np.einsum("nd,nd->d", D, D))
    joint = (G.reshape(h, p, h, p) * (W @ W.T)[:, None, :, None]).reshape(h * p, h * p)
    size = np.sqrt(np.diagonal(joint))
    size = np.maximum(size, max(1e-8 * float(size.max()), 1e-140))  # whose square has an inverse
    joint /= size[:, None] * size
    joint[np.diag_indices(h * p)] += 1e-10
    factor, failed = lapack.dpotrf(joint, lower=1)
    if failed:
        return np.full((R, k), theta.size / (R * k))
    lower = np.tril(lapack.dpotri(factor, lower=1)[0])
    inverse = (lower + np.tril(lower, -1).T) / (size[:, None] * size)
    folded = (inverse * G).reshape(h, p, h, p).sum(axis=(1, 3))
    total = np.einsum("kj,kl,lj->j", W, folded, W, optimize=True)
    found = np.repeat(total[None] / R, R, axis=0)
    for j in np.argsort(-total)[: int(work / (R * (h * p) ** 2))]:
        moved = D * np.repeat(W[:, j], p)
        found[:, j] = np.einsum("nd,nd->n", moved @ inverse, moved)
    return found


def span_of_units(rows: Rows, theta: np.ndarray, fit: Fit) -> np.ndarray:
    """Z (R, h p), Z Zᵀ the units' part of the hat matrix of the linearised problem, for an output of one mode.

    Where the units' numbers are more than the data can tell apart, those not told apart count for nothing.
    """
    (h, p), R = theta.shape, len(rows.targets)
    moved = rows.derivatives(theta)[:R] * np.repeat(fit.coefficients[len(fit.tau) - h :, 0], p)
    moved -= fit.Q @ (fit.Q.T @ moved)
    size = np.sqrt((moved**2).sum(axis=0))
    moved /= np.maximum(size, max(1e-8 * float(size.max(initial=0.0)), 1e-140))
    values, V = np.linalg.eigh(moved.T @ moved)
    known = values > 1e-10 * values[-1]
    return np.asarray(moved @ (V[:, known] / np.sqrt(values[known])))


def _outside(fit: Fit, D: np.ndarray, single: bool) -> np.ndarray:
    """Dᵀ P D (h p, h p), lower triangle, of D (R + c, h p), whose last rows are zero; D is overwritten."""
    c, kind = len(fit.tau), np.float32 if single else np.float64
    ormqr, syrk = (lapack.sormqr, blas.ssyrk) if single else (lapack.dormqr, blas.dsyrk)
    reflectors, tau = fit.reflectors.astype(kind, copy=False), fit.tau.astype(kind, copy=False)
    Z = D.astype(kind, copy=False).T
    if c:
        Z = ormqr("R", "N", reflectors, tau, Z, 64 * (len(Z) + 64), overwrite_c=1)[0]
    # the rows of QᵀD below the first c are D's part outside the regressors' span
    return np.asarray(syrk(1.0, Z[:, c:], lower=1))
