"""Reports of Abaqus, ``.rpt``: field output by node, element or integration point, and XY data.

A field report names no units, and no coordinates unless COORD was asked for. Each frame is a case, also where reports
were appended to one file. Of an XY report each row is a case.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.dataset.readers.file_text import read_lines
from palpate.dataset.readers.results import TIME, Column, Places, Results, refuse

__all__ = ["is_report", "read_report"]

_FIELD, _PROBE = "Field Output Report", "Probe Values Report"
_FRAME = re.compile(r"Step Time\s*=\s*(?P<time>[-+.\dEe]+)|Frequency\s*=\s*(?P<frequency>[-+.\dEe]+)")
_REGION = re.compile(r"reported at (?P<where>.+?) for (?P<kind>part|region):\s*(?P<name>.+?)\s*$")
_SECOND = re.compile(r"Label|Int Pt|Pt|@Loc\s*\d+")
_STATISTICS = ("Minimum", "Maximum", "Total", "At Node", "At Element", "Int Pt")
_AXES = {"COOR1": "x", "COOR2": "y", "COOR3": "z"}
_POINTS = 1000  # more than an element has integration points: number of a place is element · 1000 + point
_XY_HEAD = 12  # lines within which the first row of numbers of an XY report stands


def is_report(head: str) -> bool:
    """Return whether a file begins like a report of Abaqus."""
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    return any(_FIELD in line or _PROBE in line for line in lines[:5]) or bool(
        lines and re.match(r"X\s{2,}\S", lines[0])
    )


@dataclass(eq=False)
class _Table:
    """Rows of one region at one frame: names, identities and values."""

    line: int
    frame: int  # number of the report in the file
    time: float
    where: str  # what the rows are of: nodes, or others
    region: str
    names: list[str]
    ids: list[int] = field(default_factory=list)
    rows: list[list[float]] = field(default_factory=list)


def read_report(path: Path) -> Results:
    """Read a field report or an XY report."""
    lines = read_lines(path)
    if any(_PROBE in line for line in lines[:10]):
        raise refuse(
            path,
            1,
            "a Probe Values Report is not read.",
            why="It holds the values that somebody clicked on, not a field.",
            fix="Write a field report: Report → Field Output.",
        )
    if any(_FIELD in line for line in lines[:10]):
        return _field_results(path, list(_tables(path, lines)))
    return _xy_results(path, lines)


def _tables(path: Path, lines: Sequence[str]) -> Iterator[_Table]:
    """Yield the tables of a file of field reports."""
    frame, time, where, region, number = 0, np.nan, "", "", 0
    while number < len(lines):
        line = lines[number]
        if _FIELD in line:
            frame, time = frame + 1, np.nan
        elif match := _FRAME.search(line):
            time = float(match["time"] or match["frequency"])
        elif match := _REGION.search(line):
            where, region = match["where"], match["name"]
        elif line.strip().startswith("---") and number >= 2 and "@Loc" in lines[number - 1]:
            keys, names, ends = _columns(path, number, lines[number - 2], lines[number - 1])
            table = _Table(number + 1, frame, time, where, region, names)
            number = _read_rows(path, lines, number + 1, table, keys, len(ends))
            yield table
            continue
        number += 1


def _columns(path: Path, number: int, first: str, second: str) -> tuple[int, list[str], list[int]]:
    """Return how many columns number the rows, the names of the others, and where all of them end in a head."""
    words = [(match[0], match.end()) for match in _SECOND.finditer(second)]
    names, start = [], 0
    for _, end in words:
        names.append(first[start:end].strip())
        start = end
    keys = sum(not word.startswith("@Loc") for word, _ in words)
    if not 1 <= keys <= 2 or not all(names[keys:]):
        raise refuse(
            path, number, "the head of a table is none of a field report.", why=f"It is {second.strip()!r}."
        )
    return keys, names[keys:], [end for _, end in words]


def _read_rows(path: Path, lines: Sequence[str], number: int, table: _Table, keys: int, width: int) -> int:
    """Read the rows of a table and return the number of the line behind them."""
    while number < len(lines) and (cells := lines[number].split()):
        if cells[0] in {"Minimum", "Maximum", "Total"}:
            break
        try:
            if len(cells) != width:
                raise ValueError(f"{len(cells)} values stand where {width} belong")  # noqa: TRY301
            identity = [int(cell) for cell in cells[:keys]]
            table.rows.append([np.nan if cell == "NoValue" else float(cell) for cell in cells[keys:]])
        except ValueError as error:
            raise refuse(path, number + 1, "the row can't be read.", why=f"{error}.") from error
        table.ids.append(identity[0] if keys == 1 else identity[0] * _POINTS + identity[1])
        number += 1
    if not table.rows:
        raise refuse(path, number, f"the table of {table.region} has no rows.")
    return number


def _field_results(path: Path, tables: Sequence[_Table]) -> Results:
    if not tables:
        raise refuse(
            path, None, "the report has no table.", why="It is cut short, or its layout is not known."
        )
    frames = list(dict.fromkeys(table.frame for table in tables))
    kinds = list(dict.fromkeys((table.where, table.region) for table in tables))
    columns, places = [], {}
    times = np.array([next(t.time for t in tables if t.frame == frame) for frame in frames])
    if np.isfinite(times).all():
        columns.append(Column(TIME, times, None, "{time}"))
    for where, region in kinds:
        nodal = where.strip().lower() == "nodes"
        own = [table for table in tables if (table.where, table.region) == (where, region)]
        place = ("nodes" if nodal else where) + (f" of {region}" if len(kinds) > 1 else "")
        ids = own[0].ids
        for table in own:
            if table.ids != ids or table.names != own[0].names or len(own) != len(frames):
                raise refuse(
                    path,
                    table.line,
                    f"the tables of {region} differ from report to report.",
                    why=f"They have {len(own[0].ids)} and {len(table.ids)} rows, {len(own)} tables in {len(frames)} "
                    "reports, or other columns.",
                    fix="Write one report with all variables for each frame, of the same mesh.",
                )
        values = np.array([table.rows for table in own])
        coordinates = {}
        for i, name in enumerate(own[0].names):
            axis = _AXES.get(name.rpartition(".")[2].upper())
            if axis is not None:
                coordinates[axis] = Column(axis, values[0, :, i], None, "{length}")
                continue
            full = name + (f" of {region}" if len(kinds) > 1 else "")
            columns.append(Column(full, values[:, :, i], None, _measure(name), place))
        places[place] = Places(np.array(ids), coordinates, nodal=nodal)
    notes = [
        f"Coordinates of {name} are COORD of the first frame: those of the deformed body, if it was deformed then."
        for name, entry in places.items()
        if entry.coordinates
    ]
    return Results.of(path, "Abaqus field report", len(frames), columns, places, notes)


def _measure(name: str) -> str:
    base = name.partition(".")[0]
    return {"U": "{length}", "RF": "{force}", "CF": "{force}", "S": "{force}/{length}**2"}.get(base, "")


def _xy_results(path: Path, lines: Sequence[str]) -> Results:
    first = next((i for i, line in enumerate(lines[:_XY_HEAD]) if _numbers(line) is not None), None)
    if first is None:
        raise refuse(
            path,
            1,
            "the file is neither a field report nor an XY report.",
            why=f"No row of numbers stands in its first {_XY_HEAD} lines.",
        )
    ends = [match.end() for match in re.finditer(r"\S+", lines[first])]
    parts: list[list[str]] = [[] for _ in ends]
    for line in lines[:first]:
        start = 0
        for i, end in enumerate(ends):
            stop = len(line) if i == len(ends) - 1 else end
            if word := line[start:stop].strip():
                parts[i].append(word)
            start = stop
    rows, number = [], first
    while number < len(lines) and lines[number].strip():
        if lines[number].split()[0].startswith(_STATISTICS):
            break
        row = _numbers(lines[number])
        if row is None or len(row) != len(ends):
            raise refuse(
                path, number + 1, "the row can't be read.", why=f"It is {lines[number].strip()[:60]!r}."
            )
        rows.append(row)
        number += 1
    if any(_numbers(line) for line in lines[number:]) and not any(
        line.strip().startswith(_STATISTICS) for line in lines[number:]
    ):
        raise refuse(
            path,
            number + 1,
            "a second table begins.",
            fix="Write one XY report into a file, with all its curves.",
        )
    values = np.array(rows)
    names = [" ".join(words) or f"column {i + 1}" for i, words in enumerate(parts)]
    columns = [Column(name, values[:, i]) for i, name in enumerate(names)]
    return Results.of(path, "Abaqus XY report", len(values), columns)


def _numbers(line: str) -> list[float] | None:
    """Return the numbers of a row; None where it holds none, or something else."""
    cells = line.split()
    try:
        return [np.nan if cell == "NoValue" else float(cell) for cell in cells] or None
    except ValueError:
        return None
