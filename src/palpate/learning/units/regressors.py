"""The regressors of a network, units and tail, and their derivatives by every parameter.

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
from typing import Literal, get_args

import numpy as np

from palpate.errors import UsageError
from palpate.learning.units.chained import chained
from palpate.learning.units.forms import Form
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction, radial, third

__all__ = ["Regressors", "Tail", "pairs"]

Tail = Literal["affine", "constant", "none"]


def pairs(inputs: int) -> tuple[np.ndarray, np.ndarray]:
    """The pairs i ≤ j of n inputs, n (n + 1)/2 of each index: 00, 01, …, 11, 12, …."""
    return np.triu_indices(inputs)


@dataclass(frozen=True)
class Regressors:
    """Units of one form and radial function, and a tail.

    Attributes
    ----------
    form : Form
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2"}
    tail : {"affine", "constant", "none"}
        T·[1, x], T, or nothing.

    Raises
    ------
    UsageError
        If there is no such radial function or tail.
    """

    form: Form
    radial: RadialFunction = "gaussian"
    tail: Tail = "affine"

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
        chained(self.form, theta, X, v, 2.0 * by_q * scale[:, None], out)

    def slopes(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """∂φ_k/∂x_i (N, n, h)."""
        A, b = self.form.factors(theta)
        v = self._v(X, A, b)
        g1 = radial(self.radial, np.einsum("nkr,nkr->nk", v, v))[1]
        return np.asarray(np.einsum("nkr,kri->nik", 2.0 * g1[..., None] * v, A))

    def slopes_by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂φ_k/∂x_i (N, n, h) and its derivatives by θ_k (N, n, h, p)."""
        rows, columns = self.form.rows, self.form.columns
        A, b = self.form.factors(theta)
        v = self._v(X, A, b)
        _, g1, g2 = radial(self.radial, np.einsum("nkr,nkr->nk", v, v))
        u = np.einsum("nkr,kri->nik", v, A)
        two, four = 2.0 * g1[:, None, :, None], 4.0 * g2[:, None, :, None]
        through_q = four * u[..., None] * v[:, None]  # (N, n, h, r)
        through_u = two * A.transpose(2, 0, 1)[None]  # ∂u_i/∂v_a = A_ai
        by_v = through_q + through_u
        by_entry = by_v[..., rows] * X[:, None, None, columns]
        same = columns == np.arange(self.form.inputs)[:, None]  # (n, e): δ_ij
        by_entry += two * same[:, None, :] * v[:, None][..., rows]
        return 2.0 * g1[:, None] * u, self.form.pull(theta, by_entry, -by_v)

    def curvatures(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """∂²φ_k/∂x_i∂x_j (N, n(n+1)/2, h), i ≤ j."""
        A, b = self.form.factors(theta)
        v = self._v(X, A, b)
        _, g1, g2 = radial(self.radial, np.einsum("nkr,nkr->nk", v, v))
        u = np.einsum("nkr,kri->nik", v, A)
        i, j = pairs(self.form.inputs)
        B = np.einsum("kre,kre->ek", A[:, :, i], A[:, :, j])
        return np.asarray(4.0 * g2[:, None] * u[:, i] * u[:, j] + 2.0 * g1[:, None] * B)

    def curvatures_by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂²φ_k/∂x_i∂x_j (N, n(n+1)/2, h), i ≤ j, and its derivatives by θ_k (N, n(n+1)/2, h, p)."""
        rows, columns = self.form.rows, self.form.columns
        A, b = self.form.factors(theta)
        v = self._v(X, A, b)
        q = np.einsum("nkr,nkr->nk", v, v)
        _, g1, g2 = radial(self.radial, q)
        two, four = 2.0 * g1[:, None, :, None], 4.0 * g2[:, None, :, None]
        eight = 8.0 * third(self.radial, q)[:, None, :, None]
        u = np.einsum("nkr,kri->nik", v, A)
        i, j = pairs(self.form.inputs)
        ui, uj = u[:, i, :, None], u[:, j, :, None]  # (N, pairs, h, 1)
        Ai, Aj = A.transpose(2, 0, 1)[i], A.transpose(2, 0, 1)[j]  # (pairs, h, r)
        B = (Ai * Aj).sum(axis=2, keepdims=True)
        by_v = (eight * ui * uj + four * B) * v[:, None] + four * (Ai * uj + ui * Aj)
        by_entry = by_v[..., rows] * X[:, None, None, columns]
        for e, (a, column) in enumerate(zip(rows, columns, strict=True)):
            for own, u_other, A_other in ((i, uj, Aj), (j, ui, Ai)):
                at = np.flatnonzero(own == column)
                direct = four[..., 0] * v[:, None, :, a] * u_other[:, at, :][..., 0]
                by_entry[..., e][:, at] += direct + two[..., 0] * A_other[..., a][at]
        return (four * ui * uj + two * B)[..., 0], self.form.pull(theta, by_entry, -by_v)

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
