"""Which solves are one column: depths over one place, pressed one after the other."""

from __future__ import annotations

import numpy as np

from palpate.surrogates import TouchedSurface

__all__ = ["columns_of"]

SAME_FOOT = 0.02  # of the radius: how near to each other two feet on the surface are one


def columns_of(X: np.ndarray, surface: TouchedSurface, radius: float) -> np.ndarray:
    """Number (N,) of each solve's column: those over one place of the surface, with the same further inputs.

    Parameters
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    surface : TouchedSurface
        At rest.
    radius : float
        Of the probe, m.
    """
    C = np.ascontiguousarray(X[:, :3])
    distance, normal, _ = surface.at(C)
    feet = np.round((C - distance[:, None] * normal) / (SAME_FOOT * radius))
    return np.asarray(np.unique(np.hstack([feet, X[:, 3:]]), axis=0, return_inverse=True)[1].ravel())
