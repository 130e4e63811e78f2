"""When a unit is added, and what it is (Platt 1991; Lu, Sundararajan & Saratchandran 1997).

All must hold: the error is large, it has been large for a while, and no unit is near. With growth by
significance (Huang, Saratchandran & Sundararajan 2004) the error counts by what the new unit would contribute
over all inputs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.significance import significance
from palpate.rbf.filter.state import State

__all__ = ["grown", "nearest", "wants_growth"]


def nearest(state: State, x: np.ndarray, settings: Settings) -> tuple[int, float]:
    """The unit nearest to x (n,), and its distance; −1 and infinity while there is none.

    Units with a centre are where that is. Oblique ones reach across the range, so they are where they were added.
    """
    if not state.units:
        return -1, float("inf")
    form = settings.regressors(state.inputs).form
    places = form.centres(state.theta) if form.rank == form.inputs else state.places
    square = ((places - x) ** 2).sum(axis=1)
    winner = int(square.argmin())
    return winner, float(np.sqrt(square[winner]))


def wants_growth(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> bool:
    """Whether the observation (x, error (m,)) meets the criteria; its error is already in the window."""
    if state.units >= settings.units_max:
        return False
    if settings.wait_for_window and len(state.errors) < settings.window:
        return False
    if state.errors.mean() <= settings.error_rms_min**2:
        return False
    threshold = max(settings.distance_max * settings.distance_decay**state.count, settings.distance_min)
    distance = nearest(state, x, settings)[1]
    if distance <= threshold:
        return False
    size = float(np.linalg.norm(error))
    # the first unit's width is no distance to another, so it is not judged by what it would contribute
    if settings.growth == "significance" and state.units:
        unit = _unit(state, x, distance, settings)[None]
        size = float(significance(state, unit, np.array([size]), settings)[0])
    return size > settings.error_min


def grown(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> State:
    """The state with a unit at x whose weights are the error: it meets the observation exactly."""
    theta = _unit(state, x, nearest(state, x, settings)[1], settings)
    form = settings.regressors(state.inputs).form
    covariance = state.covariance.grown(
        np.full(error.size, settings.prior), form.variances(settings.prior, settings.width_prior)
    )
    led = None
    if state.in_modes is not None and state.modes is not None:
        led = np.vstack([state.in_modes, error @ state.modes])
    return replace(
        state,
        coefficients=np.vstack([state.coefficients, error]),
        theta=np.vstack([state.theta, theta]),
        places=np.vstack([state.places, x]),
        covariance=covariance,
        silent=np.append(state.silent, 0),
        in_modes=led,
    )


def _unit(state: State, x: np.ndarray, distance: float, settings: Settings) -> np.ndarray:
    # growth asks for at least the smallest distance; the floor keeps a width from collapsing on a duplicate
    distance = max(distance, settings.distance_min) if state.units else settings.distance_max
    form = settings.regressors(state.inputs).form
    return form.unit(x, settings.overlap * distance, seed=state.count)
