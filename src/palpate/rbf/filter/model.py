"""The network that a state stands for: its value, and its derivatives by every parameter.

    ∂f/∂w_k = φ_k I     ∂f/∂θ_k = w_k ∂φ_k/∂θ_k     ∂f/∂T = I ⊗ [1, x]

Platt 1991 has the value; Kadirkamanathan & Niranjan 1993 the derivatives.
"""

from __future__ import annotations

import numpy as np

from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["activations", "jacobian", "measured", "regressors_at", "value"]


def regressors_at(state: State, X: np.ndarray, settings: Settings) -> np.ndarray:
    """All regressors (N, p_t + h), tail first, at scaled points X (N, n)."""
    of = settings.regressors(state.inputs)
    return np.hstack([of.tail_rows(X), of.phi(X, state.theta)])


def activations(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """φ (h,) at one scaled point x (n,)."""
    return np.asarray(settings.regressors(state.inputs).phi(x[None], state.theta)[0])


def value(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """f(x): (m,) at one scaled point (n,), (N, m) at many (N, n)."""
    X = np.atleast_2d(x)
    Y = regressors_at(state, X, settings) @ state.coefficients
    return np.asarray(Y if x.ndim > 1 else Y[0])


def measured(state: State, seen: Observation, settings: Settings) -> np.ndarray:
    """What the network has for everything that an observation holds, (q,)."""
    y = value(state, seen.x, settings)
    if seen.plain:
        return y
    of, X, parts = settings.regressors(state.inputs), seen.x[None], [y]
    if seen.slopes is not None:
        rows = np.hstack([of.tail_slopes(1)[0], of.slopes(X, state.theta)[0]])  # (n, p_t + h)
        parts.append((rows @ state.coefficients).T.ravel())
    if seen.curvatures is not None:
        parts.append((of.curvatures(X, state.theta)[0] @ state.weights).T.ravel())
    return np.asarray(np.concatenate(parts)[seen.counts])


def jacobian(state: State, seen: Observation, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """What the network has for an observation, (q,), and its derivatives (q, d) by z."""
    of = settings.regressors(state.inputs)
    X = seen.x[None]
    phi, by_theta = of.by_theta(X, state.theta)
    f, H = _rows(state, of.tail_rows(X)[0], phi[0], by_theta[0])
    if seen.plain:
        return f, H
    found, tails = [(f, H)], of.tail_slopes(1)[0]
    if seen.slopes is not None:
        slopes, by_theta = of.slopes_by_theta(X, state.theta)
        found.append(_several(state, tails, slopes[0], by_theta[0]))
    if seen.curvatures is not None:
        bends, by_theta = of.curvatures_by_theta(X, state.theta)
        found.append(_several(state, np.zeros((len(bends[0]), tails.shape[1])), bends[0], by_theta[0]))
    kept = seen.counts
    return np.concatenate([p[0] for p in found])[kept], np.vstack([p[1] for p in found])[kept]


def _several(
    state: State, tails: np.ndarray, units: np.ndarray, by_theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Several functionals, output by output: (m q,) and (m q, d) from (q, p_t), (q, h) and (q, h, p)."""
    parts = [_rows(state, *one) for one in zip(tails, units, by_theta, strict=True)]
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
