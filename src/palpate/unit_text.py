"""Units as people write them: of tables and files, behind numbers, and of one dimension or any."""

from __future__ import annotations

import functools
import math
import re
import tokenize
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

from palpate.errors import UsageError

__all__ = ["conversion_to", "registry", "si_conversion", "usual_unit"]

# units in which quantities are stated, by what they measure; the first that fits is taken
_STATED: tuple[str, ...] = ("m", "m/s", "m/s²", "N", "N/m", "Pa", "J", "s", "Hz", "kg", "kg/m³", "m²", "m³")
_STATED += ("K", "rad", "rad/s", "W", "V", "A", "Pa s", "mol")
_STATED += (
    "W/m²",
    "W/m³",
    "W/(m K)",
    "W/(m² K)",
    "J/(kg K)",
    "1/K",
    "m²/s",
    "m³/s",
    "kg/s",
)  # of heat and flow
_ANGLE = re.compile(r"\b(rad|deg(?!C|F|_)|rpm|rev|turn|cycle)", re.IGNORECASE)
_SPELT = str.maketrans(
    {"µ": "u", "μ": "u", "·": "*", "⋅": "*", "²": "**2", "³": "**3", "^": "**", "°": "deg", "%": "percent"}
)

_PIECE = re.compile(
    r" *(?:(?P<mark>[*·⋅/()])|(?P<one>1(?= ?/))|(?P<name>[A-Za-zµμΩÅ°%][A-Za-z0-9_]*)"
    r"(?P<power>(?:\^|\*\*) ?-?[0-9]{1,2}|-[0-9]|⁻?[¹²³⁴-⁹])?)"
)
_WITH_DIGIT = re.compile(r"(\D+)([234])")  # mm2
_POWERS = str.maketrans("⁻¹²³⁴⁵⁶⁷⁸⁹", "-123456789", "^* ")
_LONGEST = 60  # characters of a unit
_MOST = 300  # spellings of a unit that are looked at
_USUAL = {"m": "mm", "m^2": "mm^2", "m^3": "mm^3", "m^4": "mm^4", "Pa": "kPa"}


@functools.cache
def registry() -> Any:
    """Return the one registry of units of Pint."""
    import pint  # costs about 0.3 s: only those who parse units pay

    return pint.UnitRegistry()


