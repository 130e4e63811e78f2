"""Measured forces as functions of what may change, and their rows.

With θ = (u, b), independent standard normal numbers a priori (see `prior`), a touch at c has

    ℓ = ℓ₀ + a·u        ∇ℓ = ∇ℓ₀ + B u        s = s₀ + σ_o b        κ = exp ℓ
    F = κ (U₀'(s) ∇d − U₀(s) ∇ℓ)
    ∂F/∂u = F aᵀ − U B                          ∂F/∂b = σ_o κ (U₀'' ∇d − U₀' ∇ℓ)

F is not linear in θ, so the rows are taken anew wherever θ goes. They are whitened by the noise's covariance
(σ_a² + σ_r²‖F‖²) I + σ_x² K Kᵀ, K the model's stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.learning.correction.prior import SpecimenPrior, regressors
from palpate.options import Noise
from palpate.surrogates import ContactBaseline, ContactLaw, LearntEnergy
from palpate.surrogates.continuation import saturated
from palpate.units import bounds

__all__ = ["Touches"]

_ARRAYS = ("depth", "normal", "base", "lines", "measured", "whitening")
_FARTHEST = 30.0  # of a change of ℓ: e³⁰ times the model's force is nobody's specimen


def _whitening(noise: Noise, force: np.ndarray, stiffness: np.ndarray, along: np.ndarray) -> np.ndarray:
    """W (N, 3, 3): W (measured − F) has unit variance; rows of zeros where a component is not measured."""
    size = (force**2).sum(axis=1)
    C = (noise.absolute**2 + noise.relative**2 * size)[:, None, None] * np.eye(3)
    C = C + noise.position**2 * stiffness @ stiffness.transpose(0, 2, 1)
    W = np.linalg.inv(np.linalg.cholesky(C))
    one = along.any(axis=1)
    own = np.einsum("ni,nij,nj->n", along, C, along)[one]
    W[one] = 0.0
    W[one, 0] = along[one] / np.sqrt(own)[:, None]
    return np.asarray(W)


@dataclass(frozen=True, eq=False)
class Touches:
    """N measured touches of one specimen."""

    depth: np.ndarray  # (N,) s₀ into the model's surface, m
    normal: np.ndarray  # (N, 3) ∇d
    base: np.ndarray  # (N, 4) ℓ₀ and ∇ℓ₀ of the model
    lines: np.ndarray  # (N, 4, z) a and B
    measured: np.ndarray  # (N, 3) forces, N
    whitening: np.ndarray  # (N, 3, 3) W of the noise: W (measured − F) has unit variance
    law: ContactLaw  # U₀ and its derivatives by the depth
    offset: float  # σ_o, m

    @classmethod
    def of(
        cls,
        energy: LearntEnergy,
        prior: SpecimenPrior,
        X: np.ndarray,
        force: np.ndarray,
        along: np.ndarray,
        noise: Noise,
    ) -> Touches:
        """Return touches at inputs X (N, n); `along` (N, 3) as in `Corrector.observe`."""
        net, baseline = energy.network, energy.baseline
        taken, slopes = _saturated(energy, X)
        r, by = regressors(net, net.scaling.scale_inputs(taken))
        by = by[:, :3] * (slopes / net.scaling.input_half[:3])[:, :, None]
        both = np.concatenate([r[:, None], by], axis=1)  # (N, 4, c)
        scale = float(net.scaling.output_scale[0])
        base = scale * both @ np.concatenate([net.tail[0], net.weights[0]])
        base[:, 0] += net.scaling.output_centre[0]
        assert isinstance(baseline, ContactBaseline)
        depth, normal, _ = baseline.law_depth(X)
        W = _whitening(noise, force, energy.stiffness(X), along)
        return cls(
            depth, normal, base, scale * both @ prior.root, force.copy(), W, baseline.law, prior.offset
        )

    def __len__(self) -> int:
        return len(self.depth)

    @property
    def single(self) -> np.ndarray:
        """Mask (N,) of the touches with one measured component."""
        return np.asarray(~self.whitening[:, 1:].any(axis=(1, 2)))

    def take(self, which: np.ndarray) -> Touches:
        """Return some of the touches, by index or mask."""
        parts: dict[str, Any] = {name: getattr(self, name)[which] for name in _ARRAYS}
        return replace(self, **parts)

    def weighted(self, weights: np.ndarray) -> Touches:
        """Return the touches, each counting as `weights` (N,) of them."""
        return replace(self, whitening=np.sqrt(weights)[:, None, None] * self.whitening)

    @classmethod
    def joined(cls, touches: Sequence[Touches]) -> Touches:
        """Return all touches of a sequence as one."""
        parts: dict[str, Any] = {
            name: np.concatenate([getattr(t, name) for t in touches]) for name in _ARRAYS
        }
        return replace(touches[0], **parts)

    def forces(self, theta: np.ndarray) -> np.ndarray:
        """F (N, 3), N."""
        return self._answers(theta)[1]

    def residuals(self, theta: np.ndarray) -> np.ndarray:
        """Whitened measured − F, (N, 3)."""
        return np.asarray(np.einsum("nij,nj->ni", self.whitening, self.measured - self.forces(theta)))

    def rows(self, theta: np.ndarray, spread: float = 0.0) -> np.ndarray:
        """Whitened ∂F/∂θ, (N, 3, z + 1).

        With a `spread` that by b is the quotient of differences over ± spread, as wide as b is unsure: outside of
        contact the derivative is zero although a force may come (Schei 1997).
        """
        U, F, by_offset = self._answers(theta)
        by = F[:, :, None] * self.lines[:, None, 0] - U[:, None, None] * self.lines[:, 1:]
        if spread:
            step = np.eye(1, theta.size, theta.size - 1)[0] * spread
            by_offset = (self.forces(theta + step) - self.forces(theta - step)) / (2.0 * spread)
        return np.asarray(self.whitening @ np.concatenate([by, by_offset[:, :, None]], axis=2))

    def _answers(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """U (N,), F (N, 3) and ∂F/∂b (N, 3)."""
        line = self.base + self.lines @ theta[:-1]
        kappa = np.exp(np.clip(line[:, 0], self.base[:, 0] - _FARTHEST, self.base[:, 0] + _FARTHEST))
        value, first, second = self.law.energy(self.depth + self.offset * theta[-1])
        g = line[:, 1:]
        F = kappa[:, None] * (first[:, None] * self.normal - value[:, None] * g)
        by = self.offset * kappa[:, None] * (second[:, None] * self.normal - first[:, None] * g)
        return kappa * value, F, by


def _saturated(energy: LearntEnergy, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where ℓ is taken (N, n), and how that follows the centre (N, 3); no deeper than trained."""
    low, high = bounds(energy.inputs)
    going = energy.going
    taken, slopes = X.copy(), np.ones((len(X), 3))
    for i, j in zip(*np.nonzero((low > X) | (high < X)), strict=True):
        sign, edge = (-1.0, -low[j]) if X[i, j] < low[j] else (1.0, high[j])
        value, slope, _ = saturated(sign * X[i, j], edge, going.widths[j])
        taken[i, j] = sign * value
        if j < 3:
            slopes[i, j] = slope
    return taken, slopes
