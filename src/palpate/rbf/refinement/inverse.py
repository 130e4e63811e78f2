"""The inverse of an information matrix, whatever the data left open."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

__all__ = ["inverse"]


def inverse(information: np.ndarray) -> np.ndarray:
    """Of a positive definite matrix, by way of its scaled self; symmetric."""
    if not information.size:
        return information
    scale = 1.0 / np.sqrt(np.diag(information))
    scaled = information * scale[:, None] * scale
    try:
        found = cho_solve(cho_factor(scaled), np.eye(len(scaled)))
    except LinAlgError:
        # directions that the data do not see to working precision get the variance of what they barely see
        values, V = np.linalg.eigh(scaled)
        found = (V / np.maximum(values, 1e-14 * values[-1])) @ V.T
    found = found * scale[:, None] * scale
    return np.asarray((found + found.T) / 2)