@functools.cache
def si_conversion(unit: str) -> tuple[float, float, str]:
    """Return factor, offset and SI unit: a value v in `unit` is factor · v + offset in the SI unit.

    The unit is such as ``"mm"``, ``"N/mm²"`` or ``"°C"``; "" and "1" are pure numbers, whose SI unit is "".
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


def usual_unit(unit: str) -> str:
    """Return the unit in which people state what has this SI unit, for examples in messages."""
    return _USUAL.get(unit, unit)


def conversion_to(text: str, unit: str | None) -> tuple[Fraction, Fraction]:
    """Return factor and offset, exactly where they are short, from a unit as people write it to the SI unit wanted.

    A value v in the unit of the text is factor · v + offset in `unit`; "" is for pure numbers, None for any dimension.
    The text may be ``"kPa"``, ``"N/mm²"``, ``"mm2"`` or ``"kpa"``, whose case is wrong and can mean one thing only.
    Pint gets the unit alone.
    """
    pieces = list(_pieces(text))
    exact = _joined(pieces)
    fitting = [exact] if _fits(exact, unit) else []
    if not fitting:
        choices = [_spellings(piece) for piece in pieces]
        if math.prod(map(len, choices)) <= _MOST:
            fitting = [s for s in dict.fromkeys(map(_joined, product(*choices))) if _fits(s, unit)]
        if len(fitting) != 1 or unit is None:
            raise _wrong_unit(text, exact, fitting)
    factor, offset, _ = si_conversion(fitting[0])
    return _short(factor), _short(offset)


def _pieces(text: str) -> Iterator[str]:
    """Yield names with their powers, and marks, as Pint writes them; refuse all else, and a product below a slash."""
    if len(text) > _LONGEST:
        raise UsageError(f"'{text[:20]}…' has too many characters for a unit.")
    if text.count("%") > 1:
        raise UsageError(f"{text!r} is no unit: a share is in % once.")
    # place in the text; of each open bracket, whether a slash came; whether a name came last
    place, below, operand = 0, [False], False
    while place < len(text):
        match = _PIECE.match(text, place)
        if match is None:
            raise UsageError(f"{text[place:].strip()!r} does not belong to a unit.")
        place, mark = match.end(), match["mark"]
        if operand and (mark is None or mark == "("):
            yield "*"
        if below[-1] and ((operand and mark in {None, "("}) or mark in {"*", "·", "⋅"}):
            raise UsageError(
                f"What is below the slash of {text!r} is not clear.", fix="Write brackets, as in J/(kg K)."
            )
        if mark == "(":
            below.append(False)
        elif mark == ")" and len(below) > 1:
            below.pop()
        elif mark == "/":
            below[-1] = True
            if not operand:
                yield "1"
        operand = mark is None or mark == ")"
        yield (mark and mark.translate(_SPELT)) or match["one"] or _power(match["name"], match["power"] or "")


def _power(name: str, power: str) -> str:
    """Return a name with its power as Pint writes it: of mm², mm^2 and mm2 mm**2."""
    plain = name.translate(_SPELT)
    split = _WITH_DIGIT.fullmatch(plain)
    if split and not power and not registry().parse_unit_name(plain):
        plain, power = split.groups()
    return f"{plain}**{power.translate(_POWERS)}" if power else plain


def _joined(pieces: Sequence[str]) -> str:
    return re.sub(r"\b(rev|cycles)\b", "turn", "".join(pieces))


def _fits(text: str, unit: str | None) -> bool:
    """Return whether a text is a unit of the dimension of an SI unit; an angle is no pure number."""
    dimension = _dimension(text)
    if dimension is None or unit is None:
        return dimension is not None
    same_kind = bool(_ANGLE.search(text)) == bool(_ANGLE.search(unit))
    return same_kind and dimension == _dimension(unit.translate(_SPELT).replace(" ", "*"))


@functools.cache
def _dimension(text: str) -> Any:
    """Return the dimension of a unit, None where there is no such unit."""
    import pint

    try:
        return registry().Unit(text).dimensionality
    except _no_quantity(pint):
        return None


def _spellings(piece: str) -> list[str]:
    """Return a piece of a unit, and the units that it may mean where its letters have another case."""
    name, mark, power = piece.partition("**")
    if not name[:1].isalpha():
        return [piece]
    known = registry().parse_unit_name
    cases = (name, name.lower(), name.upper(), name[0].swapcase() + name[1:], name.swapcase())
    units = [prefix + unit for case in cases for prefix, unit, _ in known(case, case_sensitive=False)]
    symbols = dict.fromkeys(registry().get_symbol(unit) for unit in units)
    return [f"{symbol}{mark}{power}" for symbol in symbols if symbol.lower() == name.lower()] or [piece]


def _wrong_unit(text: str, exact: str, fitting: Sequence[str]) -> UsageError:
    """Return the error of a text that is no unit of the wanted dimension, or in the case of which several are."""
    shown = [f'"{spelling.replace("**", "^")}"' for spelling in fitting]
    if len(shown) > 1:
        return UsageError(
            f"{text!r} may mean {' or '.join(shown)}.",
            why="Small and capital letters make a difference: m is a thousandth, M a million.",
            fix=f"Write {' or '.join(shown)}.",
        )
    if _dimension(exact) is not None:
        return UsageError(f"{text!r} is a unit of something else.")
    return UsageError(f"There is no unit {text!r}.", fix=f"Did you mean {shown[0]}?" if shown else "")


def _short(value: float) -> Fraction:
    """Return a factor without the roundings in its last digits: a thousandth is one thousandth."""
    text = next(
        text for text in (f"{value:.12g}", repr(value)) if math.isclose(float(text), value, rel_tol=1e-14)
    )
    return Fraction(text)
