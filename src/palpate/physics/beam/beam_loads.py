"""Loads on beams: point loads, and loads with a history that bodies with memory answer to.

A load gives the values of its size that it runs through, as knots (time in s, size in N) between which it changes
evenly, from nothing at the time 0. Bodies that yield know no time: for them the time only counts the knots.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate import checks
from palpate.errors import UsageError
from palpate.units import Range

__all__ = ["Load", "LoadAndUnload", "PointLoad", "StepAndHold", "TipLoad", "as_loads"]


class Load(Protocol):
    """The members that a beam needs of a load."""

    @property
    def name(self) -> str:
        """Name of its size."""

    @property
    def at(self) -> float | None:
        """Place in m along the undeformed beam; ``None`` is the tip."""

    @property
    def direction(self) -> tuple[float, float]:
        """Direction (x, y), of length 1."""

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, ranges and units of its inputs."""

    def knots(self, values: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Return times in s and sizes in N that it runs through, of its inputs."""


@dataclass(frozen=True)
class PointLoad:
    """A dead force at one point of a beam; its size is an input, its direction stays.

    Attributes
    ----------
    name : str
        Name of the input.
    at : float or None
        Place in m along the undeformed beam where it acts; ``None`` is the tip.
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
        checks.finite(f"The lower end of the load {self.name!r}", self.low, "N")
        checks.finite(f"The upper end of the load {self.name!r}", self.high, "N")
        if self.at is not None:
            checks.finite(f"The position of the load {self.name!r}", self.at, "m")
        Range(self.name, self.low, self.high, "N")  # raises for an empty range
        x, y = _pair(self.name, self.direction)
        length = math.hypot(x, y)
        if length == 0:
            raise UsageError(
                f"The load {self.name!r} has no direction: {self.direction}.",
                why="A direction needs a length above zero.",
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
        """Return its one knot: a load without a history is put on first of all and stays."""
        return ((0.0, values[0]),)


def _pair(name: str, direction: object) -> tuple[float, float]:
    parts = tuple(direction) if isinstance(direction, Iterable) else (direction,)
    if len(parts) != 2:
        raise UsageError(
            f"The direction of the load {name!r} is {direction!r}.",
            why="It must be two numbers, along the beam and across it.",
            fix="Give (x, y), for example (0, -1) for downwards.",
        )
    x, y = (checks.finite(f"The direction of the load {name!r}", part) for part in parts)
    return x, y


def TipLoad(
    low: float,
    high: float,
    *,
    direction: tuple[float, float] = (0.0, -1.0),
    name: str = "P",
) -> PointLoad:
    """A load at the tip of a beam.

    Parameters
    ----------
    low, high : float
        Range of the load, N.
    direction : (2,)
        Its direction in the plane of the beam; by default it pushes down.
    name : str
        Name of the input.
    """
    return PointLoad(name, None, low, high, direction)


def as_loads(loads: Load | Sequence[Load]) -> tuple[Load, ...]:
    """Return one load or several, as a tuple that is not empty and has distinct names."""
    several = tuple(loads) if isinstance(loads, Iterable) else (loads,)
    for load in several:
        if not (hasattr(load, "inputs") and hasattr(load, "knots")):
            raise UsageError(
                f"{load!r} is no load.",
                why=f"It is of type {type(load).__name__}.",
                fix="Pass loads such as TipLoad(0, 5), with their ranges in N.",
            )
    names = [entry.name for load in several for entry in load.inputs]
    if not names or len(set(names)) < len(names):
        raise UsageError(
            "A sweep needs at least one load, each with a name of its own.",
            why=f"The names given are: {', '.join(names) or 'none'}.",
            fix="Name the loads apart, for example 'P_x' and 'P_y'.",
        )
    return several


@dataclass(frozen=True)
class LoadAndUnload:
    """A dead force that grows to a peak and then goes to its final size: what a body that yields remembers.

    Its two inputs are ``<name>_max`` and ``<name>``, both in N. A final size beyond the peak is a load that goes on
    growing.

    Attributes
    ----------
    name : str
        Name of the final size among the inputs.
    peak : tuple of two floats
        Range of the peak in N.
    final : tuple of two floats, optional
        Range of the final size in N; by default from 0 to the highest peak.
    at : float or None
        Place in m along the undeformed beam where it acts; ``None`` is the tip.
    direction : tuple of two floats
        Direction in the plane (x, y), normalised to length 1; the default pushes down.

    Raises
    ------
    UsageError
        For an empty range or a direction without length.
    """

    name: str
    peak: tuple[float, float]
    final: tuple[float, float] | None = None
    at: float | None = None
    direction: tuple[float, float] = (0.0, -1.0)

    def __post_init__(self) -> None:
        peak = _ends(f"The range of the peak of {self.name!r}", self.peak, "N")
        final = self.final if self.final is not None else tuple(sorted((0.0, max(peak, key=abs))))
        object.__setattr__(self, "peak", peak)
        object.__setattr__(self, "final", _ends(f"The final range of {self.name!r}", final, "N"))
        object.__setattr__(self, "direction", _point_load(self.name, self.at, self.direction).direction)
        _ = self.inputs  # raises for an empty range

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, ranges and units of the inputs."""
        assert self.final is not None
        return Range(f"{self.name}_max", *self.peak, "N"), Range(self.name, *self.final, "N")

    def knots(self, values: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Return times and sizes that the load runs through, of its inputs."""
        peak, final = values
        return (1.0, peak), (2.0, final)


@dataclass(frozen=True)
class StepAndHold:
    """A dead force that is put on and then held: what a viscoelastic body creeps under.

    Its two inputs are ``<name>`` in N and ``<name>_held``, the time in s since it has had its full size.

    Attributes
    ----------
    name : str
        Name of the size among the inputs.
    low, high : float
        Range of its size in N.
    held : tuple of two floats
        Range of the time for which it is held, in s, not negative.
    rise : float
        Time in s over which it grows evenly to its size; 0 puts it on at once.
    at : float or None
        Place in m along the undeformed beam where it acts; ``None`` is the tip.
    direction : tuple of two floats
        Direction in the plane (x, y), normalised to length 1; the default pushes down.

    Raises
    ------
    UsageError
        For an empty range, a negative time or a direction without length.
    """

    name: str
    low: float
    high: float
    held: tuple[float, float]
    rise: float = 0.0
    at: float | None = None
    direction: tuple[float, float] = (0.0, -1.0)

    def __post_init__(self) -> None:
        held = _ends(f"The range of the time for which {self.name!r} is held", self.held, "s")
        checks.finite(f"The time in which {self.name!r} rises", self.rise, "s")
        if held[0] < 0 or self.rise < 0:
            raise UsageError(
                f"The load {self.name!r} rises in {self.rise} s and is held for {held[0]} … {held[1]} s.",
                why="Times are finite and not negative.",
                fix="Give for example rise=0.5 and held=(0, 10).",
            )
        object.__setattr__(self, "held", held)
        checked = _point_load(self.name, self.at, self.direction)
        object.__setattr__(self, "direction", checked.direction)
        _ = self.inputs  # raises for an empty range

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, ranges and units of the inputs."""
        for what, end in (("lower", self.low), ("upper", self.high)):
            checks.finite(f"The {what} end of the load {self.name!r}", end, "N")
        return Range(self.name, self.low, self.high, "N"), Range(f"{self.name}_held", *self.held, "s")

    def knots(self, values: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Return times and sizes that the load runs through, of its inputs."""
        size, held = values
        return (self.rise, size), (self.rise + held, size)


def _ends(what: str, pair: object, unit: str) -> tuple[float, float]:
    if not (isinstance(pair, tuple | list) and len(pair) == 2):
        raise UsageError(
            f"{what} is {pair!r}.",
            why=f"It must be two numbers in {unit}.",
            fix="Give for example (0.0, 10.0).",
        )
    low, high = (checks.finite(what, end, unit) for end in pair)
    return low, high


def _point_load(name: str, at: float | None, direction: tuple[float, float]) -> PointLoad:
    """Return a point load of this place and direction, for its checks."""
    return PointLoad(name, at, 0.0, 1.0, direction)
