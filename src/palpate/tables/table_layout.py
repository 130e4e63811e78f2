"""The layout of a text table: its rows of cells, where the data begin, and what the head says of the columns.

The head of a table may have lines of comment (# or %), a line ``sep=;``, titles, several lines of names, and a row of
units. Data are rows whose columns of numbers hold numbers or nothing; what columns these are is taken from the rows
themselves. Names stand in the last full row above them; where no row does, in the last comment of as many cells.
"""

from __future__ import annotations

import collections
import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from palpate.errors import UsageError
from palpate.tables.numerals import is_missing, is_numeral
from palpate.tables.unit_names import is_unit

__all__ = [
    "Head",
    "Row",
    "body_of",
    "choose_separator",
    "could_name",
    "head_of",
    "is_row_of_units",
    "rows_of",
    "split_comments",
]

_RULE = re.compile(r"[\s|+:;,-]*(?:-{3,}|={3,})[\s|+:;,=-]*")  # a line drawn under a head
_COMMENT = re.compile(r'\s*"?\s*[#%]+')
_SEPARATORS = (";", "\t", ",", "|", " ")
_NAMED = {"tab": "\t", "\\t": "\t", "space": " ", "blank": " ", "comma": ",", "semicolon": ";"}
_SAMPLE = 400  # rows at both ends from which the layout is taken
_QUOTED_LINES = 50  # that one quoted cell may have
_WORD = re.compile(r"\S+(?:\s*[\[(][^\])]*[\])])?")  # between blanks, with a unit in brackets


class Row(NamedTuple):
    """Cells of one row, stripped, and the number of its first line."""

    line: int
    cells: tuple[str, ...]

    @property
    def filled(self) -> int:
        """Number of cells up to the last that is not empty."""
        return next((i for i in range(len(self.cells), 0, -1) if self.cells[i - 1]), 0)


@dataclass(frozen=True)
class Head:
    """Content of a table's head."""

    names: Row  # of the columns, as they stand there
    units: Row | None = None  # row of units
    others: tuple[Row, ...] = ()  # further rows of names, of the whole width, from the nearest on
    groups: tuple[Row, ...] = ()  # rows with names of groups of columns
    skipped: tuple[int, ...] = ()  # lines that are neither


def split_comments(text: str) -> tuple[list[tuple[int, str]], list[tuple[int, str]], str | None]:
    """Return the numbered lines of a table, those of its comments without their mark, and what ``sep=`` says."""
    lines: list[tuple[int, str]] = []
    comments: list[tuple[int, str]] = []
    stated: str | None = None
    for i, line in enumerate(text.split("\n"), 1):
        begin = line.lstrip()[:2]
        if not begin or (("---" in line or "===" in line) and _RULE.fullmatch(line)):
            continue
        if (
            not lines
            and stated is None
            and (match := re.fullmatch(r'"?sep=(.|\\t)"?[;,\t]*', line.strip(" ")))
        ):
            stated = _NAMED.get(match[1], match[1])
        elif begin[0] in '#%"' and (match := _COMMENT.match(line)):
            comments.append((i, line[match.end() :].rstrip('"') if '"' in match[0] else line[match.end() :]))
        else:
            lines.append((i, line))
    return lines, comments, stated


def choose_separator(lines: Sequence[tuple[int, str]], stated: str | None) -> str | None:
    """Return the mark between cells: the stated one, else the one by which most cells are numbers; None for none.

    `stated` is one character, or a word for it such as "tab"; `lines` has (number, line) without comments.
    """
    if stated is not None:
        mark = _NAMED.get(stated.lower(), stated)
        if len(mark) != 1 or mark in '"\n' or mark.isalnum():
            raise UsageError(
                f"{stated!r} is no mark between cells.",
                fix="Such as ';', ',', 'tab' or 'space' (--separator).",
            )
        return mark
    sample = [
        line for _, line in (lines if len(lines) <= 2 * _SAMPLE else [*lines[:_SAMPLE], *lines[-_SAMPLE:]])
    ]
    best, choice = 0.0, None
    if not any(mark in line for line in sample if not is_numeral(line) for mark in ";\t,|"):
        best = _share_of_numbers([(line,) for line in sample], 1)
    for mark in _SEPARATORS:
        rows = [tuple(_cells(line, mark) or [line]) for line in sample]
        widths = collections.Counter(len(row) for row in rows if len(row) > 1)
        if not widths:
            continue
        width = max(widths, key=lambda w: (widths[w] * w, w))
        share = _share_of_numbers(rows, width) * widths[width] / len(rows)
        if share > best or (choice is None and share == best):
            best, choice = share, mark
    return choice


