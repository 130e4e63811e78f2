"""Units with a centre and widths: A lower triangular with diagonal 1/σ, b = A μ.

θ = (μ (n), log σ or σ (n, or one for all), entries of A below the diagonal (n (n − 1)/2, rotated only)).

Isotropic: Platt 1991. Rotated: Singla, Subbarao & Junkins 2007; here AᵀA can't stop being positive definite,
and a rotated unit whose lower entries are zero is the axis-aligned one.
"""

from __future__ import annotations

import numpy as np

from palpate.rbf.units.forms.form import Widths

__all__ = ["Centred"]


class Centred:
    """Isotropic, axis-aligned or rotated units of n inputs; see `Form` for the contract."""

    def __init__(self, name: str, inputs: int, widths: Widths = "log") -> None:
        n = inputs
        rotated = name == "rotated"
        self.name, self.inputs, self.rank, self.log = name, n, n, widths == "log"
        below = np.tril_indices(n, -1) if rotated else (np.zeros(0, int), np.zeros(0, int))
        self._widths = 1 if name == "isotropic" else n
        self.rows = np.concatenate([np.arange(n), below[0]])
        self.columns = np.concatenate([np.arange(n), below[1]])
        self.size = n + self._widths + below[0].size

    def widths(self, theta: np.ndarray) -> np.ndarray:
        """σ (h, n): reciprocals of A's diagonal."""
        s = theta[:, self.inputs : self.inputs + self._widths]
        sigma = np.exp(s) if self.log else s
        return sigma if self._widths == self.inputs else np.repeat(sigma, self.inputs, axis=1)

    def centres(self, theta: np.ndarray) -> np.ndarray:
        """μ (h, n)."""
        return theta[:, : self.inputs]

    def of(self, centres: np.ndarray, widths: np.ndarray) -> np.ndarray:
        """θ (h, p) of units at centres (h, n) with widths (h, n) along the axes."""
        s = widths if self._widths > 1 else widths[:, :1]
        lower = np.zeros((len(centres), self.size - self.inputs - self._widths))
        return np.hstack([centres, np.log(s) if self.log else s, lower])

    def factors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (h, n, n) and b = A μ (h, n)."""
        n = self.inputs
        A, entries = np.zeros((len(theta), n, n)), self._entries(theta)
        A[:, self.rows, self.columns] = entries
        if self.rows.size == n:
            return A, theta[:, :n] * entries
        return A, np.einsum("kij,kj->ki", A, theta[:, :n])

    def _entries(self, theta: np.ndarray) -> np.ndarray:
        diagonal = 1.0 / self.widths(theta)
        if self.rows.size == self.inputs:
            return diagonal
        return np.hstack([diagonal, theta[:, self.inputs + self._widths :]])

    def unit(self, x: np.ndarray, width: float, seed: int = 0) -> np.ndarray:
        """θ (p,) of a round unit at x (n,)."""
        return np.asarray(self.of(x[None], np.full((1, self.inputs), width))[0])

    def pull(self, theta: np.ndarray, by_entry: np.ndarray, by_shift: np.ndarray) -> np.ndarray:
        """With b = A μ, an entry A_ij acts directly and through b_i; μ_j acts through b."""
        n, w = self.inputs, self._widths
        entries = self._entries(theta)
        out = np.empty((*by_entry.shape[:-1], self.size))
        through = by_shift[..., self.rows]
        total = by_entry + through * theta[:, self.columns]
        moved = through * entries
        out[..., :n] = moved[..., :n]
        for e in range(n, self.rows.size):
            out[..., self.columns[e]] += moved[..., e]
        diagonal = entries[:, :n]
        by_width = -total[..., :n] * (diagonal if self.log else diagonal * diagonal)
        out[..., n : n + w] = by_width if w == n else by_width.sum(axis=-1, keepdims=True)
        out[..., n + w :] = total[..., n:]
        return out

    def stride(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Centres in widths, log widths, and lower entries times the width that they act over."""
        if not theta.size:
            return 0.0
        n, w = self.inputs, self._widths
        sigma = self.widths(theta)
        size = np.abs(step)
        parts = [size[:, :n] / sigma, size[:, n : n + w] / (1.0 if self.log else sigma[:, :w])]
        if self.rows.size > n:
            parts.append(size[:, n + w :] * sigma[:, self.columns[n:]])
        return float(max(p.max() for p in parts))

    def variances(self, centre: float, width: float) -> np.ndarray:
        """Prior variances (p,): `centre` for μ, `width` for widths and rotation."""
        return np.concatenate([np.full(self.inputs, centre), np.full(self.size - self.inputs, width)])
