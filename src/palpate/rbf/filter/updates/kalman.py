"""The extended Kalman filter's measurement update over the parameters of the network.

    K = P Hᵀ (R + H P Hᵀ)⁻¹,   z ← z + K e,   P ← ((I − K H) P (I − K H)ᵀ + K R Kᵀ)/λ + q₀ I

The Joseph form on the right is expanded to P − K Bᵀ − B Kᵀ with B = P Hᵀ − ½ K S, one rank-2q update of a
triangle: it can't lose symmetry and is, to first order, insensitive to round-off in K (Bucy & Joseph 1968).

With more than one iteration the measurement is re-linearised about the latest estimate while the prior stays
where it was (iterated extended Kalman filter, Bell & Cathey 1993): the observation is used once.

Over a block-diagonal P this is the decoupled filter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from palpate.rbf.filter.covariance import Blocks, Full
from palpate.rbf.filter.memory import forgets
from palpate.rbf.filter.model import jacobian, measured
from palpate.rbf.filter.noise import variance
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.updates.bound import TRIES, excess

__all__ = ["updated"]


@dataclass(frozen=True, eq=False)
class _Linear:
    """One linearisation: estimate z (d,), P Hᵀ (d, q), S (q, q) and its Cholesky factor."""

    z: np.ndarray
    PH: np.ndarray
    S: np.ndarray
    factor: np.ndarray


def updated(
    state: State,
    seen: Observation,
    first: tuple[np.ndarray, np.ndarray],
    settings: Settings,
    *,
    spoils: Callable[[np.ndarray], bool] | None = None,
    donate: bool = False,
) -> State:
    """The state after one observation, predicted by `first`.

    `spoils` says of parameters z (d,) that they may not be taken, by default what the memory says. With `donate`
    the old covariance is overwritten.
    """
    spoils = spoils or (lambda z: forgets(state, z, settings))
    error = (seen.targets() - first[0])[: seen.y.size]
    r = variance(seen.x, error, state.innovation, settings)
    for _ in range(TRIES):
        found = _iterate(state, seen, r, first, settings)
        far = excess(state, state.split(found.z)[1] - state.theta, settings)
        if far <= 1.0 and not spoils(found.z):
            K = dpotrs(found.factor, found.PH.T, lower=1)[0].T
            return _taken(state, found.z, K, found.PH - 0.5 * K @ found.S, settings, donate=donate)
        # a smaller step by more measurement noise keeps estimate and covariance consistent
        r += max(far - 1.0, 1.0) * float(np.trace(found.S)) / len(found.S)
    # no step, so nothing was learnt and nothing is surer than before
    nothing = np.zeros_like(found.PH)
    return _taken(state, state.vector(), nothing, nothing, settings, donate=donate)


def _taken(
    state: State,
    z: np.ndarray,
    K: np.ndarray,
    B: np.ndarray,
    settings: Settings,
    *,
    donate: bool,
) -> State:
    """The state at z (d,), with P ← (P − K Bᵀ − B Kᵀ)/λ + q₀ I."""
    P = state.covariance
    assert isinstance(P, (Full, Blocks))
    covariance = P.reduced(
        K,
        B,
        growth=1.0 / settings.forgetting_factor,
        added=settings.process_noise,
        donate=donate,
    )
    return replace(state.moved(z), covariance=covariance)


def _iterate(
    state: State,
    seen: Observation,
    r: float,
    first: tuple[np.ndarray, np.ndarray],
    settings: Settings,
) -> _Linear:
    """The best linearisation.

    The iteration is Gauss–Newton on ‖y − f(z)‖²/R + ‖z − z₀‖²_P⁻¹ and may overshoot: it ends where that rises.
    """
    P = state.covariance
    assert isinstance(P, (Full, Blocks))
    prior, targets, R = state.vector(), seen.targets(), seen.variances(r)
    (f, H), z, least = first, prior, np.inf
    best: _Linear | None = None
    for i in range(settings.iterations):
        if i:
            f, H = jacobian(state.moved(z), seen, settings)
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
            return _Linear(z, PH, S, factor)
        error = targets - measured(state.moved(z), seen, settings)
        cost = float(error @ (error / R)) + float(lam @ HPH @ lam)
        if best is not None and not cost < least:
            break
        least, best = cost, _Linear(z, PH, S, factor)
    if best is None:
        raise FloatingPointError("the innovation covariance is not positive definite")
    return best
