"""Errors relative to how much outputs vary, in whatever unit: squares of SI numbers may under- or overflow."""

from __future__ import annotations

import numpy as np

__all__ = ["relative_error", "spread_of"]


def spread_of(Y: np.ndarray) -> float:
    """Root mean square deviation of the outputs Y (N, m) from their means; 1 where they do not vary."""
    size = float(np.abs(Y).max())
    if size == 0.0:
        return 1.0
    scaled = Y / size
    return float(np.sqrt(((scaled - scaled.mean(axis=0)) ** 2).mean())) * size or 1.0


def relative_error(predicted: np.ndarray, Y: np.ndarray, spread: float) -> float:
    """Root mean square error (N, m) over the outputs' spread."""
    return float(np.sqrt((((predicted - Y) / spread) ** 2).mean()))
