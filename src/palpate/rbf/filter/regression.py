"""Regressions: changes that undo what the remembered observations taught, and the limit on them.

More than the window of the growth rule is remembered here, and the observations themselves, not their errors
alone. Updates, growth and pruning ask for the limit. Without it the filter regresses: a step that fits one sample can
spoil the others where the linearisation is bad, a new unit may reach too far, and a unit that contributes little
beside much larger ones that nearly cancel may be all that is left of their sum.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["exceeds_regression_limit", "memory_error", "remember", "track_least_error"]


def remember(state: State, x: np.ndarray, y: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """The memory (≤ S, n + m) with one more observation, newest last, and the time of each (≤ S,).

    Without a limit on regressions it holds the window. Else, once it is full, the new observation replaces the
    nearest, so that places which are seldom visited are not forgotten.
    """
    memory, times = state.memory, state.memory_times
    if not settings.regression_limit:
        memory, times = (old[max(0, len(old) - settings.window + 1) :] for old in (memory, times))
    elif len(memory) >= max(settings.window, settings.memory):
        nearest = int(((memory[:, : x.size] - x) ** 2).sum(axis=1).argmin())
        memory, times = np.delete(memory, nearest, axis=0), np.delete(times, nearest)
    return np.vstack([memory, np.concatenate([x, y])]), np.append(times, state.count + 1)


def memory_error(state: State, coefficients: np.ndarray, theta: np.ndarray, settings: Settings) -> float:
    """Sum of squared errors of other parameters, (p_t + h, m or r) and (h, p), over a state's memory.

    With a forgetting factor λ an observation of age a counts λᵃ, as in the filter.
    """
    X, Y = state.memory[:, : state.inputs], state.memory[:, state.inputs :]
    regressors = settings.regressors(state.inputs)
    error = np.hstack([regressors.tail_rows(X), regressors.phi(X, theta)]) @ coefficients - Y
    if settings.forgetting_factor < 1.0:
        error *= np.sqrt(_counts(state, settings))[:, None]
    return float(np.vdot(error, error))


def exceeds_regression_limit(
    state: State, coefficients: np.ndarray, theta: np.ndarray, settings: Settings
) -> bool:
    """True where other parameters raise the error over the memory by more than the settings allow.

    Coefficients (p_t + h, m or r) and shapes (h, p) are by the output modes where the memory is. One step may raise
    the error by the settings' limit. Many such steps would add up, so the limit counts from the least error so far;
    above it no step may raise the error.
    """
    if not settings.regression_limit or len(state.memory) < 2:
        return False
    before = memory_error(state, state.latent_coefficients, state.theta, settings)
    least = min(before, state.least_error * float(_counts(state, settings).sum()))
    after = memory_error(state, coefficients, theta, settings)
    return after > max(before, settings.regression_limit * least)


def track_least_error(state: State, settings: Settings) -> State:
    """The state with its least mean squared error over the memory so far.

    That fades as the memory does, by e over its length, so that a target that has moved can be followed.
    """
    if not settings.regression_limit or len(state.memory) < settings.window:
        return state
    counts = float(_counts(state, settings).sum())
    now = memory_error(state, state.latent_coefficients, state.theta, settings) / counts
    return replace(state, least_error=min(state.least_error * (1.0 + 1.0 / counts), now))


def _counts(state: State, settings: Settings) -> np.ndarray:
    return np.asarray(settings.forgetting_factor ** (state.count - state.memory_times).astype(float))
