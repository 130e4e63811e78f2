"""Numbers in the cells of a table: decimal points or commas, groups of thousands, and cells without a value.

One convention holds for a whole table, and is taken from cells that can mean one thing only: 0,5 has a decimal comma,
1,234.5 a decimal point and groups. Where all that is there is 1,234, nobody can know, and the table is refused.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from palpate.errors import UsageError
from palpate.number_text import BODY, GROUPED, plain_digits, plain_text

__all__ = ["Cell", "Numerals", "is_missing", "is_numeral"]

Cell: TypeAlias = tuple[int, str]  # the number of its line, and its text

_MISSING = {
    "",
    "-",
    "--",
    "–",
    "—",
    "?",
    "nan",
    "+nan",
    "-nan",
    "nan(ind)",
    "-nan(ind)",
    "1.#qnan",
    "-1.#ind",
    "1.#ind",
}
_MISSING |= {"na", "n/a", "n.a.", "#n/a", "#nv", "#na", "null", "none", "nil", "missing"}
_SHAPE = re.compile(rf"[+-]?(?P<body>{BODY}[.,]?)(?P<exponent>(?:[eEdD][+-]?|[+-])[0-9]+)?")
_PLAIN = frozenset("0123456789+-.eE \n")


def is_missing(cell: str) -> bool:
    """Return true of a cell that holds no value: an empty one, NaN, NA, -, and the like."""
    return cell.strip().lower() in _MISSING


def is_numeral(cell: str) -> bool:
    """Return true of a cell that is a number in some convention."""
    match = _SHAPE.fullmatch(plain_text(cell))
    return match is not None and (
        plain_digits(match["body"], ".") is not None or plain_digits(match["body"], ",") is not None
    )


@dataclass(frozen=True)
class Numerals:
    """Convention by which numbers are written.

    The one of "." and "," that is not the decimal mark may stand between groups of three digits, as blanks and
    apostrophes may.
    """

    decimal: str = "."  # the decimal mark, "." or ","

    @classmethod
    def of(cls, columns: Sequence[Sequence[Cell]], separator: str | None) -> Numerals:
        """Find the convention of a table.

        `columns` are those that hold numbers; where commas separate cells, a decimal comma would have to be quoted.
        Cells that contradict each other or allow more than one reading are refused by line and cell.
        """
        evidence = _Evidence.of(columns)
        comma, dot = evidence.decimal[","], evidence.decimal["."]
        if comma and dot:
            raise _contradiction(comma, dot)
        for mark, shown, other in ((",", comma, "."), (".", dot, ",")):
            unsure = evidence.unsure[other]
            if shown and unsure and not evidence.groups[other]:
                raise _ambiguity(unsure, f"Line {shown[0]} holds {shown[1]!r}, with a decimal {_NAMES[mark]}")
            if shown:
                return cls(mark)
        if evidence.unsure[","]:
            raise _ambiguity(evidence.unsure[","], "No other cell tells")
        mixed = None if separator == "," else _grouped_by_dots(columns)
        if mixed:
            raise _ambiguity(mixed, "Numbers without a point stand in the same column")
        return cls(".")

    def values(self, cells: Sequence[str]) -> np.ndarray:
        """Return the numbers (N,) of cells; not-a-number where one holds no value, or is no number.

        `first_fault` names the latter.
        """
        text = "\n".join(cells)
        if self.decimal == ",":  # a point could only stand between thousands
            text = "grouped" if "." in text else text.replace(",", ".")
        if set(text) <= _PLAIN:
            try:
                return np.fromiter(map(float, text.split("\n")), dtype=np.float64, count=len(cells))
            except ValueError:  # an empty cell, groups of thousands, or no number
                pass
        return np.array([self._value(cell) for cell in cells], dtype=np.float64)

    def first_fault(self, cells: Iterable[str]) -> int | None:
        """Return the index of the first cell that is neither a finite number nor without a value."""
        for i, cell in enumerate(cells):
            if not np.isfinite(self._value(cell)) and not is_missing(cell):
                return i
        return None

    def _value(self, cell: str) -> float:
        match = _SHAPE.fullmatch(plain_text(cell))
        if match is None:
            return np.nan
        body = plain_digits(match["body"], self.decimal)
        if body is None:
            return np.nan
        exponent = (match["exponent"] or "").upper().replace("D", "E")
        if exponent and exponent[0] != "E":  # Fortran leaves the letter out before three digits
            exponent = f"E{exponent}"
        sign = "-" if plain_text(cell).startswith("-") else ""
        return float(sign + body + exponent)


_NAMES = {",": "comma", ".": "point"}


@dataclass
class _Evidence:
    """Cells that show a convention: by the decimal mark, by the mark between groups, and those that allow two."""

    decimal: dict[str, Cell | None]
    groups: dict[str, Cell | None]
    unsure: dict[str, Cell | None]

    @classmethod
    def of(cls, columns: Sequence[Sequence[Cell]]) -> _Evidence:
        none: dict[str, Cell | None] = {",": None, ".": None}
        found = cls(dict(none), dict(none), dict(none))
        for mark in ",.":
            for cell in itertools.chain.from_iterable(columns):
                if mark in cell[1]:
                    found._add(cell)
                    if found.decimal[mark]:
                        break
        for cell in itertools.chain.from_iterable(columns):  # what may contradict it
            commas, dots = cell[1].count(","), cell[1].count(".")
            if (
                commas + dots > 1
                or (dots and found.decimal[","] is not None)
                or (commas and found.decimal["."] is not None)
            ):
                found._add(cell)
        return found

    def _add(self, cell: Cell) -> None:
        match = _SHAPE.fullmatch(plain_text(cell[1]))
        if match is None:
            return
        body = match["body"]
        counts = {mark: body.count(mark) for mark in ",."}
        readings = [mark for mark in ",." if plain_digits(body, mark) is not None]
        if len(readings) == 1 and any(counts.values()):
            decimal, other = readings[0], "." if readings[0] == "," else ","
            self.decimal[decimal] = self.decimal[decimal] or cell
            if counts[other]:
                self.groups[other] = self.groups[other] or cell
        elif len(readings) == 2 and any(counts.values()):  # one mark before three digits
            mark = "," if counts[","] else "."
            # nobody groups digits before a power of ten
            kind = self.decimal if match["exponent"] else self.unsure
            kind[mark] = kind[mark] or cell


def _grouped_by_dots(columns: Sequence[Sequence[Cell]]) -> Cell | None:
    """Return a cell such as 1.234 of a column whose other numbers have no point, so that it may be 1234."""
    for column in columns:
        pointed = [cell for cell in column if "." in cell[1]]
        if not pointed or len(pointed) == len(column):
            continue
        whole = [text.strip().lstrip("+-") for _, text in column if "." not in text and not is_missing(text)]
        if (
            all(GROUPED.fullmatch(text.strip().lstrip("+-")) for _, text in pointed)
            and whole
            and all(text.isdigit() and len(text) <= 3 for text in whole)
        ):
            return pointed[0]
    return None


def _ambiguity(cell: Cell, reason: str) -> UsageError:
    line, text = cell
    mark = "," if "," in text else "."
    plain = text.strip()
    return UsageError(
        f"line {line}: {plain!r} may be {plain.replace(mark, '.')} or {plain.replace(mark, '')}.",
        why=f"The {_NAMES[mark]} may be a decimal mark or stand between thousands. {reason}.",
        fix="Say which mark is decimal: decimal=',' or decimal='.' (--decimal , or --decimal .).",
    )


def _contradiction(comma: Cell, dot: Cell) -> UsageError:
    first, second = sorted([comma, dot])
    return UsageError(
        f"line {second[0]}: {second[1].strip()!r} has another decimal mark than {first[1].strip()!r} "
        f"in line {first[0]}.",
        why="One table has one decimal mark; else 1,234 could be two numbers.",
        fix="Write all numbers alike, or say which mark is decimal: decimal=',' or decimal='.' (--decimal).",
    )
