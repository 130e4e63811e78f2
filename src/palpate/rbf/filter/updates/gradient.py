"""Least mean squares, as the resource-allocating network has it (Platt 1991): z ← z + α Hᵀ e, widths resting."""

from __future__ import annotations

import numpy as np

from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["updated"]


def updated(
    state: State, seen: Observation, found: tuple[np.ndarray, np.ndarray], settings: Settings
) -> State:
    """The state after one step of gradient descent on the squared error."""
    f, H = found
    shares = seen.variances(1.0)
    step = settings.learning_rate * (H.T @ ((seen.targets() - f) / shares))
    coefficients, theta = state.split(step)
    form = settings.regressors(state.inputs).form
    theta[:, form.variances(1.0, 0.0) == 0.0] = 0.0
    units = np.hstack([coefficients[len(coefficients) - state.units :], theta])
    tail = coefficients[: len(coefficients) - state.units].T
    return state.moved(state.vector() + np.concatenate([tail.ravel(), units.ravel()]))
