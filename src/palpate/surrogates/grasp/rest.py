"""How stiff a held body is before it has moved: a symmetric root of its stiffness, as a polynomial of place.

A pad displaced by d stores, while all is small, U₀ = ½ dᵀ A d with A(y) symmetric and positive definite, y the place
of the pad and any further inputs. Of such matrices the symmetric roots A = S² are kept, since

    U₀ = ½ ‖S(y) d‖²

cannot be negative whatever the numbers of S are; S may be a polynomial; and an isometry M that takes y to y'
asks of it no more than S(y') = M S(y) Mᵀ, which is linear. A body that is stiffer along its surface than across it,
√A = s_t (I − n nᵀ) + s_n n nᵀ, on a sphere has a quadratic S, n being linear in place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from palpate.checks import own_arrays
from palpate.errors import UsageError

__all__ = ["RestStiffness", "monomials", "root_at", "terms"]

_jit = njit(cache=True, nogil=True, error_model="numpy")
_I, _J = np.triu_indices(3)
ENTRIES = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # where the six entries of a symmetric matrix are
MOST = 2  # highest degree


def terms(count: int, degree: int) -> np.ndarray:
    """Which two of `count` variables each monomial is the product of, (m, 2); −1 stands for one."""
    found = [(-1, -1)]
    found += [(i, -1) for i in range(count)] if degree >= 1 else []
    found += [(i, j) for i in range(count) for j in range(i, count)] if degree >= MOST else []
    return np.array(found, dtype=np.int64)


def monomials(Z: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (N, m), slopes (N, m, k) and curvatures (N, m, k, k) of all monomials at Z (N, k)."""
    N, k = Z.shape
    found = terms(k, degree)
    wide = np.column_stack([Z, np.ones(N)])
    i, j = found.T
    value = wide[:, i] * wide[:, j]
    one = np.vstack([np.eye(k), np.zeros(k)])
    slope = one[i] * wide[:, j, None] + wide[:, i, None] * one[j]
    bend = one[i][:, :, None] * one[j][:, None] + one[j][:, :, None] * one[i][:, None]
    return value, slope, np.broadcast_to(bend, (N, *bend.shape))


@dataclass(frozen=True, eq=False)
class RestStiffness:
    """S as a polynomial of scaled inputs.

    Attributes
    ----------
    coefficients : (m, 6)
        Of the monomials 1, ζ_i, ζ_i ζ_j (i ≤ j) in this order, those of a degree all or none, for the entries xx,
        xy, xz, yy, yz, zz of S; √(N/m).
    count : int
        Number k of inputs ζ, in [−1, 1] over their ranges.

    Raises
    ------
    UsageError
        If there are not as many rows as a polynomial of degree 0, 1 or 2 has, or a number is not finite.
    """

    coefficients: np.ndarray
    count: int

    def __post_init__(self) -> None:
        own_arrays(self, "coefficients")
        C = self.coefficients
        lengths = [len(terms(self.count, d)) for d in range(MOST + 1)]
        if C.ndim != 2 or C.shape[1] != 6 or len(C) not in lengths or not np.isfinite(C).all():
            raise UsageError(
                f"Coefficients of shape {C.shape} are no stiffness at rest over {self.count} inputs.",
                why=f"They are finite, six for each of {', '.join(map(str, lengths))} monomials.",
                fix="Give a polynomial of degree 0, 1 or 2.",
            )

    @classmethod
    def even(cls, matrix: np.ndarray, count: int = 0) -> RestStiffness:
        """The same stiffness A (3, 3), N/m, everywhere.

        Raises
        ------
        UsageError
            If the matrix is not positive definite.
        """
        A = np.asarray(matrix, dtype=np.float64)
        values, V = np.linalg.eigh((A + A.T) / 2)
        if not (np.isfinite(A).all() and values[0] > 0):
            raise UsageError(
                f"A stiffness at rest with the eigenvalues {values} N/m holds nothing.",
                fix="Give a positive definite matrix: minus the derivative of the force on the hand.",
            )
        root = (V * np.sqrt(values)) @ V.T
        return cls(root[_I, _J][None], count)

    @property
    def degree(self) -> int:
        """0, 1 or 2; without inputs 0."""
        return next(d for d in range(MOST + 1) if len(terms(self.count, d)) == len(self.coefficients))

    def root(self, Z: np.ndarray) -> np.ndarray:
        """S (N, 3, 3) at scaled inputs Z (N, k)."""
        return np.asarray((monomials(Z, self.degree)[0] @ self.coefficients)[:, ENTRIES])

    def least(self, Z: np.ndarray) -> float:
        """Least |eigenvalue| of S over its largest, over Z (N, k): zero where a direction has no stiffness."""
        values = np.abs(np.linalg.eigvalsh(self.root(Z)))
        return float((values.min(axis=1) / values.max(axis=1)).min())

    def compiled(self) -> tuple[np.ndarray, np.ndarray]:
        """What `root_at` takes."""
        return self.coefficients, terms(self.count, self.degree)


@_jit
def root_at(zeta, S, coefficients, pairs) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """S (3, 3) at scaled inputs ζ (k,)."""
    S[:, :] = 0.0
    for m in range(pairs.shape[0]):
        t = 1.0
        if pairs[m, 0] >= 0:
            t *= zeta[pairs[m, 0]]
        if pairs[m, 1] >= 0:
            t *= zeta[pairs[m, 1]]
        e = 0
        for i in range(3):
            for j in range(i, 3):
                S[i, j] += t * coefficients[m, e]
                e += 1
    for i in range(3):
        for j in range(i):
            S[i, j] = S[j, i]
