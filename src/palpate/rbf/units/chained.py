"""∂φ/∂θ of many units at many points, compiled: the largest array of a refinement is written once."""

from __future__ import annotations

import numpy as np
from numba import njit

from palpate.rbf.units.forms import Form

__all__ = ["chained"]


def chained(
    form: Form, theta: np.ndarray, X: np.ndarray, v: np.ndarray, by_v: np.ndarray, out: np.ndarray
) -> None:
    """Into out (N, h, p): by_v (N, h) times v (N, h, r) is ∂φ/∂v at X (N, n), and v = A x − b."""
    h, e, r = len(theta), form.rows.size, form.rank
    # the chain rule is linear in each unit: its matrix comes from the form's own `pull` of unit vectors
    one = np.broadcast_to(np.eye(e + r)[:, None], (e + r, h, e + r))
    chain = np.ascontiguousarray(form.pull(theta, one[..., :e], one[..., e:]).transpose(1, 0, 2))
    _chained(X, v, by_v, form.rows, form.columns, chain, out)


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
