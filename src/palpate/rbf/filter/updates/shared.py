"""The shared-weight filter: cost linear in the number of outputs m, memory independent of it but for the weights.

All outputs have the same regressors φ̃ = [tail, φ], so with R = r I their weights share one covariance P_φ. The
units' shapes θ are a second group, driven by r output modes V (m, r), orthonormal. With s = r + φ̃ᵀ P_φ φ̃ and
M = Hᵥ P_θ Hᵥᵀ, Hᵥ the modes' derivatives by θ, the innovation covariance is s I + V M Vᵀ, and

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
from palpate.rbf.filter.covariance import Shared, triangle
from palpate.rbf.filter.memory import spoils
from palpate.rbf.filter.noise import variance
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.updates.bound import TRIES, excess

__all__ = ["updated"]


def updated(
    state: State, seen: Observation, error: np.ndarray, settings: Settings, *, donate: bool = False
) -> State:
    """The state after one observation whose error (m,) is known already.

    Raises
    ------
    UsageError
        If the observation holds slopes or curvatures: they have other regressors than the outputs.
    """
    if not seen.plain:
        raise UsageError(
            "The shared-weight rule can't learn from slopes or curvatures.",
            why="It lives on all observed quantities having the same regressors.",
            fix='Choose update="full" or "decoupled".',
        )
    P = state.covariance
    assert isinstance(P, Shared)  # the settings' update rule made the state
    row, H = _linearised(state, seen.x, settings)
    gain, PH = triangle.product(P.regressors, row[:, None])[:, 0], triangle.product(P.shapes, H.T)
    M, spread = H @ PH, float(row @ gain)
    led = error if state.modes is None else state.modes.T @ error
    r = variance(seen.x, error, state.innovation, settings) / seen.weight
    for _ in range(TRIES):
        s = r + spread
        S = M + s * np.eye(len(M))
        factor, flaw = dpotrf(S, lower=1)
        if flaw:
            raise FloatingPointError("the innovation covariance is not positive definite")
        lam = dpotrs(factor, led, lower=1)[0]
        step = (PH @ lam).reshape(state.theta.shape)
        led_after = state.led + np.outer(gain, lam)
        far = excess(state, step, settings)
        if far <= 1.0 and not spoils(state, led_after, state.theta + step, settings):
            break
        # a smaller step by more measurement noise keeps estimate and covariance consistent
        r += max(far - 1.0, 1.0) * (s + float(np.trace(M)) / max(len(M), 1))
    else:
        # no step, so nothing was learnt and nothing is surer than before
        return replace(
            state, covariance=_reduced(P, 0.0 * gain, 1.0, 0.0 * PH, S, factor, state, settings, donate)
        )
    whole = lam if state.modes is None else error / s + state.modes @ (lam - led / s)
    C = dger(1.0, whole, gain, a=state.coefficients.T, overwrite_a=int(donate)).T
    return replace(
        state,
        coefficients=C,
        theta=state.theta + step,
        covariance=_reduced(P, gain, s, PH, S, factor, state, settings, donate),
        in_modes=None if state.modes is None else led_after,
    )


def _linearised(state: State, x: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (p_t + h,) and the modes' derivatives by θ, (r, h p)."""
    of = settings.regressors(state.inputs)
    phi, by_theta = of.by_theta(x[None], state.theta)
    weights = state.led_weights
    H = weights.T[:, :, None] * by_theta
    return np.concatenate([of.tail_rows(x[None])[0], phi[0]]), H.reshape(weights.shape[1], -1)


def _reduced(
    P: Shared,
    gain: np.ndarray,
    s: float,
    PH: np.ndarray,
    S: np.ndarray,
    factor: np.ndarray,
    state: State,
    settings: Settings,
    donate: bool,
) -> Shared:
    growth, added = 1.0 / settings.forgetting_factor, settings.process_noise
    M = np.trace(S) - s * len(S)
    k = (gain / (s + M / state.outputs))[:, None]
    regressors = triangle.reduced(
        P.regressors, k, 0.5 * gain[:, None], growth=growth, added=added, donate=donate
    )
    K = dpotrs(factor, PH.T, lower=1)[0].T
    B = PH - 0.5 * K @ S
    return Shared(regressors, triangle.reduced(P.shapes, K, B, growth=growth, added=added, donate=donate))
