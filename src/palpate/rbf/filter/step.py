"""MRAN: one observation in, the network grown, updated and pruned (Lu, Sundararajan & Saratchandran 1997, 1998).

The settings say which rules; `step` is the whole of the method; `learn` in `palpate.learning.learn` is a fold of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.rbf.filter.growth import add_unit, prune_units, wants_growth
from palpate.rbf.filter.kalman import running_mean_square
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.regression import exceeds_regression_limit, remember, track_least_error
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.updates import predict_observation, update_state

__all__ = ["Event", "observe", "step"]


@dataclass(frozen=True)
class Event:
    """The outcome of one observation.

    Attributes
    ----------
    error : float
        ‖y − f(x)‖ before the observation was used, in scaled outputs.
    window_rms : float
        RMS error norm over the window.
    grew, updated : bool
        True where a unit was added, and where the parameters were updated.
    pruned : int
        Units removed.
    units : int
        Units afterwards.
    why : str
        For a skipped observation, the reason; else empty.
    refined : bool
        Whether an iteration of the refinement on retained samples followed (see `palpate.learning.stream.learner`).
    outlier : bool
        True where the observation is likelier wrong than right (see `palpate.learning.stream.tracker`).
    changed : bool
        True where it made likely that the map has jumped, at the state's `changed_at`.
    """

    error: float
    window_rms: float
    grew: bool
    updated: bool
    pruned: int
    units: int
    why: str = ""
    refined: bool = False
    outlier: bool = False
    changed: bool = False


def step(
    state: State, x: np.ndarray, y: np.ndarray, settings: Settings, *, donate: bool = False
) -> tuple[State, Event]:
    """Learn one observation.

    Parameters
    ----------
    state : State
        The state before the observation.
    x : (n,)
        Scaled input.
    y : (m,)
        Scaled output.
    settings : Settings
        Rules and thresholds, the same for every step of a run.
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
    state: State, observation: Observation, settings: Settings, *, donate: bool = False
) -> tuple[State, Event]:
    """Learn one observation that may have a weight, slopes and curvatures; else as `step`.

    Parameters
    ----------
    state : State
        Before the observation.
    observation : Observation
        Values, slopes and curvatures at one place.
    settings : Settings
        Settings of the filter.
    donate : bool
        Whether the old state's covariance may be overwritten.
    """
    if observation.flaw:
        return state, Event(np.nan, np.nan, False, False, 0, state.units, observation.flaw)
    old, prediction = state, predict_observation(state, observation, settings)
    error = observation.y - prediction[0][: observation.y.size]
    size = float(np.sqrt(error @ error))
    state = _count(state, observation, error, settings)
    grows = wants_growth(state, observation.x, error, settings)
    if grows:
        # the new unit meets the observation, so the update below starts from a zero error, not twice the old one
        state = _grow(state, observation.x, error, settings)
        prediction = predict_observation(state, observation, settings)
    updates = settings.update_on_growth or not grows
    if updates:
        try:
            state = update_state(state, observation, prediction, settings, donate=donate)
        except FloatingPointError as reason:  # raised before anything of the old state is overwritten
            return old, Event(np.nan, np.nan, False, False, 0, old.units, str(reason))
    before = state.units
    # by significance: the nearest unit, once it was updated
    if settings.pruning == "contribution" or not grows:
        state = prune_units(state, observation.x, settings)
    state = track_least_error(state, settings)
    event = Event(
        size, float(np.sqrt(state.errors.mean())), grows, updates, before - state.units, state.units
    )
    return state, event


def _grow(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> State:
    """The state with a unit at x; without weight, for the update to decide, where it would spoil what was learnt."""
    more = add_unit(state, x, error, settings)
    if exceeds_regression_limit(state, more.latent_coefficients, more.theta, settings):
        return add_unit(state, x, np.zeros_like(error), settings)
    return more


def _count(state: State, observation: Observation, error: np.ndarray, settings: Settings) -> State:
    """The state with one more observation counted, and it and its error in the window."""
    errors = np.append(state.errors, float(error @ error))[-settings.window :]
    y = observation.y if state.modes is None else observation.y @ state.modes
    count = state.count + 1
    innovation = running_mean_square(state.innovation, error, count)
    memory, times = remember(state, observation.x, y, settings)
    return replace(
        state, errors=errors, memory=memory, memory_times=times, count=count, innovation=innovation
    )
