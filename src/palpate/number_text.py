"""Numbers as people write them: decimal points or commas, groups of thousands, and powers of ten.

One grammar serves the cells of a table, the options of the command line, study files and the page. A mark that allows
two readings, such as that of 1,234, is never guessed at.
"""

from __future__ import annotations

import re
import sys
import unicodedata
from dataclasses import dataclass
from fractions import Fraction

from palpate.errors import UsageError

__all__ = [
    "BODY",
    "GROUPED",
    "NumberText",
    "leading_number",
    "number_list",
    "plain_digits",
    "plain_text",
    "whole_number",
]

# blanks, apostrophe and minus of typesetting, and what programs write instead
_MARKS = str.maketrans({"\xa0": " ", "\u202f": " ", "\u2009": " ", "’": "'", "−": "-"})

BODY = r"(?:[0-9](?:[0-9.,' ]*[0-9])?|[.,][0-9]+)"
"""Pattern of a number without sign and power; `plain_digits` says whether its marks make sense."""

GROUPED = re.compile(r"[1-9][0-9]{0,2}(?:([.,' ])[0-9]{3})(?:\1[0-9]{3})*")
"""Pattern of a whole number in groups of thousands."""

_LONGEST = 200  # characters of a text; a float has 17 digits and a power of at most 324
_NUMBER = re.compile(
    rf"(?P<sign>[+-]? ?)(?P<body>{BODY})(?P<point>\.(?![0-9.,]))?"
    r"(?:[eE](?P<exponent>[+-]?[0-9]+)| ?× ?10(?P<raised>[⁺⁻]?[⁰¹²³⁴-⁹]+))?"
)
_RECIPROCAL = re.compile(r" +(?=1 ?/)")  # before a unit such as 1/s, whose 1 belongs to no number
_RAISED = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")


@dataclass(frozen=True)
class NumberText:
    """The number at the beginning of a text, and what follows it."""

    value: Fraction  # the number, exactly
    rest: str  # the text behind it, without blanks around it


def plain_text(text: str) -> str:
    """Return a text with plain blanks, apostrophes and minus signs, and without blanks around it."""
    return text.translate(_MARKS).strip()


def plain_digits(body: str, decimal: str) -> str | None:
    """Return the digits of a number with a decimal point, if they are one with this decimal mark; else None."""
    whole, mark, fraction = body.partition(decimal)
    if mark and not re.fullmatch(r"[0-9]*", fraction):
        return None
    if whole and not re.fullmatch(r"[0-9]+", whole):
        match = GROUPED.fullmatch(whole)
        if match is None or match[1] == decimal:
            return None
        whole = whole.replace(match[1], "")
    return f"{whole}.{fraction}" if mark and (whole or fraction) else whole or None


def leading_number(text: str) -> NumberText:
    """Return the number at the beginning of a text, such as ``"10,5kPa"`` or ``"−1 000 mm"``, exactly, and the rest.

    A comma that allows two readings, and a number too large or too small for a float, are refused.
    """
    shown = text.strip()
    if not shown:
        raise UsageError("The number is missing.", fix="Write a number, such as 0.5.")
    if len(shown) > _LONGEST:
        raise UsageError(
            f"'{shown[:20]}…' has {len(shown)} characters: no number needs so many.",
            fix=f"Write it with {_LONGEST} characters at most.",
        )
    plain = plain_text(text)
    first, *unit = _RECIPROCAL.split(plain, maxsplit=1)
    match = _NUMBER.match(first)
    if match is None or (unit and match.end() < len(first)):
        raise _no_number(shown, plain)
    exponent = match["exponent"] or (match["raised"] or "0").translate(_RAISED)
    digits = _digits(shown, match["body"], powered=bool(match["exponent"] or match["raised"]))
    value = _exact(shown, ("-" if "-" in match["sign"] else "") + digits, exponent)
    return NumberText(value, unit[0] if unit else first[match.end() :].strip())


def whole_number(text: str) -> int:
    """Return a whole number, exactly."""
    number = leading_number(text)
    if number.rest or number.value.denominator != 1:
        raise UsageError(
            f"{text.strip()!r} is no whole number.", fix="Write it with digits alone, such as 40."
        )
    return int(number.value)


def number_list(text: str) -> list[str]:
    """Return the parts of a list of numbers; blanks, or else commas, stand between them.

    So "0,5 0,3" and "0,5, 0,3" are two numbers with decimal commas, and never four.
    """
    plain = plain_text(text)
    return re.split(r" *, +" if ", " in plain else r" +" if " " in plain else ",", plain)


def _digits(shown: str, body: str, *, powered: bool) -> str:
    """Return digits with a decimal point; a single comma before three digits is refused, for it may be either mark."""
    point, comma = plain_digits(body, "."), plain_digits(body, ",")
    if point is None and comma is None:
        raise UsageError(
            f"{shown!r}: the marks in {body!r} make no number.",
            why="A number has one decimal mark, and three digits between the marks of thousands.",
            fix="Write it with a decimal point and without marks between thousands: 1234.5.",
        )
    if point is not None and comma is not None and "," in body and not powered:
        raise UsageError(
            f"{shown!r}: {body} may be {comma} or {point}.",
            why="The comma may be a decimal mark or stand between thousands.",
            fix=f"Write {comma} or {point}.",
        )
    # of two readings, the point of 1.234 is decimal, as programs write it; nobody groups digits before a power of ten
    return comma if point is None or (comma is not None and "," in body) else point  # type: ignore[return-value]


def _exact(shown: str, digits: str, exponent: str) -> Fraction:
    """Return a number exactly; one that no float is near to is refused, before its digits are written out."""
    nearest = abs(float(f"{digits}e{exponent}"))
    something = any(digit in "123456789" for digit in digits)
    if nearest > sys.float_info.max or (something and nearest < sys.float_info.min):
        raise UsageError(
            f"{shown!r} is too {'large' if nearest > 1 else 'small'} a number.",
            why=f"Numbers here have sizes between {sys.float_info.min:.2g} and {sys.float_info.max:.2g}.",
            fix="Correct its power of ten.",
        )
    return Fraction(f"{digits}e{exponent}") if something else Fraction(0)


def _no_number(shown: str, plain: str) -> UsageError:
    """Return the error of a text that does not begin with a number; it names a character that no number has."""
    strange = next((c for c in plain if not c.isascii() and c not in "×µμ°²³"), None)
    why = "A text that means a quantity begins with a number."
    if strange is not None:
        why = f"{strange!r} ({unicodedata.name(strange, 'no character').lower()}) belongs to no number here."
    elif plain.lower().lstrip("+-").startswith(("inf", "nan")):
        why = "A number is finite here."
    return UsageError(
        f"{shown!r} is no number.", why=why, fix="Write a number with digits 0 to 9, such as 0.5."
    )
