"""Rules by which units are added and removed.

A unit is added (Platt 1991; Lu, Sundararajan & Saratchandran 1997) where the error is large, has been large for a
while, and no unit is near. It is removed once it was silent for a whole window, its contribution to every output
being small beside the largest.

With growth and pruning by significance (GAP-RBF, Huang, Saratchandran & Sundararajan 2004; GGAP-RBF, the same, 2005)
the error counts by what the new unit would contribute in the mean over all inputs, and the nearest unit goes once its
own mean contribution is below the growth threshold; others can't have lost any, as only the nearest is updated.

    E(k) = ‖w_k‖ (∫ φ_k(x)^q p(x) dx)^(1/q)

With inputs uniform over [−1, 1]ⁿ, q = 1 and a Gaussian, the integral over all space is πⁿᐟ²/(|det A| 2ⁿ), taken in
logarithms because it overflows for many inputs (the paper's 1.8 σ is √π σ). Elsewhere it is the root mean square over
the remembered inputs, q = 2.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from palpate.rbf.filter.covariance import Shared
from palpate.rbf.filter.prediction import activations
from palpate.rbf.filter.regression import exceeds_regression_limit
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = [
    "add_unit",
    "contributions",
    "nearest_unit",
    "prune_units",
    "remove_unit",
    "significance",
    "wants_growth",
]


def nearest_unit(state: State, x: np.ndarray, settings: Settings) -> tuple[int, float]:
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
    """True where the observation (x, error (m,)), whose error is in the window already, asks for a unit."""
    if state.units >= settings.units_max:
        return False
    if settings.wait_for_window and len(state.errors) < settings.window:
        return False
    if state.errors.mean() <= settings.error_rms_min**2:
        return False
    threshold = max(settings.distance_max * settings.distance_decay**state.count, settings.distance_min)
    distance = nearest_unit(state, x, settings)[1]
    if distance <= threshold:
        return False
    size = float(np.linalg.norm(error))
    # the first unit's width is no distance to another, so it is not judged by what it would contribute
    if settings.growth == "significance" and state.units:
        unit = _unit(state, x, distance, settings)[None]
        size = float(significance(state, unit, np.array([size]), settings)[0])
    return size > settings.error_min


def add_unit(state: State, x: np.ndarray, error: np.ndarray, settings: Settings) -> State:
    """The state with a unit at x whose weights are the error: it meets the observation exactly."""
    theta = _unit(state, x, nearest_unit(state, x, settings)[1], settings)
    form = settings.regressors(state.inputs).form
    covariance = state.covariance.add_unit(
        np.full(error.size, settings.prior), form.variances(settings.prior, settings.width_prior)
    )
    modes = None
    if state.mode_coefficients is not None and state.modes is not None:
        modes = np.vstack([state.mode_coefficients, error @ state.modes])
    return replace(
        state,
        coefficients=np.vstack([state.coefficients, error]),
        theta=np.vstack([state.theta, theta]),
        places=np.vstack([state.places, x]),
        covariance=covariance,
        silent=np.append(state.silent, 0),
        mode_coefficients=modes,
    )


def _unit(state: State, x: np.ndarray, distance: float, settings: Settings) -> np.ndarray:
    # growth asks for at least the smallest distance; the floor keeps a width from collapsing on a duplicate
    distance = max(distance, settings.distance_min) if state.units else settings.distance_max
    form = settings.regressors(state.inputs).form
    return form.unit(x, settings.overlap * distance, seed=state.count)


def contributions(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """Largest normalised contribution of each unit over the outputs, (h,) in [0, 1].

    |w_k φ_k| / max_j |w_j φ_j| output by output (by the modes where there are some), 0 where the maximum is 0.
    """
    share = np.abs(state.latent_weights * activations(state, x, settings)[:, None])
    largest = share.max(axis=0)
    return np.asarray((share / np.where(largest > 0, largest, 1.0)).max(axis=1))


def prune_units(state: State, x: np.ndarray, settings: Settings) -> State:
    """The state without the units that x (n,) shows to be of no use, and with the silent ones counted.

    With a limit on regressions, only units without which the window's error stays within it are removed.
    """
    if not state.units or settings.prune_after == 0:
        return state
    if settings.pruning == "significance":
        return _prune_insignificant(state, x, settings)
    silent = np.where(contributions(state, x, settings) < settings.prune_below, state.silent + 1, 0)
    state = replace(state, silent=silent)
    for k in np.flatnonzero(silent >= settings.prune_after)[::-1]:
        fewer = remove_unit(state, int(k))
        if not exceeds_regression_limit(state, fewer.latent_coefficients, fewer.theta, settings):
            state = fewer
    return state


def _prune_insignificant(state: State, x: np.ndarray, settings: Settings) -> State:
    k = nearest_unit(state, x, settings)[0]
    size = np.linalg.norm(state.weights[k : k + 1], axis=1)
    if significance(state, state.theta[k : k + 1], size, settings)[0] < settings.error_min:
        return remove_unit(state, k)
    return state


def remove_unit(state: State, unit: int) -> State:
    """The state with one unit, and its part of the covariance, removed; nothing else changes."""
    place = len(state.coefficients) - state.units + unit
    size = state.theta.shape[1] if isinstance(state.covariance, Shared) else state.unit_size
    modes = None if state.mode_coefficients is None else np.delete(state.mode_coefficients, place, axis=0)
    return replace(
        state,
        coefficients=np.delete(state.coefficients, place, axis=0),
        theta=np.delete(state.theta, unit, axis=0),
        places=np.delete(state.places, unit, axis=0),
        covariance=state.covariance.remove_unit(unit, size),
        silent=np.delete(state.silent, unit),
        mode_coefficients=modes,
    )


def significance(state: State, theta: np.ndarray, sizes: np.ndarray, settings: Settings) -> np.ndarray:
    """E (k,) of units θ (k, p) with weight norms (k,)."""
    regressors = settings.regressors(state.inputs)
    form = regressors.form
    if settings.density == "uniform" and regressors.radial == "gaussian" and form.rank == form.inputs:
        A = form.factors(theta)[0]
        log_share = form.inputs * math.log(math.sqrt(math.pi) / 2.0) - np.linalg.slogdet(A)[1]
        return np.asarray(sizes * np.exp(np.minimum(log_share, 700.0)))
    X = state.memory[:, : state.inputs]
    if not len(X):
        return sizes
    return np.asarray(sizes * np.sqrt((regressors.phi(X, theta) ** 2).mean(axis=0)))
