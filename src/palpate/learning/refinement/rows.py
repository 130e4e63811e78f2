"""The rows of a least-squares problem: values and slopes of many outputs, weighted, reduced to their modes.

    value row of sample i     √w_i φ(x_i)ᵀ C ≈ √w_i y_i
    slope rows of sample i    √(w_i s_i) ∂φ(x_i)/∂x_l C ≈ √(w_i s_i) ∂y_i/∂x_l,   l = 1 … n

An orthogonal change of the outputs leaves the cost as it is, so m outputs of rank k are fitted as k: what a fit
costs doesn't grow with m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from palpate.learning.checks import numbers, samples
from palpate.learning.modes import every_mode
from palpate.learning.units.regressors import Regressors
from palpate.network.radial import radial

__all__ = ["Rows"]


@dataclass(frozen=True, eq=False)
class Rows:
    """A weighted least-squares problem in the outputs' modes; R rows, k modes.

    Attributes
    ----------
    regressors : Regressors
    X : (N, n)
        Where values are known.
    scale : (N,)
        √w of the value rows.
    sloped : (S,) int
        Samples whose slopes are known too.
    slope_scale : (S,)
        √(w s) of their rows.
    targets : (R, k)
        R = N + S n rows, already weighted: values first, then the slopes sample by sample.
    modes : (k, m)
        Orthonormal; outputs are targets @ modes.
    total : float
        Sum of the weights w.
    """

    regressors: Regressors
    X: np.ndarray
    scale: np.ndarray
    sloped: np.ndarray
    slope_scale: np.ndarray
    targets: np.ndarray
    modes: np.ndarray
    total: float

    @classmethod
    def of(
        cls,
        regressors: Regressors,
        X: np.ndarray,
        Y: np.ndarray,
        *,
        weights: np.ndarray | None = None,
        slopes: np.ndarray | None = None,
        slope_weight: float | np.ndarray = 1.0,
    ) -> Rows:
        """From X (N, n), Y (N, m), weights (N,), slopes ∂y_j/∂x_i (N, m, n) and their weights.

        Samples of no weight are left out; so are slopes of no weight, which may then be not-a-number.

        Raises
        ------
        UsageError
            If shapes disagree, or a weight is negative or a number that counts is not finite.
        """
        n = regressors.form.inputs
        X, Y, w, slopes, s = samples(X, Y, weights, slopes, slope_weight=slope_weight, inputs=n)
        s = w * s
        kept = np.flatnonzero(w > 0)
        sloped = np.flatnonzero(s[kept] > 0)
        targets = Y[kept] * np.sqrt(w[kept])[:, None]
        if slopes is not None:
            part = slopes[kept][sloped] * np.sqrt(s[kept][sloped])[:, None, None]
            targets = np.vstack([targets, part.transpose(0, 2, 1).reshape(-1, Y.shape[1])])
        latent, basis = every_mode(targets)
        return cls(
            regressors,
            np.ascontiguousarray(X[kept], float),
            np.sqrt(w[kept]),
            sloped,
            np.sqrt(s[kept][sloped]),
            latent,
            basis,
            float(w.sum()),
        )

    @classmethod
    def blank(
        cls,
        regressors: Regressors,
        X: np.ndarray,
        *,
        weights: np.ndarray | None = None,
        slope_weight: float | np.ndarray | None = None,
    ) -> Rows:
        """Rows of X (N, n) whose targets do not matter; slopes are among them if they have a weight.

        Raises
        ------
        UsageError
            As `of`.
        """
        X = numbers("Inputs X", X, (None, regressors.form.inputs), finite=False)
        N, n = X.shape
        slopes = None if slope_weight is None else np.zeros((N, 1, n))
        share = 1.0 if slope_weight is None else slope_weight
        return cls.of(regressors, X, np.zeros((N, 1)), weights=weights, slopes=slopes, slope_weight=share)

    def matrix(self, theta: np.ndarray, below: int = 0) -> np.ndarray:
        """Weighted regressors, tail then units (R + below, p_t + h), column by column; the last rows are zero."""
        r, N = self.regressors, len(self.X)
        t, end = r.tail_size, len(self.targets)
        F = np.zeros((end + below, t + len(theta)), order="F")
        F[:N, :t] = r.tail_rows(self.X)
        F[:N, t:] = r.phi(self.X, theta)
        F[:N] *= self.scale[:, None]
        if len(self.sloped):
            parts = [r.tail_slopes(len(self.sloped)), r.slopes(self.X[self.sloped], theta)]
            both = np.concatenate(parts, axis=2) * self.slope_scale[:, None, None]
            F[N:end] = both.reshape(end - N, -1)
        return F

    def derivatives(self, theta: np.ndarray, below: int = 0) -> np.ndarray:
        """Weighted ∂φ_k/∂θ_k (R + below, h p), row by row; the last rows are zero."""
        N, p = len(self.X), self.regressors.form.size
        D = np.empty((len(self.targets) + below, len(theta) * p))
        _values_by_theta(self.regressors, self.X, theta, self.scale, D[:N].reshape(N, len(theta), p))
        end = len(self.targets)
        D[end:] = 0.0
        if len(self.sloped):
            part = self.regressors.slopes_by_theta(self.X[self.sloped], theta)[1]
            D[N:end] = (part * self.slope_scale[:, None, None, None]).reshape(end - N, -1)
        return D


def _values_by_theta(
    regressors: Regressors, X: np.ndarray, theta: np.ndarray, scale: np.ndarray, out: np.ndarray
) -> None:
    """√w ∂φ_k/∂θ_k into out (N, h, p)."""
    form = regressors.form
    A, b = form.factors(theta)
    h, r, n = A.shape
    v = (X @ A.reshape(h * r, n).T).reshape(len(X), h, r) - b
    by_q = radial(regressors.radial, np.einsum("nkr,nkr->nk", v, v))[1]
    # the chain rule is linear in each unit: its matrix comes from the form's own `pull` of unit vectors
    e = form.rows.size
    one = np.broadcast_to(np.eye(e + r)[:, None], (e + r, h, e + r))
    chain = np.ascontiguousarray(form.pull(theta, one[..., :e], one[..., e:]).transpose(1, 0, 2))
    _chained(X, v, 2.0 * by_q * scale[:, None], form.rows, form.columns, chain, out)


@njit(cache=True, nogil=True, error_model="numpy")
def _chained(
    X: np.ndarray,
    v: np.ndarray,
    by_v: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    chain: np.ndarray,
    out: np.ndarray,
) -> None:
    N, h, r = v.shape
    e, p = rows.size, out.shape[2]
    for i in range(N):
        for k in range(h):
            t, o = by_v[i, k], out[i, k]
            o[:] = 0.0
            for a in range(e):
                d = t * v[i, k, rows[a]] * X[i, columns[a]]
                for j in range(p):
                    o[j] += d * chain[k, a, j]
            for a in range(r):
                d = -t * v[i, k, a]
                for j in range(p):
                    o[j] += d * chain[k, e + a, j]
