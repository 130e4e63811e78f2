"""Energies, forces and stiffnesses of a body, as values, slopes and curvatures of ℓ = ln((U + offset)/U₀).

With E = U + offset, Q = −∂U/∂x the force that belongs to all inputs x, the felt coordinates first, R = ∂Q/∂x and
λ = ln U₀, exactly:

    ℓ = ln E − λ         ∇ℓ = −Q/E − ∇λ         ∇²ℓ = −R/E − QQᵀ/E² − ∇²λ

An error of ℓ is a relative one of E; an error δ of ∇ℓ one of the force, E δ/‖F‖; one of ∇²ℓ one of the stiffness,
E δ/‖K‖. These quotients are the rows' natural weights. What is known by further inputs counts as its baseline says.
A body at rest has neither energy nor force, but its stiffness tells ℓ: exp ℓ = tr(A⁻¹(−∂F/∂u))/k, A the baseline's.

What is left out together is a group (a depth series over one place): with a part of it in the fit, the rest would
tell nothing of places that were not solved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.regressors import pairs
from palpate.rbf.sample_checks import numbers
from palpate.surrogates import Baseline, Solves
from palpate.units import Range, bounds

__all__ = ["CURVATURE_SHARE", "EnergySamples"]

CURVATURE_SHARE = 0.1  # of a stiffness row's weight: its error level is about three times a force's
# Weight of a press up to which it may end in the gap before an element's flat face: a contact counts that little at a
# quarter of the depth that the mesh resolves, h²/8R, the gap of elements h on a surface as curved as the ball.
GAP = 1 / 64


@dataclass(frozen=True, eq=False)
class EnergySamples:
    """Solves that tell of an energy, N of them, k of their n inputs felt."""

    X: np.ndarray  # (N, n), felt coordinates, m, then further inputs
    energy: np.ndarray  # (N,), E = U + offset > 0, J; zero for a body at rest whose stiffness is known
    # (N, n), −∂U by the inputs: on the hand, N, then by further ones; not-a-number where it is not known
    force: np.ndarray
    # (N, n, n), derivative of the force by the inputs, symmetric; not-a-number where it is not known
    stiffness: np.ndarray
    depth: np.ndarray  # (N,), the baseline's own coordinate, m
    groups: np.ndarray  # (N,), solves of one number tell of each other
    inputs: tuple[Range, ...]  # names, units and trained ranges
    felt: int  # k
    forceful: int  # inputs whose forces count: the felt ones, and those after them that have one of their own
    numbers: np.ndarray  # (N,), of the solves that they were made from

    @classmethod
    def of(cls, solves: Solves, baseline: Baseline) -> EnergySamples:
        """Return all solves that tell something: those without contact have no energy, whatever is learnt.

        Flat faces of elements lie a little inside the curved surface through their corners. A press that ends in that
        gap meets nothing, and counts as one without contact.
        """
        inputs, k = tuple(solves.inputs), len(baseline.directions)
        n = len(inputs)
        X = numbers("Inputs X", solves.X, (None, n))
        N = len(X)
        E = numbers("Energies", solves.energy, (N,)) + baseline.offset
        F, K = _known_forces(solves.force, N, n, k), _known_stiffnesses(solves.stiffness, N, n, k)
        s = baseline.coordinate(X)
        touching = s > 0
        touching[touching] = (E[touching] > 0) | (baseline.row_weights(X[touching]) > GAP)
        _require_energy(s, E, touching, baseline.holds)
        resting = np.isfinite(K[:, :k, :k]).all(axis=(1, 2)) & ~touching & baseline.holds
        samples = cls(
            X,
            E,
            F,
            (K + K.transpose(0, 2, 1)) / 2,
            s,
            np.arange(N),
            inputs,
            k,
            k + baseline.forces,
            np.arange(N),
        )
        samples = samples.take(touching | resting)
        return replace(samples, groups=baseline.groups(samples.X))

    def __len__(self) -> int:
        return len(self.X)

    @property
    def moved(self) -> np.ndarray:
        """Mask (N,) of the solves that are away from rest, and so have an energy."""
        return np.asarray(self.energy > 0)

    @property
    def scaled(self) -> np.ndarray:
        """ξ (N, n) in [−1, 1] over the declared ranges."""
        low, high = bounds(self.inputs)
        return np.asarray((2.0 * self.X - low - high) / (high - low))

    @property
    def half(self) -> np.ndarray:
        """Half (n,) of each input's range."""
        low, high = bounds(self.inputs)
        return np.asarray((high - low) / 2)

    def take(self, which: np.ndarray) -> EnergySamples:
        """Return some of them, by index or mask."""
        own = ("X", "energy", "force", "stiffness", "depth", "groups", "numbers")
        return replace(self, **{name: getattr(self, name)[which] for name in own})

    def targets(self, baseline: Baseline) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ℓ (N, 1), its slopes (N, 1, n) and curvatures (N, 1, n(n+1)/2) by scaled inputs; unknown ones zero."""
        half, moved = self.half, self.moved
        i, j = pairs(len(half))
        baseline_log, first, second = baseline.logarithm(self.X, self.inputs)
        with np.errstate(divide="ignore", invalid="ignore"):
            value = np.log(self.energy) - baseline_log
            g = -self.force / self.energy[:, None]
            H = -self.stiffness / self.energy[:, None, None] - g[:, :, None] * g[:, None]
            slopes, bends = (g - first) * half, (H - second) * half[:, None] * half
        if not moved.all():
            rest = np.flatnonzero(~moved)
            A = baseline.stiffness_at_rest(self.X[rest], self.inputs)
            K = -self.stiffness[rest, : self.felt, : self.felt]
            value[rest] = np.log(np.trace(np.linalg.solve(A, K), axis1=1, axis2=2) / self.felt)
            slopes[rest], bends[rest] = 0.0, 0.0
        return value[:, None], np.nan_to_num(slopes)[:, None], np.nan_to_num(bends[:, i, j])[:, None]

    def rows(self, baseline: Baseline, *, curvature_share: float = CURVATURE_SHARE) -> dict[str, np.ndarray]:
        """Return what `refine` takes besides X: targets and natural weights; a stiffness has a share of a force's."""
        Y, slopes, curvatures = self.targets(baseline)
        half, n, k = self.half, len(self.inputs), self.forceful
        i, j = pairs(n)
        size = np.linalg.norm(self.force[:, :k], axis=1)
        size = size.clip(max(baseline.force_floor * size.max(), 1e-300))
        by_force = (self.energy / size)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            by_stiffness = (self.energy / np.linalg.norm(self.stiffness[:, :k, :k], axis=(1, 2)))[:, None]
        own, further, moved = np.arange(n) < k, baseline.further_share, self.moved[:, None]
        slope_weight = np.where(own, (by_force / half) ** 2, further) * np.isfinite(self.force)
        curvature_weight = np.where(
            own[i] & own[j],
            curvature_share * (by_stiffness / (half[i] * half[j])) ** 2,
            further * (by_force / half[i]) ** 2 * (own[i] & ~own[j]),
        )
        return {
            "Y": Y,
            "weights": baseline.row_weights(self.X),
            "slopes": slopes,
            "slope_weight": slope_weight * moved,
            "curvatures": curvatures,
            "curvature_weight": np.where(np.isfinite(self.stiffness[:, i, j]) & moved, curvature_weight, 0.0),
            "groups": self.groups,
        }


