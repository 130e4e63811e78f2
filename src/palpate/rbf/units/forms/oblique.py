"""Units of rank r < n: constant but along r oblique directions, the rows of A; rank 1 is a ridge g((a·x − b)²).

θ = (A row by row (r n), b (r)). Ridges do not decay, so their places say nothing of where data were.
"""

from __future__ import annotations

import numpy as np

__all__ = ["Oblique"]


class Oblique:
    """Units of rank r and n inputs; see `Form` for the contract."""

    def __init__(self, inputs: int, rank: int) -> None:
        self.name = f"rank-{rank}"
        self.inputs, self.rank = inputs, rank
        self.size = rank * (inputs + 1)
        self.rows = np.repeat(np.arange(rank), inputs)
        self.columns = np.tile(np.arange(inputs), rank)

    def factors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (h, r, n) and b (h, r)."""
        e = self.rank * self.inputs
        return theta[:, :e].reshape(len(theta), self.rank, self.inputs), theta[:, e:]

    def centres(self, theta: np.ndarray) -> np.ndarray:
        """The points (h, n) of A μ = b nearest to the origin."""
        A, b = self.factors(theta)
        return np.array([np.linalg.pinv(a) @ s for a, s in zip(A, b, strict=True)]).reshape(-1, self.inputs)

    def unit(self, x: np.ndarray, width: float, seed: int = 0) -> np.ndarray:
        """θ (p,) of a unit through x (n,) along r random orthogonal directions, 1/width long."""
        drawn = np.random.default_rng(seed).normal(size=(self.inputs, self.rank))
        A = np.linalg.qr(drawn)[0].T / width
        return np.concatenate([A.ravel(), A @ x])

    def pull(self, theta: np.ndarray, by_entry: np.ndarray, by_shift: np.ndarray) -> np.ndarray:
        """The numbers are the entries themselves."""
        return np.concatenate([by_entry, by_shift], axis=-1)

    def stride(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Largest change of A x − b at the range's ends, in widths."""
        if not theta.size:
            return 0.0
        A, b = self.factors(step)
        return float(np.sqrt((A * A).sum(axis=2) + b * b).max())

    def variances(self, centre: float, width: float) -> np.ndarray:
        """Prior variances (p,): `width` for directions, `centre` for shifts."""
        e = self.rank * self.inputs
        return np.concatenate([np.full(e, width), np.full(self.rank, centre)])
