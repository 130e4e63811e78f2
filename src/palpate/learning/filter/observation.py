"""One observation: what the filter is shown at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["Observation"]


@dataclass(frozen=True, eq=False)
class Observation:
    """A value of the map, and possibly its slopes, in scaled quantities.

    Attributes
    ----------
    x : (n,)
    y : (m,)
    weight : float
        How many ordinary observations this one counts as: its measurement variance is R/weight.
    slopes : (m, n), optional
        ∂y/∂x. A force is the slope of an energy; a stiffness that of a force.
    slope_weight : float
        How many ordinary values a slope counts as, on top of the observation's weight.
    """

    x: np.ndarray
    y: np.ndarray
    weight: float = 1.0
    slopes: np.ndarray | None = None
    slope_weight: float = 1.0

    @property
    def flaw(self) -> str:
        """Why nothing can be learnt from it; empty if something can."""
        parts = [self.x, self.y] + ([] if self.slopes is None else [self.slopes])
        if not all(np.isfinite(p).all() for p in parts):
            return "not finite"
        weights = (self.weight, self.slope_weight)
        return "" if all(0.0 < w < math.inf for w in weights) else "its weight is not positive and finite"

    @property
    def finite(self) -> bool:
        """Whether something can be learnt from it."""
        return not self.flaw

    def targets(self) -> np.ndarray:
        """All that was observed, (q,): y, then the slopes row by row."""
        return self.y if self.slopes is None else np.concatenate([self.y, self.slopes.ravel()])

    def variances(self, r: float) -> np.ndarray:
        """Measurement variances (q,) for an R of `r`."""
        value = np.full(self.y.size, r / self.weight)
        if self.slopes is None:
            return value
        return np.concatenate([value, np.full(self.slopes.size, r / (self.weight * self.slope_weight))])
