"""The readings among the rows below a table's head: without heads that stand again, and without rows of statistics.

A file of several blocks repeats its head, with lines of the block above it; other names or units there are refused.
Mean, maximum and the like beside the readings are none, in whatever column their word stands.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from palpate.errors import FileFormatError, UsageError
from palpate.format import by_number
from palpate.tables.numerals import is_missing, is_numeral
from palpate.tables.table_layout import Head, Row, could_name, is_row_of_units

__all__ = ["check_widths", "readings_of", "words_among_numbers"]

_STATISTIC = re.compile(
    r"(mean|average|avg|median|minimum|min|maximum|max|std|stdev|stddev|sd|s\.d|stand(ard)?\.? ?(deviation|dev|error)"
    r"|sem|variance|var|range|sum|total|count|cv|cov|coefficient of variation|rms"
    r"|mittel|mittelwert|mw|durchschnitt|standardabweichung|stabw|varianz|summe|anzahl|spannweite|variationskoeffizient"
    r"|moyenne|écart[ -]type|médiane|somme|media|mediana|mínimo|máximo|desviación|varianza|suma)"
    r"(?![^\W\d_]).*|[ns]|x̄|ø|σ|ν"
)
_NUMERIC = frozenset("0123456789+-−.,")  # what a number begins with


def readings_of(
    rows: Sequence[Row], head: Head | None, columns: Sequence[int]
) -> tuple[list[Row], list[str]]:
    """Return the rows below the head that are readings, and notes on what was left out.

    `columns` are those that hold numbers. A table that begins anew with other names or units is refused.
    """
    rows = [row for row in rows if row.filled]
    words = [i for i, row in enumerate(rows) if any(map(_is_word, row.cells))]
    heads, above = _repeated_heads(rows, words, head, columns) if head else (set(), set())
    statistics = _statistics(rows, [i for i in words if i not in heads | above], columns)
    notes = []
    if heads:
        note = (
            f"The head stands again in {by_number('line', [rows[i].line for i in sorted(heads)])}: left out"
        )
        lines = by_number("line", [rows[i].line for i in sorted(above)])
        notes.append(note + (f", with what is written above it in {lines}." if above else "."))
    if statistics:
        shown = ", ".join(dict.fromkeys(statistics[i] for i in sorted(statistics)))
        lines = by_number("line", [rows[i].line for i in sorted(statistics)])
        notes.append(f"Left out, since no readings: {shown:.80} ({lines}).")
    lost = heads | above | statistics.keys()
    return [row for i, row in enumerate(rows) if i not in lost], notes


def words_among_numbers(rows: Sequence[Row], columns: Sequence[int], names: Mapping[int, str]) -> list[str]:
    """Return a note on words that stand where a column has numbers; whoever uses that column gets an error instead."""
    notes = []
    for j in columns:
        found = [
            row
            for row in rows
            if j < len(row.cells) and _is_word(row.cells[j]) and not is_numeral(row.cells[j])
        ]
        if found and j in names:
            where = by_number("line", [row.line for row in found])
            word = found[0].cells[j]
            notes.append(
                f"{word[:40]!r} stands where {names[j]!r} has numbers ({where}); its row is a reading all the same."
            )
    return notes


def check_widths(
    path: Path, data: Sequence[Row], width: int, head: Head | None, separator: str | None
) -> None:
    """Refuse rows that have fewer cells than others, or more than there are names."""
    named = head.names.filled if head else width
    room = max(named, len(head.names.cells)) if head else width  # names of the last columns may be empty
    for row in data:
        if named <= len(row.cells) <= room:
            continue
        if len(row.cells) < named or row.filled > room:
            comma = (
                " If commas are decimal marks too, the cells can't be told apart." if separator == "," else ""
            )
            number = max(row.filled, min(len(row.cells), named))
            raise FileFormatError(
                f"{path}, line {row.line}: {number} values stand where {named} belong.",
                why="Between which cells one is missing or too much can't be known." + comma,
                fix="Correct the line. If it is none of the table, say where that ends: last=… (--last). If marks or "
                "names were taken wrongly, state them: separator=… (--separator), header=… (--header).",
            )


def _is_word(cell: str) -> bool:
    return cell != "" and cell[0] not in _NUMERIC and not is_missing(cell)


@functools.lru_cache(maxsize=1024)
def _is_statistic(cell: str) -> bool:
    return _STATISTIC.fullmatch(" ".join(cell.split()).casefold()) is not None


def _is_text(cell: str) -> bool:
    return not is_numeral(cell) and not is_missing(cell)


def _repeated_heads(
    rows: Sequence[Row], words: Sequence[int], head: Head, columns: Sequence[int]
) -> tuple[set[int], set[int]]:
    """Return the indices of rows that say what the head says, and of the lines that each block has above them."""
    same = {_filled(row) for row in (head.names, head.units, *head.others, *head.groups) if row is not None}
    firsts = {cells[0] for cells in same if cells}
    heads = {i for i in words if rows[i].cells[0] in firsts and _filled(rows[i]) in same}
    above: set[int] = set()
    for i in heads:
        if _filled(rows[i]) == _filled(head.names):
            above |= set(range(_end_of_block(rows, i, columns), i)) - heads
    width = len(head.names.cells)
    for i in words:
        if len(columns) < 2 or not _is_word(rows[i].cells[min(columns[0], len(rows[i].cells) - 1)]):
            continue
        cells = [rows[i].cells[j] if j < len(rows[i].cells) else "" for j in columns]
        if i not in heads | above and all(map(_is_text, cells)) and could_name(rows[i], width):
            raise _other_head(rows, i, head, columns, is_units=is_row_of_units(rows[i], width))
    return heads, above


def _end_of_block(rows: Sequence[Row], i: int, columns: Sequence[int]) -> int:
    """Return the index behind the last reading above row i."""
    while i > 0 and _opens_block(rows[i - 1], columns):
        i -= 1
    return i


def _other_head(
    rows: Sequence[Row], i: int, head: Head, columns: Sequence[int], *, is_units: bool
) -> UsageError:
    """Return the error of a second head that says something else."""
    end = _end_of_block(rows, i, columns)
    last, first = rows[max(end - 1, 0)].line, rows[max(i - 1, end) if is_units else i].line
    known = head.units.line if is_units and head.units else head.names.line
    return UsageError(
        f"line {rows[i].line}: the table begins anew, with other {'units' if is_units else 'names'} than in line "
        f"{known}: {', '.join(filter(None, rows[i].cells)):.80}.",
        why="One table has one head; what stands below the second one would be taken for something else.",
        fix=f"Read one part: up to line {last} by last={last} (--last), from there on by header={first} (--header). "
        "Or split the file.",
    )


def _opens_block(row: Row, columns: Sequence[int]) -> bool:
    """Return true of a line of text above the head of a block: words, in place of what would be a reading."""
    cells = [row.cells[j] if j < len(row.cells) else "" for j in columns]
    return any(map(_is_text, cells)) and sum(map(is_numeral, cells)) < len(columns) - 1


def _statistics(rows: Sequence[Row], words: Sequence[int], columns: Sequence[int]) -> dict[int, str]:
    """Return the words of rows that hold statistics of the others, by index.

    In a column of numbers, or one that is empty but for them, such a word says so by itself. Among words, such as the
    names of specimens, it does at the end of the column, where each stands once.
    """
    found: dict[int, dict[int, str]] = {}
    for i in words:
        for j, cell in enumerate(rows[i].cells):
            if cell != "" and cell[0] not in _NUMERIC and _is_statistic(cell) and not is_missing(cell):
                found.setdefault(j, {})[i] = cell
    left_out: dict[int, str] = {}
    for j, cells in found.items():
        if j not in columns:
            others = [
                i for i, row in enumerate(rows) if i not in cells and j < len(row.cells) and row.cells[j]
            ]
            is_label = not others and len(cells) < len(rows)
            ends = len(cells) < len(others) < min(cells) + 1 and max(others) < min(cells)
            if not is_label and not (ends and len(set(cells.values())) == len(cells)):
                continue
        left_out |= {i: word for i, word in cells.items() if i not in left_out}
    return left_out


def _filled(row: Row) -> tuple[str, ...]:
    return row.cells[: row.filled]
