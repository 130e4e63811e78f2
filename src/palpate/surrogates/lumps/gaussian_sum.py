"""A sum of Gaussians of one shape with an affine tail: a function of a few inputs, and its slopes, in tables of NumPy.

The networks of `palpate.network` have a shape for each unit, as a hand's loop needs; lumps are looked up with
one shape for all, which is a seventh of the numbers in a file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError

__all__ = ["GaussianSum"]


@dataclass(frozen=True, eq=False)
class GaussianSum:
    """f(z) = t₀ + t·ξ + Σ w_k exp(−‖(ξ − μ_k)/σ‖²) in scaled inputs ξ = (z − middle)/half.

    `middle` and `half` (n,) are of each input's range, in its unit; `centres` (h, n) are μ_k and `widths` (n,) σ,
    scaled and positive; `weights` (h,) are w_k and `tail` (1 + n,) t₀ and t. Arrays that don't fit together, and a
    width or half a range that is not positive, are a UsageError.
    """

    middle: np.ndarray
    half: np.ndarray
    centres: np.ndarray
    widths: np.ndarray
    weights: np.ndarray
    tail: np.ndarray

    def __post_init__(self) -> None:
        own_arrays(self, "middle", "half", "centres", "widths", "weights", "tail")
        n, h = self.middle.size, len(self.weights)
        shapes = [a.shape for a in (self.middle, self.half, self.widths, self.tail, self.centres)]
        fits = shapes == [(n,), (n,), (n,), (1 + n,), (h, n)] and self.weights.shape == (h,)
        if not (fits and (self.half > 0).all() and (self.widths > 0).all()):
            raise UsageError(
                f"A sum of Gaussians can't be made of arrays of shapes {shapes}.",
                why="Of n inputs and h units these are (n,), (n,), (n,), (1 + n,) and (h, n), widths positive.",
                fix="Learn it again.",
            )

    @property
    def units(self) -> int:
        """Number of Gaussians h."""
        return len(self.weights)

    def scale(self, Z: np.ndarray) -> np.ndarray:
        """Return scaled inputs (N, n) of inputs Z (N, n)."""
        return np.asarray((Z - self.middle) / self.half)

    def value_and_slopes(self, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values (N,) and slopes (N, n), by the unit of each input, at inputs Z (N, n)."""
        xi = self.scale(Z)
        # the squared distance of all rows to all centres is a product of two tables
        far, near = xi / self.widths, self.centres / self.widths
        q = (far**2).sum(axis=1)[:, None] + (near**2).sum(axis=1) - 2.0 * far @ near.T
        phi = np.exp(-np.maximum(q, 0.0)) * self.weights
        total = phi.sum(axis=1)
        value = self.tail[0] + xi @ self.tail[1:] + total
        slopes = self.tail[1:] - 2.0 * (total[:, None] * far - phi @ near) / self.widths
        return value, slopes / self.half
