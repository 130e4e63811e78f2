"""Errors of a linear least-squares fit at samples left out of it, without fitting again (PRESS; Allen 1974).

With the hat matrix H = Q Qᵀ of the weighted rows, leaving out the rows of one sample changes its residual to

    (I − H_ii)⁻¹ e_i,

a number for a sample of one row, a block for one whose slopes are known too. Removing regressor k as well takes
z_k z_kᵀ/M_kk from H and adds z_k c_k/M_kk to the residual, M = (ΦᵀΦ)⁻¹ and z_k = Φ M e_k: every unit's removal is
judged for the price of one product.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from palpate.learning.refinement.projection import Fit
from palpate.learning.refinement.rows import Rows

__all__ = ["left_out", "without_each"]


def left_out(
    rows: Rows, fit: Fit, *, shared: float | np.ndarray = 0.0, most: float = 1.0 - 1e-12
) -> np.ndarray:
    """Errors (N, k) of the values at each sample, in modes, when it and its slopes are left out.

    Exact for given units. `shared`, one number or (R, k), is leverage to add for what else was fitted; no row's
    leverage counts as more than `most`.
    """
    Q, N = fit.Q, len(rows.X)
    shared = np.broadcast_to(shared, fit.residual.shape)
    leverage = np.minimum((Q[:N] ** 2).sum(axis=1)[:, None] + shared[:N], most)
    errors = fit.residual[:N] / (1.0 - leverage)
    n = rows.X.shape[1]
    for j, i in enumerate(rows.sloped):
        block = np.r_[i, N + j * n + np.arange(n)]
        hat = Q[block] @ Q[block].T
        values, V = np.linalg.eigh(hat)
        left = 1.0 - np.minimum(values[:, None] + shared[block].mean(axis=0), most)
        errors[i] = V[0] @ ((V.T @ fit.residual[block]) / left)
    return np.asarray(errors / rows.scale[:, None])


def without_each(
    rows: Rows, fit: Fit, units: int, *, shared: float = 0.0, most: float = 1.0 - 1e-12
) -> np.ndarray:
    """Weighted sums (h,) of squared leave-one-out errors over all rows, were one unit removed, for each unit.

    Exact for given units and one row per sample; slopes count as samples of their own.
    """
    if not units:
        return np.zeros(0)
    Q = fit.Q
    root = lapack.dtrtri(fit.R)[0]
    Z = Q @ root.T[:, -units:]  # Φ M e_k, as Φ = Q R and M = R⁻¹ R⁻ᵀ
    M = np.einsum("ij,ij->i", root, root)[-units:]
    C = fit.coefficients[-units:]
    leverage = np.minimum((Q**2).sum(axis=1)[:, None] + shared - Z**2 / M, most)
    squares = (
        (fit.residual**2).sum(axis=1)[:, None]
        + 2.0 * (fit.residual @ C.T) * Z / M
        + Z**2 * ((C**2).sum(axis=1) / M**2)
    )
    return np.asarray((squares / (1.0 - leverage) ** 2).sum(axis=0))
