"""Energies, forces and stiffnesses of a held pad, as values, slopes and curvatures of ℓ = ln(U/U₀) − P.

With U₀ = ½ ‖S d‖², Q the force −∂U/∂x that belongs to the inputs x = (d, y), its first three components the force F
on the hand, and with R = ∂Q/∂x, exactly:

    ℓ + P = ln U − ln U₀     ∇(ℓ + P) = −Q/U − ∇U₀/U₀     ∇²(ℓ + P) = −R/U − QQᵀ/U² − ∇²U₀/U₀ + ∇U₀∇U₀ᵀ/U₀²

A pad at rest, d = 0, has neither energy nor force, but its stiffness tells ℓ: exp(P + ℓ) = tr(A⁻¹(−∂F/∂d))/3, A = S².

The rows' natural weights make an error of ℓ one of the energy, of ∂ℓ/∂d one of the force, of ∂²ℓ/∂d² one of the
stiffness, all relative. How energy and force change with place is known too, from the same solve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.energy.samples import CURVATURE_SHARE
from palpate.rbf.regressors import pairs
from palpate.rbf.sample_checks import numbers
from palpate.surrogates.grasp.rest import ENTRIES, RestStiffness, monomials
from palpate.surrogates.grasp.stiffening import Stiffening
from palpate.units import Range, bounds

__all__ = ["PLACE_SHARE", "GraspSamples"]

PLACE_SHARE = 0.1  # what a change with place counts beside the energy and the force themselves


@dataclass(frozen=True, eq=False)
class GraspSamples:
    """Solves of a held body, N of them.

    Attributes
    ----------
    X : (N, n)
        Displacement of the pad (m), then its place and further inputs.
    energy : (N,)
        U, J; zero at rest.
    force : (N, n)
        −∂U/∂x; not-a-number where it is not known.
    stiffness : (N, n, n)
        Its derivative by x, symmetric; not-a-number where it is not known.
    inputs : n ranges
    """

    X: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    inputs: tuple[Range, ...]

    @classmethod
    def of(
        cls, X: Any, energy: Any, force: Any, stiffness: Any, *, inputs: tuple[Range, ...]
    ) -> GraspSamples:
        """From solves; force (N, 3) or (N, n), stiffness (N, 3, 3), (N, n, n) or None.

        Raises
        ------
        UsageError
            If shapes disagree, a displaced pad has stored no energy, or all pads are at rest and tell no stiffness.
        """
        n = len(inputs)
        X = numbers("Inputs X", X, (None, n))
        N = len(X)
        U = numbers("Energies", energy, (N,))
        F, K = np.full((N, n), np.nan), np.full((N, n, n), np.nan)
        given = np.asarray(force, float)
        q = n if given.shape == (N, n) else 3
        F[:, :q] = numbers("Forces", given, (N, q))
        if stiffness is not None:
            given = np.asarray(stiffness, float)
            q = n if given.shape == (N, n, n) else 3
            flat = numbers("Stiffnesses", given.reshape(N, -1), (N, q * q), finite=False)
            K[:, :q, :q] = flat.reshape(N, q, q)
        moved = X[:, :3].any(axis=1)
        strange = moved & ~(U > 0)
        if strange.any():
            raise UsageError(
                f"{int(strange.sum())} solves with a displaced pad stored no energy.",
                why="A body that is held gives way under a force, and stores what the hand gives.",
                fix="Pass energies less those of the body at rest, and displacements in the first three columns.",
            )
        kept = moved | np.isfinite(K[:, :3, :3]).all(axis=(1, 2))
        if not moved.any():
            raise UsageError(
                f"None of {N} solves has a displaced pad.",
                fix="Solve with the pad displaced, in all directions.",
            )
        return cls(X, U, F, (K + K.transpose(0, 2, 1)) / 2, tuple(inputs)).take(kept)

    def __len__(self) -> int:
        return len(self.X)

    @property
    def moved(self) -> np.ndarray:
        """Which pads are displaced (N,)."""
        return np.asarray(self.X[:, :3].any(axis=1))

    @property
    def scaled(self) -> np.ndarray:
        """ξ (N, n) in [−1, 1] over the declared ranges."""
        low, high = bounds(self.inputs)
        return np.asarray((2.0 * self.X - low - high) / (high - low))

    def take(self, which: np.ndarray) -> GraspSamples:
        """Some of them, by index or mask."""
        own = ("X", "energy", "force", "stiffness")
        return replace(self, **{name: getattr(self, name)[which] for name in own})

    def targets(
        self, rest: RestStiffness, stiffening: Stiffening | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """ℓ (N, 1), its slopes (N, 1, n) and curvatures (N, 1, n(n+1)/2) by scaled inputs; unknown ones zero."""
        half, moved = self.half, self.moved
        U0, first, second = _logarithm(rest, self.X[:, :3], self.scaled[:, 3:], half)
        i, j = pairs(len(half))
        with np.errstate(divide="ignore", invalid="ignore"):
            value = np.log(self.energy / U0)
            g = -self.force * half / self.energy[:, None]
            H = (
                -self.stiffness * half[:, None] * half / self.energy[:, None, None]
                - g[:, :, None] * g[:, None]
            )
            slopes, bends = g - first, (H - second)[:, i, j]
        for row in np.flatnonzero(~moved):
            S = rest.root(self.scaled[row : row + 1, 3:])[0]
            value[row] = np.log(np.trace(np.linalg.solve(S @ S, -self.stiffness[row, :3, :3])) / 3)
        if stiffening is not None:
            P, by_inputs, twice = stiffening.at(self.scaled)
            value, slopes, bends = value - P, slopes - by_inputs, bends - twice[:, i, j]
        slopes[~moved], bends[~moved] = 0.0, 0.0
        return value[:, None], np.nan_to_num(slopes)[:, None], np.nan_to_num(bends)[:, None]

    def rows(
        self,
        rest: RestStiffness,
        stiffening: Stiffening | None = None,
        *,
        curvature_share: float = CURVATURE_SHARE,
        place_share: float = PLACE_SHARE,
    ) -> dict[str, np.ndarray]:
        """What `refine` takes besides X: targets, and their natural weights.

        `curvature_share` is what a stiffness counts beside a force, `place_share` what a change with place counts
        beside energy and force.
        """
        Y, slopes, curvatures = self.targets(rest, stiffening)
        half, n = self.half, len(self.inputs)
        i, j = pairs(n)
        by_force = (self.energy / np.linalg.norm(self.force[:, :3], axis=1).clip(1e-300))[:, None]
        by_stiffness = (self.energy / np.linalg.norm(self.stiffness[:, :3, :3], axis=(1, 2)))[:, None]
        own = np.arange(n) < 3
        slope_weight = np.where(own, (by_force / half) ** 2, place_share) * np.isfinite(self.force)
        curvature_weight = np.where(
            own[i] & own[j],
            curvature_share * (by_stiffness / (half[i] * half[j])) ** 2,
            place_share * (by_force / half[i]) ** 2 * (own[i] & ~own[j]),
        )
        moved = self.moved[:, None]
        known = np.isfinite(self.stiffness[:, i, j])
        return {
            "Y": Y,
            "weights": np.ones(len(self)),
            "slopes": slopes,
            "slope_weight": slope_weight * moved,
            "curvatures": curvatures,
            "curvature_weight": np.where(known & moved, curvature_weight, 0.0),
        }

    @property
    def half(self) -> np.ndarray:
        """Half (n,) of each input's range."""
        low, high = bounds(self.inputs)
        return np.asarray((high - low) / 2)


