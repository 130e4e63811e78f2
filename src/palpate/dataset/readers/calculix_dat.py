"""Printed results of CalculiX, ``.dat``: tables for sets of nodes and elements at each time.

A table begins with its name, components, set and time,

     displacements (vx,vy,vz) for set TOP and time  0.5000000E+00

an empty line, and rows of a node's number, or an element's and an integration point's, and values. Totals have one row
without a number. Stresses come in another order than in an ``.frd``: here ``sxz`` before ``syz``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.dataset.readers.file_text import read_lines
from palpate.dataset.readers.results import TIME, Column, Places, Results, refuse

__all__ = ["is_dat", "read_dat"]

FORMAT = "CalculiX .dat"
MEASURES = {
    "displacements": "{length}",
    "forces": "{force}",
    "total force": "{force}",
    "stresses": "{force}/{length}**2",
    "volume": "{length}**3",
    "total volume": "{length}**3",
    "internal energy": "{force}*{length}",
    "total internal energy": "{force}*{length}",
}
PURE = ("strains", "mechanical strains", "equivalent plastic strain")
_HEAD = re.compile(
    r"^\s*(?P<title>[A-Za-z][^(]*?)\s*(?:\((?P<parts>[^)]*)\)\s*)?for set\s*(?P<set>\S+) and time\s+(?P<time>\S+)\s*$"
)
# titles of one row without a number, whose components the head leaves out
_BARE = {"center of gravity": ("x", "y", "z")}
_MODE = re.compile(r"^\s*E I G E N V A L U E +N U M B E R\s")  # every mode is a case, all at one time
_KEYS = {"elem", "element", "node", "integ.pnt."}
_NUMBER = re.compile(
    r"^[-+]?(?:\d+(?:\.\d*)?(?:[EeDd][-+]?\d+|[-+]\d{3})?|nan|inf(?:inity)?)$", re.IGNORECASE
)


@dataclass
class _Table:
    """One table at one time."""

    title: str
    set: str
    keys: tuple[str, ...]
    components: tuple[str, ...]
    line: int
    local: str = ""  # name of a system of coordinates of its own
    ids: list[int] = field(default_factory=list)
    rows: list[list[float]] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name and set of the table."""
        return f"{self.title} of {self.set}"


def is_dat(head: str) -> bool:
    """Return whether the beginning of a file is that of a .dat file of CalculiX."""
    return any(_HEAD.match(line) for line in head.splitlines())


def read_dat(path: Path) -> Results:
    """Read the printed results of CalculiX.

    Columns are called ``TITLE.COMPONENT of SET``, such as ``total force.fz of TOP``; of one component alone ``internal
    energy of BODY``. Each time is a case.
    """
    cases: list[tuple[float, dict[str, _Table]]] = []
    table: _Table | None = None
    unknown: dict[str, int] = {}
    mode_begins = False
    for number, line in enumerate(read_lines(path), 1):
        if not line.strip():
            continue
        if head := _HEAD.match(line):
            time, table = _number(path, number, head["time"]), _table_of(head, number)
            if not cases or cases[-1][0] != time or mode_begins:
                cases.append((time, {}))
            mode_begins = False
            table = _add(path, cases[-1][1], table)
        elif _MODE.match(line):
            table, mode_begins = None, True
        elif re.match(r"^\s*[A-Za-z]", line) and not _NUMBER.match(line.split()[0]):
            table = None
            unknown.setdefault(line.strip(), number)
        elif table is not None:
            _add_row(path, number, line, table)
    if not cases:
        raise refuse(
            path,
            min(unknown.values(), default=1),
            "no table of a set begins here.",
            why="Tables that are known begin like: displacements (vx,vy,vz) for set NAME and time 1.0.",
            fix="Print results by *NODE PRINT and *EL PRINT.",
        )
    notes = [f"Skipped line {line}, {text[:60]!r}: no table of a set." for text, line in unknown.items()]
    return _collect(path, cases, notes)


def _number(path: Path, line: int, text: str) -> float:
    if not _NUMBER.match(text):
        raise refuse(path, line, f"{text!r} is no number.", why="The file is damaged here.")
    # three digits of an exponent leave no room for its letter
    return float(re.sub(r"(?<=\d)([-+]\d{3})$", r"E\1", text.upper().replace("D", "E")))


