"""Radial functions g(q) of q = ‖A x − b‖², with their first three derivatives by q.

gaussian               exp(−q), the founding form (Platt 1991; papers that write exp(−q/2) have widths √2 smaller)
inverse-multiquadric   (1 + q)^−½ (Hardy 1971): decays slowly, so fewer units reach across the range
matern-5/2             (1 + s + s²/3) e^−s with s = √(5 q) (Stein 1999): twice differentiable at its centre
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

__all__ = ["RADIAL_FUNCTIONS", "RadialFunction", "radial", "third"]

RadialFunction = Literal["gaussian", "inverse-multiquadric", "matern-5/2"]
RADIAL_FUNCTIONS: tuple[RadialFunction, ...] = get_args(RadialFunction)


def radial(name: RadialFunction, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """g, dg/dq and d²g/dq² at squared distances q ≥ 0 of any shape; all finite at q = 0."""
    if name == "gaussian":
        g = np.exp(-q)
        return g, -g, g
    if name == "inverse-multiquadric":
        u = 1.0 / (1.0 + q)
        g = np.sqrt(u)
        return g, -0.5 * g * u, 0.75 * g * u * u
    s = np.sqrt(5.0 * q)
    e = np.exp(-s)
    return (1.0 + s + s * s / 3.0) * e, (-5.0 / 6.0) * (1.0 + s) * e, (25.0 / 12.0) * e


def third(name: RadialFunction, q: np.ndarray) -> np.ndarray:
    """d³g/dq³ at squared distances q ≥ 0 of any shape.

    That of matern-5/2 grows like q^−½ towards q = 0, where it counts as zero: in a derivative by place it comes
    with three factors of A x − b, whose product vanishes faster.
    """
    if name == "gaussian":
        return np.asarray(-np.exp(-q))
    if name == "inverse-multiquadric":
        u = 1.0 / (1.0 + q)
        return np.asarray(-1.875 * np.sqrt(u) * u * u * u)
    s = np.sqrt(5.0 * q)
    at_centre = q == 0
    return np.asarray(np.where(at_centre, 0.0, (-125.0 / 24.0) * np.exp(-s) / np.where(at_centre, 1.0, s)))
