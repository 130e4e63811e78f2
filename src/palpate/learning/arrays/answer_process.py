"""A Gaussian process that all answers of a dataset share: what it misses of samples left out, and how sure it is.

Numbers, fields and curves enter by their leading modes, each part scaled to its own spread. What is missed of a sample
by the process of the others follows in closed form (Rasmussen & Williams 2006, eq. 5.12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.learning.kernel_layer import Metric, likely_metric
from palpate.network import Scaling
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.rbf.output_modes import leading_modes
from palpate.units import Range

__all__ = ["AnswerProcess", "joined_answers"]

_MODES = 8  # of each part: smaller ones say nothing of its error
_PLANE = 1e3  # variance of the plane's coefficients over that of the kernel: it follows the samples


@dataclass(frozen=True, eq=False)
class AnswerProcess:
    """A Gaussian process that all answers share, with a plane of large variance beside it."""

    metric: Metric
    scaling: Scaling
    xi: np.ndarray  # (N, n), scaled inputs of its samples
    missed: np.ndarray  # (N, k), of each sample by the process of the others
    variance: np.ndarray  # (N,), of each sample by the process of the others, over that of the kernel

    @classmethod
    def likeliest(
        cls, X: np.ndarray, Y: np.ndarray, inputs: Sequence[Range], bends: np.ndarray
    ) -> AnswerProcess:
        """Return the process of the radial function that misses least of samples left out."""
        scaling, made = Scaling.of(inputs, Y, bends=bends), []
        xi = scaling.scale_inputs(X)
        for name in RADIAL_FUNCTIONS:
            metric = likely_metric(name, xi, Y)
            inverse = np.linalg.inv(metric.covariance(xi) + _plane(xi, xi))
            own = np.diagonal(inverse)
            made.append(cls(metric, scaling, xi, (inverse @ Y) / own[:, None], 1.0 / own))
        return min(made, key=lambda one: one.error)

    @property
    def error(self) -> float:
        """Root mean square of what is missed of samples left out."""
        return float(np.sqrt((self.missed**2).mean()))

    def scale(self, X: np.ndarray) -> np.ndarray:
        """Return scaled inputs of X (M, n)."""
        return self.scaling.scale_inputs(X)

    def covariance_after(self, places: np.ndarray, solved: np.ndarray) -> np.ndarray:
        """Return the covariance (C, C) at scaled places (C, n), after answers at scaled inputs `solved` (S, n)."""
        kernel = self.metric.kernel
        across = kernel(places, solved) + _plane(places, solved)
        known = self.metric.covariance(solved) + _plane(solved, solved)
        prior = kernel(places, places) + _plane(places, places)
        return np.asarray(prior - across @ np.linalg.solve(known, across.T))

    def surprise(self, places: np.ndarray, *, calm: float) -> np.ndarray:
        """Return how far samples beside each place (C, n) are missed, squared, over what is expected; 1 in the mean.

        `calm` samples that are missed as expected are added to those beside a place.
        """
        ratio = (self.missed**2).sum(axis=1) / self.variance
        near = self.metric.kernel(places, self.xi)
        local = (near @ (ratio / ratio.mean()) + calm) / (near.sum(axis=1) + calm)
        return np.asarray(local / local.mean())


def _plane(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    return _PLANE * (1.0 + A @ B.T)


def joined_answers(parts: Sequence[np.ndarray], rows: np.ndarray) -> np.ndarray:
    """Return the leading modes (R, k) of all parts, each (N, m) and of spread one, at some rows (R,)."""
    return np.hstack([_spread_to_one(np.asarray(part, float)[rows]) for part in parts])


def _spread_to_one(values: np.ndarray) -> np.ndarray:
    """Return the leading modes of values (N, m), whose squares add up to one at the mean sample."""
    off = values - values.mean(axis=0)
    size = np.sqrt((off**2).sum(axis=1).mean())
    if not size > 0.0:
        return np.zeros((len(values), 0))
    return np.asarray(leading_modes(off / size, most=min(_MODES, *off.shape))[0])
