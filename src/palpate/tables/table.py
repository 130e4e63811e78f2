"""Tables of numbers from files: one reader for what measuring programs, spreadsheets and solvers export.

::

    table = read_table("bench.csv")
    table.names                       names of the columns
    table.values("Fz")                one column in SI units, with not-a-number where a cell is empty
    table.array(["x", "y"])           several columns (N, 2), in SI units

What can't be certain is refused, with the line, what stands there and the option that settles it.
"""

from __future__ import annotations

import collections
import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate import checks
from palpate.errors import FileFormatError, UsageError
from palpate.format import by_number
from palpate.tables.labview import is_labview, labview_rows
from palpate.tables.numerals import Numerals
from palpate.tables.table_body import check_widths, readings_of, words_among_numbers
from palpate.tables.table_layout import Head, Row, body_of, choose_separator, head_of, rows_of, split_comments
from palpate.tables.table_text import read_table_text
from palpate.tables.unit_names import name_and_unit, plain_unit, si_unit
from palpate.unit_text import registry

__all__ = ["Column", "Table", "read_table"]

_MAKE = "Write a line of names such as t [s], x [mm], F [N], and rows of numbers."
_WORKBOOKS = {".xlsx", ".xlsm"}
_SHOWN = 20  # names of columns that a message lists


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : str
        Its name, without the unit.
    unit : str
        Its unit as the file states it; "1" for a pure number, "" where no unit is stated.
    position : int
        Its number, counted from 1.
    aliases : tuple of str
        Names that further lines of the head give it.
    line, unit_line : int
        Lines of its name and of its unit; 0 where there are none.
    """

    name: str
    unit: str
    position: int
    aliases: tuple[str, ...] = ()
    line: int = 0
    unit_line: int = 0


@dataclass(frozen=True, eq=False)
class Table:
    """A table of a file.

    Attributes
    ----------
    path : Path
        The file.
    columns : tuple of Column
        Columns in the order of the file.
    cells : tuple of tuples of str
        Text of the cells, by column.
    lines : (N,) int
        Number of the line of each row.
    numerals : Numerals
        Convention by which numbers are written.
    notes : tuple of str
        Sentences on what was skipped or taken for something.
    """

    path: Path
    columns: tuple[Column, ...]
    cells: tuple[tuple[str, ...], ...]
    lines: np.ndarray
    numerals: Numerals
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in the order of the file."""
        return tuple(column.name for column in self.columns)

    def column(self, name: str) -> Column:
        """Return the column of a name; where none is spelt so, of one that differs in case or blanks alone.

        Raises
        ------
        UsageError
            If there is none.
        FileFormatError
            If more than one has the name.
        """
        for key, further in ((str, False), (_folded, False), (str, True), (_folded, True)):
            found = [c for c in self.columns if key(name) in map(key, c.aliases if further else (c.name,))]
            if len(found) == 1:
                return found[0]
            if found:
                where = " and ".join(str(c.position) for c in found)
                raise FileFormatError(
                    f"{self.path}, line {found[0].line}: {name!r} is the name of columns {where}.",
                    why="One of them would be taken by chance.",
                    fix="Give each a name of its own.",
                )
        raise UsageError(
            f"{self.path} has no column {name!r}.",
            why=f"Its columns are {', '.join(map(repr, self.names[:_SHOWN]))}{', …' * (len(self.names) > _SHOWN)}.",
            fix=checks.did_you_mean(name, self.names, shown=repr) or "Choose among these.",
        )

    def numbers(self, name: str) -> np.ndarray:
        """Return the numbers (N,) of a column in its own unit; not-a-number where a cell holds no value.

        Raises
        ------
        UsageError
            If there is no such column.
        FileFormatError
            If a cell holds something else; the message names its line.
        """
        column = self.column(name)
        cells = self.cells[column.position - 1]
        values = self.numerals.values(cells)
        if not np.isfinite(values).all() and (fault := self.numerals.first_fault(cells)) is not None:
            raise FileFormatError(
                f"{self.path}, line {self.lines[fault]}: Column {column.position} ({column.name}) holds "
                f"{cells[fault][:40]!r}, which is no finite number.",
                why=f"Numbers here have the decimal mark {self.numerals.decimal!r}.",
                fix="Correct the cell or leave it empty. How numbers are written: decimal=',' (--decimal); where the "
                "table ends: last=… (--last).",
            )
        return values

    def values(self, name: str, unit: str | None = None) -> np.ndarray:
        """Return a column (N,) in SI units; see `numbers`.

        Parameters
        ----------
        name : str
            Name of the column.
        unit : str, optional
            SI unit that it must have; any by default.

        Raises
        ------
        UsageError
            If there is no such column, or its unit is unknown, not stated, or of another quantity.
        FileFormatError
            If a cell holds something else than a number.
        """
        column = self.column(name)
        factor, offset, own = self._si(column)
        if unit is not None and own != unit and not (column.unit and _same(own, unit)):
            raise UsageError(
                f"{self._unit_place(column)}: column {column.name!r} "
                + (f"is in {column.unit}" if column.unit else "has no unit")
                + f"; {unit or 'a pure number'} is needed.",
                why="A guessed unit may be wrong by a factor of a thousand.",
                fix=f"State it in the head, such as {column.name} [{unit or '1'}], or by units={{{column.name!r}: "
                f"{unit or '1'!r}}} (--unit {column.name}={unit or '1'}).",
            )
        return factor * self.numbers(name) + offset

    def array(self, names: Sequence[str]) -> np.ndarray:
        """Return several columns (N, k) in SI units, in the order of their names; see `values`."""
        return np.column_stack([self.values(name) for name in names]) if names else np.zeros((len(self), 0))

    def si_unit(self, name: str) -> str:
        """Return the SI unit in which `values` states a column; "" where the file states none."""
        return self._si(self.column(name))[2]

    def rows_without_gaps(
        self, values: np.ndarray, names: Sequence[str], missing: str
    ) -> tuple[np.ndarray, list[str]]:
        """Return which rows (N,) have all values, and a note on the others.

        Parameters
        ----------
        values : (N, k)
            Numbers of k columns; a gap is not finite.
        names : sequence of k str
            Names of these columns, for messages.
        missing : str
            "leave-out" or "refuse" rows with a gap.

        Raises
        ------
        UsageError
            If `missing` is neither of these.
        FileFormatError
            If rows with gaps are to be refused, and there are some.
        """
        checks.one_of("What becomes of missing values", missing, ("leave-out", "refuse"))
        whole = np.isfinite(values).all(axis=1)
        rows = np.flatnonzero(~whole)
        if not rows.size:
            return whole, []
        if missing == "refuse":
            column = names[int((~np.isfinite(values[rows[0]])).argmax())]
            raise FileFormatError(
                f"{self.path}, line {self.lines[rows[0]]}: Column {column!r} has no value. {len(rows)} of "
                f"{len(whole)} rows {'has' if len(rows) == 1 else 'have'} a gap.",
                why="Rows with a gap were to be refused.",
                fix="Correct them, or have them left out: missing='leave-out' (--missing leave-out).",
            )
        lines = by_number("line", self.lines[rows].tolist())
        note = f"{len(rows)} of {len(whole)} rows left out, in which a value is missing: {lines}."
        return whole, [note]

    def with_units(self, units: Mapping[str, str]) -> Table:
        """Return the table with other units of some columns, by name.

        Raises
        ------
        UsageError
            If there is no such column.
        """
        new = {self.column(name).position: plain_unit(unit) or "1" for name, unit in units.items()}
        columns = tuple(replace(c, unit=new.get(c.position, c.unit)) for c in self.columns)
        return replace(self, columns=columns)

    def _si(self, column: Column) -> tuple[float, float, str]:
        try:
            return si_unit(column.unit)
        except UsageError as error:
            raise FileFormatError(
                f"{self._unit_place(column)}: column {column.name!r}: {error.what}",
                why=error.why,
                fix=error.fix,
            ) from error

    def _unit_place(self, column: Column) -> str:
        line = column.unit_line or column.line
        return f"{self.path}, line {line}" if line else str(self.path)


