"""Result files of CalculiX, ``.frd``: nodes, elements and fields at nodes, in ASCII (long and short) or binary.

The file has fixed columns, for negative numbers touch. A block of results is announced by ``100CL`` with the time (the
load factor of a static step that lasts 1), ``-4`` with its name and a ``-5`` line for each component, and ends with
``-3``; a binary block has no end mark, its length follows from the number of nodes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.dataset.readers.file_text import read_bytes
from palpate.dataset.readers.results import TIME, Column, Places, Results, refuse
from palpate.dataset.readers.surface import outer_surface

__all__ = ["is_frd", "read_frd"]

FORMAT = "CalculiX .frd"
MEASURES = {
    "DISP": "{length}",
    "VELO": "{length}/{time}",
    "STRESS": "{force}/{length}**2",
    "FORC": "{force}",
    "ENER": "{force}/{length}**2",
    "CONTACT": "",
}
"""Formulas of the units of blocks, by their names."""

PURE = frozenset({"TOSTRAIN", "MESTRAIN", "PE"})
# an estimate of the discretisation's error in per cent, of no use beside a mesh
IGNORED = frozenset({"ERROR"})

# number of nodes and kind of each type of element
_TYPES = {
    1: (8, "hexahedron"),
    2: (6, "wedge"),
    3: (4, "tetra"),
    4: (20, "hexahedron"),
    5: (15, "wedge"),
    6: (10, "tetra"),
    7: (3, "triangle"),
    8: (6, "triangle"),
    9: (4, "quad"),
    10: (8, "quad"),
    11: (2, "line"),
    12: (3, "line"),
}
_NUMBER = re.compile(r"[-+]?\d\.\d+[EeDd][-+]\d{2,3}|[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_FREQUENCY = 2  # kind of analysis whose value is a frequency


@dataclass
class _Cursor:
    """A place in the bytes of a file."""

    path: Path
    content: bytes
    at: int = 0
    line: int = 0

    def next_line(self, what: str = "") -> str | None:
        """Return the next line, None at the end of the file; inside of `what` the end is an error."""
        if self.at >= len(self.content):
            if what:
                raise refuse(self.path, self.line, f"the file ends inside of {what}.", why="It is cut short.")
            return None
        end = self.content.find(b"\n", self.at)
        if end < 0 and what:
            raise refuse(self.path, self.line + 1, f"the file ends inside of {what}.", why="It is cut short.")
        end = len(self.content) if end < 0 else end
        text = self.content[self.at : end].decode("latin-1").rstrip("\r")
        self.at, self.line = end + 1, self.line + 1
        return text

    def records(self, kind: np.dtype, count: int, what: str) -> np.ndarray:
        """Return binary records of one kind."""
        size = kind.itemsize * count
        if self.at + size > len(self.content):
            raise refuse(
                self.path,
                self.line,
                f"{what} needs {size:,} bytes, {len(self.content) - self.at:,} are left.",
                why="The file is cut short.",
            )
        values = np.frombuffer(self.content, kind, count, self.at)
        self.at += size
        return values


@dataclass
class _Case:
    value: float
    step: int
    increment: int
    fields: dict[str, tuple[list[str], np.ndarray, np.ndarray]] = field(default_factory=dict)


@dataclass
class _File:
    ids: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    cells: list[tuple[str, list[int]]] = field(default_factory=list)
    cases: list[_Case] = field(default_factory=list)
    frequency: bool = False
    ended: bool = False


def is_frd(head: str) -> bool:
    """Return whether the beginning of a file is that of a result file of CalculiX."""
    return head.startswith("    1C") or head.startswith("    1U")


def read_frd(path: Path) -> Results:
    """Read a result file of CalculiX.

    Columns are called ``NAME.COMPONENT``, such as ``DISP.D1`` and ``STRESS.SZX``. Each increment is a case.
    """
    cursor, read = _Cursor(path, read_bytes(path)), _File()
    step, increment = 0, 0
    while (line := cursor.next_line()) is not None:
        key = line[:7].strip()
        if key in {"2C"}:
            _nodes(cursor, line, read)
        elif key == "3C":
            _elements(cursor, line, read)
        elif line[4:10] == "1PSTEP":
            numbers = line[10:].split()
            increment, step = (_integer(cursor, number) for number in numbers[1:3])
        elif key == "100CL" or line[2:7] == "100CL":
            _results(cursor, line, read, step, increment)
        elif line.strip() == "9999":
            read.ended = True
            break
        elif line[:5].strip() not in {"", "1"} or (line.strip() and line[4:5] != "1"):
            raise refuse(
                path,
                cursor.line,
                f"{line[:20].strip()!r} begins no block that is known.",
                why="Blocks begin with 1C, 1U, 1P, 2C, 3C and 100CL.",
            )
    if not len(read.ids) or not read.cases:
        missing = "results" if len(read.ids) else "nodes"
        raise refuse(
            path,
            cursor.line,
            f"the file ends without {missing}.",
            why="It was cut short, or the solver failed.",
        )
    return _collect(path, read)


def _integer(cursor: _Cursor, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise refuse(cursor.path, cursor.line, f"{text.strip()!r} is no whole number.") from None


def _real(cursor: _Cursor, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise refuse(cursor.path, cursor.line, f"{text.strip()!r} is no number.") from None


def _nodes(cursor: _Cursor, head: str, read: _File) -> None:
    count, coding = _integer(cursor, head[24:36]), _integer(cursor, head.rstrip()[-1:])
    _require_room(cursor, count, 16, "the nodes")
    if coding < 2:
        read.ids, read.points = _rows(cursor, count, 3, coding, "the nodes")
        return
    kind = np.dtype([("id", "<i4"), ("x", f"<f{8 if coding == 3 else 4}", (3,))])
    records = cursor.records(kind, count, "the block of nodes")
    read.ids, read.points = records["id"].astype(np.int64), records["x"].astype(float)


def _require_room(cursor: _Cursor, count: int, size: int, what: str) -> None:
    """Refuse a number of things that the rest of the file can't hold, before memory is taken for them."""
    left = len(cursor.content) - cursor.at
    if count < 0 or count * size > left:
        raise refuse(
            cursor.path,
            cursor.line,
            f"{count:,} entries of {what} are announced, {left:,} bytes are left.",
            why="The file is cut short, or damaged here.",
        )


