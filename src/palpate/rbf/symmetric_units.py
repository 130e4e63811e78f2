"""Units with their images under a finite group of maps of the inputs: a map that is symmetric by construction.

    φ_k(x) = Σ_g g(‖A_k x_g − b_k‖²),   x_g = G x + t

Each image is a unit itself, with the factor A_k G and the shift b_k − A_k t, so the map is an ordinary network whose
units share their weights within an orbit. It is what training on all images of every sample tends to, for a
fraction of the rows. The affine tail is left with what the group leaves unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.errors import UsageError
from palpate.network.radial import radial
from palpate.rbf.regressors import Regressors, pairs

__all__ = ["Images", "SymmetricRegressors"]

_SAME = 1e-9  # difference of scaled inputs that is round-off of a declared matrix


@dataclass(frozen=True, eq=False)
class Images:
    """The maps x ↦ G x + t of a group, on scaled inputs; two in succession are again one of them."""

    turns: np.ndarray  # (c, n, n), the matrices G
    shifts: np.ndarray  # (c, n), the shifts t

    def __post_init__(self) -> None:
        maps = self.homogeneous
        both = np.einsum("aij,bjk->abik", maps, maps).reshape(-1, *maps.shape[1:])
        away = np.abs(both[:, None] - maps[None]).max(axis=(2, 3)).min(axis=1)
        if not (away < _SAME).all():
            raise UsageError(
                f"The {len(maps)} maps are not a symmetry: two of them in succession are none of them.",
                why="What leaves a body unchanged does so when done twice, and so does its inverse.",
                fix="List every map of the group, the identity among them.",
            )

    @property
    def homogeneous(self) -> np.ndarray:
        """[[1, 0], [t, G]] (c, 1 + n, 1 + n): the maps on [1, x]."""
        c, n = self.shifts.shape
        found = np.zeros((c, 1 + n, 1 + n))
        found[:, 0, 0] = 1.0
        found[:, 1:, 0], found[:, 1:, 1:] = self.shifts, self.turns
        return found

    def of(self, X: np.ndarray) -> np.ndarray:
        """The images (c, N, n) of points X (N, n)."""
        return np.asarray(np.einsum("cij,Nj->cNi", self.turns, X) + self.shifts[:, None])

    @cached_property
    def unchanged(self) -> np.ndarray:
        """An orthonormal basis (1 + n, r) of the affine functions T of [1, x] that every map leaves as they are."""
        mean = self.homogeneous.mean(axis=0)  # T·[1, x] averaged over the images is (meanᵀ T)·[1, x]
        U, sizes, _ = np.linalg.svd(mean.T)  # a projection: its singular values are none or at least one
        return np.asarray(U[:, sizes > 0.5])


@dataclass(frozen=True)
class SymmetricRegressors(Regressors):
    """Regressors of units with their images, and of the tail that the images of a group leave as it is.

    The number of units is that of orbits.
    """

    images: Images | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.images is None or self.tail == "constant":
            raise UsageError("Symmetric units need their images, and a tail that is affine or none.")

    @property
    def _images(self) -> Images:
        assert self.images is not None  # checked when it was made
        return self.images

    @property
    def copies(self) -> int:
        """Images of each unit."""
        return len(self._images.turns)

    @property
    def tail_size(self) -> int:
        """Affine functions that every map leaves as they are."""
        return 0 if self.tail == "none" else self._images.unchanged.shape[1]

    def phi(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """Σ over the images of φ (N, h)."""
        return self._summed(super().phi(self._all(X), theta))

    def by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """φ (N, h) and ∂φ_k/∂θ_k (N, h, p)."""
        phi, by_theta = super().by_theta(self._all(X), theta)
        return self._summed(phi), self._summed(by_theta)

    def scaled_by_theta(self, X: np.ndarray, theta: np.ndarray, scale: np.ndarray, out: np.ndarray) -> None:
        """∂φ_k/∂θ_k times scale (N,) into out (N, h, p)."""
        form, (A, b) = self.form, self.form.factors(theta)
        by_entry = np.zeros((len(X), len(theta), form.rows.size))
        by_shift = np.zeros((len(X), *b.shape))
        for image in self._images.of(X):
            v = self._v(image, A, b)
            g1 = radial(self.radial, np.einsum("nkr,nkr->nk", v, v))[1]
            v *= (2.0 * g1 * scale[:, None])[..., None]
            by_entry += v[..., form.rows] * image[:, None, form.columns]
            by_shift -= v
        out[:] = form.pull(theta, by_entry, by_shift)

    def slopes(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """∂φ_k/∂x_i (N, n, h)."""
        return self._slopes_at(self._images.of(X), self._images.turns, theta)[0]

    def slopes_by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂φ_k/∂x_i (N, n, h) and its derivatives by θ_k (N, n, h, p)."""
        found, *by = self._slopes_at(self._images.of(X), self._images.turns, theta, self._pattern)
        return found, self.form.pull(theta, *by)

    def curvatures(self, X: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """∂²φ_k/∂x_i∂x_j (N, n(n+1)/2, h), i ≤ j."""
        return self._curvatures_at(self._images.of(X), self._turns_of_pairs, theta)[0]

    def curvatures_by_theta(self, X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂²φ_k/∂x_i∂x_j (N, n(n+1)/2, h), i ≤ j, and its derivatives by θ_k (N, n(n+1)/2, h, p)."""
        found, *by = self._curvatures_at(self._images.of(X), self._turns_of_pairs, theta, self._pattern)
        return found, self.form.pull(theta, *by)

    def tail_rows(self, X: np.ndarray) -> np.ndarray:
        """The tail's regressors (N, p_t)."""
        one = np.hstack([np.ones((len(X), 1)), X])
        return np.asarray(one @ self._images.unchanged[:, : self.tail_size])

    def tail_slopes(self, count: int) -> np.ndarray:
        """∂/∂x_i of the tail's regressors at N points, (N, n, p_t)."""
        one = self._images.unchanged[1:, : self.tail_size]
        return np.broadcast_to(one, (count, *one.shape))

    def expanded(
        self, theta: np.ndarray, coefficients: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The ordinary network: factors (h c, r, n), shifts (h c, r) and coefficients (1 + n + h c, k), tail first.

        The images of a unit stand together. Coefficients (p_t + h, k) may be any linear function of the regressors,
        such as a root of their covariance.
        """
        A, b = self.form.factors(theta)
        turns, shifts = self._images.turns, self._images.shifts
        factors = np.einsum("kri,cij->kcrj", A, turns).reshape(-1, *A.shape[1:])
        places = (b[:, None] - np.einsum("kri,ci->kcr", A, shifts)).reshape(-1, b.shape[1])
        p_t = self.tail_size
        tail = self._images.unchanged[:, :p_t] @ coefficients[:p_t]
        return factors, places, np.vstack([tail, np.repeat(coefficients[p_t:], len(turns), axis=0)])

    @cached_property
    def _turns_of_pairs(self) -> np.ndarray:
        """The linear map from curvatures of an image, pair by pair, to those of the point: (c, n(n+1)/2, n(n+1)/2)."""
        turns = self._images.turns
        i, j = pairs(self.form.inputs)
        a, b = i[:, None], j[:, None]
        both = turns[:, a, i] * turns[:, b, j] + turns[:, a, j] * turns[:, b, i]  # (c, pair ab, pair ij)
        return np.asarray(np.where((i == j)[:, None], 0.5, 1.0) * both)

    def _all(self, X: np.ndarray) -> np.ndarray:
        return self._images.of(X).reshape(-1, X.shape[1])

    def _summed(self, found: np.ndarray) -> np.ndarray:
        c = len(self._images.turns)
        return np.asarray(found.reshape(c, len(found) // c, *found.shape[1:]).sum(axis=0))
