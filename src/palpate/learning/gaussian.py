"""Axis-aligned Gaussian units and the tail: value and derivatives by every parameter.

    f(x) = T·[1, x] + Σ_k w_k φ_k(x),   φ_k = exp(−Σ_i ((x_i − μ_ki)/σ_ki)²)
    ∂f/∂w_k = φ_k I                     ∂f/∂μ_ki = 2 φ_k w_k (x_i − μ_ki)/σ_ki²
    ∂f/∂log σ_ki = 2 φ_k w_k (x_i − μ_ki)²/σ_ki²
    ∂f/∂T = I ⊗ [1, x]

Platt 1991 has the value; Kadirkamanathan & Niranjan 1993 the derivatives. Papers that write exp(−½ …) have
widths √2 times smaller.
"""

from __future__ import annotations

import numpy as np

from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["activations", "jacobian", "tail_row", "value"]


def tail_row(x: np.ndarray, columns: int) -> np.ndarray:
    """The first `columns` of [1, x] for one point (n,) or many (N, n)."""
    ones = np.ones((*x.shape[:-1], 1))
    return np.concatenate([ones, x], axis=-1)[..., :columns]


def activations(x: np.ndarray, centres: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """φ: (h,) at one point (n,), (N, h) at many (N, n)."""
    t = (x[..., None, :] - centres) / widths
    return np.asarray(np.exp(-np.einsum("...i,...i->...", t, t)))


def value(state: State, x: np.ndarray, settings: Settings) -> np.ndarray:
    """f(x): (m,) at one scaled point (n,), (N, m) at many (N, n)."""
    phi = activations(x, state.centres, state.widths(settings))
    return np.asarray(tail_row(x, state.tail.shape[1]) @ state.tail.T + phi @ state.weights)


def jacobian(state: State, x: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """f(x) (m,) and ∂f/∂z (m, d) at one scaled point x (n,)."""
    m, n, h = state.outputs, state.inputs, len(state.units)
    w, sigma = state.weights, state.widths(settings)
    t = (x - state.centres) / sigma
    phi = np.exp(-np.einsum("ki,ki->k", t, t))
    row = tail_row(x, state.tail.shape[1])
    units = np.zeros((m, h, m + 2 * n))
    units[np.arange(m), :, np.arange(m)] = phi
    by_width = 2.0 * phi[:, None] * t * t
    units[:, :, m : m + n] = w.T[:, :, None] * (2.0 * phi[:, None] * t / sigma)
    units[:, :, m + n :] = w.T[:, :, None] * (by_width if settings.widths == "log" else by_width / sigma)
    tail = np.kron(np.eye(m), row)
    return state.tail @ row + phi @ w, np.hstack([tail, units.reshape(m, -1)])
