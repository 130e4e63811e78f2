"""Nonlinear least squares in a few unknowns (Levenberg 1944; Marquardt 1963), without anything but NumPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

__all__ = ["descend", "slopes"]

STEPS = 200
STEEP, SHALLOW = 0.3, 5.0  # factors of the damping after a good and a bad step
FLAT = 1e15  # damping at which nothing falls any more
CLOSE = 1e-13  # relative change of the unknowns at which the search ends
STEP = 6e-6  # of the differences: cube root of the rounding error

Residual = Callable[[np.ndarray], np.ndarray]


def descend(
    residual: Residual, start: np.ndarray, jacobian: Callable[[np.ndarray], np.ndarray] | None = None
) -> np.ndarray:
    """Unknowns (k,) at which the squares of residual(x) (N,) sum to a local least.

    Parameters
    ----------
    residual : callable
        (k,) → (N,).
    start : (k,)
        Unknowns, scaled so that 1 is a large change.
    jacobian : callable, optional
        (k,) → (N, k); by central differences if it isn't given.
    """
    tangent = jacobian or (lambda x: slopes(residual, x))
    x = np.array(start, dtype=float)
    r, damping = residual(x), 1e-3
    for _ in range(STEPS):
        J = tangent(x)
        normal, pull = J.T @ J, J.T @ r
        while damping < FLAT:
            step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-300), pull)
            step /= max(1.0, float(np.abs(step).max()))
            trial = residual(x + step)
            if np.isfinite(trial).all() and trial @ trial <= r @ r:
                break
            damping *= SHALLOW
        else:
            return x
        x, r, damping = x + step, trial, max(STEEP * damping, 1e-15)
        if np.abs(step).max() <= CLOSE * (1 + np.abs(x).max()):
            return x
    return x


def slopes(residual: Residual, x: np.ndarray) -> np.ndarray:
    """∂residual/∂x (N, k) by central differences."""
    moves = STEP * np.eye(len(x))
    return np.stack([(residual(x + m) - residual(x - m)) / (2 * STEP) for m in moves], axis=1)
