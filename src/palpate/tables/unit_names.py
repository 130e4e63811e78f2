"""Names and units in the head of a table, and columns in SI units.

A unit stands in the head as ``x [mm]``, ``x (mm)``, ``x / mm`` or ``x in mm``, or in a row of its own. Square brackets
always hold a unit, the other forms where what stands there is a unit that is known.
"""

from __future__ import annotations

import functools
import re

from palpate.errors import UsageError
from palpate.unit_text import si_conversion

__all__ = ["is_unit", "name_and_unit", "plain_unit", "si_unit"]

_SQUARE = re.compile(r"(?P<name>[^\[\]]*?)\s*\[(?P<unit>[^\[\]]*)\]")
_ROUND = re.compile(r"(?P<name>.*\S)\s*\((?P<unit>[^()]*)\)")
_BEHIND = re.compile(r"(?P<name>.*\S)(?:\s*/\s*|\s+in\s+)(?P<unit>\S.*)")
_WRAPPED = re.compile(r"\[\s*(?P<square>[^\[\]]*?)\s*\]|\(\s*(?P<round>[^()]*?)\s*\)")
_PURE = {"", "-", "–", "—", "1", "none", "dimensionless"}

_PREFIXED = "m|s|g|N|Pa|J|W|V|A|K|Hz|mol|Ohm|L|l|gf|bar|rad"
_BARE = "min|h|deg|°|°C|degC|degF|°F|in|inch|ft|lb|lbf|psi|rpm|%|C|sec|atm|eV|cycles?|rev"
_SYMBOL = re.compile(rf"(?:(?:da|[fpnuµmcdhkMGT])?(?:{_PREFIXED})|{_BARE})")
_WORDS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sekunde", "sekunden"), "s"),
    **dict.fromkeys(("msec", "msecs", "milliseconds"), "ms"),
    **dict.fromkeys(("mins", "minute", "minutes", "minuten"), "min"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours", "stunden"), "h"),
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("volt", "volts"), "V"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("pct", "percent", "prozent"), "%"),
    **dict.fromkeys(("count", "counts", "cts", "samples", "#"), "1"),
}
"""Words and abbreviations that machines write for a unit, in lower case."""
_CAPITALS = {"SEC": "s", "MM": "mm", "KN": "kN", "KPA": "kPa", "MPA": "MPa", "GPA": "GPa"}
"""Spellings of machines without small letters; of small ones mPa is another unit."""
_LETTERS = re.compile(r"[^\W\d_]+|#")
_PARTS = re.compile(r"[\s·⋅*/().]+")
_POWER = re.compile(r"(?:\*\*|\^)?[-⁻]?[\d²³¹⁰⁴-⁹]+$")
_NO_UNIT_ALONE = {"C", "h", "A", "K", "l", "L", "in"}  # in a row of words one of these is a word


def name_and_unit(cell: str) -> tuple[str, str]:
    """Return the name of a column and its unit as they stand in the head; "" where no unit does."""
    text = " ".join(cell.split())
    if match := _SQUARE.fullmatch(text):
        return match["name"], plain_unit(match["unit"])
    for form in (_ROUND, _BEHIND):
        if (match := form.fullmatch(text)) and is_unit(match["unit"]):
            return match["name"], plain_unit(match["unit"])
    return text, ""


def plain_unit(cell: str) -> str:
    """Return a unit without brackets, with one kind of µ, words as symbols: Sec is s; "1" for a pure number."""
    text = cell.strip()
    if match := _WRAPPED.fullmatch(text):
        text = match["square"] if match["square"] is not None else match["round"]
        text = text.strip() or "1"
    text = text.replace("μ", "µ")
    text = _LETTERS.sub(lambda m: _CAPITALS.get(m[0]) or _WORDS.get(m[0].lower(), m[0]), text)
    return "1" if text and text.lower() in _PURE else text


def is_unit(cell: str, *, among_words: bool = False) -> bool:
    """Return true of what is a unit: in brackets, a pure number's mark, or made of known symbols.

    With `among_words`, a single letter may as well be a name.
    """
    text = cell.strip()
    if _WRAPPED.fullmatch(text):
        return True
    text = plain_unit(text)
    if text == "1":
        return True
    if not text or (among_words and text in _NO_UNIT_ALONE):
        return False
    parts = [part for part in _PARTS.split(text) if part and part != "1"]
    return bool(parts) and all(_SYMBOL.fullmatch(_POWER.sub("", part) or "?") for part in parts)


@functools.cache
def si_unit(unit: str) -> tuple[float, float, str]:
    """Return factor, offset and SI unit: a value v in `unit` is factor · v + offset in the SI unit.

    The units "" and "1" are pure numbers.
    """
    text = plain_unit(unit)
    if text in {"", "1"}:
        return 1.0, 0.0, ""
    if text == "C":
        raise UsageError(
            "'C' may be degrees Celsius or coulombs.",
            fix="Write °C, or A s: in the head or by units= (--unit).",
        )
    if not is_unit(text):
        raise UsageError(
            f"{unit!r} is no unit that is known.",
            why="A column without a right unit would be taken for something else.",
            fix="Write it as mm, N, kPa, N/mm^2, 1/s or 1, or name the column's unit: units={'NAME': 'mm'} "
            "(--unit NAME=mm).",
        )
    factor, offset, name = si_conversion(text)
    if name and (factor, offset) == (1.0, 0.0):
        return factor, offset, text  # as it is written: N m is not J
    return factor, offset, "N m" if name == "J" and "N" in text else name
