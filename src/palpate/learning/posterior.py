"""From a refined network back to the filter: the Gauss–Newton posterior, from which learning goes on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from palpate.learning.covariance import Full
from palpate.learning.model import jacobian
from palpate.learning.observation import Observation
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
    theta = np.hstack([refined.centres, np.log(refined.widths)])
    mean = replace(
        empty,
        coefficients=np.vstack([refined.tail, refined.weights.reshape(h, m)]),
        theta=theta,
        places=refined.centres,
        silent=np.zeros(h, dtype=np.int64),
        count=len(X),
        innovation=refined.rms**2,
    )
    variance = max(settings.noise, refined.rms**2)
    information = np.diag(1.0 / _prior(mean, settings))
    for x in X:
        H = jacobian(mean, Observation(x, np.zeros(m)), settings)[1]
        information += H.T @ H / variance
    covariance = cho_solve(cho_factor(information), np.eye(len(information)))
    return replace(mean, covariance=Full(np.asfortranarray(covariance), mean.tail.size))


def _prior(state: State, settings: Settings) -> np.ndarray:
    """Prior variances (d,) of the parameters."""
    form = settings.regressors(state.inputs).form
    unit = np.concatenate(
        [np.full(state.outputs, settings.prior), form.variances(settings.prior, settings.width_prior)]
    )
    return np.concatenate([np.full(state.tail.size, settings.tail_prior), np.tile(unit, state.units)])
