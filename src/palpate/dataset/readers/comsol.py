"""Text exports of COMSOL Multiphysics: spreadsheets, sectionwise data, grids, points and tables.

Lines that begin with ``%`` are the head or announce what follows; a head begins with keys, ``% Nodes: 120`` in a .txt
and ``% Nodes,120`` in a .csv, and ends with the names of the columns:

    spreadsheet   coordinates, then expressions ``v (mm)``; of several solutions ``v (mm) @ F=0.5``, one column each
    sectionwise   ``% Coordinates``, ``% Elements (triangles)``, ``% Data`` with a name and one value a node
    grid          ``% Grid`` with one line of values for each axis, then ``% Data``, first axis fastest
    point         a name on a ``%`` line, its value on the next
    table         a row for each solution, parameters first

A file saved again by a spreadsheet program has its comments in quotes, and perhaps decimal commas.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.dataset.readers.comsol_names import Name, parse_name, split_cells, split_names
from palpate.dataset.readers.file_text import read_lines, to_number
from palpate.dataset.readers.results import Column, Places, Results, refuse
from palpate.dataset.readers.surface import outer_surface

__all__ = ["is_comsol", "read_comsol"]

FORMAT = "COMSOL text export"
KEYS = (
    "model",
    "version",
    "date",
    "dimension",
    "nodes",
    "elements",
    "expressions",
    "description",
    "length unit",
    "table",
)
_KEY = re.compile(rf"^({'|'.join(KEYS)})\s*([:,;\t])\s*(.*)$", re.IGNORECASE)
_SECTION = re.compile(
    r"^(coordinates|elements|grid|data)\b\s*(?:\((?P<word>.*)\)|[,:;]\s*(?P<rest>.*))?\s*$", re.I
)
_QUOTED = re.compile(r'^"((?:[^"]|"")*)"[;,\t]*$')
_COORDINATE = re.compile(r"^(?:[xyzrXYZR]|phi|PHI|cpl\d+[xyz]|s|arc length)$", re.IGNORECASE)
_CELLS = {
    "triangles": "triangle",
    "quadrilaterals": "quad",
    "quads": "quad",
    "tetrahedra": "tetra",
    "hexahedra": "hexahedron",
    "bricks": "hexahedron",
    "prisms": "wedge",
    "pyramids": "pyramid",
}
_KINDS = "a spreadsheet, sectionwise data, a grid, a point or a table"


@dataclass
class _Block:
    """Comment lines, and the rows of cells below them."""

    comments: list[tuple[int, str]] = field(default_factory=list)
    rows: list[tuple[int, str]] = field(default_factory=list)

    @property
    def line(self) -> int:
        """Number of the last comment line, of the first row where there is none."""
        return self.comments[-1][0] if self.comments else self.rows[0][0] if self.rows else 1


@dataclass
class _Export:
    """A file taken apart: its keys, its blocks, and how cells are separated."""

    path: Path
    keys: Mapping[str, str]
    blocks: Sequence[_Block]
    separator: str
    decimal_comma: bool

    def numbers(self, row: tuple[int, str], wanted: int | None = None, named: int = 0) -> list[complex]:
        """Return the numbers of a row; `named` is the line that says how many there are."""
        line, text = row
        cells = split_cells(text, self.separator)
        if wanted is not None and len(cells) != wanted:
            where = f" (line {named})" if named else ""
            raise refuse(
                self.path,
                line,
                f"{len(cells)} values stand here, {wanted} are announced{where}.",
                why="The file is cut short here, or its columns are separated otherwise.",
            )
        values = [to_number(cell, decimal_comma=self.decimal_comma) for cell in cells]
        for cell, value in zip(cells, values, strict=True):
            if value is None:
                raise refuse(
                    self.path, line, f"{cell!r} is no number.", fix="Correct that cell, or export again."
                )
        return [value for value in values if value is not None]

    def table(self, block: _Block, width: int) -> np.ndarray:
        """Return the rows of a block as (row, width), complex where one of them is."""
        if not block.rows:
            raise refuse(self.path, block.line, "no rows follow.", why="The file is cut short here.")
        rows = [self.numbers(row, width, block.line) for row in block.rows]
        return np.array(rows)

    def count(self, key: str) -> int | None:
        """Return a number of the head, None where it isn't there."""
        text = self.keys.get(key, "")
        return int(text) if text.isdecimal() else None

    def require(self, key: str, number: int, what: str, line: int) -> None:
        """Refuse a number of things other than the head announces."""
        promised = self.count(key)
        if promised is not None and promised != number:
            raise refuse(
                self.path,
                line,
                f"{number} {what} stand here, the head announces {promised}.",
                why="The file was cut short, or put together of two.",
            )


