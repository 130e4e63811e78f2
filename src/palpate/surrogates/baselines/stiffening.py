"""The way in which a held body leaves the linear spring: a polynomial of ln(U/½ ‖S d‖²) in scaled inputs.

Far from any edge a body's answer to a displacement is smooth, and a polynomial of low degree says most of it from few
solves; what it leaves is the network's. On a body with a symmetry most monomials are absent.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Annotated

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import part

__all__ = ["HIGHEST", "Stiffening", "exponents", "powers", "stiffening_into"]

HIGHEST = 5  # highest degree of the polynomial


def exponents(count: int, degree: int) -> np.ndarray:
    """Return exponents (m, count) of all monomials up to a degree, the constant first."""
    rows = [
        [chosen.count(i) for i in range(count)]
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(count), d)
    ]
    return np.array(rows, dtype=np.int64).reshape(len(rows), count)


def powers(X: np.ndarray, E: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values (N, m), slopes (N, m, n) and curvatures (N, m, n, n) of monomials E (m, n) at X (N, n)."""

    def product(exponent: np.ndarray, factor: np.ndarray) -> np.ndarray:
        return np.asarray(factor * np.prod(X[:, None] ** np.maximum(exponent, 0), axis=2))

    (N, n), m, unit = X.shape, len(E), np.eye(E.shape[1], dtype=np.int64)
    slope, bend = np.zeros((N, m, n)), np.zeros((N, m, n, n))
    for i in range(n):
        slope[:, :, i] = product(E - unit[i], E[:, i])
        for j in range(i, n):
            bend[:, :, i, j] = bend[:, :, j, i] = product(
                E - unit[i] - unit[j], E[:, i] * (E - unit[i])[:, j]
            )
    return product(E, np.ones(m)), slope, bend


@dataclass(frozen=True, eq=False)
class Stiffening:
    """P(ξ) = Σ c_m ∏ ξ_i^{e_mi}.

    Attributes
    ----------
    coefficients : (m,)
        c_m of each monomial.
    exponents : (m, n) int
        e_mi, powers of the n scaled inputs in each monomial; their sum is at most five.

    Raises
    ------
    UsageError
        If they do not fit together, or a degree is above five.
    """

    coefficients: np.ndarray
    exponents: Annotated[np.ndarray, np.int64]

    def __post_init__(self) -> None:
        own_arrays(self, "coefficients")
        own_arrays(self, "exponents", dtype=np.int64)
        c, E = self.coefficients, self.exponents
        fits = E.ndim == 2 and c.shape == E.shape[:1] and np.isfinite(c).all()
        if not fits or (E < 0).any() or E.sum(axis=1).max(initial=0) > HIGHEST:
            raise UsageError(
                f"Coefficients {c.shape} and exponents {E.shape} are no polynomial of degree up to {HIGHEST}.",
                fix="Give one finite coefficient for each row of exponents, none of them negative.",
            )

    @classmethod
    def none(cls, count: int) -> Stiffening:
        """Return P = 0 of so many inputs."""
        return cls(np.zeros(0), np.zeros((0, count), dtype=np.int64))

    @classmethod
    def of(cls, coefficients: np.ndarray, count: int, degree: int) -> Stiffening:
        """Return the polynomial of coefficients (m,) of all monomials up to a degree, without those that are absent."""
        E, c = exponents(count, degree), np.asarray(coefficients)
        kept = np.abs(c) > 1e-12 * np.abs(c).max(initial=0.0)  # what round-off leaves of a symmetry
        return cls(c[kept], E[kept])

    @property
    def degree(self) -> int:
        """Highest degree of a monomial; 0 of none."""
        return int(self.exponents.sum(axis=1).max(initial=0))

    def at(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return P (N,), slopes (N, n) and curvatures (N, n, n) at scaled inputs X (N, n)."""
        value, slope, bend = powers(X, self.exponents)
        c = self.coefficients
        return value @ c, np.einsum("nmi,m->ni", slope, c), np.einsum("nmij,m->nij", bend, c)

    def compiled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what `stiffening_into` takes at its end, with scratch for one thread."""
        return self.coefficients, self.exponents, np.ones((self.exponents.shape[1], HIGHEST + 1))


@part
def _product(e, table, i, j) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """∏ ξ_k^{e_k}, differentiated by ξ_i and ξ_j; −1 for none."""
    t = 1.0
    for k in range(e.size):
        power = e[k]
        for a in (i, j):
            if a == k:
                t *= power
                power -= 1
        if power < 0:
            return 0.0
        t *= table[k, power]
    return t


@part
def stiffening_into(xi, g, H, scales, coefficients, exponents, table) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """P at ξ (n,); its slopes and curvatures by the first unscaled inputs are added to g (q,) and H (q, q)."""
    for k in range(xi.size):
        for p in range(1, table.shape[1]):
            table[k, p] = table[k, p - 1] * xi[k]
    total = 0.0
    for m in range(coefficients.size):
        c, e = coefficients[m], exponents[m]
        total += c * _product(e, table, -1, -1)
        for i in range(g.size):
            if e[i] == 0:
                continue
            g[i] += c * _product(e, table, i, -1) / scales[1, i]
            for j in range(i, g.size):
                if e[j] == 0:
                    continue
                t = c * _product(e, table, i, j) / (scales[1, i] * scales[1, j])
                H[i, j] += t
                if i != j:
                    H[j, i] += t
    return total
