"""The force that a Gaussian process on ℓ = ln(U/U₀) expects, and the way from an error of ℓ to one of the force.

With U = U₀ exp ℓ and F = −∇U = −U(∇ℓ + ∇ ln U₀), to first order

    δF/f = A (δℓ, δ∇ℓ),        A = [F,  −U diag(1/half)]/f,        f = max(‖F‖, f₀)

where ∇ℓ goes by scaled inputs and `half` is half of each input's range. f₀ is a share of the largest force: lighter
touches are judged against it, as validation does. Rows count less where the mesh shows through (`row_weights` of the
baseline).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.energy.energy_images import images_of
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.energy.suspect_solves import observations
from palpate.learning.gradient_process import (
    GradientProcess,
    fit_process,
    no_symmetry,
)
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import Baseline, Solves
from palpate.units import Range, bounds

__all__ = ["ForceModel"]

LIGHT = 0.05  # of the largest force: f₀
_CLIP = 30.0  # of ℓ: far from data an exponential must not overflow


@dataclass(frozen=True, eq=False)
class ForceModel:
    """A process on ℓ, by scaled inputs, with the baseline from which ℓ is counted."""

    process: GradientProcess
    baseline: Baseline  # U₀
    inputs: tuple[Range, ...]  # n ranges that scale the inputs
    largest: float  # largest force of the solves, N
    answered: np.ndarray  # (n,) bool, inputs by which a solve answers the slope of the energy

    @classmethod
    def fit(
        cls, solves: Solves, baseline: Baseline, begin: ForceModel | None = None, *, seed: int = 0
    ) -> ForceModel:
        """Return the model of solves; of the baseline's candidates the one that makes them most likely.

        The search goes on from a model of fewer solves, if there is one, and looks at a part of many solves, which the
        seed decides.
        """
        samples = EnergySamples.of(solves, baseline)
        images = images_of(solves, baseline) or no_symmetry(len(samples.inputs))
        own = baseline if begin is None else begin.baseline
        process = fit_process(
            observations(samples, own), images, None if begin is None else begin.process, seed=seed
        )
        own, process = _likeliest(samples, own, process, baseline)
        largest = float(np.linalg.norm(samples.force[:, : samples.felt], axis=1).max())
        answered = np.isfinite(samples.force).any(axis=0)
        return cls(process, own, samples.inputs, largest, answered)

    @property
    def images(self) -> Images:
        """The body's symmetry, on scaled inputs."""
        return self.process.images

    @property
    def half(self) -> np.ndarray:
        """Half (n,) of each input's range."""
        low, high = bounds(self.inputs)
        return np.asarray((high - low) / 2)

    def scaled(self, X: np.ndarray) -> np.ndarray:
        """Return inputs X (N, n) scaled to [−1, 1] over their ranges."""
        low, high = bounds(self.inputs)
        return np.asarray((2.0 * X - low - high) / (high - low))

    def energy_and_force(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return U (N,) in J and −∂U/∂x (N, n) at inputs X (N, n) in contact."""
        expected = self.process.predict(self.scaled(X))
        value, first, _ = self.baseline.logarithm(X, self.inputs)
        U = np.exp(np.clip(expected[:, 0], -_CLIP, _CLIP) + value) - self.baseline.offset
        total = U + self.baseline.offset
        return U, -total[:, None] * (expected[:, 1:] / self.half + first)

    def force(self, X: np.ndarray) -> np.ndarray:
        """Return the force on the hand (N, k) in N at inputs X (N, n); zero without contact."""
        k = len(self.baseline.directions)
        F, touching = np.zeros((len(X), k)), self.baseline.coordinate(X) > 0
        if touching.any():
            F[touching] = self.energy_and_force(X[touching])[1][:, :k]
        return F

    def error_maps(self, X: np.ndarray) -> np.ndarray:
        """Return A (N, k, 1 + n) at inputs X (N, n) in contact, times the root of each row's weight."""
        U, F = self.energy_and_force(X)
        k, n = len(self.baseline.directions), X.shape[1]
        F, total = F[:, :k], U + self.baseline.offset
        size = np.maximum(np.linalg.norm(F, axis=1), LIGHT * self.largest)
        A = np.zeros((len(X), k, 1 + n))
        A[:, :, 0] = F / size[:, None]
        own = np.arange(k)
        A[:, own, 1 + own] = -(total / size)[:, None] / self.half[:k]
        return np.asarray(A * np.sqrt(self.baseline.row_weights(X))[:, None, None])

    def weights(self, X: np.ndarray) -> np.ndarray:
        """Return the weights (N, 1 + n) that solves at X (N, n) will have, by what the model expects of them."""
        U, F = self.energy_and_force(X)
        k = len(self.baseline.directions)
        size = np.maximum(
            np.linalg.norm(F[:, :k], axis=1), max(self.baseline.force_floor * self.largest, 1e-300)
        )
        of_slope = np.where(
            np.arange(X.shape[1]) < k,
            (((U + self.baseline.offset) / size)[:, None] / self.half) ** 2,
            self.baseline.further_share,
        )
        known = of_slope * self.answered
        return np.asarray(self.baseline.row_weights(X)[:, None] * np.hstack([np.ones((len(X), 1)), known]))


def _likeliest(
    samples: EnergySamples, own: Baseline, process: GradientProcess, kind: Baseline
) -> tuple[Baseline, GradientProcess]:
    """Return the baseline that makes the solves most likely with these lengths, and its process.

    Likelihoods of two baselines can be compared: the observations are the same, less a known function.
    """
    best, chosen = own, process
    for other in kind.candidates():
        rival = replace(process, seen=observations(samples, other))
        if rival.misfit < chosen.misfit:
            best, chosen = other, rival
    return best, chosen
