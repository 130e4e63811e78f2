"""Rules by which one observation changes the parameters; the settings say which.

full, decoupled   the Kalman filter over the whole covariance or over its blocks (see `kalman`)
winner            EMRAN (Li, Sundararajan & Saratchandran 2000): the nearest unit and the tail only. That is the
                  decoupled filter of a network of one unit, shown what the other units leave of the observation;
                  beyond evaluating the network it costs (2n + m)² m whatever the number of units.
gradient          least mean squares, as the resource-allocating network has it (Platt 1991): z ← z + α Hᵀ e, widths
                  resting
shared            cost linear in the number of outputs m, memory independent of it but for the weights

The shared rule: all outputs have the same regressors φ̃ = [tail, φ], so with R = r I their weights share one
covariance P_φ. The units' shapes θ are a second group, driven by r output modes V (m, r), orthonormal. With
s = r + φ̃ᵀ P_φ φ̃ and M = Hᵥ P_θ Hᵥᵀ, Hᵥ the modes' derivatives by θ, the innovation covariance is s I + V M Vᵀ, and

    C ← C + P_φ φ̃ (S⁻¹ e)ᵀ        S⁻¹ e = e/s + V [(s I + M)⁻¹ − I/s] Vᵀ e
    θ ← θ + P_θ Hᵥᵀ (s I + M)⁻¹ Vᵀ e
    P_φ ← P_φ − P_φ φ̃ φ̃ᵀ P_φ/(s + tr M/m)

This is a two-group decoupled filter (Puskorius & Feldkamp 1991) whose first group is a Kronecker product. It is
the full filter exactly while P_θ is zero; the last line spreads what the shapes add to S over the outputs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg.blas import dger
from scipy.linalg.lapack import dpotrf, dpotrs

from palpate.errors import UsageError
from palpate.rbf.filter.covariance import Blocks, Shared, downdate_triangle, triangle_product
from palpate.rbf.filter.growth import nearest_unit
from palpate.rbf.filter.kalman import TRIES, kalman_update, measurement_variance, step_excess
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.prediction import linearise, measurement
from palpate.rbf.filter.regression import exceeds_regression_limit
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["Prediction", "predict_observation", "update_state"]

Prediction = tuple[np.ndarray, np.ndarray]


def predict_observation(state: State, observation: Observation, settings: Settings) -> Prediction:
    """The network's measurement where something was observed, (q,), and its derivatives (q, d).

    The winner's and the shared-weight rule form their own derivatives, of a part: theirs are (q, 0) here.
    """
    if settings.update in {"shared", "winner"}:
        f = measurement(state, observation, settings)
        return f, np.zeros((f.size, 0))
    return linearise(state, observation, settings)


def update_state(
    state: State,
    observation: Observation,
    prediction: Prediction,
    settings: Settings,
    *,
    donate: bool = False,
) -> State:
    """Return the state after one observation, in scaled quantities, that it had predicted so.

    With `donate` the old state's arrays may be overwritten: the caller promises not to use it again.
    """
    if settings.update == "gradient":
        return _gradient(state, observation, prediction, settings)
    if settings.update == "shared":
        return _shared(state, observation, prediction, settings, donate=donate)
    if settings.update == "winner":
        return _winner(state, observation, prediction, settings, donate=donate)
    return kalman_update(state, observation, prediction, settings, donate=donate)


def _gradient(state: State, observation: Observation, prediction: Prediction, settings: Settings) -> State:
    f, H = prediction
    shares = observation.variances(1.0)
    step = settings.learning_rate * (H.T @ ((observation.targets() - f) / shares))
    coefficients, theta = state.split(step)
    form = settings.regressors(state.inputs).form
    theta[:, form.variances(1.0, 0.0) == 0.0] = 0.0
    units = np.hstack([coefficients[len(coefficients) - state.units :], theta])
    tail = coefficients[: len(coefficients) - state.units].T
    return state.with_parameters(state.vector() + np.concatenate([tail.ravel(), units.ravel()]))


def _winner(
    state: State, observation: Observation, prediction: Prediction, settings: Settings, *, donate: bool
) -> State:
    if not state.units:
        first = linearise(state, observation, settings)
        return kalman_update(state, observation, first, settings, donate=donate)
    P = state.covariance
    assert isinstance(P, Blocks)  # the settings' update rule made the state
    unit = nearest_unit(state, observation.x, settings)[0]
    row = len(state.coefficients) - state.units + unit
    part = replace(
        state,
        coefficients=np.vstack([state.tail.T, state.coefficients[row]]),
        theta=state.theta[unit : unit + 1],
        covariance=P.of_unit(unit),
    )
    own, H = linearise(part, observation, settings)
    rest = observation.minus(prediction[0] - own)

    def whole(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        coefficients, theta = state.coefficients.copy(), state.theta.copy()
        changed, theta[unit : unit + 1] = part.split(z)
        coefficients[: len(changed) - 1], coefficients[row] = changed[:-1], changed[-1]
        return coefficients, theta

    def refuses(z: np.ndarray) -> bool:
        return exceeds_regression_limit(state, *whole(z), settings)

    part = kalman_update(part, rest, (own, H), settings, refuses=refuses)
    assert isinstance(part.covariance, Blocks)
    coefficients, theta = whole(part.vector())
    covariance = P.with_unit_of(unit, part.covariance, donate=donate)
    return replace(state, coefficients=coefficients, theta=theta, covariance=covariance)


def _shared(
    state: State, observation: Observation, prediction: Prediction, settings: Settings, *, donate: bool
) -> State:
    if not observation.plain:
        raise UsageError(
            "The shared-weight rule can't learn from slopes or curvatures.",
            why="It lives on all observed quantities having the same regressors.",
            fix='Choose update="full" or "decoupled".',
        )
    P = state.covariance
    assert isinstance(P, Shared)  # the settings' update rule made the state
    error = observation.y - prediction[0]
    row, H = _linearise_modes(state, observation.x, settings)
    gain, PH = triangle_product(P.regressors, row[:, None])[:, 0], triangle_product(P.shapes, H.T)
    M, spread = H @ PH, float(row @ gain)
    latent_error = error if state.modes is None else state.modes.T @ error
    r = measurement_variance(observation.x, error, state.innovation, settings) / observation.weight
    for _ in range(TRIES):
        s = r + spread
        S = M + s * np.eye(len(M))
        factor, info = dpotrf(S, lower=1)
        if info:
            raise FloatingPointError("the innovation covariance is not positive definite")
        lam = dpotrs(factor, latent_error, lower=1)[0]
        step = (PH @ lam).reshape(state.theta.shape)
        latent_coefficients = state.latent_coefficients + np.outer(gain, lam)
        excess = step_excess(state, step, settings)
        if excess <= 1.0 and not exceeds_regression_limit(
            state, latent_coefficients, state.theta + step, settings
        ):
            break
        # a smaller step by more measurement noise keeps estimate and covariance consistent
        r += max(excess - 1.0, 1.0) * (s + float(np.trace(M)) / max(len(M), 1))
    else:
        # no step, so nothing was learnt and nothing is surer than before
        return replace(
            state, covariance=_downdate_shared(state, 0.0 * gain, 1.0, 0.0 * PH, S, factor, settings, donate)
        )
    whole = lam if state.modes is None else error / s + state.modes @ (lam - latent_error / s)
    C = dger(1.0, whole, gain, a=state.coefficients.T, overwrite_a=int(donate)).T
    return replace(
        state,
        coefficients=C,
        theta=state.theta + step,
        covariance=_downdate_shared(state, gain, s, PH, S, factor, settings, donate),
        mode_coefficients=None if state.modes is None else latent_coefficients,
    )


def _linearise_modes(state: State, x: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (p_t + h,) and the modes' derivatives by θ, (r, h p)."""
    regressors = settings.regressors(state.inputs)
    phi, by_theta = regressors.by_theta(x[None], state.theta)
    weights = state.latent_weights
    H = weights.T[:, :, None] * by_theta
    return np.concatenate([regressors.tail_rows(x[None])[0], phi[0]]), H.reshape(weights.shape[1], -1)


def _downdate_shared(
    state: State,
    gain: np.ndarray,
    s: float,
    PH: np.ndarray,
    S: np.ndarray,
    factor: np.ndarray,
    settings: Settings,
    donate: bool,
) -> Shared:
    P, growth, added = state.covariance, 1.0 / settings.forgetting_factor, settings.process_noise
    assert isinstance(P, Shared)
    M = np.trace(S) - s * len(S)
    k = (gain / (s + M / state.outputs))[:, None]
    regressors = downdate_triangle(
        P.regressors, k, 0.5 * gain[:, None], growth=growth, added=added, donate=donate
    )
    K = dpotrs(factor, PH.T, lower=1)[0].T
    B = PH - 0.5 * K @ S
    return Shared(regressors, downdate_triangle(P.shapes, K, B, growth=growth, added=added, donate=donate))