def _rows(cursor: _Cursor, count: int, width: int, coding: int, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the ids (count,) and values (count, width) of an ASCII block, up to its end mark."""
    first = 3 + (10 if coding == 1 else 5)
    ids, values = np.empty(count, dtype=np.int64), np.empty((count, width))
    for row in range(count):
        line = cursor.next_line(what) or ""
        if line[:3] != " -1":
            raise refuse(
                cursor.path,
                cursor.line,
                f"{what} end after {row} of {count} rows.",
                why=f"A row begins with -1; here stands {line[:20].strip()!r}.",
            )
        ids[row] = _integer(cursor, line[3:first])
        numbers = _NUMBER.findall(line[first:])
        while len(numbers) < width and cursor.content[cursor.at : cursor.at + 3] == b" -2":
            numbers += _NUMBER.findall((cursor.next_line(what) or "")[first:])
        if len(numbers) != width:
            raise refuse(
                cursor.path,
                cursor.line,
                f"{len(numbers)} numbers stand in a row of {what}, {width} are announced.",
                why="The line is cut short or damaged.",
            )
        values[row] = [float(number.replace("D", "E")) for number in numbers]
    end = cursor.next_line(what) or ""
    if end[:3] != " -3":
        raise refuse(
            cursor.path,
            cursor.line,
            f"{what} go on after their {count} rows.",
            why="The end mark -3 is missing.",
        )
    return ids, values


def _elements(cursor: _Cursor, head: str, read: _File) -> None:
    count, coding = _integer(cursor, head[24:36]), _integer(cursor, head.rstrip()[-1:])
    _require_room(cursor, count, 8, "the elements")
    width = 10 if coding == 1 else 5
    for _ in range(count):
        if coding >= 2:
            kind = int(cursor.records(np.dtype("<i4"), 4, "an element")[1])
            size, name = _type(cursor, kind)
            nodes = cursor.records(np.dtype("<i4"), size, "an element").tolist()
        else:
            line = cursor.next_line("the elements") or ""
            if line[:3] != " -1":
                raise refuse(
                    cursor.path, cursor.line, "the elements end too soon.", why="A row begins with -1."
                )
            size, name = _type(cursor, _integer(cursor, line[3 + width : 8 + width]))
            nodes = []
            while len(nodes) < size:
                text = (cursor.next_line("the elements") or "").rstrip()
                if text[:3] != " -2":
                    raise refuse(cursor.path, cursor.line, "an element has too few nodes.")
                nodes += [_integer(cursor, text[i : i + width]) for i in range(3, len(text), width)]
        read.cells.append((name, nodes))
    if coding < 2 and (cursor.next_line("the elements") or "")[:3] != " -3":
        raise refuse(cursor.path, cursor.line, "the elements have no end mark -3.")


def _type(cursor: _Cursor, number: int) -> tuple[int, str]:
    if number not in _TYPES:
        raise refuse(cursor.path, cursor.line, f"{number} is no type of element that is known.")
    return _TYPES[number]


def _results(cursor: _Cursor, head: str, read: _File, step: int, increment: int) -> None:
    """Read one block of results and add it to its case."""
    value, count = _real(cursor, head[12:24]), _integer(cursor, head[24:36])
    kind, coding = head[56:58].strip(), _integer(cursor, head[73:75])
    title = cursor.next_line("a block of results") or ""
    if title[:3] != " -4":
        raise refuse(
            cursor.path, cursor.line, "the name of the results is missing.", why="Its line begins with -4."
        )
    name, number = title[5:13].strip(), _integer(cursor, title[13:18])
    components = []
    for _ in range(number):
        line = cursor.next_line(f"the block {name}") or ""
        if line[:3] != " -5":
            raise refuse(cursor.path, cursor.line, f"{name} has fewer than its {number} components.")
        if line[33:38].strip() != "1":  # computed by the program that shows the file: it has no column
            components.append(line[5:13].strip())
    what, width = f"the values of {name}", len(components)
    _require_room(cursor, count, 4 + 4 * width, what)
    if coding < 2:
        ids, values = _rows(cursor, count, width, coding, what)
    else:
        record = np.dtype([("id", "<i4"), ("v", f"<f{8 if coding == 3 else 4}", (width,))])
        records = cursor.records(record, count, what)
        ids, values = records["id"].astype(np.int64), records["v"].astype(float)
    read.frequency |= kind.isdecimal() and int(kind) == _FREQUENCY
    last = read.cases[-1] if read.cases else None
    if (
        last is None
        or (last.value, last.step, last.increment) != (value, step, increment)
        or name in last.fields
    ):
        read.cases.append(last := _Case(value, step, increment))
    last.fields[name] = (components, ids, values)


def _collect(path: Path, read: _File) -> Results:
    """Return the results with one array for each component, by case and node."""
    order = np.argsort(read.ids)
    columns, notes = [], []
    names = dict.fromkeys(name for case in read.cases for name in case.fields)
    for name in names:
        if name in IGNORED:
            notes.append(f"Skipped {name}: an estimate of the discretisation's error.")
            continue
        components = next(case.fields[name][0] for case in read.cases if name in case.fields)
        stacked = np.full((len(components), len(read.cases), len(read.ids)), np.nan)
        for number, case in enumerate(read.cases):
            if name not in case.fields:
                continue
            own, ids, values = case.fields[name]
            at = order[np.clip(np.searchsorted(read.ids[order], ids), 0, len(order) - 1)]
            if own != components or not np.array_equal(read.ids[at], ids):
                raise refuse(path, None, f"{name} has other components, or nodes that the mesh has not.")
            stacked[:, number, at] = values.T
        unit = "" if name in PURE else None
        columns += [
            Column(f"{name}.{part}", values, unit, MEASURES.get(name, ""), "nodes")
            for part, values in zip(components, stacked, strict=True)
        ]
    if not read.ended:
        notes.append(
            "The file ends without its last line 9999: the solver was stopped, or later cases are missing."
        )
    value = np.array([case.value for case in read.cases])
    head = [
        Column(
            "frequency" if read.frequency else TIME, value, None, "1/{time}" if read.frequency else "{time}"
        ),
        Column("step", np.array([case.step for case in read.cases], dtype=float), ""),
        Column("increment", np.array([case.increment for case in read.cases], dtype=float), ""),
    ]
    coordinates = {axis: Column(axis, read.points[:, i], None, "{length}") for i, axis in enumerate("xyz")}
    places = Places(read.ids, coordinates, _surface(path, read, order))
    return Results.of(path, FORMAT, len(read.cases), [*head, *columns], {"nodes": places}, notes)


def _surface(path: Path, read: _File, order: np.ndarray) -> np.ndarray | None:
    blocks = []
    for kind in dict.fromkeys(kind for kind, _ in read.cells):
        size = {len(nodes) for own, nodes in read.cells if own == kind}
        for width in size:
            ids = np.array([nodes for own, nodes in read.cells if own == kind and len(nodes) == width])
            at = order[np.clip(np.searchsorted(read.ids[order], ids), 0, len(order) - 1)]
            if not np.array_equal(read.ids[at], ids):
                raise refuse(path, None, "an element has a node that the file doesn't list.")
            blocks.append((kind, at))
    return outer_surface(blocks, read.points)
