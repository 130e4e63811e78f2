"""Names, SI units and ranges of the quantities that travel between palpate's parts.

Everything inside palpate is in SI units: m, N, Pa, kg/m³, s, rad. Other units exist only at the door: a study
file may say ``"110 GPa"``, and `to_si` turns it into 1.1e11.
"""

from __future__ import annotations

import functools
import math
import re
import tokenize
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["Quantity", "Range", "bounds", "registry", "si_conversion", "to_base_si", "to_si"]

# units in which quantities are stated, by what they measure; the first that fits is taken
_STATED: tuple[str, ...] = ("m", "m/s", "m/s²", "N", "N/m", "Pa", "J", "s", "Hz", "kg", "kg/m³", "m²", "m³")
_STATED += ("K", "rad", "rad/s", "W", "V", "A", "Pa s", "mol")
_ANGLE = re.compile(r"\b(rad|deg(?!C|F|_)|rpm|rev|turn|cycle)", re.IGNORECASE)
_SPELT = str.maketrans(
    {"µ": "u", "μ": "u", "·": "*", "⋅": "*", "²": "**2", "³": "**3", "^": "**", "°": "deg", "%": "percent"}
)

_DIGITS = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")


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


def _rounded_once(text: str, quantity: Any, unit: Any) -> float:
    """Return a quantity in a unit; its digits are rounded once where one unit is a whole number of the other.

    So "0.12 mm" is 0.00012 to the last bit, and not a rounded number times a rounded thousandth.
    """
    value = float(quantity.to(unit).magnitude)
    digits = _DIGITS.match(text)
    if not value or digits is None:
        return value
    share = float(registry().Quantity(1.0, unit).to(quantity.units).magnitude)
    factor = Fraction(1, round(share)) if share >= 1 else Fraction(round(1 / share)) if share > 0 else 0
    exact = float(Fraction(digits.group()) * factor)
    return exact if math.isclose(exact, value, rel_tol=1e-14) else value


def bounds(ranges: Sequence[Range]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper ends of n ranges, each of shape (n,)."""
    return np.array([r.low for r in ranges]), np.array([r.high for r in ranges])


@functools.cache
def registry() -> Any:
    """Return the one registry of units of Pint."""
    import pint  # costs about 0.3 s: only those who parse units pay

    return pint.UnitRegistry()


@functools.cache
def si_conversion(unit: str) -> tuple[float, float, str]:
    """Return factor, offset and SI unit: a value v in `unit` is factor · v + offset in the SI unit.

    Parameters
    ----------
    unit : str
        For example ``"mm"``, ``"N/mm²"`` or ``"°C"``; "" and "1" are pure numbers, whose SI unit is "".

    Raises
    ------
    UsageError
        If there is no such unit.
    """
    if unit.strip() in {"", "1"}:
        return 1.0, 0.0, ""
    import pint

    text = re.sub(r"\b(rev|cycles)\b", "turn", unit.translate(_SPELT))
    try:
        zero, one = (registry().Quantity(value, text).to_base_units() for value in (0.0, 1.0))
    except _no_quantity(pint) as error:
        raise UsageError(
            f"{unit!r} is no unit that is known.",
            why=f"{error}.",
            fix="Write it as mm, N, kPa, N/mm^2, 1/s, or 1 for a pure number.",
        ) from error
    factor, offset = float(one.magnitude - zero.magnitude), float(zero.magnitude)
    angular = bool(_ANGLE.search(text))
    for name in _STATED:
        if ("rad" in name) == angular and _stated(name).dimensionality == one.dimensionality:
            return factor, offset, name
    if one.dimensionless:
        return factor, offset, ""
    return factor, offset, unit if (factor, offset) == (1.0, 0.0) else f"{one.units:~C}".replace("**", "^")


def _stated(name: str) -> Any:
    return registry().Unit(name.translate(_SPELT).replace(" ", "*"))


def _no_quantity(pint: Any) -> tuple[type[Exception], ...]:
    """Return what Pint raises of a text that is no quantity.

    It reads texts as Python does and computes what they say: brackets that nobody closes are a `TokenError`, 1/0 an
    `ArithmeticError`, a thousand brackets a `RecursionError`.
    """
    read = (ValueError, TypeError, AttributeError, AssertionError, SyntaxError, tokenize.TokenError)
    return (pint.errors.PintError, *read, ArithmeticError, RecursionError)


def to_base_si(value: str) -> float:
    """Convert a quantity of any dimension, such as ``"110 GPa"``, to a number in SI base units.

    Parameters
    ----------
    value : str
        Text with a number and a unit; a number alone is a pure number.

    Raises
    ------
    UsageError
        If the text is no quantity.
    """
    import pint

    try:
        quantity = registry().Quantity(value)
        return _rounded_once(value.strip(), quantity, quantity.to_base_units().units)
    except _no_quantity(pint) as error:
        raise UsageError(
            f"{value!r} is no number and no quantity with a unit.",
            why=f"{error}.",
            fix='Write a number, or a quantity such as "110 GPa".',
        ) from error


def to_si(value: str | float, unit: str) -> float:
    """Convert a quantity such as ``"110 GPa"`` to a number in `unit`.

    Parameters
    ----------
    value : str or float
        Text with a number and a unit; a number alone is taken to be in `unit` already.
    unit : str
        The SI unit wanted, for example ``"Pa"``.

    Returns
    -------
    float
        The value in `unit`.

    Raises
    ------
    UsageError
        If the text is no quantity, or of another dimension than `unit`.
    """
    if not isinstance(value, str):
        return float(value)
    import pint

    try:
        quantity = registry().Quantity(value)
        if unit and quantity.unitless:
            raise UsageError(
                f"{value!r} has no unit.",
                why=f"As text a quantity needs one; as a number, without quotes, it is in {unit}.",
                fix=f'Write "{value.strip()} {unit}", or the number without quotes.',
            )
        return _rounded_once(value.strip(), quantity, unit or "dimensionless")
    except _no_quantity(pint) as error:
        raise UsageError(
            f"{value!r} is not a quantity in {unit or 'pure numbers'}.",
            why=f"{error}.",
            fix=f'Write a number in {unit}, or a quantity such as "1 {unit}".'
            if unit
            else "Write a number alone.",
        ) from error
