"""No covariance: the gradient rule keeps none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Nothing"]


@dataclass(frozen=True)
class Nothing:
    """Stands where a covariance would."""

    @property
    def matrix(self) -> np.ndarray:
        """An empty matrix."""
        return np.zeros((0, 0))

    @property
    def numbers(self) -> int:
        """None are kept."""
        return 0

    def grown(self, weights: np.ndarray, shape: np.ndarray) -> Nothing:
        """Itself."""
        return self

    def without(self, unit: int, size: int) -> Nothing:
        """Itself."""
        return self