def _table_of(head: re.Match[str], line: int) -> _Table:
    parts = [part.strip() for part in (head["parts"] or "").split(",") if part.strip()]
    keys = tuple(part for part in parts if part in _KEYS)
    components = tuple(part for part in parts if part not in _KEYS)
    title = head["title"].strip()
    components = _BARE.get(title, components)
    if not keys and not title.startswith("total") and title not in _BARE:
        keys = ("node",)
    return _Table(title, head["set"], keys, components or ("",), line)


def _add(path: Path, tables: dict[str, _Table], table: _Table) -> _Table:
    """Add a table to its case; one that was printed twice stands under a further name until it is compared."""
    name = table.name
    if name in tables:
        table.title = f"{table.title} again"
    if table.name in tables:
        raise refuse(path, table.line, f"{name!r} is printed more than twice for one time.")
    tables[table.name] = table
    return table


def _add_row(path: Path, number: int, line: str, table: _Table) -> None:
    cells = line.split()
    if not _NUMBER.match(cells[-1]) and re.match(r"[A-Za-z_]", cells[-1]):
        table.local = "of the node" if cells[-1] == "L" else cells[-1]
        cells = cells[:-1]
    if table.components == ("values",) and not table.rows:
        table.components = tuple(f"v{i + 1}" for i in range(len(cells) - len(table.keys)))
    width = len(table.keys) + len(table.components)
    if len(cells) != width:
        raise refuse(
            path,
            number,
            f"{len(cells)} numbers stand here, {width} are announced in line {table.line}.",
            why="The line is cut short, or overlong numbers touch.",
        )
    values = [_number(path, number, cell) for cell in cells]
    if table.keys:
        table.ids.append(int(values[0]))
    table.rows.append(values[len(table.keys) :])


def _collect(path: Path, cases: Sequence[tuple[float, dict[str, _Table]]], notes: list[str]) -> Results:
    """Return the results with one array for each component, by case and place."""
    columns = [Column(TIME, np.array([time for time, _ in cases]), None, "{time}")]
    places: dict[str, Places] = {}
    for name in dict.fromkeys(name for _, tables in cases for name in tables):
        tables = [tables.get(name) for _, tables in cases]
        first = next(table for table in tables if table is not None)
        for table in tables:
            if table is not None:
                _require_like(path, first, table)
        nothing = np.full((len(first.rows), len(first.components)), np.nan)
        values = np.stack([nothing if table is None else np.array(table.rows) for table in tables])
        if first.local:
            notes.append(f"{name}: its components are along local axes, {first.local}.")
        if first.title.endswith(" again") and _is_repetition(cases, name):
            continue
        support = _places_of(first, places)
        unit = "" if first.title in PURE else None
        measure = MEASURES.get(first.title.removesuffix(" again"), "")
        for i, part in enumerate(first.components):
            title = f"{first.title}.{part}" if len(first.components) > 1 else first.title
            one = values[:, :, i] if support else values[:, 0, i]
            columns.append(Column(f"{title} of {first.set}", one, unit, measure, support))
    return Results.of(path, FORMAT, len(cases), columns, places, notes)


def _require_like(path: Path, first: _Table, table: _Table) -> None:
    if not table.rows:
        raise refuse(path, table.line, f"no rows follow {table.name!r}.", why="The file is cut short here.")
    if table.ids != first.ids or len(table.rows) != len(first.rows) or table.components != first.components:
        raise refuse(
            path,
            table.line,
            f"{table.name!r} has {len(table.rows)} rows, {len(first.rows)} in line {first.line}.",
            why="The file is cut short here, or the set is another one.",
        )


def _is_repetition(cases: Sequence[tuple[float, dict[str, _Table]]], name: str) -> bool:
    plain = name.replace(" again of ", " of ", 1)
    pairs = [(tables.get(plain), tables.get(name)) for _, tables in cases]
    return all(b is None or (a is not None and a.rows == b.rows) for a, b in pairs)


def _places_of(table: _Table, places: dict[str, Places]) -> str:
    """Return the name of the places that a table belongs to, "" for a total; new places are added."""
    if not table.keys:
        return ""
    nodal = table.keys == ("node",)
    kind = "nodes" if nodal else "points" if len(table.keys) > 1 else "elements"
    name = f"{kind} of {table.set}"
    ids = np.array(table.ids, dtype=np.int64)
    if name in places and not np.array_equal(places[name].ids, ids):
        name = f"{name}, {table.title}"
    places.setdefault(name, Places(ids, nodal=nodal))
    return name
