"""Output modes: the few directions in which many outputs move (proper orthogonal decomposition, Sirovich 1987)."""

from __future__ import annotations

import numpy as np

__all__ = ["output_modes"]


def output_modes(Y: np.ndarray, count: int) -> np.ndarray | None:
    """The `count` leading orthonormal directions (m, r) of scaled outputs (N, m); None if they are all directions.

    Through the smaller of the two Gram matrices, so many outputs cost no more than there are samples.
    """
    N, m = Y.shape
    r = min(count, N)
    if m <= r:
        return None
    if m <= N:
        return np.ascontiguousarray(np.linalg.eigh(Y.T @ Y)[1][:, : -r - 1 : -1])
    directions = Y.T @ np.linalg.eigh(Y @ Y.T)[1][:, : -r - 1 : -1]
    # the Gram matrix loses half the digits of small modes; orthogonalising restores what counts here
    return np.ascontiguousarray(np.linalg.qr(directions)[0])
