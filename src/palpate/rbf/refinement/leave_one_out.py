"""Errors of a linear least-squares fit at samples left out of it, without fitting again (PRESS; Allen 1974).

With the hat matrix H = Q Qᵀ of the weighted rows, leaving out the rows of one sample, or of one group of samples,
changes their residual to

    (I − H_ii)⁻¹ e_i,

a number for a sample of one row, a block for one whose slopes or curvatures are known too (Cook & Weisberg 1982,
§3.6). What else was fitted adds to H_ii. Removing regressor k as well takes z_k z_kᵀ/M_kk from H and adds
z_k c_k/M_kk to the residual, M = (ΦᵀΦ)⁻¹ and z_k = Φ M e_k: every unit's removal is judged for the price of one
product.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from palpate.rbf.refinement.projection import Fit
from palpate.rbf.refinement.rows import Rows

__all__ = ["errors_without_each_unit", "leave_one_out_errors", "leave_one_out_row_errors"]


def leave_one_out_errors(
    rows: Rows, fit: Fit, *, shared: float | np.ndarray = 0.0, most: float = 1.0 - 1e-12
) -> np.ndarray:
    """Errors (N, k) of the values at each sample, in modes, when all that is known of it is left out.

    See `leave_one_out_row_errors`, of whose result these are the first N rows without their weights.
    """
    return np.asarray(
        leave_one_out_row_errors(rows, fit, shared=shared, most=most)[: len(rows.X)] / rows.scale[:, None]
    )


def leave_one_out_row_errors(
    rows: Rows,
    fit: Fit,
    *,
    shared: float | np.ndarray = 0.0,
    basis: np.ndarray | None = None,
    most: float = 1.0 - 1e-12,
) -> np.ndarray:
    """Weighted errors (R, k) of every row, in modes, when all rows of its group are left out.

    Exact for given units. `shared`, one number or (R, k), is leverage to add for what else was fitted; `basis`
    (R, b) are the columns Z of a matrix Z Zᵀ to add to H for it. No leverage counts as more than `most`.
    """
    Q = fit.Q if basis is None else np.hstack([fit.Q, basis])
    shared = np.broadcast_to(shared, fit.residual.shape)
    leverage = np.minimum((Q**2).sum(axis=1)[:, None] + shared, most)
    errors = fit.residual / (1.0 - leverage)
    for block in _blocks(rows):
        hat = Q[block] @ Q[block].T
        values, V = np.linalg.eigh(hat)
        left = 1.0 - np.minimum(values[:, None] + shared[block].mean(axis=0), most)
        errors[block] = V @ ((V.T @ fit.residual[block]) / left)
    return np.asarray(errors)


def _blocks(rows: Rows) -> list[np.ndarray]:
    """The rows of each group that has more than one."""
    group = rows.groups[rows.samples]
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order])) + 1
    return [block for block in np.split(order, starts) if len(block) > 1]


def errors_without_each_unit(
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
