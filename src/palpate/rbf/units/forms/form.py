"""The contract of a unit's form, and forms by name."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, Protocol

import numpy as np

from palpate.errors import UsageError

__all__ = ["Form", "Widths", "form"]

Widths = Literal["log", "plain"]


class Form(Protocol):
    """How the p numbers θ_k of a unit make its factor A_k (r, n) and shift b_k (r,).

    Attributes
    ----------
    name : str
    inputs, rank, size : int
        n, r and p.
    rows, columns : (e,) int
        Pattern: the entries of A that may differ from zero.
    """

    name: str
    inputs: int
    rank: int
    size: int
    rows: np.ndarray
    columns: np.ndarray

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


@lru_cache(maxsize=64)
def form(name: str, inputs: int, widths: Widths = "log") -> Form:
    """A form by name for n inputs: isotropic, axis-aligned, rotated, rank-1, rank-2, ….

    Raises
    ------
    UsageError
        If there is no such form, or the rank is not between 1 and n.
    """
    from palpate.rbf.units.forms.centred import Centred
    from palpate.rbf.units.forms.oblique import Oblique

    if name in {"isotropic", "axis-aligned", "rotated"}:
        return Centred(name, inputs, widths)
    rank = name.removeprefix("rank-")
    if rank != name and rank.isdecimal() and 1 <= int(rank) <= inputs:
        return Oblique(inputs, int(rank))
    raise UsageError(
        f"There is no form of unit {name!r} for {inputs} inputs.",
        fix=f"Choose isotropic, axis-aligned, rotated, or rank-1 to rank-{inputs}.",
    )
