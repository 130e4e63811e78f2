"""The settings' update rule."""

from __future__ import annotations

import numpy as np

from palpate.rbf.filter.model import jacobian, measured
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.updates import gradient, kalman, shared, winner

__all__ = ["Predicted", "predicted", "updated"]

Predicted = tuple[np.ndarray, np.ndarray]


def predicted(state: State, seen: Observation, settings: Settings) -> Predicted:
    """What the network has for an observation, (q,), and its derivatives (q, d).

    The winner's and the shared-weight rule form their own derivatives, of a part: theirs are (q, 0) here.
    """
    if settings.update in {"shared", "winner"}:
        f = measured(state, seen, settings)
        return f, np.zeros((f.size, 0))
    return jacobian(state, seen, settings)


def updated(
    state: State, seen: Observation, found: Predicted, settings: Settings, *, donate: bool = False
) -> State:
    """The state after one observation, in scaled quantities, for which it predicted what was `found`.

    With `donate` the old state's arrays may be overwritten: the caller promises not to use it again.
    """
    if settings.update == "gradient":
        return gradient.updated(state, seen, found, settings)
    if settings.update == "shared":
        return shared.updated(state, seen, seen.y - found[0][: seen.y.size], settings, donate=donate)
    if settings.update == "winner":
        return winner.updated(state, seen, found[0], settings, donate=donate)
    return kalman.updated(state, seen, found, settings, donate=donate)
