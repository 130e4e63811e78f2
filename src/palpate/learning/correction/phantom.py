"""A specimen made by formula, to try a correction with: another energy, measured with noise.

    U_p(c) = U₀(s) exp[ℓ(c) + ln m + ½ g (1 + tanh((s − s_l)/w))],     s the depth under a surface raised by o

The modulus is m times the model's; a stiffer layer makes the energy e^g times as large once the probe is deeper than
s_l. That is no change of the kind that the prior of a correction expects, and not one that the network contains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.learning.correction.corrected_surrogate import raise_surface
from palpate.surrogates import ContactBaseline, LearntEnergy

__all__ = ["Phantom"]


@dataclass(frozen=True, eq=False)
class Phantom:
    """A specimen that differs from a model.

    Attributes
    ----------
    model : LearntEnergy
        The energy that the specimen differs from.
    factor : float
        m.
    layer : float
        g.
    depth, width : float
        s_l and w, m.
    height : float
        o, m.
    """

    model: LearntEnergy
    factor: float = 1.4
    layer: float = 0.3
    depth: float = 0.006
    width: float = 0.002
    height: float = 3e-4

    def force(self, X: np.ndarray) -> np.ndarray:
        """Return forces F (N, 3) in N at inputs X (N, n), without noise."""
        baseline = self.model.baseline
        assert isinstance(baseline, ContactBaseline)
        surface = raise_surface(baseline.touched, self.height, baseline.radius)
        s, normal, _ = baseline.raised(self.height, surface).law_depth(X)
        U0, first, _ = baseline.law.energy(s)
        value, slope = self._factor(X)
        t = np.tanh((s - self.depth) / self.width)
        kappa = self.factor * np.exp(value + 0.5 * self.layer * (1.0 + t))
        grows = 0.5 * self.layer * (1.0 - t * t) / self.width  # of the layer's part, by s
        by_s = first + U0 * grows
        return np.asarray(kappa[:, None] * (by_s[:, None] * normal - U0[:, None] * slope))

    def measured(
        self, X: np.ndarray, noise: float, rng: np.random.Generator, relative: float = 0.0
    ) -> np.ndarray:
        """Return forces with Gaussian noise (N, and relative to the force's size) in each component."""
        F = self.force(X)
        size = np.sqrt(noise**2 + (relative * np.linalg.norm(F, axis=1)) ** 2)
        return np.asarray(F + size[:, None] * rng.standard_normal(F.shape))

    def _factor(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """ℓ (N,) and ∇ℓ (N, 3) of the model, inside of its trained ranges."""
        net = self.model.network
        return net.predict(X)[:, 0], np.stack([net.jacobian(x)[0, :3] for x in X])
