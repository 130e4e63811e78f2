"""Rows of a workbook (.xlsx) as rows of text, read by openpyxl where it is installed, in a child process.

A workbook is packed XML: a small file may hold gigabytes, and a cell may claim to stand in column 16,384. What is read
is bounded by the cells that are there.
"""

from __future__ import annotations

import importlib.util
import zipfile
from pathlib import Path
from typing import Any

from palpate.errors import FileFormatError, UsageError
from palpate.input_files import DAMAGE, plain_text
from palpate.supervised import read_in_child
from palpate.tables.table_layout import Row

__all__ = ["workbook_rows"]

# rows of numbers deflate to a tenth, constant ones to a hundredth; blanks to a thousandth
_LARGEST_BLANK, _DENSEST = 50_000_000, 200
# cells that rows may have in all, and more for each full one
_EMPTY_CELLS, _EMPTY_SHARE = 1_000_000, 100


def workbook_rows(path: Path, sheet: str | None) -> tuple[list[Row], list[str]]:
    """Return the rows of a sheet that are not empty, and notes on what was left out.

    Of a formula the value counts that was last computed. `sheet` is needed where several hold something.
    """
    if importlib.util.find_spec("openpyxl") is None:
        raise UsageError(
            f"workbook {path.name} needs openpyxl, which is not installed.",
            fix="Install it: pip install 'palpate[xlsx]'. Or save the sheet as CSV.",
        )
    names, sheets = read_in_child(_read_sheets, path, sheet)
    full = {name: rows for name, rows in sheets.items() if rows}
    if sheet is not None and sheet not in sheets:
        raise FileFormatError(f"{path} has no sheet {sheet!r}.", why=f"It has {', '.join(map(repr, names))}.")
    if len(full) > 1:
        raise FileFormatError(
            f"{path} has {len(full)} sheets: {', '.join(map(repr, full))}.",
            why="Which one is meant can't be known.",
            fix=f"Name it: sheet={next(iter(full))!r} (--sheet).",
        )
    return next(iter(full.values()), []), []


def _read_sheets(path: Path, sheet: str | None) -> tuple[list[str], dict[str, list[Row]]]:
    """Return the names of all sheets, and the rows of the one that is meant, or of each."""
    import openpyxl

    try:
        _require_dense(path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        pages = {plain_text(page.title): page for page in book.worksheets}
        sheets = {title: _rows(page) for title, page in pages.items() if sheet in {None, title}}
        book.close()
    except (openpyxl.utils.exceptions.InvalidFileException, *DAMAGE) as error:
        raise FileFormatError(
            f"{path} can't be read as a workbook.", why=f"{error}.", fix="Save the sheet as CSV."
        ) from error
    return list(pages), sheets


def _require_dense(path: Path) -> None:
    """Refuse a workbook whose packed parts are larger than cells would make them."""
    with zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            if member.file_size > _LARGEST_BLANK + _DENSEST * member.compress_size:
                raise ValueError(
                    f"{member.compress_size:,} bytes of {member.filename} promise {member.file_size:,}"
                )


def _rows(page: Any) -> list[Row]:
    """Return the rows that hold something, of equal length; a far cell that would make them too long is refused."""
    page.reset_dimensions()  # what the sheet says of its size may be anything
    rows, width, there = [], 0, 0
    for number, cells in enumerate(page.iter_rows(values_only=True), 1):
        texts = tuple("" if value is None else plain_text(str(value)).strip() for value in cells)
        if not any(texts):
            continue
        rows.append(Row(number, texts))
        width, there = max(width, len(texts)), there + sum(map(bool, texts))
        if width * len(rows) > _EMPTY_CELLS + _EMPTY_SHARE * there:
            raise ValueError(f"row {number} has a cell in column {len(texts)}, far from the others")
    return [Row(row.line, row.cells + ("",) * (width - len(row.cells))) for row in rows]
