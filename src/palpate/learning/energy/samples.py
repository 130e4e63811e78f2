"""Energies, forces and stiffnesses of touches, as values, slopes and curvatures of ℓ = ln(U/U₀(s)).

With λ = ln U₀, F = −∂U/∂c and K = ∂F/∂c, exactly:

    ℓ = ln U − λ         ∇ℓ = −F/U − λ'∇s         ∇²ℓ = −K/U − FFᵀ/U² − λ''∇s∇sᵀ − λ'∇²s

An error of ℓ is a relative one of U; an error δ of ∇ℓ one of the force, U δ/‖F‖; one of ∇²ℓ one of the stiffness,
U δ/‖K‖. These quotients are the rows' natural weights. Where ∂U/∂p is known of a further input p, ∂ℓ/∂p = ∂U/∂p / U
counts by the relative energy error that it makes over half the input's range. Where p is the probe's radius, s grows
with it: ∂ℓ/∂R = ∂U/∂R / U − λ'.

What is left out together is a column of depths over one place: with a part of it in the fit, the rest would tell
nothing of places that were not solved.

A mesh shows through where the contact's radius √(2Rs) is less than an element: there all rows of a sample count less,
by 1 + (s₀/s)³ for elements of size √(2R s₀).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.energy.columns import columns_of
from palpate.rbf.regressors import pairs
from palpate.rbf.sample_checks import numbers
from palpate.surrogates import ContactLaw, TouchedSurface
from palpate.units import Range, bounds

__all__ = ["CURVATURE_SHARE", "EnergySamples"]

_FINEST = 1.0 / 40.0  # of the probe's radius
CURVATURE_SHARE = 0.1  # of a stiffness row's weight: its error level is about three times a force's


@dataclass(frozen=True, eq=False)
class EnergySamples:
    """Touches of a body, N of them with contact.

    Attributes
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    energy : (N,)
        U > 0, J.
    force : (N, n)
        −∂U by the inputs: on the probe, N, then by the further inputs; not-a-number where it is not known.
    stiffness : (N, 3, 3)
        ∂F/∂c, N/m; not-a-number where it is not known.
    depth, slope, bend : (N,), (N, 3), (N, 3, 3)
        s, ∇s and ∇²s of the rigid probe into the surface at rest.
    columns : (N,) int
        Number of the column that a solve belongs to: solves over one place with the same further inputs.
    inputs : n ranges
    radius_input : int or None
        Which of them is the probe's radius.
    """

    X: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    depth: np.ndarray
    slope: np.ndarray
    bend: np.ndarray
    columns: np.ndarray
    inputs: tuple[Range, ...]
    radius_input: int | None = None

    @classmethod
    def of(
        cls,
        X: Any,
        energy: Any,
        force: Any,
        stiffness: Any,
        *,
        surface: TouchedSurface,
        radius: float,
        inputs: tuple[Range, ...],
        radius_input: int | None = None,
    ) -> EnergySamples:
        """From all solves; those without contact, whose energy is zero whatever is learnt, are left out.

        `radius` is the probe's, m, or where it is an input, a usual one.

        Raises
        ------
        UsageError
            If shapes disagree, no solve has contact, or one that has stored no energy.
        """
        X = numbers("Inputs X", X, (None, len(inputs)))
        N = len(X)
        U, F = numbers("Energies", energy, (N,)), _responses(force, N, len(inputs))
        K = np.full((N, 3, 3), np.nan) if stiffness is None else np.asarray(stiffness, float)
        K = numbers("Stiffnesses", K.reshape(N, -1), (N, 9), finite=False).reshape(N, 3, 3)
        distance, gradient, hessian = surface.at(np.ascontiguousarray(X[:, :3]))
        s = (radius if radius_input is None else X[:, radius_input]) - distance
        touching = (s > 0) & (U > 0)
        if not touching.any():
            raise UsageError(
                f"None of {N} solves has contact.",
                why="A surrogate is learnt from touches: without contact the energy is zero.",
                fix="Press deeper, or check the surface and the probe's radius.",
            )
        strange = (s > 0) & ~(U > 0)
        if strange.any():
            raise UsageError(
                f"{int(strange.sum())} solves in contact stored no energy, the deepest at {s[strange].max():.3g} m.",
                why="The surface does not lie where the solved body's did, or the energy is not that of the touch.",
                fix="Pass the touched surface of the body at rest, and energies less those without contact.",
            )
        K = (K + K.transpose(0, 2, 1)) / 2
        columns = columns_of(X, surface, radius)
        return cls(X, U, F, K, s, -gradient, -hessian, columns, tuple(inputs), radius_input).take(touching)

    def __len__(self) -> int:
        return len(self.X)

    @property
    def scaled(self) -> np.ndarray:
        """ξ (N, n) in [−1, 1] over the declared ranges."""
        low, high = bounds(self.inputs)
        return np.asarray((2.0 * self.X - low - high) / (high - low))

    def finest(self, radius: float) -> np.ndarray:
        """Of scaled inputs (n,), the shortest way over which touches by a probe of that radius (m) change.

        The contact smooths over its own width √(2Rs), 2 mm of a probe of 10 mm at 0.2 mm; an eighth of that is allowed.
        """
        found = np.zeros(len(self.inputs))
        found[:3] = _FINEST * radius / self.half[:3]
        return found

    def take(self, which: np.ndarray) -> EnergySamples:
        """Some of them, by index or mask."""
        own = ("X", "energy", "force", "stiffness", "depth", "slope", "bend", "columns")
        return replace(self, **{name: getattr(self, name)[which] for name in own})

    def targets(self, law: ContactLaw) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """ℓ (N, 1), its slopes (N, 1, n) and curvatures (N, 1, n(n+1)/2) by scaled inputs; unknown ones zero."""
        value, first, second = law.log(self.depth)
        by_all = -np.nan_to_num(self.force) / self.energy[:, None]
        g = by_all[:, :3]
        slopes = g - first[:, None] * self.slope
        bends = -self.stiffness / self.energy[:, None, None] - g[:, :, None] * g[:, None]
        bends -= second[:, None, None] * self.slope[:, :, None] * self.slope[:, None]
        bends -= first[:, None, None] * self.bend
        half, n = self.half, len(self.inputs)
        i, j = pairs(n)
        if self.radius_input is not None:  # the sphere grows into the body
            by_all[:, self.radius_input] -= first
        all_slopes, all_bends = by_all * half, np.zeros((len(self), n, n))
        all_slopes[:, :3], all_bends[:, :3, :3] = slopes * half[:3], bends * half[:3, None] * half[:3]
        return (np.log(self.energy) - value)[:, None], all_slopes[:, None], all_bends[:, None, i, j]

    def rows(
        self, law: ContactLaw, *, resolved: float, curvature_share: float = CURVATURE_SHARE
    ) -> dict[str, np.ndarray]:
        """What `refine` takes besides X: targets, and their natural weights.

        `resolved` is the depth s₀ (m) below which the mesh shows; `curvature_share` what a stiffness counts beside
        a force.
        """
        Y, slopes, curvatures = self.targets(law)
        half, n = self.half, len(self.inputs)
        i, j = pairs(n)
        by_force = (self.energy / np.linalg.norm(self.force[:, :3], axis=1))[:, None]
        by_stiffness = (self.energy / np.linalg.norm(self.stiffness, axis=(1, 2)))[:, None]
        own = np.arange(n) < 3
        curvature_weight = curvature_share * (by_stiffness / (half[i] * half[j])) ** 2 * (own[i] & own[j])
        return {
            "Y": Y,
            "weights": 1.0 / (1.0 + (resolved / self.depth) ** 3),
            "slopes": slopes,
            "slope_weight": np.where(own, (by_force / half) ** 2, 1.0) * np.isfinite(self.force),
            "curvatures": curvatures,
            "curvature_weight": np.nan_to_num(curvature_weight, nan=0.0),
            "groups": self.columns,
        }

    @property
    def half(self) -> np.ndarray:
        """Half (n,) of each input's range."""
        low, high = bounds(self.inputs)
        return np.asarray((high - low) / 2)


def _responses(force: Any, N: int, n: int) -> np.ndarray:
    """(N, n) from forces (N, 3), or from forces and what is known of −∂U by the further inputs (N, n)."""
    F = np.asarray(force, float)
    if F.ndim == 2 and F.shape[1] == 3:
        return np.hstack([numbers("Forces", F, (N, 3)), np.full((N, n - 3), np.nan)])
    F = numbers("Forces and responses to further inputs", F, (N, n), finite=False)
    numbers("Forces", F[:, :3], (N, 3))
    return F
