"""The remembered window as a judge: a change must not undo what the last observations taught.

The window of the growth rule remembers the observations themselves here, not their errors alone. Both the
update and pruning ask it. Without it the filter relapses: a step that fits one sample can spoil the others where
the linearisation is bad, and a unit that contributes little beside much larger ones that nearly cancel may be
all that is left of their sum.
"""

from __future__ import annotations

import numpy as np

from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["forgets", "window_error"]


def window_error(state: State, coefficients: np.ndarray, theta: np.ndarray, settings: Settings) -> float:
    """Sum of squared errors of other parameters, (p_t + h, m or r) and (h, p), over a state's window."""
    X, Y = state.seen[:, : state.inputs], state.seen[:, state.inputs :]
    of = settings.regressors(state.inputs)
    error = np.hstack([of.tail_rows(X), of.phi(X, theta)]) @ coefficients - Y
    return float(np.vdot(error, error))


def forgets(state: State, z: np.ndarray, settings: Settings) -> bool:
    """Whether other parameters z (d,) raise the error over the window by more than the settings allow."""
    return bool(settings.relapse_limit) and spoils(state, *state.split(z), settings)


def spoils(state: State, coefficients: np.ndarray, theta: np.ndarray, settings: Settings) -> bool:
    """The same for coefficients and shapes; both by the output modes where the window is."""
    if not settings.relapse_limit or len(state.seen) < 2:
        return False
    before = window_error(state, state.led, state.theta, settings)
    return window_error(state, coefficients, theta, settings) > settings.relapse_limit * before
