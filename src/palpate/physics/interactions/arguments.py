"""Arguments that interactions check alike: directions, ranges and their names."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from palpate.errors import UsageError
from palpate.physics.arguments import require_number
from palpate.physics.words import number

__all__ = ["AXES", "Interval", "along", "axis_of", "direction_of", "interval", "range_of", "tag"]

Interval = float | tuple[float, float]
"""A fixed value, or the two ends between which an input varies."""

AXES = ("x", "y", "z")


def interval(what: str, value: Any, unit: str) -> Interval:
    """A finite number, or two finite numbers in ascending order.

    Raises
    ------
    UsageError
        For anything else, an empty range among it.
    """
    if isinstance(value, str) or not isinstance(value, Iterable):
        require_number(what, value, unit)
        _require_finite(what, float(value), unit)
        return float(value)
    ends = tuple(value)
    if len(ends) != 2:
        raise UsageError(
            f"{what} is {value!r}.",
            why=f"It is either one number in {unit}, which stays, or two, between which it varies.",
            fix="Give a number, or (low, high).",
        )
    for end in ends:
        require_number(what, end, unit)
        _require_finite(what, float(end), unit)
    low, high = float(ends[0]), float(ends[1])
    if low >= high:
        raise UsageError(
            f"The range of {what[0].lower()}{what[1:]} is empty: {low:g} … {high:g} {unit}.",
            why="A range needs two ends, the lower one first.",
            fix="Swap the ends, or give one number for a value that stays.",
        )
    return low, high


def range_of(what: str, value: Any, unit: str) -> tuple[float, float]:
    """Two ends of a range in ascending order.

    Raises
    ------
    UsageError
        For anything else, a single number among it.
    """
    ends = interval(what, value, unit)
    if isinstance(ends, tuple):
        return ends
    raise UsageError(
        f"{what} is the single number {ends:g} {unit}.",
        why="An input needs a range.",
        fix=f"Give (low, high) in {unit}; what stays is `Held` with a value within its range.",
    )


def _require_finite(what: str, value: float, unit: str) -> None:
    if not math.isfinite(value):
        raise UsageError(
            f"{what} is {value} {unit}.", why="It must be finite.", fix=f"Pass a finite number in {unit}."
        )


def direction_of(what: str, value: Any) -> tuple[float, float, float]:
    """A direction as a unit vector; ``"x"``, ``"-z"`` and the like stand for axes.

    Raises
    ------
    UsageError
        If it is neither an axis nor three numbers with a length.
    """
    if isinstance(value, str):
        axis, sign = axis_of(what, value)
        return (sign * (axis == 0) + 0.0, sign * (axis == 1) + 0.0, sign * (axis == 2) + 0.0)
    parts = tuple(value) if isinstance(value, Iterable) else (value,)
    if len(parts) != 3:
        raise UsageError(
            f"{what} is {value!r}.",
            why="A direction in space has three parts, along x, y and z.",
            fix='Give (x, y, z), or the name of an axis such as "-z".',
        )
    for part in parts:
        require_number(what, part)
    length = math.hypot(*parts)
    if not (math.isfinite(length) and length > 0):
        raise UsageError(
            f"{what} is {value!r}, without a length.",
            why="A direction needs a finite length above zero.",
            fix="Give (x, y, z), for example (0, 0, -1) for downwards.",
        )
    # adding zero turns -0.0 into 0.0, so that equal directions are written alike
    x, y, z = (part / length + 0.0 for part in parts)
    return x, y, z


def axis_of(what: str, value: str) -> tuple[int, float]:
    """Index and sign of an axis named ``"x"``, ``"+x"`` or ``"-x"``."""
    name, sign = value.strip().lower(), 1.0
    if name[:1] in {"+", "-"}:
        sign, name = (-1.0 if name[0] == "-" else 1.0), name[1:]
    if name not in AXES:
        raise UsageError(
            f"{what} is {value!r}.",
            why="Axes are x, y and z, with a sign if need be.",
            fix='Say "z" or "-z".',
        )
    return AXES.index(name), sign


def along(direction: tuple[float, float, float] | str) -> str:
    """A direction in words: the axis with its sign, else its parts."""
    if isinstance(direction, str):
        return direction
    size = max(map(abs, direction))
    axis = max(range(3), key=lambda i: abs(direction[i]))
    if size == 1.0:
        return ("-" if direction[axis] < 0 else "") + AXES[axis]
    return f"({', '.join(map(number, direction))})"


def tag(name: str, part: str) -> str:
    """Name of an input: that of its interaction, if it has one, and its own."""
    return f"{name} {part}" if name else part
