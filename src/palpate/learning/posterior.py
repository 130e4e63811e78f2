"""From a refined network back to the filter: the Gauss–Newton posterior, from which learning goes on."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from palpate.learning.gaussian import jacobian
from palpate.learning.refine import Refined
from palpate.learning.settings import Settings
from palpate.learning.state import State, initial

__all__ = ["posterior"]


def posterior(refined: Refined, X: np.ndarray, settings: Settings) -> State:
    """The filter's state that a refined network stands for.

    P = (Σ_i H_iᵀ H_i / r + P₀⁻¹)⁻¹ with the rows H_i = ∂f(x_i)/∂z of all samples, P₀ the settings' prior and
    r the mean squared residual, not below the settings' noise. For a linear model this is the covariance that
    the filter itself reaches after the same samples.

    Parameters
    ----------
    refined : Refined
        With h units, n inputs, m outputs; its tail must be of the settings' kind.
    X : (N, n)
        Scaled inputs it was refined on.
    settings : Settings
        With log widths.

    Returns
    -------
    State
    """
    h, m = refined.weights.shape if len(refined.centres) else (0, refined.tail.shape[1])
    n = X.shape[1]
    empty = initial(n, m, settings)
    units = np.hstack([refined.weights.reshape(h, m), refined.centres, np.log(refined.widths)])
    mean = State(
        tail=refined.tail.T.copy(),
        units=units,
        covariance=np.zeros((0, 0)),
        errors=empty.errors,
        seen=empty.seen,
        silent=np.zeros(h, dtype=np.int64),
        count=len(X),
        innovation=refined.rms**2,
        inputs=n,
    )
    variance = max(settings.noise, refined.rms**2)
    information = np.diag(1.0 / _prior(mean, settings))
    for x in X:
        H = jacobian(mean, x, settings)[1]
        information += H.T @ H / variance
    covariance = cho_solve(cho_factor(information), np.eye(len(information)))
    return State(**{**vars(mean), "covariance": (covariance + covariance.T) / 2})


def _prior(state: State, settings: Settings) -> np.ndarray:
    """Prior variances (d,) of the parameters."""
    unit = np.full(state.units.shape[1], settings.prior)
    unit[state.outputs + state.inputs :] = settings.width_prior
    return np.concatenate([np.full(state.tail.size, settings.tail_prior), np.tile(unit, len(state.units))])
