"""The stiffness of a held body at rest: a symmetric root of it, as a polynomial of place.

A pad displaced by d stores, while all is small, U₀ = ½ dᵀ A d with A(y) symmetric and positive definite, (k, k) for k
felt coordinates d, y the place of the pad and any further inputs. Of such matrices the symmetric roots A = S² are kept,
since

    U₀ = ½ ‖S(y) d‖²

cannot be negative whatever the numbers of S are; S may be a polynomial; and an isometry M that takes y to y'
asks of it no more than S(y') = M S(y) Mᵀ, which is linear. A body that is stiffer along its surface than across it,
√A = s_t (I − n nᵀ) + s_n n nᵀ, on a sphere has a quadratic S, n being linear in place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import part

__all__ = ["MOST", "RestStiffness", "entries", "monomials", "root_at", "terms"]

MOST = 2  # highest degree
_SIZES = {1: 1, 3: 2, 6: 3}  # felt coordinates by the number of a symmetric matrix's entries


def entries(size: int) -> np.ndarray:
    """Return where the entries i ≤ j, row by row, of a symmetric matrix (size, size) stand."""
    places = np.zeros((size, size), dtype=np.int64)
    i, j = np.triu_indices(size)
    places[i, j] = places[j, i] = np.arange(len(i))
    return places


def terms(count: int, degree: int) -> np.ndarray:
    """Return the two of `count` variables that each monomial is the product of, (m, 2); −1 stands for one."""
    factors = [(-1, -1)]
    factors += [(i, -1) for i in range(count)] if degree >= 1 else []
    factors += [(i, j) for i in range(count) for j in range(i, count)] if degree >= MOST else []
    return np.array(factors, dtype=np.int64)


def monomials(Z: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values (N, m), slopes (N, m, k) and curvatures (N, m, k, k) of all monomials at Z (N, k)."""
    N, k = Z.shape
    wide = np.column_stack([Z, np.ones(N)])
    i, j = terms(k, degree).T
    value = wide[:, i] * wide[:, j]
    unit = np.vstack([np.eye(k), np.zeros(k)])
    slope = unit[i] * wide[:, j, None] + wide[:, i, None] * unit[j]
    bend = unit[i][:, :, None] * unit[j][:, None] + unit[j][:, :, None] * unit[i][:, None]
    return value, slope, np.broadcast_to(bend, (N, *bend.shape))


@dataclass(frozen=True, eq=False)
class RestStiffness:
    """S as a polynomial of scaled inputs.

    Attributes
    ----------
    coefficients : (m, k (k + 1)/2)
        Of the monomials 1, ζ_i, ζ_i ζ_j (i ≤ j) in this order, those of a degree all or none, for the entries i ≤ j
        of S (k, k) row by row: xx, xy, xz, yy, yz, zz of three felt coordinates; √(N/m).
    count : int
        Number of inputs ζ, in [−1, 1] over their ranges.

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
        if C.ndim != 2 or C.shape[1] not in _SIZES or len(C) not in lengths or not np.isfinite(C).all():
            raise UsageError(
                f"Coefficients of shape {C.shape} are no stiffness at rest over {self.count} inputs.",
                why=f"They are finite, six of three directions for each of {', '.join(map(str, lengths))} monomials.",
                fix="Give a polynomial of degree 0, 1 or 2.",
            )

    @classmethod
    def even(cls, matrix: np.ndarray, count: int = 0) -> RestStiffness:
        """Return the same stiffness A (k, k), N/m, everywhere.

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
        return cls(root[np.triu_indices(len(root))][None], count)

    @property
    def size(self) -> int:
        """Number k of felt coordinates."""
        return _SIZES[self.coefficients.shape[1]]

    @property
    def degree(self) -> int:
        """Degree of the polynomial: 0, 1 or 2; without inputs 0."""
        return next(d for d in range(MOST + 1) if len(terms(self.count, d)) == len(self.coefficients))

    def root(self, Z: np.ndarray) -> np.ndarray:
        """Return S (N, k, k) at scaled inputs Z (N, count)."""
        return np.asarray((monomials(Z, self.degree)[0] @ self.coefficients)[:, entries(self.size)])

    def least(self, Z: np.ndarray) -> float:
        """Return the least |eigenvalue| of S over its largest, over Z (N, count): zero where a direction is slack."""
        values = np.abs(np.linalg.eigvalsh(self.root(Z)))
        return float((values.min(axis=1) / values.max(axis=1)).min())

    def compiled(self) -> tuple[np.ndarray, np.ndarray]:
        """Return what `root_at` takes."""
        return self.coefficients, terms(self.count, self.degree)


@part
def root_at(zeta, S, k, coefficients, pairs) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the first (k, k) of S (3, 3) at scaled inputs ζ."""
    S[:, :] = 0.0
    for m in range(pairs.shape[0]):
        t = 1.0
        if pairs[m, 0] >= 0:
            t *= zeta[pairs[m, 0]]
        if pairs[m, 1] >= 0:
            t *= zeta[pairs[m, 1]]
        e = 0
        for i in range(k):
            for j in range(i, k):
                S[i, j] += t * coefficients[m, e]
                e += 1
    for i in range(k):
        for j in range(i):
            S[i, j] = S[j, i]