def is_comsol(head: str) -> bool:
    """Return whether the beginning of a file is that of a text export of COMSOL."""
    first = next((line for line in head.splitlines() if line.strip()), "").lstrip('\ufeff \t"')
    return first.startswith("%")


def read_comsol(path: Path) -> Results:
    """Read a text export of COMSOL Multiphysics."""
    export = _take_apart(path, read_lines(path))
    sections = {
        m[1].lower() for block in export.blocks for _, text in block.comments if (m := _SECTION.match(text))
    }
    if "coordinates" in sections:
        return _sectionwise(export)
    if "grid" in sections:
        return _grid(export)
    if not any(block.rows for block in export.blocks):
        last = export.blocks[-1].line if export.blocks else 1
        raise refuse(path, last, "no rows follow the head.", why="The file is cut short here.")
    if "table" not in export.keys and _is_point(export):
        return _point(export)
    if len(export.blocks) > 1:
        raise refuse(
            path,
            export.blocks[1].line,
            f"another head stands between the rows: {export.blocks[1].comments[0][1]!r}.",
            why=f"Exports that are read here hold {_KINDS}; the nearest is a spreadsheet, with one head.",
            fix="Import files that were joined one by one.",
        )
    return _table_or_spreadsheet(export)


def _take_apart(path: Path, lines: Sequence[str]) -> _Export:
    keys: dict[str, str] = {}
    blocks: list[_Block] = [_Block()]
    dressing = ""
    for number, raw in enumerate(lines, 1):
        line = raw.strip().lstrip("\ufeff")
        if quoted := _QUOTED.match(line):
            line = quoted[1].replace('""', '"')
        if not line:
            continue
        if not line.startswith("%"):
            blocks[-1].rows.append((number, line))
            continue
        text = line[1:].strip()
        if not text.rstrip(",;"):
            continue
        if (key := _KEY.match(text)) and len(blocks) == 1 and not blocks[0].rows:
            dressing = dressing or key[2]
            keys.setdefault(key[1].lower(), key[3].rstrip(",;\t ").strip('"'))
            continue
        if blocks[-1].rows:
            blocks.append(_Block())
        blocks[-1].comments.append((number, text))
    row = next((text for block in blocks for _, text in block.rows), "")
    separator = ";" if ";" in row else "\t" if "\t" in row else "," if "," in row and dressing != ":" else ""
    decimal_comma = separator != "," and any("," in text for block in blocks for _, text in block.rows)
    return _Export(path, keys, blocks, separator, decimal_comma)


def _is_point(export: _Export) -> bool:
    """Return whether each block is one name and one number."""
    single = all(len(block.comments) == 1 and len(block.rows) == 1 for block in export.blocks)
    numbers = single and all(len(split_cells(b.rows[0][1], export.separator)) == 1 for b in export.blocks)
    return numbers and (len(export.blocks) > 1 or export.count("dimension") == 0)


def _table_or_spreadsheet(export: _Export) -> Results:
    block = export.blocks[0]
    if not block.comments:
        raise refuse(
            export.path,
            block.rows[0][0],
            "no line above the rows names the columns.",
            why=f"The last line with % does in {_KINDS}.",
            fix="Export with the head (Include header).",
        )
    line, text = block.comments[-1]
    width = len(split_cells(block.rows[0][1], export.separator))
    texts = split_names(text, export.separator, width)
    if len(texts) != width:
        raise refuse(
            export.path,
            line,
            f"{len(texts)} columns are named for {width} values in line {block.rows[0][0]}.",
            why=f"Names are separated by {'blanks, two or more' if not export.separator else export.separator}.",
        )
    names = [parse_name(name) for name in texts]
    values = export.table(block, width)
    dimension = export.count("dimension")
    axes = _coordinate_columns(names, dimension)
    if "table" in export.keys or not axes:
        columns, notes = _real_columns([(n.text, n.unit, values[:, i], "") for i, n in enumerate(names)])
        return Results.of(export.path, f"{FORMAT}, table", len(values), columns, notes=notes)
    export.require("nodes", len(values), "rows", block.rows[-1][0])
    data = [(name, values[:, i]) for i, name in enumerate(names) if i >= axes]
    _require_expressions(export, [name for name, _ in data], line)
    return _by_solution(export, "spreadsheet", data, [(names[i], values[:, i]) for i in range(axes)], None)


