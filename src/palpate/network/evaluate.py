"""Compiled evaluation of a radial-basis-function network, without allocation per call.

    f(x) = T·[1, x] + Σ_k w_k exp(−‖A_k x − b_k‖²)

One factor A_k (r, n) per unit covers every form of unit: isotropic, axis-aligned, rotated, or rank r < n.
Weights and tail are stored as they are read: one contiguous row of m outputs per regressor.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

__all__ = ["jacobian_into", "value_into", "values_into"]

# fastmath stays off: the runtime must agree with Network.predict to the last bits on every machine
_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def value_into(
    x: np.ndarray,
    y: np.ndarray,
    centre: np.ndarray,
    half: np.ndarray,
    factors: np.ndarray,
    shifts: np.ndarray,
    rows: np.ndarray,
) -> None:
    """Evaluate one point x (n,) into y (m,).

    Parameters
    ----------
    centre, half : (n,)
        Input scaling: ξ = (x − centre)/half.
    factors : (h, r, n)
    shifts : (h, r)
    rows : (1 + n + h, m)
        Constant, n slopes and h weights, in output units.
    """
    n, h, m = x.size, factors.shape[0], y.size
    r = factors.shape[1]
    for j in range(m):
        y[j] = rows[0, j]
    for i in range(n):
        t = (x[i] - centre[i]) / half[i]
        for j in range(m):
            y[j] += rows[1 + i, j] * t
    for k in range(h):
        q = 0.0
        for a in range(r):
            v = -shifts[k, a]
            for i in range(n):
                v += factors[k, a, i] * ((x[i] - centre[i]) / half[i])
            q += v * v
        phi = math.exp(-q)
        for j in range(m):
            y[j] += rows[1 + n + k, j] * phi


@_jit
def values_into(
    X: np.ndarray,
    Y: np.ndarray,
    centre: np.ndarray,
    half: np.ndarray,
    factors: np.ndarray,
    shifts: np.ndarray,
    rows: np.ndarray,
) -> None:
    """Evaluate N points X (N, n) into Y (N, m), each exactly as `value_into` does."""
    for i in range(X.shape[0]):
        value_into(X[i], Y[i], centre, half, factors, shifts, rows)


@_jit
def jacobian_into(
    x: np.ndarray,
    J: np.ndarray,
    centre: np.ndarray,
    half: np.ndarray,
    factors: np.ndarray,
    shifts: np.ndarray,
    rows: np.ndarray,
) -> None:
    """∂f/∂x at one point x (n,) into J (m, n), in output units per input unit."""
    n, h, m = x.size, factors.shape[0], J.shape[0]
    r = factors.shape[1]
    for j in range(m):
        for i in range(n):
            J[j, i] = rows[1 + i, j] / half[i]
    for k in range(h):
        q = 0.0
        for a in range(r):
            v = -shifts[k, a]
            for i in range(n):
                v += factors[k, a, i] * ((x[i] - centre[i]) / half[i])
            q += v * v
        phi = math.exp(-q)
        for i in range(n):
            slope = 0.0
            for a in range(r):
                v = -shifts[k, a]
                for j in range(n):
                    v += factors[k, a, j] * ((x[j] - centre[j]) / half[j])
                slope += v * factors[k, a, i]
            slope *= -2.0 * phi / half[i]
            for j in range(m):
                J[j, i] += rows[1 + n + k, j] * slope
