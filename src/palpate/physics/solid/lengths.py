"""Inputs and lengths that no solve can mean: no numbers, or out of all proportion to the body by mistaken units."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.arguments import require_positive
from palpate.units import Range, bounds

__all__ = ["longest_side", "require_element", "require_finite", "require_lengths", "require_near"]

FLATTEST = (
    20.0  # radius over the body's longest side: larger spheres are flat, millimetres taken for metres larger
)
# of interactions, in m, and how many times the body's longest side they may be
LENGTHS = {"radius": FLATTEST, "depth": 1.0, "stop": 1.0, "displacement": 1.0, "element": 1.0}


def longest_side(geometry: Any) -> float:
    """The body's longest side in m."""
    size = getattr(geometry, "size", None)
    if size is None:
        low, high = geometry.rest().corners
        size = high - low
    return float(np.max(size))


def require_lengths(interaction: Any, longest: float) -> None:
    """Refuse an interaction with a length that the body's longest side in m leaves no room for.

    Raises
    ------
    UsageError
        With the length and a hint on units.
    """
    for what, share in LENGTHS.items():
        for length in _numbers(getattr(interaction, what, None)):
            if abs(length) > share * longest:
                raise _too_long(f"The {what} of the {_kind(interaction)}", length, longest)


def require_element(element: Any, longest: float) -> None:
    """Refuse an element size that is not positive, or larger than the body.

    Raises
    ------
    UsageError
        With a hint on units.
    """
    require_positive("The element size of a problem", element, "m")
    if element > longest:
        raise _too_long("The element size of the problem", element, longest)


def require_finite(values: np.ndarray, ranges: Sequence[Range]) -> None:
    """Refuse inputs (n,) that are no finite numbers.

    Raises
    ------
    UsageError
        With the first one's name.
    """
    for value, given in zip(values.tolist(), ranges, strict=True):
        if not math.isfinite(value):
            raise UsageError(
                f"The input {given.name} is {value}.",
                why="It is no finite number: often the outcome of a division by zero, or a gap in a table.",
                fix=f"Pass finite numbers; the range of {given.name} is {given.low:.4g} … {given.high:.4g} "
                f"{given.unit}".rstrip()
                + ".",
            )


def require_near(points: np.ndarray, ranges: Sequence[Range], longest: float) -> None:
    """Refuse inputs (N, n) in m that are farther from their ranges than the body is long.

    Raises
    ------
    UsageError
        With the input and a hint on units.
    """
    low, high = bounds(ranges)
    beyond = np.maximum(low - points, points - high)
    beyond[:, [r.unit != "m" for r in ranges]] = 0.0
    beyond[~np.isfinite(beyond)] = 0.0  # what is no number is refused by its name
    if not beyond.size or beyond.max() <= longest:
        return
    row, column = divmod(int(np.argmax(beyond)), len(ranges))
    given = ranges[column]
    raise UsageError(
        f"The input {given.name} is {points[row, column]:g} m, far from the body.",
        why=f"Its range is {given.low:.4g} … {given.high:.4g} m, the body's longest side "
        f"{longest:.4g} m: out there nothing touches.",
        fix="Lengths are in m: pass 0.030 for 30 mm.",
    )


def _numbers(value: Any) -> Iterator[float]:
    """The numbers in a value, a range or several of them."""
    if isinstance(value, int | float):
        yield float(value)
    elif isinstance(value, tuple | list):
        for part in value:
            yield from _numbers(part)


def _kind(interaction: Any) -> str:
    return type(interaction).__name__


def _too_long(what: str, length: float, longest: float) -> UsageError:
    return UsageError(
        f"{what} is {length:g} m, the body's longest side {longest:.4g} m.",
        why="That is out of all proportion to the body.",
        fix="Lengths are in m: pass 0.010 for 10 mm.",
    )
