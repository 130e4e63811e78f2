"""When a unit is added, and what it is (Platt 1991; Lu, Sundararajan & Saratchandran 1997).

All three must hold: the error is large, it has been large for a while, and no centre is near.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["grown", "nearest_distance", "wants_growth"]


def nearest_distance(state: State, x: np.ndarray) -> float:
    """Distance from x (n,) to the nearest centre; infinite while there is none."""
    if not len(state.units):
        return float("inf")
    return float(np.sqrt(((state.centres - x) ** 2).sum(axis=1).min()))


def wants_growth(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> bool:
    """Whether the observation (x, error (m,)) meets the three criteria; its error is already in the window."""
    if len(state.units) >= settings.units_max:
        return False
    if settings.wait_for_window and len(state.errors) < settings.window:
        return False
    if float(error @ error) <= settings.error_min**2 or state.errors.mean() <= settings.error_rms_min**2:
        return False
    distance = max(settings.distance_max * settings.distance_decay**state.count, settings.distance_min)
    return nearest_distance(state, x) > distance


def grown(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> State:
    """The state with a unit at x whose weights are the error: it meets the observation exactly."""
    # growth asks for at least the smallest distance; the floor keeps a width from collapsing on a duplicate
    distance = float(np.clip(nearest_distance(state, x), settings.distance_min, settings.distance_max))
    width = np.full(x.size, settings.overlap * distance)
    shape = np.log(width) if settings.widths == "log" else width
    block = np.full(error.size + 2 * x.size, settings.prior)
    block[error.size + x.size :] = settings.width_prior
    d, b = state.covariance.shape[0], block.size
    covariance = np.zeros((d + b, d + b))
    covariance[:d, :d] = state.covariance
    covariance[np.arange(d, d + b), np.arange(d, d + b)] = block
    return replace(
        state,
        units=np.vstack([state.units, np.concatenate([error, x, shape])]),
        covariance=covariance,
        silent=np.append(state.silent, 0),
    )
