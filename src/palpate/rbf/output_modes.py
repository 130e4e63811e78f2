"""Output modes: the few directions in which many outputs move (proper orthogonal decomposition, Sirovich 1987).

every_mode      all that are there, to round-off: a least-squares cost stays exactly what it is
leading_modes   those that carry all but a share of the outputs: what is too small to be learnt is dropped
output_modes    a fixed number of them, as directions alone
"""

from __future__ import annotations

import numpy as np

__all__ = ["every_mode", "leading_modes", "output_modes"]

_ROUND_OFF = 1e-15  # share of the largest mode, below which modes are round-off


def every_mode(Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Y (R, m) = L (R, k) V (k, m) with orthonormal V and k the rank of Y, to round-off.

    A range finder with a fixed random matrix (Halko, Martinsson & Tropp 2011) where few modes carry all of Y,
    checked against Y itself; else a singular value decomposition.
    """
    R, m = Y.shape
    size = float(np.linalg.norm(Y))
    if m == 1 or size == 0.0:
        return Y, np.eye(m)
    k = 32
    while 4 * k < min(R, m):
        sample = Y @ np.random.default_rng(k).normal(size=(m, k))
        Q = np.linalg.qr(sample)[0]
        B = Q.T @ Y
        if np.linalg.norm(Y - Q @ B) <= 1e-14 * size:
            return _factored(Q, B)
        k *= 2
    return _factored(None, Y)


def _factored(Q: np.ndarray | None, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    U, s, V = np.linalg.svd(B, full_matrices=False)
    k = max(1, int((s > _ROUND_OFF * s[0]).sum()))
    latent = U[:, :k] * s[:k]
    return np.ascontiguousarray(latent if Q is None else Q @ latent), np.ascontiguousarray(V[:k])


def leading_modes(Y: np.ndarray, *, most: int, share: float = 1e-8) -> tuple[np.ndarray, np.ndarray]:
    """Y (N, m) ≈ L (N, k) V (k, m): the modes that carry all but a share of it, `most` at most.

    A range finder with one power iteration (Halko, Martinsson & Tropp 2011).
    """
    count = min(*Y.shape, most + 10)
    sample = Y @ np.random.default_rng(0).normal(size=(Y.shape[1], count))
    Q = np.linalg.qr(Y @ (Y.T @ np.linalg.qr(sample)[0]))[0]
    U, s, V = np.linalg.svd(Q.T @ Y, full_matrices=False)
    rest = np.sqrt(np.maximum(np.cumsum((s**2)[::-1])[::-1], 0.0))
    k = int(np.clip((rest > share * max(float(rest[0]), 1e-300)).sum(), 1, most))
    return np.ascontiguousarray(Q @ (U[:, :k] * s[:k])), np.ascontiguousarray(V[:k])


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
