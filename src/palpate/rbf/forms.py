"""Forms of a unit: the free entries of its factor A, and the numbers θ that they are made of.

    φ = g(‖A x − b‖²),   A (r, n),   b (r,)

Centred   isotropic, axis-aligned and rotated units: a centre μ and widths σ. A is lower triangular with diagonal
          1/σ, and b = A μ. θ = (μ (n), log σ or σ (n, or one for all), entries of A below the diagonal
          (n (n − 1)/2, rotated only)). Isotropic: Platt 1991. Rotated: Singla, Subbarao & Junkins 2007; here AᵀA
          can't stop being positive definite, and a rotated unit whose lower entries are zero is the axis-aligned one.
Oblique   units of rank r < n: constant but along r oblique directions, the rows of A; rank 1 is a ridge
          g((a·x − b)²). θ = (A row by row (r n), b (r)). Ridges do not decay, so their places say nothing of where
          data were.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, Protocol

import numpy as np

from palpate.errors import UsageError

__all__ = ["Centred", "Form", "Oblique", "Widths", "chain_of", "unit_form"]

Widths = Literal["log", "plain"]


class Form(Protocol):
    """The contract of a form: p numbers θ_k of a unit make its factor A_k (r, n) and shift b_k (r,)."""

    name: str  # as `unit_form` takes it
    inputs: int  # n, inputs of the map
    rank: int  # r, rows of a factor
    size: int  # p, numbers of a unit
    rows: np.ndarray  # (e,) int, row of each entry of A that may differ from zero: the pattern
    columns: np.ndarray  # (e,) int, column of each of these entries

    def factors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (h, r, n) and b (h, r) of units θ (h, p)."""

    def unit(self, x: np.ndarray, width: float, seed: int = 0) -> np.ndarray:
        """θ (p,) of a unit at x (n,); `seed` decides directions where the form has them."""

    def centres(self, theta: np.ndarray) -> np.ndarray:
        """Points μ (h, n) with A μ = b, the nearest to the origin where there are many."""

    def pull(self, theta: np.ndarray, by_entry: np.ndarray, by_shift: np.ndarray) -> np.ndarray:
        """Chain rule: derivatives (…, h, e) by A's entries and (…, h, r) by b, to (…, h, p) by θ (h, p)."""

    def stride(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Longest move in a step (h, p): of a centre in widths, of a log width, of A x − b over the range."""

    def variances(self, centre: float, width: float) -> np.ndarray:
        """Prior variances (p,) from one for places and one for widths and directions."""


def chain_of(form: Form, theta: np.ndarray) -> np.ndarray:
    """∂(entries of A_k, b_k)/∂θ_k (h, e + r, p): the chain rule is linear, so this is `pull` of unit vectors."""
    h, e, r = len(theta), form.rows.size, form.rank
    each = np.broadcast_to(np.eye(e + r)[:, None], (e + r, h, e + r))
    return np.ascontiguousarray(form.pull(theta, each[..., :e], each[..., e:]).transpose(1, 0, 2))


@lru_cache(maxsize=64)
def unit_form(name: str, inputs: int, widths: Widths = "log") -> Form:
    """Return a form by name for n inputs: isotropic, axis-aligned, rotated, rank-1, rank-2, … up to rank n."""
    if name in {"isotropic", "axis-aligned", "rotated"}:
        return Centred(name, inputs, widths)
    rank = name.removeprefix("rank-")
    if rank != name and rank.isdecimal() and 1 <= int(rank) <= inputs:
        return Oblique(inputs, int(rank))
    raise UsageError(
        f"There is no form of unit {name!r} for {inputs} inputs.",
        fix=f"Choose isotropic, axis-aligned, rotated, or rank-1 to rank-{inputs}.",
    )


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
        """Chain rule with b = A μ: an entry A_ij acts directly and through b_i; μ_j acts through b."""
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
