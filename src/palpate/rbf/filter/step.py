"""MRAN: one observation in, the network grown, updated and pruned (Lu, Sundararajan & Saratchandran 1997, 1998).

The settings say which rules; `step` is the whole of the method; `learn` in `palpate.learning.learn` is a fold of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.rbf.filter.growth import grown, wants_growth
from palpate.rbf.filter.memory import kept, spoils, with_least
from palpate.rbf.filter.noise import running_mean_square
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.pruning import pruned
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.updates import predicted, updated

__all__ = ["Event", "observe", "step"]


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
    refined : bool
        Whether an iteration of the refinement on retained samples followed (see `palpate.learning.stream.learner`).
    """

    error: float
    window_rms: float
    grew: bool
    updated: bool
    pruned: int
    units: int
    why: str = ""
    refined: bool = False


def step(
    state: State, x: np.ndarray, y: np.ndarray, settings: Settings, *, donate: bool = False
) -> tuple[State, Event]:
    """Learn one observation.

    Parameters
    ----------
    state : State
    x : (n,)
        Scaled input.
    y : (m,)
        Scaled output.
    settings : Settings
    donate : bool
        Whether the old state's arrays may be overwritten. It saves copying the covariance; the old state must
        not be used again.

    Returns
    -------
    State, Event
        The new state; the old one is untouched unless donated. An observation that isn't finite is skipped and
        says so.
    """
    return observe(state, Observation(x, y), settings, donate=donate)


def observe(
    state: State, seen: Observation, settings: Settings, *, donate: bool = False
) -> tuple[State, Event]:
    """Learn one observation that may have a weight and slopes; else as `step`."""
    if seen.flaw:
        return state, Event(np.nan, np.nan, False, False, 0, state.units, seen.flaw)
    old, found = state, predicted(state, seen, settings)
    missed = seen.y - found[0][: seen.y.size]
    size = float(np.sqrt(missed @ missed))
    state = _remembered(state, seen, missed, settings)
    grew = wants_growth(state, seen.x, missed, settings)
    if grew:
        # the new unit meets the observation, so the update below starts from a zero error, not twice the old one
        state = _with_unit(state, seen.x, missed, settings)
        found = predicted(state, seen, settings)
    use = settings.update_on_growth or not grew
    if use:
        try:
            state = updated(state, seen, found, settings, donate=donate)
        except FloatingPointError as error:  # raised before anything of the old state is overwritten
            return old, Event(np.nan, np.nan, False, False, 0, old.units, str(error))
    before = state.units
    # by significance: the nearest unit, once it was updated
    if settings.pruning == "contribution" or not grew:
        state = pruned(state, seen.x, settings)
    state = with_least(state, settings)
    event = Event(size, float(np.sqrt(state.errors.mean())), grew, use, before - state.units, state.units)
    return state, event


def _with_unit(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> State:
    """The state with a unit at x; without weight, for the update to decide, where it would spoil what was learnt."""
    more = grown(state, x, error, settings)
    if spoils(state, more.led, more.theta, settings):
        return grown(state, x, np.zeros_like(error), settings)
    return more


def _remembered(state: State, seen: Observation, error: np.ndarray, settings: Settings) -> State:
    """The state with one more observation counted, and it and its error in the window."""
    errors = np.append(state.errors, float(error @ error))[-settings.window :]
    y = seen.y if state.modes is None else seen.y @ state.modes
    count = state.count + 1
    innovation = running_mean_square(state.innovation, error, count)
    remembered, when = kept(state, seen.x, y, settings)
    return replace(state, errors=errors, seen=remembered, when=when, count=count, innovation=innovation)