def read_table(
    path: str | os.PathLike[str],
    *,
    encoding: str | None = None,
    separator: str | None = None,
    decimal: str | None = None,
    header: int | None = None,
    last: int | None = None,
    sheet: str | None = None,
    units: Mapping[str, str] | None = None,
) -> Table:
    """Read a table from a text file or a workbook.

    Parameters
    ----------
    path : path
        Text with cells between commas, semicolons, tabs, bars or blanks, a LabVIEW measurement ``.lvm``, or a
        workbook ``.xlsx``.
    encoding : str, optional
        Encoding of a text file, such as "latin-1". By default found from the bytes.
    separator : str, optional
        Mark between cells; "tab" and "space" are taken too. By default found from the rows.
    decimal : str, optional
        Decimal mark, "." or ",". By default found from the numbers.
    header : int, optional
        Number of the line that names the columns, counted from 1. By default found from the rows.
    last : int, optional
        Number of the last line of data, where something else follows. By default that of the file.
    sheet : str, optional
        Name of a sheet of a workbook. By default its only one.
    units : mapping, optional
        Units of columns by name, which go before those of the file.

    Returns
    -------
    Table
        Columns with names and units, and rows of cells.

    Raises
    ------
    FileFormatError
        If the file can't be read, is no table, or is ambiguous; the message names line and remedy.
    UsageError
        If an option can't be.
    """
    path = Path(path)
    if decimal not in {None, ".", ","}:
        raise UsageError(f"The decimal mark is {decimal!r}.", fix="Choose '.' or ','.")
    mark: str | None = None
    try:
        if path.suffix.lower() in _WORKBOOKS:
            from palpate.tables.workbook import workbook_rows

            rows, notes = workbook_rows(path, sheet)
            table = _table(
                path,
                [row for row in rows if last is None or row.line <= last],
                (),
                None,
                decimal or ".",
                header,
                notes,
            )
        else:
            text, note = read_table_text(path, encoding)
            notes, comments = [note] if note else [], list[tuple[int, str]]()
            if is_labview(text):
                rows, mark, own, more = labview_rows(text)
                rows, decimal = [row for row in rows if last is None or row.line <= last], decimal or own
                notes += more
            else:
                lines, comments, stated = split_comments(text)
                lines = lines if last is None else [line for line in lines if line[0] <= last]
                mark = choose_separator(lines, stated if separator is None else separator)
                rows = list(rows_of(lines, mark))
            table = _table(path, rows, comments, mark, decimal, header, notes)
    except FileFormatError:
        raise
    except UsageError as error:
        raise FileFormatError(f"{path}, {error.what}", why=error.why, fix=error.fix) from error
    return table.with_units(units) if units else table