def _share_of_numbers(rows: Sequence[tuple[str, ...]], width: int) -> float:
    """Return the share of cells that are numbers, in rows of this width, of all cells."""
    total = sum(1 for row in rows for cell in row if cell.strip())
    good = sum(is_numeral(cell) for row in rows if len(row) == width for cell in row if cell.strip())
    return good / max(1, total)


def rows_of(lines: Sequence[tuple[int, str]], separator: str | None) -> Iterator[Row]:
    """Yield the rows of numbered lines; a quoted cell may have several lines."""
    i = 0
    while i < len(lines):
        number, line = lines[i]
        cells, more = _cells(line, separator), 0
        while cells is None and more < _QUOTED_LINES and i + more + 1 < len(lines):
            more += 1
            line += "\n" + lines[i + more][1]
            cells = _cells(line, separator)
        if cells is None:
            raise UsageError(
                f"line {number}: a double quote opens a cell and does not close it.",
                why="What follows would be one cell.",
                fix='Close it; a quote inside of a quoted cell is written twice: "".',
            )
        yield Row(number, tuple(cell.strip() for cell in cells))
        i += 1 + more


def _cells(line: str, separator: str | None) -> list[str] | None:
    """Return the cells of a line; None where a quoted one goes on."""
    if separator == " ":
        text = line.strip()
        if '"' in text:
            return _quoted_cells(text, " ", strict=False)
        words = text.split()
        return words if any(map(is_numeral, words)) else _words(text)
    if '"' not in line:
        return [line] if separator is None else line.split(separator)
    try:
        return _quoted_cells(line, separator or "\x1f", strict=True)
    except csv.Error as error:
        if "unexpected end" in str(error):
            return None
        # a quote inside of a cell, such as of inches
        return [part.strip().strip('"') for part in line.split(separator)] if separator else [line]


def _quoted_cells(line: str, separator: str, *, strict: bool) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=strict), [])
    except csv.Error as error:
        if "field limit" not in str(error):
            raise
        raise UsageError(
            f"a cell holds more than {csv.field_size_limit():,} characters, in the line that begins with "
            f"{line[:20]!r}.",
            why="No number or name is as long; a quote that opens there may not be closed.",
            fix="Correct the cell, or export the table again.",
        ) from error


def _words(text: str) -> list[str]:
    """Return names between blanks; they may have units in brackets, or several words where gaps are wider."""
    wide = re.split(r"\s{2,}|\t", text)
    return wide if len(wide) > 1 and any(" " in name for name in wide) else _WORD.findall(text)


def body_of(rows: Sequence[Row]) -> tuple[int, tuple[int, ...]]:
    """Return the index of the first row of data, and the columns that hold numbers; rows without any have none."""
    patterns: collections.Counter[tuple[int, ...]] = collections.Counter()
    for row in rows[-_SAMPLE:]:
        patterns[tuple(j for j, cell in enumerate(row.cells) if is_numeral(cell))] += 1
    del patterns[()]
    if not patterns:
        return len(rows), ()
    columns = max(reversed(patterns), key=lambda pattern: patterns[pattern] * len(pattern))
    for i, row in enumerate(rows):
        cells = [row.cells[j] if j < len(row.cells) else "" for j in columns]
        numerals = sum(map(is_numeral, cells))
        if 2 * numerals >= len(columns) and numerals + sum(map(is_missing, cells)) == len(columns):
            return _first_of(rows, i), columns
    return len(rows), columns


def _first_of(rows: Sequence[Row], first: int) -> int:
    """Return the first row of data: rows with a number right above the data, below a head, are data as well."""
    width = len(rows[first].cells)
    above = first
    while above > 0 and any(map(is_numeral, rows[above - 1].cells)) and len(rows[above - 1].cells) == width:
        above -= 1
    # without a row of names above them they are lines of a preamble
    return above if above and could_name(rows[above - 1], width) else first