def _known_forces(force: Any, N: int, n: int, k: int) -> np.ndarray:
    """Return (N, n) from forces (N, k), or from forces and what is known of −∂U by the further inputs (N, n)."""
    F = np.asarray(force, float)
    if F.ndim == 2 and F.shape[1] == k:
        return np.hstack([numbers("Forces", F, (N, k)), np.full((N, n - k), np.nan)])
    F = numbers("Forces and responses to further inputs", F, (N, n), finite=False)
    numbers("Forces", F[:, :k], (N, k))
    return F


def _known_stiffnesses(stiffness: Any, N: int, n: int, k: int) -> np.ndarray:
    """Return (N, n, n) from stiffnesses (N, k, k) or (N, n, n); not-a-number where unknown."""
    K = np.full((N, n, n), np.nan)
    if stiffness is None:
        return K
    given = np.asarray(stiffness, float)
    q = n if given.shape == (N, n, n) else k
    K[:, :q, :q] = numbers("Stiffnesses", given.reshape(N, -1), (N, q * q), finite=False).reshape(N, q, q)
    return K


def _require_energy(s: np.ndarray, E: np.ndarray, touching: np.ndarray, holds: bool) -> None:
    """Refuse solves none of which has contact, or in contact without an energy."""
    if not touching.any():
        raise UsageError(
            f"None of {len(s)} solves has {'a displaced pad' if holds else 'contact'}.",
            why="A surrogate is learnt from touches: without one the energy is zero.",
            fix="Solve with the pad displaced, in all directions."
            if holds
            else "Press deeper, or check the surface and the probe's radius.",
        )
    strange = touching & ~(E > 0)
    if strange.any():
        raise UsageError(
            f"{int(strange.sum())} solves {'with a displaced pad' if holds else 'in contact'} stored no energy, "
            f"the farthest at {s[strange].max():.3g} m.",
            why="A body that is moved gives way under a force, and stores what the hand gives."
            if holds
            else "The surface does not lie where the solved body's did, or the energy is not that of the touch.",
            fix="Pass energies less those of the body at rest, and displacements from there."
            if holds
            else "Pass the touched surface of the body at rest, and energies less those without contact.",
        )