def _table(
    path: Path,
    rows: Sequence[Row],
    comments: Sequence[tuple[int, str]],
    separator: str | None,
    decimal: str | None,
    header: int | None,
    notes: Sequence[str],
) -> Table:
    """Return the table of rows of text."""
    notes = list(notes)
    first, numeric = body_of(rows)
    if not rows:
        raise FileFormatError(f"{path} holds no table.", why="It is empty but for comments.", fix=_MAKE)
    if not numeric:
        raise FileFormatError(
            f"{path} holds no rows of numbers; line {rows[0].line} begins with {rows[0].cells[0][:40]!r}.",
            fix=_MAKE,
        )
    if header is not None:
        start = sum(row.line <= header for row in rows)
        first = max(first, start + body_of(rows[start:])[0])
    head = head_of(rows, first, comments, separator, header)
    data, left_out = readings_of(rows[first:], head, numeric)
    notes += left_out
    if not data:
        raise FileFormatError(f"{path} holds no rows of numbers below its head.", fix=_MAKE)
    width = head.names.filled if head else 0
    for row in data:
        if len(row.cells) > width:
            width = max(width, row.filled)
    check_widths(path, data, width, head, separator)
    cells = tuple(itertools.islice(itertools.zip_longest(*(row.cells for row in data), fillvalue=""), width))
    columns = tuple(
        c for c in _columns(path, head, width) if head is None or c.name or any(cells[c.position - 1])
    )
    columns = tuple(c if c.name else replace(c, name=f"column {c.position}") for c in columns)
    notes += words_among_numbers(data, numeric, {c.position - 1: c.name for c in columns})
    if head is None:
        notes.append(f"No line names the columns: they are called {columns[0].name} to {columns[-1].name}.")
    elif head.skipped:
        notes.append(f"Left out of the head: line {', '.join(map(str, head.skipped))}.")
    lines = np.array([row.line for row in data])
    if decimal is None:
        by_number = [list(zip(lines.tolist(), cells[j], strict=True)) for j in numeric if j < width]
        numerals = Numerals.of(by_number, separator)
    else:
        numerals = Numerals(decimal)
    return Table(path, columns, cells, lines, numerals, tuple(notes))


