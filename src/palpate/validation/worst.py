"""The sample at which a figure is largest, and the samples in the outer part of the range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.units import Range, bounds

__all__ = ["OUTER", "Worst", "outer_part"]

OUTER = 0.05
"""Share of an input's range at either end that counts as outer: 10 % of the range of one input."""


@dataclass(frozen=True)
class Worst:
    """The sample at which a figure is largest."""

    value: float  # the figure at this sample
    inputs: tuple[tuple[str, float, str], ...]  # name, value, unit of each
    place: str = ""  # node or output; may be empty

    @classmethod
    def of(cls, value: float, x: np.ndarray, ranges: Sequence[Range], place: str = "") -> Worst:
        """Return the worst case at inputs x (n,)."""
        named = tuple((r.name, float(v), r.unit) for r, v in zip(ranges, x, strict=True))
        return cls(float(value), named, place)

    def __str__(self) -> str:
        point = ", ".join(f"{name} = {value:.4g} {unit}".rstrip() for name, value, unit in self.inputs)
        return f"{self.place} under {point}" if self.place else f"at {point}"


def outer_part(X: np.ndarray, ranges: Sequence[Range], outer: float = OUTER) -> np.ndarray:
    """Return which samples X (N, n) have any input in the outer part of its range, bool of shape (N,)."""
    low, high = bounds(ranges)
    scaled = (X - low) / (high - low)
    # an input on the border to within round-off belongs to the rest
    return np.asarray(((scaled < outer - 1e-12) | (scaled > 1 - outer + 1e-12)).any(axis=1))
