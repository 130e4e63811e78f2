"""The extended Kalman filter's measurement update over the parameters of the network.

    K = P Hᵀ (R + H P Hᵀ)⁻¹,   z ← z + K e,   P ← ((I − K H) P (I − K H)ᵀ + K R Kᵀ)/λ + q₀ I

The Joseph form on the right is expanded to P − K Bᵀ − B Kᵀ with B = P Hᵀ − ½ K S, one rank-2q update of a
triangle: it can't lose symmetry and is, to first order, insensitive to round-off in K (Bucy & Joseph 1968).

With more than one iteration the measurement is re-linearised about the latest estimate while the prior stays
where it was (iterated extended Kalman filter, Bell & Cathey 1993): the observation is used once.

Over a block-diagonal P this is the decoupled filter. The measurement noise R and the bound on a step are those of
every rule that solves for a step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from palpate.rbf.filter.covariance import Blocks, Full
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.prediction import linearise, measurement
from palpate.rbf.filter.regression import exceeds_regression_limit
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = [
    "TRIES",
    "edge_factor",
    "kalman_update",
    "measurement_variance",
    "running_mean_square",
    "step_excess",
]

TRIES = 5  # updates with a larger R each; a step that is too long in all of them is not taken
# share that the past keeps: about twenty observations, smooth and still quick enough to follow
_MEMORY = 0.95


def running_mean_square(previous: float, error: np.ndarray, count: int) -> float:
    """Running mean of ‖e‖²/m over about the last twenty observations; the first one starts it."""
    new = float(error @ error) / error.size
    return new if count <= 1 else _MEMORY * previous + (1.0 - _MEMORY) * new


def edge_factor(x: np.ndarray, floor: float) -> float:
    """Factor on R at a scaled point x (n,): Π (1 − x_i²)², not below `floor`.

    Least squares with evenly spread samples is worst at the ends of the range, where a sample has neighbours
    on one side only. For polynomials the weight (1 − x²)^−½ evens this out (Cohen & Migliorati 2017). The
    filter also has little time at the ends, so it takes a higher power, found by measurement: over 20 orders of
    presentation of either founding beam the error in the outer tenth of the range stays below 1.8 times that of
    the rest (median 0.5); with even weights it is 2 to 40 times.
    """
    return float(max(np.prod(1.0 - np.minimum(x * x, 1.0)) ** 2, floor))


def measurement_variance(x: np.ndarray, error: np.ndarray, innovation: float, settings: Settings) -> float:
    """R for one observation: the largest of the floor and the guarded shares, times the edge factor."""
    own = float(error @ error) / error.size
    r = max(settings.noise, settings.noise_share * innovation, settings.gate * own)
    return r * (edge_factor(x, settings.edge_weight) if settings.edge_weight < 1.0 else 1.0)


def step_excess(state: State, step: np.ndarray, settings: Settings) -> float:
    """Longest move of a unit in a step (h, p) of the shapes, over the bound; 0 where there is none."""
    if not settings.step_bound or not state.units:
        return 0.0
    return settings.regressors(state.inputs).form.stride(state.theta, step) / settings.step_bound


@dataclass(frozen=True, eq=False)
class _Linearisation:
    """The problem about one estimate: z (d,), P Hᵀ (d, q), S (q, q) and its Cholesky factor."""

    z: np.ndarray
    PH: np.ndarray
    S: np.ndarray
    factor: np.ndarray


def kalman_update(
    state: State,
    observation: Observation,
    prediction: tuple[np.ndarray, np.ndarray],
    settings: Settings,
    *,
    refuses: Callable[[np.ndarray], bool] | None = None,
    donate: bool = False,
) -> State:
    """Return the state after one observation of values, slopes and curvatures of the map at one place.

    The prediction is the state's own measurement there (q,) and its derivatives (q, d) by z. `refuses` says of
    parameters z (d,) that they may not be taken; by default the remembered observations decide. With `donate` the old
    covariance may be overwritten. Of the settings, noise, step bound, iterations and forgetting count.
    """
    if refuses is None:

        def refuses(z: np.ndarray) -> bool:
            return exceeds_regression_limit(state, *state.split(z), settings)

    error = (observation.targets() - prediction[0])[: observation.y.size]
    r = measurement_variance(observation.x, error, state.innovation, settings)
    for _ in range(TRIES):
        new = _iterate(state, observation, r, prediction, settings)
        excess = step_excess(state, state.split(new.z)[1] - state.theta, settings)
        if excess <= 1.0 and not refuses(new.z):
            K = dpotrs(new.factor, new.PH.T, lower=1)[0].T
            return _moved(state, new.z, K, new.PH - 0.5 * K @ new.S, settings, donate=donate)
        # a smaller step by more measurement noise keeps estimate and covariance consistent
        r += max(excess - 1.0, 1.0) * float(np.trace(new.S)) / len(new.S)
    # no step, so nothing was learnt and nothing is surer than before
    nothing = np.zeros_like(new.PH)
    return _moved(state, state.vector(), nothing, nothing, settings, donate=donate)


def _moved(
    state: State, z: np.ndarray, K: np.ndarray, B: np.ndarray, settings: Settings, *, donate: bool
) -> State:
    """The state at z (d,), with P ← (P − K Bᵀ − B Kᵀ)/λ + q₀ I."""
    P = state.covariance
    assert isinstance(P, (Full, Blocks))
    growth, added = 1.0 / settings.forgetting_factor, settings.process_noise
    covariance = P.downdate(K, B, growth=growth, added=added, donate=donate)
    return replace(state.with_parameters(z), covariance=covariance)


def _iterate(
    state: State,
    observation: Observation,
    r: float,
    prediction: tuple[np.ndarray, np.ndarray],
    settings: Settings,
) -> _Linearisation:
    """The best linearisation.

    The iteration is Gauss–Newton on ‖y − f(z)‖²/R + ‖z − z₀‖²_P⁻¹ and may overshoot: it ends where that rises.
    """
    P = state.covariance
    assert isinstance(P, (Full, Blocks))
    prior, targets, R = state.vector(), observation.targets(), observation.variances(r)
    (f, H), z, least = prediction, prior, np.inf
    best: _Linearisation | None = None
    for i in range(settings.iterations):
        if i:
            f, H = linearise(state.with_parameters(z), observation, settings)
        PH = P.times(H.T)
        HPH = H @ PH
        S = HPH + np.diag(R)
        factor, info = dpotrf(S, lower=1)
        if info:
            break
        # z − z₀ = P Hᵀ λ, so its P⁻¹ norm is λᵀ H P Hᵀ λ
        lam = dpotrs(factor, targets - f - H @ (prior - z), lower=1)[0]
        z = prior + PH @ lam
        if settings.iterations == 1:
            return _Linearisation(z, PH, S, factor)
        error = targets - measurement(state.with_parameters(z), observation, settings)
        cost = float(error @ (error / R)) + float(lam @ HPH @ lam)
        if best is not None and not cost < least:
            break
        least, best = cost, _Linearisation(z, PH, S, factor)
    if best is None:
        raise FloatingPointError("the innovation covariance is not positive definite")
    return best
