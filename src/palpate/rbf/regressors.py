"""Regressors of a network, units and tail, and their derivatives by every parameter.

    f(x) = T·[1, x] + Σ_k w_k φ_k(x),   φ_k = g(q_k),   q_k = ‖v_k‖²,   v_k = A_k x − b_k

    ∂φ/∂A_aj = 2 g' v_a x_j                        ∂φ/∂b_a = −2 g' v_a
    ∂φ/∂x_i = 2 g' u_i,  u = Aᵀ v
    ∂²φ/∂x_i∂A_aj = 4 g'' v_a x_j u_i + 2 g' (δ_ij v_a + A_ai x_j)
    ∂²φ/∂x_i∂b_a = −4 g'' v_a u_i − 2 g' A_ai
    ∂²φ/∂x_i∂x_j = 4 g'' u_i u_j + 2 g' B_ij,  B = AᵀA
    ∂³φ/∂x_i∂x_j∂A_al = x_l t_a + 4 g'' v_a (δ_il u_j + δ_jl u_i) + 2 g' (δ_il A_aj + δ_jl A_ai)
    ∂³φ/∂x_i∂x_j∂b_a = −t_a,  t_a = 8 g‴ v_a u_i u_j + 4 g'' (A_ai u_j + u_i A_aj + v_a B_ij)

A form's `pull` takes these to the unit's own numbers θ. The second pair lets slopes be observed, and so a force
be learnt through its energy; the third curvatures, and so its stiffness. Of those the pairs i ≤ j are kept, row
by row of the upper triangle (see `pairs`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import kernel
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction, radial, third
from palpate.rbf.derivative_kernels import Derivatives, Pattern, curvatures_by_factors, slopes_by_factors
from palpate.rbf.forms import Form, chain_of

__all__ = ["Regressors", "Tail", "pairs"]

Tail = Literal["affine", "constant", "none"]


@lru_cache(maxsize=64)
def pairs(inputs: int) -> tuple[np.ndarray, np.ndarray]:
    """The pairs i ≤ j of n inputs, n (n + 1)/2 of each index: 00, 01, …, 11, 12, …."""
    i, j = np.triu_indices(inputs)
    i.flags.writeable = j.flags.writeable = False  # everybody's
    return i, j


@dataclass(frozen=True)
class Regressors:
    """Units of one form and radial function, and a tail."""

    form: Form
    radial: RadialFunction = "gaussian"  # radial function g of every unit
    tail: Tail = "affine"  # T·[1, x], T, or nothing

    def __post_init__(self) -> None:
        for what, name, known in (
            ("radial function", self.radial, RADIAL_FUNCTIONS),
            ("tail", self.tail, get_args(Tail)),
        ):
            if name not in known:
                raise UsageError(
                    f"There is no {what} {name!r}.",
                    why="Units and tail are told by name.",
                    fix=f"Choose one of {', '.join(known)}.",
                )

    @property
    def copies(self) -> int:
        """Units that each one stands for."""
        return 1

    @property
    def tail_size(self) -> int:
        """Columns of the tail: 1 + n, 1 or 0."""
        return {"affine": 1 + self.form.inputs, "constant": 1, "none": 0}[self.tail]

    def phi(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """φ (N, h) at scaled points X (N, n) for units θ (h, p)."""
        v = self._v(X, *self.form.factors(theta))
        return np.asarray(radial(self.radial, np.einsum("nkr,nkr->nk", v, v))[0])

    def by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """φ (N, h) and ∂φ_k/∂θ_k (N, h, p)."""
        v = self._v(X, *self.form.factors(theta))
        g, g1, _ = radial(self.radial, np.einsum("nkr,nkr->nk", v, v))
        by_v = 2.0 * g1[..., None] * v
        by_entry = by_v[..., self.form.rows] * X[:, None, self.form.columns]
        return g, self.form.pull(theta, by_entry, -by_v)

    def scaled_by_theta(self, X: np.ndarray, theta: np.ndarray, scale: np.ndarray, out: np.ndarray) -> None:
        """∂φ_k/∂θ_k times scale (N,) into out (N, h, p), without the memory that `by_theta` takes."""
        A, b = self.form.factors(theta)
        v = self._v(X, A, b)
        by_q = radial(self.radial, np.einsum("nkr,nkr->nk", v, v))[1]
        by_v = 2.0 * by_q * scale[:, None]
        _chain_into(X, v, by_v, self.form.rows, self.form.columns, chain_of(self.form, theta), out)

    def slopes(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """∂φ_k/∂x_i (N, n, h)."""
        return self._slopes_at(X[None], np.eye(self.form.inputs)[None], theta)[0]

    def slopes_by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂φ_k/∂x_i (N, n, h) and its derivatives by θ_k (N, n, h, p)."""
        found, *by = self._slopes_at(X[None], np.eye(self.form.inputs)[None], theta, self._pattern)
        return found, self.form.pull(theta, *by)

    def _slopes_at(
        self, points: np.ndarray, turns: np.ndarray, theta: np.ndarray, pattern: Pattern | None = None
    ) -> Derivatives:
        """Slopes summed over images (c, N, n) of the samples, which `turns` (c, n, n) turn back."""
        A, b = self.form.factors(theta)
        v, (_, g1, g2) = self._v_and_radial(points, A, b)
        return slopes_by_factors(points, turns, v, (g1, g2), A, pattern)

    def curvatures(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """∂²φ_k/∂x_i∂x_j (N, n(n+1)/2, h), i ≤ j."""
        return self._curvatures_at(X[None], np.eye(len(self._pairs[0]))[None], theta)[0]

    def curvatures_by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂²φ_k/∂x_i∂x_j (N, n(n+1)/2, h), i ≤ j, and its derivatives by θ_k (N, n(n+1)/2, h, p)."""
        found, *by = self._curvatures_at(X[None], np.eye(len(self._pairs[0]))[None], theta, self._pattern)
        return found, self.form.pull(theta, *by)

    def _curvatures_at(
        self, points: np.ndarray, turns: np.ndarray, theta: np.ndarray, pattern: Pattern | None = None
    ) -> Derivatives:
        """Curvatures summed over images (c, N, n); `turns` (c, q, q) turn the q pairs back."""
        A, b = self.form.factors(theta)
        v, (_, g1, g2) = self._v_and_radial(points, A, b)
        g3 = third(self.radial, np.einsum("cnkr,cnkr->cnk", v, v)) if pattern else g2  # of no use without
        return curvatures_by_factors(points, turns, v, (g1, g2, g3), A, pattern, self._pairs)

    @property
    def _pattern(self) -> Pattern:
        return self.form.rows, self.form.columns

    @property
    def _pairs(self) -> Pattern:
        return pairs(self.form.inputs)

    def _v_and_radial(
        self, points: np.ndarray, A: np.ndarray, b: np.ndarray
    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """v (c, N, h, r) at points (c, N, n), and g, g', g'' (c, N, h)."""
        v = self._v(points.reshape(-1, points.shape[2]), A, b).reshape(*points.shape[:2], *b.shape)
        return v, radial(self.radial, np.einsum("cnkr,cnkr->cnk", v, v))

    def tail_rows(self, X: np.ndarray) -> np.ndarray:
        """The tail's regressors (N, p_t): the first columns of [1, x]."""
        rows = np.ones((len(X), self.tail_size))
        if self.tail_size > 1:
            rows[:, 1:] = X
        return rows

    def tail_slopes(self, count: int) -> np.ndarray:
        """∂/∂x_i of the tail's regressors at N points, (N, n, p_t)."""
        one = np.eye(1 + self.form.inputs)[1:, : self.tail_size]
        return np.broadcast_to(one, (count, *one.shape))

    def _v(self, X: np.ndarray, A: np.ndarray, b: np.ndarray) -> np.ndarray:
        """A_k x − b_k (N, h, r)."""
        h, r, n = A.shape
        return np.asarray((X @ A.reshape(h * r, n).T).reshape(len(X), h, r) - b)


@kernel
def _chain_into(
    X: np.ndarray,
    v: np.ndarray,
    by_v: np.ndarray,
    rows: np.ndarray,
    columns: np.ndarray,
    chain: np.ndarray,
    out: np.ndarray,
) -> None:
    """∂φ/∂θ into out (N, h, p): the largest array of a refinement is written once."""
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