def _coordinate_columns(names: Sequence[Name], dimension: int | None) -> int:
    """Return how many leading columns are coordinates."""
    leading = 0
    while leading < len(names) and _COORDINATE.match(names[leading].text) and not names[leading].solution:
        leading += 1
    return min(leading, 3 if dimension is None else max(dimension, 0))


def _require_expressions(export: _Export, names: Sequence[Name], line: int) -> None:
    """Refuse a number of columns that is no multiple of the head's expressions."""
    promised = export.count("expressions")
    solutions = len({name.solution for name in names})
    if promised and len(names) not in {promised, promised * solutions}:
        raise refuse(
            export.path,
            line,
            f"{len(names)} columns of values stand here; the head announces {promised} expressions, "
            f"and there are {solutions} solutions.",
            why="The file was cut, or columns were taken out of it.",
        )


def _sectionwise(export: _Export) -> Results:
    points: np.ndarray | None = None
    cells: list[tuple[str, np.ndarray]] = []
    data: list[tuple[Name, np.ndarray]] = []
    notes: list[str] = []
    number_of_cells = 0
    for block in export.blocks:
        title = next((m for _, text in block.comments if (m := _SECTION.match(text))), None)
        kind = title[1].lower() if title else "data"
        if kind == "coordinates":
            width = len(split_cells(block.rows[0][1], export.separator)) if block.rows else 0
            points = export.table(block, width).real
            last = block.rows[-1][0]
            export.require("nodes", len(points), "rows of coordinates", last)
        elif kind == "elements" and title is not None:
            word = (title["word"] or title["rest"] or "").strip().lower()
            width = len(split_cells(block.rows[0][1], export.separator)) if block.rows else 0
            nodes = export.table(block, width).real.astype(np.int64) - 1
            number_of_cells += len(nodes)
            _require_nodes(export, block, nodes, 0 if points is None else len(points))
            if word in _CELLS:
                cells.append((_CELLS[word], nodes))
            else:
                notes.append(f"Skipped {len(nodes)} elements called {word!r}: they have no faces.")
        else:
            data.append(_section_of_data(export, block, 0 if points is None else len(points)))
    if points is None or not data:
        missing = "data" if points is not None else "coordinates"
        raise refuse(
            export.path, export.blocks[-1].line, f"the file ends without {missing}.", why="It is cut short."
        )
    if cells:
        export.require("elements", number_of_cells, "elements", export.blocks[-1].line)
    _require_expressions(export, [name for name, _ in data], export.blocks[-1].line)
    axes = [(Name(axis, None, ""), points[:, i]) for i, axis in enumerate("xyz"[: points.shape[1]])]
    results = _by_solution(export, "sectionwise", data, axes, outer_surface(cells, points))
    return Results(**{**results.__dict__, "notes": (*results.notes, *notes)})


def _require_nodes(export: _Export, block: _Block, nodes: np.ndarray, count: int) -> None:
    wrong = np.flatnonzero(((nodes < 0) | (nodes >= count)).any(axis=1))
    if wrong.size:
        raise refuse(
            export.path,
            block.rows[int(wrong[0])][0],
            f"an element has a node beyond 1 … {count}.",
            why="Elements count the rows of coordinates, from 1.",
        )


def _section_of_data(export: _Export, block: _Block, count: int) -> tuple[Name, np.ndarray]:
    """Return the name of a section of data and its values, one for each of `count` nodes."""
    texts = []
    for _, text in block.comments:
        title = _SECTION.match(text)
        texts.append(text if title is None else (title["word"] or title["rest"] or ""))
    text = next((t for t in reversed(texts) if t), "")
    if not text:
        raise refuse(export.path, block.line, "this section of data has no name.")
    cells = [value for row in block.rows for value in export.numbers(row)]
    if len(cells) != count:
        last = block.rows[-1][0] if block.rows else block.line
        raise refuse(
            export.path,
            last,
            f"the data of {text!r} end after {len(cells)} values, {count} are needed.",
            why="The file is cut short here.",
        )
    return parse_name(text), np.array(cells)