def _columns(path: Path, head: Head | None, width: int) -> tuple[Column, ...]:
    """Return the columns with the names and units that the head gives them."""
    if head is None:
        return tuple(Column(f"column {j + 1}", "", j + 1) for j in range(width))
    if head.units is not None and len(head.units.cells) < head.names.filled:
        raise FileFormatError(
            f"{path}, line {head.units.line}: The row of units has {len(head.units.cells)} cells for "
            f"{head.names.filled} columns.",
            fix="One for each.",
        )

    def cell(row: Row, j: int) -> str:
        return row.cells[j] if j < len(row.cells) else ""

    columns = []
    for j in range(width):
        name, unit = name_and_unit(cell(head.names, j))
        line, below = head.names.line if unit else 0, plain_unit(cell(head.units, j)) if head.units else ""
        if unit and below and unit != below:
            raise FileFormatError(
                f"{path}, line {head.units.line if head.units else 0}: column {name!r} is in {below}, in line "
                f"{head.names.line} in {unit}.",
                fix="State one unit.",
            )
        if head.units is not None and not unit:
            line = head.units.line
        others = [name_and_unit(cell(row, j)) for row in head.others]
        unit = unit or below or next((u for _, u in others if u), "")
        aliases = tuple(n for n, _ in others if n and n != name)
        columns.append(Column(name, unit, j + 1, aliases, head.names.line, line))
    return _with_groups(columns, head, width)


def _with_groups(columns: list[Column], head: Head, width: int) -> tuple[Column, ...]:
    """Return columns whose names, where several have one, begin with the name of their group."""
    counts = collections.Counter(c.name for c in columns)
    if not head.groups:
        return tuple(columns)
    groups, group = [], ""
    for j in range(width):  # merged cells stand in the first one
        group = (
            head.groups[0].cells[j] if j < len(head.groups[0].cells) and head.groups[0].cells[j] else group
        )
        groups.append(group)
    return tuple(
        replace(c, name=f"{groups[c.position - 1]} {c.name}".strip()) if counts[c.name] > 1 else c
        for c in columns
    )


def _folded(name: str) -> str:
    return " ".join(name.split()).casefold()


def _same(one: str, other: str) -> bool:
    """Return true of two spellings of one SI unit."""
    first, second = si_unit(one), si_unit(other)
    return first[:2] == second[:2] == (1.0, 0.0) and _dimension(one) == _dimension(other)


def _dimension(unit: str) -> object:
    return registry().Unit(unit.replace("·", "*").replace("^", "**") or "dimensionless").dimensionality
