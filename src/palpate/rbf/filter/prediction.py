"""The network that a state stands for: its value, its derivatives by every parameter, and its own deviation.

    ∂f/∂w_k = φ_k I     ∂f/∂θ_k = w_k ∂φ_k/∂θ_k     ∂f/∂T = I ⊗ [1, x]

Platt 1991 has the value; Kadirkamanathan & Niranjan 1993 the derivatives. The predictive variance is

    var f_j(x) = h_j(x) P h_j(x)ᵀ + R,   h_j = ∂f_j/∂z

with P the filter's covariance of its parameters: under the block rules zero between blocks, under the shared-weight
rule P_φ for each output's coefficients beside P_θ for the shapes. R is the floor of the measurement noise or the
guarded share of the running mean square of the innovation, whichever is larger, without the edge factor, which
weighs samples and is no noise. Nothing here is calibrated: a filter is sure of itself where its linearisation is
wrong, and blocks without the correlations between units that overlap say far too much.
"""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.filter.covariance import Blocks, Full, Shared, symmetric, triangle_product
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = [
    "activations",
    "linearise",
    "measurement",
    "predictive_deviation",
    "predictive_variance",
    "regressors_at",
    "value",
]


_CHUNK = 64  # points at a time: memory stays at 64 m d numbers


def regressors_at(state: State, X: np.ndarray, settings: Settings) -> np.ndarray:
    """All regressors (N, p_t + h), tail first, at scaled points X (N, n)."""
    regressors = settings.regressors(state.inputs)
    return np.hstack([regressors.tail_rows(X), regressors.phi(X, state.theta)])


def activations(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """φ (h,) at one scaled point x (n,)."""
    return np.asarray(settings.regressors(state.inputs).phi(x[None], state.theta)[0])


def value(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """f(x): (m,) at one scaled point (n,), (N, m) at many (N, n)."""
    X = np.atleast_2d(x)
    Y = regressors_at(state, X, settings) @ state.coefficients
    return np.asarray(Y if x.ndim > 1 else Y[0])


def measurement(state: State, observation: Observation, settings: Settings) -> np.ndarray:
    """The network's own values, slopes and curvatures where something was observed, (q,): the filter's h(z)."""
    y = value(state, observation.x, settings)
    if observation.plain:
        return y
    regressors, X, parts = settings.regressors(state.inputs), observation.x[None], [y]
    if observation.slopes is not None:
        rows = np.hstack([regressors.tail_slopes(1)[0], regressors.slopes(X, state.theta)[0]])  # (n, p_t + h)
        parts.append((rows @ state.coefficients).T.ravel())
    if observation.curvatures is not None:
        parts.append((regressors.curvatures(X, state.theta)[0] @ state.weights).T.ravel())
    return np.asarray(np.concatenate(parts)[observation.counts])


def linearise(state: State, observation: Observation, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """The network's `measurement` (q,) where something was observed, and its derivatives (q, d) by z."""
    regressors = settings.regressors(state.inputs)
    X = observation.x[None]
    phi, by_theta = regressors.by_theta(X, state.theta)
    f, H = _rows(state, regressors.tail_rows(X)[0], phi[0], by_theta[0])
    if observation.plain:
        return f, H
    parts, tails = [(f, H)], regressors.tail_slopes(1)[0]
    if observation.slopes is not None:
        slopes, by_theta = regressors.slopes_by_theta(X, state.theta)
        parts.append(_several(state, tails, slopes[0], by_theta[0]))
    if observation.curvatures is not None:
        bends, by_theta = regressors.curvatures_by_theta(X, state.theta)
        parts.append(_several(state, np.zeros((len(bends[0]), tails.shape[1])), bends[0], by_theta[0]))
    counts = observation.counts
    return np.concatenate([p[0] for p in parts])[counts], np.vstack([p[1] for p in parts])[counts]


def _several(
    state: State, tails: np.ndarray, units: np.ndarray, by_theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Several functionals, output by output: (m q,) and (m q, d) from (q, p_t), (q, h) and (q, h, p)."""
    parts = [_rows(state, *row) for row in zip(tails, units, by_theta, strict=True)]
    # functional by functional, (q, m, …), to (m, q, …)
    values = np.stack([p[0] for p in parts], axis=1)
    return values.ravel(), np.stack([p[1] for p in parts], axis=1).reshape(values.size, -1)


def _rows(
    state: State, tail: np.ndarray, phi: np.ndarray, by_theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One linear functional of f (m,), and its rows of H (m, d), from its regressors (p_t,), (h,), (h, p)."""
    m, (h, p), p_t = state.outputs, state.theta.shape, tail.size
    each = np.arange(m)
    H = np.zeros((m, m * p_t + h * (m + p)))
    # views into H: its rows are contiguous
    tails, units = H[:, : m * p_t].reshape(m, m, p_t), H[:, m * p_t :].reshape(m, h, m + p)
    tails[each, each] = tail
    units[each, :, each] = phi
    np.multiply(state.weights.T[:, :, None], by_theta, out=units[:, :, m:])
    return np.concatenate([tail, phi]) @ state.coefficients, H


def predictive_deviation(state: State, X: np.ndarray, settings: Settings) -> np.ndarray:
    """Return the standard deviation (N, m) of what would be measured at X (N, n), all scaled.

    States whose update rule keeps no covariance are refused.
    """
    r = max(settings.noise, settings.noise_share * state.innovation)
    return np.asarray(np.sqrt(np.maximum(predictive_variance(state, X, settings), 0.0) + r))


def predictive_variance(state: State, X: np.ndarray, settings: Settings) -> np.ndarray:
    """Return the variance h P hᵀ (N, m) of the network's outputs at X (N, n), all scaled.

    States whose update rule keeps no covariance are refused.
    """
    X, P = np.asarray(X, float), state.covariance
    parts = [X[i : i + _CHUNK] for i in range(0, len(X), _CHUNK)]
    if isinstance(P, Shared):
        variances = [_shared(state, P, part, settings) for part in parts]
    elif isinstance(P, (Full, Blocks)):
        variances = [_joint(state, P, part, settings) for part in parts]
    else:
        raise UsageError(
            "The gradient rule has no predictive variance.",
            why="It keeps no covariance of its parameters.",
            fix='Choose another update rule, such as update="full".',
        )
    return np.vstack([np.zeros((0, state.outputs)), *variances])


def _joint(state: State, P: Full | Blocks, X: np.ndarray, settings: Settings) -> np.ndarray:
    rows = np.vstack([linearise(state, Observation(x, np.zeros(state.outputs)), settings)[1] for x in X])
    variances = np.einsum("qd,dq->q", rows, P.times(rows.T))
    return np.asarray(variances.reshape(len(X), state.outputs))


def _shared(state: State, P: Shared, X: np.ndarray, settings: Settings) -> np.ndarray:
    row = regressors_at(state, X, settings)
    linear = np.einsum("nc,cn->n", row, triangle_product(P.regressors, row.T))[:, None]
    if not state.units:
        return np.tile(linear, (1, state.outputs))
    D = settings.regressors(state.inputs).by_theta(X, state.theta)[1]
    _, h, p = D.shape
    shapes = symmetric(P.shapes).reshape(h, p, h, p)
    # how the units' activations vary together, (N, h, h)
    together = np.einsum("nkla,nla->nkl", np.einsum("nkb,kbla->nkla", D, shapes, optimize=True), D)
    W = state.weights
    return np.asarray(linear + ((together @ W) * W).sum(axis=1))
