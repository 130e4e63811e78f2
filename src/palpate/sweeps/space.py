"""The space of inputs: named ranges with units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.units import Range, bounds

__all__ = ["Space"]


@dataclass(frozen=True)
class Space:
    """A box of n named ranges.

    Attributes
    ----------
    ranges : tuple of Range

    Raises
    ------
    UsageError
        Without ranges, or if two share a name.
    """

    ranges: tuple[Range, ...]

    def __init__(self, ranges: Sequence[Range]) -> None:
        object.__setattr__(self, "ranges", tuple(ranges))
        if not self.ranges or len(set(self.names)) < len(self.names):
            raise UsageError(
                "A space needs at least one range, each with a name of its own.",
                why=f"The names given are: {', '.join(self.names) or 'none'}.",
                fix="Name the ranges apart.",
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(r.name for r in self.ranges)

    @property
    def low(self) -> np.ndarray:
        """Lower ends, shape (n,)."""
        return bounds(self.ranges)[0]

    @property
    def high(self) -> np.ndarray:
        """Upper ends, shape (n,)."""
        return bounds(self.ranges)[1]

    def __len__(self) -> int:
        return len(self.ranges)

    def __iter__(self) -> Iterator[Range]:
        return iter(self.ranges)

    def __getitem__(self, name: str) -> Range:
        for r in self.ranges:
            if r.name == name:
                return r
        raise UsageError(
            f"There is no input called {name!r}.",
            why=f"The inputs are: {', '.join(self.names)}.",
            fix="Choose one of these.",
        )

    def to_unit(self, x: np.ndarray) -> np.ndarray:
        """Map points (..., n) of the space onto [0, 1]."""
        return np.asarray((np.asarray(x, dtype=float) - self.low) / (self.high - self.low))

    def from_unit(self, t: np.ndarray) -> np.ndarray:
        """Map points (..., n) of [0, 1] onto the space; 0 and 1 give its ends exactly."""
        t = np.asarray(t, dtype=float)
        return np.asarray(np.where(t == 1.0, self.high, self.low + t * (self.high - self.low)))

    def points(self, x: object) -> np.ndarray:
        """Check points and shape them as (N, n); a plain list will do for n = 1.

        Raises
        ------
        UsageError
            If they have another shape or are not finite. Points outside the ranges are allowed.
        """
        values = np.asarray(x, dtype=float)
        if values.ndim == 1 and len(self) == 1:
            values = values[:, None]
        if values.ndim != 2 or values.shape[1] != len(self) or not np.isfinite(values).all():
            raise UsageError(
                f"Points of shape {values.shape} can't be taken in this space.",
                why=f"It has {len(self)} inputs ({', '.join(self.names)}), and all values must be finite.",
                fix=f"Give an array of shape (N, {len(self)}).",
            )
        return values

    def __str__(self) -> str:
        return "Space of " + ", ".join(map(str, self.ranges))
