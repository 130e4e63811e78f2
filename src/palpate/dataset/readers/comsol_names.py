"""Names of columns in COMSOL's text exports: ``int1(x, y) (m^2)``, ``T (K) @ t=0.4``, ``v (mm) @ 3: F=2, E=1e9``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

__all__ = ["Name", "parse_name", "split_cells", "split_names"]

_UNIT = re.compile(r"^(?P<name>.*\S)\s+\((?P<unit>[^()]*(?:\([^()]*\)[^()]*)*)\)(?P<rest>,.*)?$")
_CASE = re.compile(r"^\d+\s*[:,]\s*")
_ASSIGNMENT = re.compile(
    r"^\s*(?P<key>[^=]+?)\s*=\s*(?P<number>\S+?)(?:\s*\[(?P<unit>[^\]]*)\]|\s+(?P<word>\S+))?\s*$"
)


@dataclass(frozen=True)
class Name:
    """Name of a column."""

    text: str  # expression or description, without unit and solution
    unit: str | None  # in brackets; "" for an expression without one, None for a coordinate
    solution: str  # behind ``@``; "" where the column is of all solutions
    # parameters that the solution names: each one's value, and its unit or None
    assignments: Mapping[str, tuple[float, str | None]] = field(default_factory=dict)


def parse_name(text: str) -> Name:
    """Return the parts of a column's name."""
    left, mark, right = text.strip().strip('"').partition(" @ ")
    solution = right.strip() if mark else ""
    found = _UNIT.match(left.strip())
    if found:
        return Name(
            found["name"] + (found["rest"] or ""), _plain(found["unit"]), solution, _assignments(solution)
        )
    bare = left.strip()
    unit = None if re.fullmatch(r"[xyzrXYZR]|phi|PHI|cpl\d+[xyz]", bare) else ""
    return Name(bare, unit, solution, _assignments(solution))


def _plain(unit: str) -> str:
    return "" if unit.strip() == "1" else unit.strip()


def _assignments(solution: str) -> dict[str, tuple[float, str | None]]:
    found: dict[str, tuple[float, str | None]] = {}
    for part in re.split(r"[,;]\s*", _CASE.sub("", solution)):
        match = _ASSIGNMENT.match(part)
        if match is None:
            continue
        try:
            found[match["key"]] = (float(match["number"]), match["unit"] or match["word"])
        except ValueError:
            continue  # a parameter that is a word decides nothing that can be learnt
    return found


def split_cells(text: str, separator: str) -> list[str]:
    """Split a row of numbers at a separator, "" for blanks; empty cells at the end are dropped."""
    if not separator:
        return text.split()
    return [cell.strip() for cell in text.rstrip(f"{separator} ").split(separator)]


def split_names(text: str, separator: str, wanted: int) -> list[str]:
    """Split a line of names, without its ``%``.

    A name may hold commas in brackets, in quotes, and in the assignments behind ``@``. `separator` is that of the rows
    below, "" for blanks; where it is another one for the names, `wanted`, the number of values in a row, tells.
    """
    best: list[str] = []
    for mark in dict.fromkeys((separator, ",", ";", "\t", "")):
        if mark != separator and (wanted == 1 or (mark and mark not in text)):
            continue  # it would not part anything
        names = re.split(r"\s{2,}|\t", text.strip()) if not mark else _split_outside(text, mark)
        if mark and len(names) > wanted:
            names = _join_assignments(names)
        if len(names) == wanted:
            return names
        best = best or names
    return best


def _split_outside(text: str, separator: str) -> list[str]:
    """Split at separators outside of brackets and quotes."""
    parts, depth, quoted, start = [], 0, False, 0
    text = text.rstrip(f"{separator} ")
    for i, letter in enumerate(text):
        if letter == '"':
            quoted = not quoted
        elif not quoted and letter in "([{":
            depth += 1
        elif not quoted and letter in ")]}":
            depth -= 1
        elif letter == separator and depth <= 0 and not quoted:
            parts.append(text[start:i])
            start = i + 1
    return [part.strip().strip('"').replace('""', '"') for part in [*parts, text[start:]]]


def _join_assignments(names: list[str]) -> list[str]:
    """Join ``v @ a=1`` and ``b=2``, and ``v (m)`` and ``Point: 3``, which commas have parted."""
    joined: list[str] = []
    for name in names:
        goes_on = (joined and "@" in joined[-1] and re.match(r"[^@()]+=\S+$", name)) or re.match(
            r"Point:", name
        )
        if joined and goes_on:
            joined[-1] += f", {name}"
        else:
            joined.append(name)
    return joined
