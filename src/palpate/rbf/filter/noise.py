"""How much the filter believes one observation."""

from __future__ import annotations

import numpy as np

from palpate.rbf.filter.settings import Settings

__all__ = ["edge_factor", "running_mean_square", "variance"]

_MEMORY = 0.95  # about twenty observations: long enough to be smooth, short enough to follow the convergence


def running_mean_square(previous: float, error: np.ndarray, count: int) -> float:
    """Running mean of ‖e‖²/m over about the last twenty observations; the first one starts it."""
    new = float(error @ error) / error.size
    return new if count <= 1 else _MEMORY * previous + (1.0 - _MEMORY) * new


def edge_factor(x: np.ndarray, floor: float) -> float:
    """Factor on R at a scaled point x (n,): Π (1 − x_i²)², not below `floor`.

    Least squares with evenly spread samples is worst at the ends of the range, where a sample has neighbours
    on one side only. For polynomials the weight (1 − x²)^−½ evens this out (Cohen & Migliorati 2017). The
    filter also has little time at the ends, so it takes a higher power, found by measurement: over 20 orders of
    presentation of either founding beam the error in the outer tenth of the range stays below 1.8 times that of
    the rest (median 0.5); with even weights it is 2 to 40 times.
    """
    return float(max(np.prod(1.0 - np.minimum(x * x, 1.0)) ** 2, floor))


def variance(x: np.ndarray, error: np.ndarray, innovation: float, settings: Settings) -> float:
    """R for one observation: the largest of the floor and the guarded shares, times the edge factor."""
    own = float(error @ error) / error.size
    r = max(settings.noise, settings.noise_share * innovation, settings.gate * own)
    return r * (edge_factor(x, settings.edge_weight) if settings.edge_weight < 1.0 else 1.0)
