"""Names, SI units and ranges of the quantities that travel between palpate's parts.

Everything inside palpate is in SI units: m, N, Pa, kg/m³, s, rad. Other units exist only at the door: a study
file may say ``"110 GPa"``, and `parse_quantity` turns it into 1.1e11.
"""

from __future__ import annotations

import contextlib
import math
import numbers
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from palpate.errors import UsageError
from palpate.number_text import leading_number
from palpate.unit_text import conversion_to, usual_unit

__all__ = ["Quantity", "Range", "bounds", "parse_quantity"]


@dataclass(frozen=True)
class Quantity:
    """A named scalar output.

    Attributes
    ----------
    name : str
        For example ``"u_y at 1.0 m"``.
    unit : str
        SI unit, for example ``"m"``; ``""`` for a pure number.
    """

    name: str
    unit: str = ""


@dataclass(frozen=True)
class Range:
    """A named input and the interval of values it may take.

    Attributes
    ----------
    name : str
        What varies, for example ``"tip load"``; messages, reports and the page show it.
    low, high : float
        Ends of the interval in `unit`, ``low < high``.
    unit : str
        SI unit of both ends, for example ``"N"``; ``""`` for a pure number.

    Raises
    ------
    UsageError
        If the ends are not finite or not in order.
    """

    name: str
    low: float
    high: float
    unit: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise UsageError(
                f"The range of {self.name!r} is empty: {self.low} … {self.high} {self.unit}.",
                why="A range needs two finite ends, the lower one first.",
                fix="Swap the ends, or give the input a fixed value instead of a range.",
            )

    def __repr__(self) -> str:
        # roundings in the last digits of an end say nothing
        return f"Range({self.name!r}, {self.low:.12g}, {self.high:.12g}, {self.unit!r})"

    def __str__(self) -> str:
        return f"{self.name} {self.low + 0.0:g} … {self.high:g} {self.unit}".rstrip()


def bounds(ranges: Sequence[Range]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper ends of n ranges, each of shape (n,)."""
    return np.array([r.low for r in ranges]), np.array([r.high for r in ranges])


def parse_quantity(value: str | float, unit: str | None, name: str = "", *, bare: bool = False) -> float:
    """Return a quantity that a person has written, such as ``"110 GPa"`` or ``"10,5kPa"``, in an SI unit.

    Every text that means a quantity comes through here: a number, and then its unit. A decimal comma and marks between
    thousands are understood where they allow one reading, as in tables. So is a unit in the wrong case, such as that of
    ``"10 kpa"``.

    A number, which is no text, is taken to be in `unit` already. "" is a pure number, which a text may give in %, too;
    None is a quantity of any dimension, in SI base units. `name` is what it is, for messages, such as ``"--young"``.
    `bare` is True where a text without a unit, too, is a number in `unit`, as behind options whose help names the unit.
    Digits are rounded once.
    """
    try:
        if not isinstance(value, str):
            return _finite(value, unit or "")
        number = leading_number(value)
        factor, offset = _conversion(number.rest, unit if number.rest or not bare else "", value.strip())
        return _as_float(number.value * factor + offset, value.strip())
    except UsageError as error:
        what = f"{name}: {error.what}" if name else error.what
        raise UsageError(what, why=error.why, fix=error.fix) from error


def _as_float(value: Fraction, text: str) -> float:
    if value and not sys.float_info.min <= abs(value) <= sys.float_info.max:
        raise UsageError(
            f"{text!r} is beyond what a number in SI units can hold.", fix="Correct number and unit."
        )
    return float(value)


def _finite(value: object, unit: str) -> float:
    if not isinstance(value, bool) and isinstance(value, numbers.Real):
        with contextlib.suppress(OverflowError):  # of a whole number with 400 digits
            if math.isfinite(number := float(value)):
                return number
    raise UsageError(
        f"{value!r} is no finite number{f' in {unit}' if unit else ''}.",
        fix=f'Write a number, or a text with its unit, such as "10 {usual_unit(unit)}".' if unit else "",
    )


def _conversion(text: str, unit: str | None, whole: str) -> tuple[Fraction, Fraction]:
    """Return factor and offset from the unit of a text, of which `whole` is all, to the SI unit wanted."""
    if not text and unit:
        raise UsageError(
            f"{whole!r} has no unit.",
            fix=f'Write it with its unit, for example "{whole} {usual_unit(unit)}".',
        )
    if text in {"", "%"} and not unit:  # needs no registry of units, which costs a good half second
        return Fraction(1, 100 if text else 1), Fraction(0)
    try:
        return conversion_to(text, unit)
    except UsageError as error:
        wanted = (
            f"a quantity in {unit}" if unit else "a number or a quantity" if unit is None else "a pure number"
        )
        fix = f'Write for example "10 {usual_unit(unit)}".' if unit else "Write a number alone, such as 0.5."
        raise UsageError(
            f"{whole!r} is not {wanted}.", why=f"{error.what} {error.why}".strip(), fix=error.fix or fix
        ) from error
