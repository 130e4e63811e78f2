"""When a unit is removed.

By contribution: it was silent for a whole window (Lu, Sundararajan & Saratchandran 1997). By significance: the
nearest unit goes when its mean contribution over all inputs is below the growth threshold (Huang, Saratchandran
& Sundararajan 2004); others can't have lost any, as only the nearest is updated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.rbf.filter.covariance import Shared
from palpate.rbf.filter.growth import nearest
from palpate.rbf.filter.memory import spoils
from palpate.rbf.filter.model import activations
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.significance import significance
from palpate.rbf.filter.state import State

__all__ = ["contributions", "pruned", "without"]


def contributions(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """Largest normalised contribution of each unit over the outputs, (h,) in [0, 1].

    |w_k φ_k| / max_j |w_j φ_j| output by output (by the modes where there are some), 0 where the maximum is 0.
    """
    share = np.abs(state.led_weights * activations(state, x, settings)[:, None])
    largest = share.max(axis=0)
    return np.asarray((share / np.where(largest > 0, largest, 1.0)).max(axis=1))


def pruned(state: State, x: np.ndarray, settings: Settings) -> State:
    """The state after judging its units at x (n,).

    With a limit on relapses, only units without which the window's error stays within it are removed.
    """
    if not state.units or settings.prune_after == 0:
        return state
    if settings.pruning == "significance":
        return _insignificant_removed(state, x, settings)
    silent = np.where(contributions(state, x, settings) < settings.prune_below, state.silent + 1, 0)
    state = replace(state, silent=silent)
    for k in np.flatnonzero(silent >= settings.prune_after)[::-1]:
        fewer = without(state, int(k))
        if not spoils(state, fewer.led, fewer.theta, settings):
            state = fewer
    return state


def _insignificant_removed(state: State, x: np.ndarray, settings: Settings) -> State:
    k = nearest(state, x, settings)[0]
    size = np.linalg.norm(state.weights[k : k + 1], axis=1)
    if significance(state, state.theta[k : k + 1], size, settings)[0] < settings.error_min:
        return without(state, k)
    return state


def without(state: State, unit: int) -> State:
    """The state with one unit, and its part of the covariance, removed; nothing else changes."""
    place = len(state.coefficients) - state.units + unit
    size = state.theta.shape[1] if isinstance(state.covariance, Shared) else state.unit_size
    led = None if state.in_modes is None else np.delete(state.in_modes, place, axis=0)
    return replace(
        state,
        coefficients=np.delete(state.coefficients, place, axis=0),
        theta=np.delete(state.theta, unit, axis=0),
        places=np.delete(state.places, unit, axis=0),
        covariance=state.covariance.without(unit, size),
        silent=np.delete(state.silent, unit),
        in_modes=led,
    )