def _logarithm(
    rest: RestStiffness, d: np.ndarray, Z: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """U₀ (N,), and gradient (N, n) and Hessian (N, n, n) of ln U₀ by scaled inputs."""
    N, n = len(d), len(half)
    value, slope, bend = monomials(Z, rest.degree)
    C = rest.coefficients
    S = (value @ C)[:, ENTRIES]
    by_place = np.einsum("nmk,me->nek", slope, C)[:, ENTRIES]  # (N, 3, 3, k)
    twice = np.einsum("nmkl,me->nekl", bend, C)[:, ENTRIES]
    v = np.einsum("nij,nj->ni", S, d)
    J, B = np.zeros((N, 3, n)), np.zeros((N, 3, n, n))
    J[:, :, :3] = S * half[:3]
    J[:, :, 3:] = np.einsum("nijk,nj->nik", by_place, d)
    B[:, :, :3, 3:] = by_place * half[:3, None]
    B[:, :, 3:, :3] = B[:, :, :3, 3:].transpose(0, 1, 3, 2)
    B[:, :, 3:, 3:] = np.einsum("nijkl,nj->nikl", twice, d)
    U0 = (v**2).sum(axis=1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.einsum("nai,na->ni", J, v) / U0[:, None]
        second = (np.einsum("nai,naj->nij", J, J) + np.einsum("na,naij->nij", v, B)) / U0[:, None, None]
        return U0, first, second - first[:, :, None] * first[:, None]
