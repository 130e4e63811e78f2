"""Modes of fields on a surface: proper orthogonal decomposition in its mean square (Sirovich 1987).

With shares m_j of the surface the inner product is ⟨u, v⟩ = Σ_j m_j u_j·v_j. Of snapshots u_i the modes φ_k are
orthonormal in it, and the best r of them miss (Σ_{k>r} σ_k²/N)^½ of the snapshots in the root mean square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["SurfaceModes", "left_out", "lumped_mass"]

_ROUND_OFF = 1e-13  # modes below this share of the largest are round-off
_FOLDS = 10


def lumped_mass(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Share (nodes,) of the surface's area that each node stands for: a third of its triangles'.

    Parameters
    ----------
    points : (nodes, 3)
    triangles : (t, 3) int

    Raises
    ------
    UsageError
        If the triangles have no area.
    """
    a, b, c = np.moveaxis(np.asarray(points, float)[triangles], 1, 0)
    thirds = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0, 3)
    mass = np.bincount(np.ravel(triangles), thirds, minlength=len(points))
    if not (np.isfinite(mass).all() and mass.sum() > 0):
        raise UsageError(
            "These triangles have no area.", fix="Pass the triangles of a surface and its nodes in m."
        )
    return np.asarray(mass / mass.sum())


@dataclass(frozen=True, eq=False)
class SurfaceModes:
    """Modes of N snapshots.

    Attributes
    ----------
    modes : (k, nodes, components)
        φ, the largest first; zero at nodes that stand for no surface.
    sizes : (k,)
        σ_k/√N: root mean square of the coefficients, in the field's unit.
    """

    modes: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray, mass: np.ndarray) -> SurfaceModes:
        """Of fields (N, nodes, components), by a singular value decomposition in shares of mass (nodes,)."""
        N, nodes, components = values.shape
        root = np.sqrt(mass)[:, None]
        V, sizes = _right((values * root).reshape(N, -1))
        with np.errstate(divide="ignore", invalid="ignore"):
            modes = np.where(root > 0, V.reshape(-1, nodes, components) / root, 0.0)
        return cls(modes, sizes / np.sqrt(N))

    def count(self, tolerance: float) -> int:
        """Fewest modes that miss at most the tolerance of the snapshots; one at least.

        Parameters
        ----------
        tolerance : float
            Root mean square over surface and snapshots, in the field's unit.
        """
        return int(np.clip((self.missed > tolerance).sum(), 1, max(len(self.sizes), 1)))

    @property
    def missed(self) -> np.ndarray:
        """Root mean square (k,) of the snapshots that the first r = 0, 1, … modes miss."""
        return np.asarray(np.sqrt(np.cumsum((self.sizes**2)[::-1])[::-1]))

    def take(self, count: int) -> SurfaceModes:
        """The first so many."""
        return SurfaceModes(self.modes[:count], self.sizes[:count])


def _right(B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal right singular vectors and singular values of B above round-off; one vector at least."""
    _, sizes, V = np.linalg.svd(B, full_matrices=False)
    k = max(1, int((sizes > _ROUND_OFF * max(float(sizes[0]), 1e-300)).sum()))
    return V[:k], sizes[:k]


def left_out(values: np.ndarray, mass: np.ndarray, count: int, groups: np.ndarray) -> float:
    """Root mean square that so many modes of the other snapshots miss of each tenth of the groups (N,) left out."""
    B = (values * np.sqrt(mass)[:, None]).reshape(len(values), -1)
    _, own = np.unique(groups, return_inverse=True)
    total, folds = 0.0, min(_FOLDS, int(own.max()) + 1)
    if folds < 2:
        return float("nan")
    # all that counts is in the span of the snapshots: their Gram matrix's root is as good, and small
    U, s, _ = np.linalg.svd(B, full_matrices=False)
    small = U * s
    for fold in range(folds):
        out = own % folds == fold
        V = _right(small[~out])[0][:count]
        total += float(((small[out] - small[out] @ V.T @ V) ** 2).sum())
    return float(np.sqrt(total / len(values)))
