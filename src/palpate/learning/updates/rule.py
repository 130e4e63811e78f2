"""The settings' update rule."""

from __future__ import annotations

import numpy as np

from palpate.learning.observation import Observation
from palpate.learning.settings import Settings
from palpate.learning.state import State
from palpate.learning.updates import gradient, kalman, shared

__all__ = ["updated"]


def updated(
    state: State, seen: Observation, error: np.ndarray, settings: Settings, *, donate: bool = False
) -> State:
    """The state after one observation, in scaled quantities, whose error y − f(x) (m,) is known already.

    With `donate` the old state's arrays may be overwritten: the caller promises not to use it again.
    """
    if settings.update == "gradient":
        return gradient.updated(state, seen, settings)
    if settings.update == "shared":
        return shared.updated(state, seen, error, settings, donate=donate)
    return kalman.updated(state, seen, settings, donate=donate)
