"""MRAN: one observation in, the network grown, updated and pruned (Lu, Sundararajan & Saratchandran 1997, 1998).

`step` is the whole of the method; `learn` in `palpate.learning.learn` is a fold of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.ekf import updated
from palpate.learning.gaussian import value
from palpate.learning.growth import grown, wants_growth
from palpate.learning.noise import running_mean_square
from palpate.learning.pruning import pruned
from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["Event", "step"]


@dataclass(frozen=True)
class Event:
    """What one observation did.

    Attributes
    ----------
    error : float
        ‖y − f(x)‖ before the observation was used, in scaled outputs.
    window_rms : float
        RMS error norm over the window.
    grew, updated : bool
    pruned : int
        Units removed.
    units : int
        Units afterwards.
    why : str
        For a skipped observation, the reason; else empty.
    """

    error: float
    window_rms: float
    grew: bool
    updated: bool
    pruned: int
    units: int
    why: str = ""


def step(state: State, x: np.ndarray, y: np.ndarray, settings: Settings) -> tuple[State, Event]:
    """Learn one observation.

    Parameters
    ----------
    state : State
    x : (n,)
        Scaled input.
    y : (m,)
        Scaled output.
    settings : Settings

    Returns
    -------
    State, Event
        The new state; the old one is untouched. An observation that isn't finite is skipped and says so.
    """
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        return state, Event(np.nan, np.nan, False, False, 0, len(state.units), "not finite")
    error = y - value(state, x, settings)
    state = _remembered(state, x, y, error, settings)
    grew = wants_growth(state, x, error, settings)
    if grew:
        # the new unit meets the observation, so the update below starts from a zero error, not twice the old one
        state = grown(state, x, error, settings)
    use = settings.update_on_growth or not grew
    if use:
        state = updated(state, x, y, settings)
    before = len(state.units)
    state = pruned(state, x, settings)
    event = Event(
        float(np.linalg.norm(error)),
        float(np.sqrt(state.errors.mean())),
        grew,
        use,
        before - len(state.units),
        len(state.units),
    )
    return state, event


def _remembered(state: State, x: np.ndarray, y: np.ndarray, error: np.ndarray, settings: Settings) -> State:
    """The state with one more observation counted, and it and its error in the window."""
    errors = np.append(state.errors, float(error @ error))[-settings.window :]
    seen = np.vstack([state.seen, np.concatenate([x, y])])[-settings.window :]
    count = state.count + 1
    innovation = running_mean_square(state.innovation, error, count)
    return replace(state, errors=errors, seen=seen, count=count, innovation=innovation)
