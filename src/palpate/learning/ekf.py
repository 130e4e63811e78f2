"""The extended Kalman filter's measurement update over all parameters of the network.

    K = P Hᵀ (R + H P Hᵀ)⁻¹,   z ← z + K e,   P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ + q₀ I

The Joseph form on the right is expanded to P − K Bᵀ − B Kᵀ with B = P Hᵀ − ½ K S, one rank-2m update: it is
exactly symmetric and, to first order, insensitive to round-off in K (Bucy & Joseph 1968).

With more than one iteration the measurement is re-linearised about the latest estimate while the prior stays
where it was (iterated extended Kalman filter, Bell & Cathey 1993): the observation is used once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from palpate.learning.gaussian import jacobian, value
from palpate.learning.memory import forgets
from palpate.learning.noise import variance
from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["updated"]

_TRIES = (
    4  # a step that is still too long after so many enlargements of R is taken as it is, cut to the bound
)


def updated(state: State, x: np.ndarray, y: np.ndarray, settings: Settings) -> State:
    """The state after one observation (x (n,), y (m,)), both scaled."""
    predicted, _ = jacobian(state, x, settings)
    r = variance(x, y - predicted, state.innovation, settings)
    z, K, PH, S = _iterate(state, x, y, r, settings)
    for _ in range(_TRIES):
        excess = _excess(state, z, settings)
        if excess <= 1.0 and not forgets(state, state.moved(z), settings):
            break
        # a smaller step by more measurement noise keeps estimate and covariance consistent
        r += max(excess - 1.0, 1.0) * float(np.trace(S)) / y.size
        z, K, PH, S = _iterate(state, x, y, r, settings)
    else:
        z = state.vector()
    B = PH - 0.5 * K @ S
    G = K @ B.T
    covariance = state.covariance - (G + G.T)
    if settings.process_noise:
        covariance[np.diag_indices_from(covariance)] += settings.process_noise
    return replace(state.moved(z), covariance=covariance)


def _iterate(
    state: State, x: np.ndarray, y: np.ndarray, r: float, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Estimate z (d,), gain K (d, m), P Hᵀ (d, m) and S (m, m) of the best linearisation.

    The iteration is Gauss–Newton on ‖y − f(z)‖²/R + ‖z − z₀‖²_P⁻¹ and may overshoot: it ends where that rises.
    """
    prior = state.vector()
    z, here, least = prior, state, np.inf
    best = None
    for _ in range(settings.iterations):
        f, H = jacobian(here, x, settings)
        PH = state.covariance @ H.T
        HPH = H @ PH
        S = HPH + r * np.eye(y.size)
        factor = cho_factor(S, check_finite=False)
        # z − z₀ = P Hᵀ λ, so its P⁻¹ norm is λᵀ H P Hᵀ λ
        lam = cho_solve(factor, y - f - H @ (prior - z), check_finite=False)
        z = prior + PH @ lam
        here = state.moved(z)
        error = y - value(here, x, settings)
        cost = float(error @ error) / r + float(lam @ HPH @ lam)
        if best is not None and not cost < least:
            break
        least = cost
        best = (z, cho_solve(factor, PH.T, check_finite=False).T, PH, S)
    assert best is not None  # settings.iterations is at least 1
    return best


def _excess(state: State, z: np.ndarray, settings: Settings) -> float:
    """Largest step of a centre (in widths) or log width over the bound."""
    if not settings.step_bound or not len(state.units):
        return 0.0
    step = state.split(z)[1] - state.units
    m, n = state.outputs, state.inputs
    sigma = state.widths(settings)
    centres = np.abs(step[:, m : m + n] / sigma).max()
    widths = np.abs(step[:, m + n :] if settings.widths == "log" else step[:, m + n :] / sigma).max()
    return float(max(centres, widths)) / settings.step_bound
