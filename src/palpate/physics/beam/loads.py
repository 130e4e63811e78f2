"""Point loads: the inputs of a sweep that are forces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import UsageError
from palpate.physics.arguments import require_number
from palpate.units import Range

__all__ = ["Load", "PointLoad", "TipLoad"]


class Load(Protocol):
    """What a beam asks of a load."""

    @property
    def name(self) -> str:
        """Name of its size."""

    @property
    def at(self) -> float | None:
        """Where it acts, in m along the undeformed beam; ``None`` is the tip."""

    @property
    def direction(self) -> tuple[float, float]:
        """Direction (x, y), of length 1."""

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, ranges and units of its inputs."""

    def knots(self, values: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Times in s and sizes in N that it runs through, of its inputs."""


@dataclass(frozen=True)
class PointLoad:
    """A dead force at one point of a beam; its size is an input, its direction stays.

    Attributes
    ----------
    name : str
        Name of the input.
    at : float or None
        Where it acts, in m along the undeformed beam; ``None`` is the tip.
    low, high : float
        Range of its size in N; a negative size reverses the direction.
    direction : tuple of two floats
        Direction in the plane (x, y), normalised to length 1; the default pushes down.

    Raises
    ------
    UsageError
        For an empty range or a direction without length.
    """

    name: str
    at: float | None
    low: float
    high: float
    direction: tuple[float, float] = (0.0, -1.0)

    def __post_init__(self) -> None:
        require_number(f"The lower end of the load {self.name!r}", self.low, "N")
        require_number(f"The upper end of the load {self.name!r}", self.high, "N")
        if self.at is not None:
            require_number(f"The position of the load {self.name!r}", self.at, "m")
        Range(self.name, self.low, self.high, "N")  # raises for an empty range
        x, y = _pair(self.name, self.direction)
        length = math.hypot(x, y)
        if not (math.isfinite(length) and length > 0):
            raise UsageError(
                f"The load {self.name!r} has no direction: {self.direction}.",
                why="A direction needs a finite length above zero.",
                fix="Give (x, y), for example (0, -1) for downwards.",
            )
        # adding zero turns -0.0 into 0.0, so that equal directions are written alike
        object.__setattr__(self, "direction", (x / length + 0.0, y / length + 0.0))

    @property
    def range(self) -> Range:
        """The input's name, range and unit."""
        return Range(self.name, self.low, self.high, "N")

    @property
    def inputs(self) -> tuple[Range, ...]:
        """The one input: its size."""
        return (self.range,)

    def knots(self, values: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """A load without a history is put on first of all and stays."""
        return ((0.0, values[0]),)


def _pair(name: str, direction: object) -> tuple[float, float]:
    parts = tuple(direction) if isinstance(direction, Iterable) else (direction,)
    if len(parts) != 2:
        raise UsageError(
            f"The direction of the load {name!r} is {direction!r}.",
            why="It must be two numbers, along the beam and across it.",
            fix="Give (x, y), for example (0, -1) for downwards.",
        )
    for part in parts:
        require_number(f"The direction of the load {name!r}", part)
    return float(parts[0]), float(parts[1])


def TipLoad(
    low: float,
    high: float,
    *,
    direction: tuple[float, float] = (0.0, -1.0),
    name: str = "P",
) -> PointLoad:
    """A load at the tip of a beam, between `low` and `high` N; by default it pushes down."""
    return PointLoad(name, None, low, high, direction)


def as_loads(loads: Load | Sequence[Load]) -> tuple[Load, ...]:
    """One load or several, as a tuple with distinct names.

    Raises
    ------
    UsageError
        Without loads, or if two share a name.
    """
    several = tuple(loads) if isinstance(loads, Iterable) else (loads,)
    for load in several:
        if not (hasattr(load, "inputs") and hasattr(load, "knots")):
            raise UsageError(
                f"{load!r} is no load.",
                why=f"It is of type {type(load).__name__}.",
                fix="Pass loads such as TipLoad(0, 5), with their ranges in N.",
            )
    names = [one.name for load in several for one in load.inputs]
    if not names or len(set(names)) < len(names):
        raise UsageError(
            "A sweep needs at least one load, each with a name of its own.",
            why=f"The names given are: {', '.join(names) or 'none'}.",
            fix="Name the loads apart, for example 'P_x' and 'P_y'.",
        )
    return several
