"""Rotations by rotation vectors w in rad, whose direction is the axis and whose length is the angle.

R = exp [w]× = I + sin θ/θ [w]× + (1 − cos θ)/θ² [w]×² (Rodrigues' formula). When w changes by dw, the turn that is
added to R is J dw, in the frame of the body, with the left Jacobian (Solà, Deray & Atchuthan 2018, eq. 145)

    J = I + (1 − cos θ)/θ² [w]× + (θ − sin θ)/θ³ [w]×²

so a torque T, which works along turns, has the components Jᵀ T along the components of w.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["left_jacobian", "rotation_matrix", "rotation_vector", "swing_vector"]

SERIES = 1e-2  # rad; below it (θ − sin θ)/θ³ is taken from its series, which is exact there to rounding


def rotation_matrix(w: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 3, 3) of rotation vectors (..., 3) in rad."""
    K, angle = _cross_matrix(w), np.linalg.norm(w, axis=-1)[..., None, None]
    first, second = np.sinc(angle / math.pi), np.sinc(angle / (2 * math.pi)) ** 2 / 2
    return np.asarray(np.eye(3) + first * K + second * K @ K)


def left_jacobian(w: np.ndarray) -> np.ndarray:
    """Return the left Jacobians (..., 3, 3) of rotation vectors (..., 3) in rad."""
    K, angle = _cross_matrix(w), np.linalg.norm(w, axis=-1)[..., None, None]
    second = np.sinc(angle / (2 * math.pi)) ** 2 / 2
    series = 1 / 6 - angle**2 / 120 + angle**4 / 5040
    safe = np.maximum(angle, SERIES)
    third = np.where(angle < SERIES, series, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + second * K + third * K @ K)


def rotation_vector(R: np.ndarray) -> list[float]:
    """Return the rotation vector of a rotation (3, 3), rad, of an angle below π."""
    x, y, z = float(R[2, 1] - R[1, 2]), float(R[0, 2] - R[2, 0]), float(R[1, 0] - R[0, 1])
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    cosine = 0.5 * (float(R[0, 0] + R[1, 1] + R[2, 2]) - 1.0)
    factor = 0.5 if sine < 1e-8 else 0.5 * math.atan2(sine, cosine) / sine
    return [factor * x, factor * y, factor * z]


def swing_vector(before: np.ndarray, after: np.ndarray) -> list[float]:
    """Return the rotation vector in the x–y plane that turns one unit vector (3,) into another, rad."""
    dx, dy, _ = (after - before).tolist()
    size = math.hypot(dx, dy)
    if size < 1e-12:
        return [0.0, 0.0, 0.0]
    n = np.array(
        [-dy / size, dx / size, 0.0]
    )  # at right angles to the change, so both have the same part along it
    across = before - (n @ before) * n
    angle = math.atan2(float(n @ np.cross(across, after)), float(across @ after))
    return [angle * float(n[0]), angle * float(n[1]), 0.0]


def _cross_matrix(w: np.ndarray) -> np.ndarray:
    """Return the matrices (..., 3, 3) that take a vector v to w × v."""
    a, b, c = np.moveaxis(np.asarray(w, dtype=float), -1, 0)
    zero = np.zeros_like(a)
    rows = [np.stack(row, axis=-1) for row in ((zero, -c, b), (c, zero, -a), (-b, a, zero))]
    return np.stack(rows, axis=-2)
