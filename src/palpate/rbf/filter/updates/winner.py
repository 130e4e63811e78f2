"""EMRAN's rule: an observation changes the nearest unit and the tail only (Li, Sundararajan & Saratchandran 2000).

That is the decoupled filter of a network of one unit, shown what the other units leave of the observation; beyond
evaluating the network it costs (2n + m)² m whatever the number of units.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.rbf.filter.covariance import Blocks
from palpate.rbf.filter.growth import nearest
from palpate.rbf.filter.memory import spoils
from palpate.rbf.filter.model import jacobian
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.updates import kalman

__all__ = ["updated"]


def updated(
    state: State, seen: Observation, found: np.ndarray, settings: Settings, *, donate: bool = False
) -> State:
    """The state after one observation, for which it predicted what was `found` (q,)."""
    if not state.units:
        first = jacobian(state, seen, settings)
        return kalman.updated(state, seen, first, settings, donate=donate)
    P = state.covariance
    assert isinstance(P, Blocks)  # the settings' update rule made the state
    unit = nearest(state, seen.x, settings)[0]
    row = len(state.coefficients) - state.units + unit
    part = replace(
        state,
        coefficients=np.vstack([state.tail.T, state.coefficients[row]]),
        theta=state.theta[unit : unit + 1],
        covariance=P.only(unit),
    )
    own, H = jacobian(part, seen, settings)
    rest = seen.less(found - own)

    def whole(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        coefficients, theta = state.coefficients.copy(), state.theta.copy()
        changed, theta[unit : unit + 1] = part.split(z)
        coefficients[: len(changed) - 1], coefficients[row] = changed[:-1], changed[-1]
        return coefficients, theta

    part = kalman.updated(part, rest, (own, H), settings, spoils=lambda z: spoils(state, *whole(z), settings))
    assert isinstance(part.covariance, Blocks)
    coefficients, theta = whole(part.vector())
    covariance = P.renewed(unit, part.covariance, donate=donate)
    return replace(state, coefficients=coefficients, theta=theta, covariance=covariance)
