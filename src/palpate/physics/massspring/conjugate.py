"""Conjugate gradients that stop where the curvature turns negative."""

from __future__ import annotations

import numpy as np

from palpate.physics.massspring.state import Tangent

__all__ = ["conjugate_gradients"]


def conjugate_gradients(
    tangent: Tangent, b: np.ndarray, tolerance: float, limit: int = 2000
) -> tuple[np.ndarray, bool]:
    """Solve H d = b.

    Newton's method with this inner solver is Algorithm 7.1 of Nocedal & Wright (2006): along a direction of negative
    curvature the solution so far is kept, which still leads downhill.

    Parameters
    ----------
    tangent : Tangent
    b : (node, 3) array
    tolerance : float
        Of the residual, relative to `b`.
    limit : int
        Largest number of products.

    Returns
    -------
    d : (node, 3) array
    solved : bool
        False where the curvature was negative or the limit was met.
    """
    d, r = np.zeros_like(b), b.copy()
    z = tangent.precondition(r)
    p, rz = z.copy(), float(np.vdot(r, z))
    target = tolerance * float(np.linalg.norm(b))
    for step in range(limit):
        if float(np.linalg.norm(r)) <= target:
            return d, True
        product = tangent.apply(p)
        curvature = float(np.vdot(p, product))
        if curvature <= 0.0:
            return (z if step == 0 else d), False
        alpha = rz / curvature
        d += alpha * p
        r -= alpha * product
        z = tangent.precondition(r)
        rz, before = float(np.vdot(r, z)), rz
        p = z + (rz / before) * p
    return d, False
