"""When a unit is removed: it was silent for a whole window (Lu, Sundararajan & Saratchandran 1997)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.learning.gaussian import activations
from palpate.learning.memory import forgets
from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["contributions", "pruned", "without"]


def contributions(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """Largest normalised contribution of each unit over the outputs, (h,) in [0, 1].

    |w_k φ_k| / max_j |w_j φ_j| output by output, 0 where the maximum is 0.
    """
    share = np.abs(state.weights * activations(x, state.centres, state.widths(settings))[:, None])
    largest = share.max(axis=0)
    return np.asarray((share / np.where(largest > 0, largest, 1.0)).max(axis=1))


def pruned(state: State, x: np.ndarray, settings: Settings) -> State:
    """The state after judging every unit at x; units silent for S_w observations in a row go.

    With a limit on forgetting, only those without which the window's error stays within it.
    """
    if not len(state.units) or settings.prune_after == 0:
        return state
    silent = np.where(contributions(state, x, settings) < settings.prune_below, state.silent + 1, 0)
    state = replace(state, silent=silent)
    for k in np.flatnonzero(silent >= settings.prune_after)[::-1]:
        fewer = without(state, np.array([k]))
        if not forgets(state, fewer, settings):
            state = fewer
    return state


def without(state: State, units: np.ndarray) -> State:
    """The state with some units' rows, and their rows and columns of P, removed; nothing else changes."""
    rows = np.ones(state.covariance.shape[0], dtype=bool)
    for k in units:
        rows[state.block(int(k))] = False
    keep = np.delete(np.arange(len(state.units)), units)
    return replace(
        state,
        units=state.units[keep],
        covariance=state.covariance[np.ix_(rows, rows)],
        silent=state.silent[keep],
    )
