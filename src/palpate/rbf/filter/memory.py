"""The remembered observations as a judge: a change must not undo what they taught.

More than the window of the growth rule is remembered here, and the observations themselves, not their errors
alone. Updates, growth and pruning ask it. Without it the filter relapses: a step that fits one sample can spoil
the others where the linearisation is bad, a new unit may reach too far, and a unit that contributes little beside
much larger ones that nearly cancel may be all that is left of their sum.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["forgets", "kept", "spoils", "window_error", "with_least"]


def kept(state: State, x: np.ndarray, y: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """The remembered observations (≤ S, n + m) with one more, newest last, and when each was seen (≤ S,).

    Without a limit on relapses these are the window's. Else, once the memory is full, the new one replaces the
    nearest, so that places which are seldom visited are not forgotten.
    """
    row, now = np.concatenate([x, y]), state.count + 1
    seen, when = state.seen, state.when
    if not settings.relapse_limit:
        seen, when = (old[max(0, len(old) - settings.window + 1) :] for old in (seen, when))
    elif len(seen) >= max(settings.window, settings.memory):
        nearest = int(((seen[:, : x.size] - x) ** 2).sum(axis=1).argmin())
        seen, when = np.delete(seen, nearest, axis=0), np.delete(when, nearest)
    return np.vstack([seen, row]), np.append(when, now)


def window_error(state: State, coefficients: np.ndarray, theta: np.ndarray, settings: Settings) -> float:
    """Sum of squared errors of other parameters, (p_t + h, m or r) and (h, p), over a state's memory.

    With a forgetting factor λ an observation of age a counts λᵃ, as in the filter.
    """
    X, Y = state.seen[:, : state.inputs], state.seen[:, state.inputs :]
    of = settings.regressors(state.inputs)
    error = np.hstack([of.tail_rows(X), of.phi(X, theta)]) @ coefficients - Y
    if settings.forgetting_factor < 1.0:
        error *= np.sqrt(_counts(state, settings))[:, None]
    return float(np.vdot(error, error))


def forgets(state: State, z: np.ndarray, settings: Settings) -> bool:
    """Whether other parameters z (d,) raise the error over the memory by more than the settings allow."""
    return bool(settings.relapse_limit) and spoils(state, *state.split(z), settings)


def spoils(state: State, coefficients: np.ndarray, theta: np.ndarray, settings: Settings) -> bool:
    """The same for coefficients and shapes; both by the output modes where the memory is.

    One step may raise the error by the settings' limit. Many such steps would add up, so the limit counts from the
    least error so far; above it no step may raise the error.
    """
    if not settings.relapse_limit or len(state.seen) < 2:
        return False
    before = window_error(state, state.led, state.theta, settings)
    least = min(before, state.least * float(_counts(state, settings).sum()))
    after = window_error(state, coefficients, theta, settings)
    return after > max(before, settings.relapse_limit * least)


def with_least(state: State, settings: Settings) -> State:
    """The state with its least mean squared error over the memory so far.

    That fades as the memory does, by e over its length, so that a target that has moved can be followed.
    """
    if not settings.relapse_limit or len(state.seen) < settings.window:
        return state
    counts = float(_counts(state, settings).sum())
    now = window_error(state, state.led, state.theta, settings) / counts
    return replace(state, least=min(state.least * (1.0 + 1.0 / counts), now))


def _counts(state: State, settings: Settings) -> np.ndarray:
    return np.asarray(settings.forgetting_factor ** (state.count - state.when).astype(float))