def _grid(export: _Export) -> Results:
    first = export.blocks[0]
    ticks = [np.array(export.numbers(row)).real for row in first.rows]
    if not 1 <= len(ticks) <= 3:
        raise refuse(
            export.path,
            first.line,
            f"{len(ticks)} lines follow % Grid.",
            why="There is one line of values for each of one to three axes.",
        )
    mesh = np.meshgrid(*ticks, indexing="ij")
    points = np.stack([axis.ravel(order="F") for axis in mesh], axis=1)
    data = [_section_of_data(export, block, len(points)) for block in export.blocks[1:]]
    if not data:
        raise refuse(export.path, first.rows[-1][0], "the file ends without data.", why="It is cut short.")
    _require_expressions(export, [name for name, _ in data], export.blocks[-1].line)
    axes = [(Name(axis, None, ""), points[:, i]) for i, axis in enumerate("xyz"[: len(ticks)])]
    return _by_solution(export, "grid", data, axes, None)


def _point(export: _Export) -> Results:
    data = [
        (parse_name(block.comments[0][1]), np.array(export.numbers(block.rows[0], 1)))
        for block in export.blocks
    ]
    return _by_solution(export, "point", data, [], None)


def _by_solution(
    export: _Export,
    kind: str,
    data: Sequence[tuple[Name, np.ndarray]],
    axes: Sequence[tuple[Name, np.ndarray]],
    triangles: np.ndarray | None,
) -> Results:
    """Return results whose cases are the solutions that the names of the columns end with."""
    solutions = list(dict.fromkeys(name.solution for name, _ in data if name.solution)) or [""]
    stacked: dict[tuple[str, str | None], dict[str, np.ndarray]] = {}
    for name, values in data:
        column = stacked.setdefault((name.text, name.unit), {})
        if name.solution in column:
            raise refuse(export.path, None, f"the column {name.text!r} stands there twice for one solution.")
        column[name.solution] = values
    full = []
    for (text, unit), by_solution in stacked.items():
        missing = [s for s in solutions if s not in by_solution]
        if missing and "" not in by_solution:  # an expression without @ is the same in all solutions
            raise refuse(export.path, None, f"{text!r} has no column for the solution {missing[0]!r}.")
        values = np.stack([by_solution[s] if s in by_solution else by_solution[""] for s in solutions])
        full.append((text, unit, values if axes else values[:, 0], "nodes" if axes else ""))
    columns, notes = _real_columns(full)
    columns += _parameters(solutions, data)
    length = export.keys.get("length unit")
    coordinates = {
        name.text: Column(name.text, np.asarray(values).real, name.unit or length, "{length}")
        for name, values in axes
    }
    places = {"nodes": Places(np.arange(1, len(axes[0][1]) + 1), coordinates, triangles)} if axes else {}
    return Results.of(export.path, f"{FORMAT}, {kind}", len(solutions), columns, places, notes)


def _parameters(solutions: Sequence[str], data: Sequence[tuple[Name, np.ndarray]]) -> list[Column]:
    """Return a column for each parameter that all solutions assign."""
    by_solution = {name.solution: name.assignments for name, _ in data}
    rows = [by_solution.get(solution, {}) for solution in solutions]
    names = [key for key in rows[0] if all(key in row for row in rows)]
    return [
        Column(key, np.array([row[key][0] for row in rows], dtype=float), rows[0][key][1]) for key in names
    ]


def _real_columns(
    columns: Sequence[tuple[str, str | None, np.ndarray, str]],
) -> tuple[list[Column], list[str]]:
    """Return columns of real numbers, and sentences about the complex ones."""
    real, notes = [], []
    for text, unit, values, places in columns:
        if np.iscomplexobj(values) and np.abs(np.nan_to_num(values.imag)).max(initial=0.0) > 0:
            notes.append(f"Skipped {text}: its values are complex; export real({text}) or abs({text}).")
            continue
        real.append(Column(text, np.asarray(values.real, dtype=float), unit, places=places))
    return real, notes