def could_name(row: Row, width: int) -> bool:
    """Return true of a row that has words, and no number, for most of so many columns."""
    filled = sum(1 for cell in row.cells if cell)
    return (
        not any(map(is_numeral, row.cells))
        and 2 * filled > min(width, len(row.cells))
        and 2 * filled > width - 2
    )


def head_of(
    rows: Sequence[Row],
    first: int,
    comments: Sequence[tuple[int, str]],
    separator: str | None,
    line: int | None = None,
) -> Head | None:
    """Return the head of a table; None where it has none.

    `first` is the index of the first row of data; comments come as (number, text) without their marks; `line` is
    the number of the line that names the columns, where it was stated.
    """
    width = max((row.filled for row in rows[first : first + _SAMPLE]), default=0)
    above = list(rows[:first])
    if line is not None:
        return _stated_head(above, comments, separator, line, width)
    block = [row for row in above if row.filled and not any(map(is_numeral, row.cells))]
    while block and not could_name(block[0], width):
        if block[0].filled > 1 and len(block) > 1 and len(block[0].cells) >= width - 1:
            break  # names of groups of columns
        block.pop(0)  # a title
    if any(could_name(row, width) for row in block):
        return _arranged(block, width)
    last = rows[first].line if first < len(rows) else (rows[-1].line + 1 if rows else 1)
    noted = [_comment_row(n, text, separator, width) for n, text in comments if not rows or n < last]
    fitting = [row for row in noted if row is not None and not any(map(is_numeral, row.cells))]
    if not fitting:
        return None
    # of comments only the last ones can be a head
    return _arranged(fitting[-2:] if is_row_of_units(fitting[-1], width) else fitting[-1:], width)


def _stated_head(
    above: list[Row], comments: Sequence[tuple[int, str]], separator: str | None, line: int, width: int
) -> Head:
    places = {row.line: i for i, row in enumerate(above)}
    if line in places:
        i = places[line]
        units = above[i + 1] if i + 1 < len(above) and is_row_of_units(above[i + 1], width) else None
        return Head(above[i], units)
    for number, text in comments:
        if number == line and (row := _comment_row(number, text, separator, None)) is not None:
            return Head(row)
    raise UsageError(
        f"line {line} names no columns: it is empty, or among the data.",
        fix="Give the number of the line in which the names stand, counted from 1 (--header).",
    )


def _comment_row(number: int, text: str, separator: str | None, width: int | None) -> Row | None:
    """Return a comment as a row, if it has this many cells; between blanks names may have two words."""
    if separator == " ":
        for cells in (re.split(r"\s{2,}|\t", text.strip()), _WORD.findall(text), text.split()):
            if width is None or len(cells) == width:
                return Row(number, tuple(cells))
        return None
    split = _cells(text, separator)
    if split is None:
        return None
    row = Row(number, tuple(cell.strip() for cell in split))
    return row if width is None or (row.filled == width and row.filled) else None


def is_row_of_units(row: Row, width: int) -> bool:
    """Return true of a row half of whose words, or more, are units."""
    cells = [cell for cell in row.cells if cell]
    units = sum(is_unit(cell, among_words=True) for cell in cells)
    return bool(cells) and 2 * units >= len(cells) and len(cells) <= max(width, 1) + 1


def _arranged(block: list[Row], width: int) -> Head:
    """Return the roles of rows of words above the data."""
    units, rest = None, block
    naming = [i for i, row in enumerate(block) if could_name(row, width)]
    if len(block) > 1 and naming[0] < len(block) - 1 and is_row_of_units(block[-1], width):
        units, rest = block[-1], block[:-1]
    most = max(sum(map(bool, row.cells)) for row in rest)
    at = max(i for i, row in enumerate(rest) if sum(map(bool, row.cells)) == most)
    full: list[Row] = []
    groups: list[Row] = []
    line = rest[at].line
    for row in reversed(rest[:at]):
        if row.line != line - 1:  # what stands apart is no head
            break
        (full if sum(map(bool, row.cells)) == most else groups).append(row)
        line = row.line
    return Head(rest[at], units, tuple(full), tuple(groups), tuple(row.line for row in rest[at + 1 :]))
