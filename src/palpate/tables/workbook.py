"""Rows of a workbook (.xlsx) as rows of text, read by openpyxl where it is installed."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

from palpate.errors import FileFormatError, UsageError
from palpate.tables.table_layout import Row

__all__ = ["workbook_rows"]


def workbook_rows(path: Path, sheet: str | None) -> tuple[list[Row], list[str]]:
    """Return the rows of a sheet that are not empty, and notes on what was left out.

    Of a formula the value counts that was last computed. `sheet` is needed where several hold something.
    """
    try:
        import openpyxl
    except ImportError as error:
        raise UsageError(
            f"workbook {path.name} needs openpyxl, which is not installed.",
            fix="Install it: pip install 'palpate[xlsx]'. Or save the sheet as CSV.",
        ) from error
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {page.title: _rows(page) for page in book.worksheets if sheet in {None, page.title}}
        names = [page.title for page in book.worksheets]
        book.close()
    except (
        OSError,
        KeyError,
        ValueError,
        zipfile.BadZipFile,
        openpyxl.utils.exceptions.InvalidFileException,
    ) as error:
        raise FileFormatError(
            f"{path} can't be read as a workbook.", why=f"{error}.", fix="Save the sheet as CSV."
        ) from error
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


def _rows(page: Any) -> list[Row]:
    rows = [
        Row(i, tuple("" if value is None else str(value).strip() for value in cells))
        for i, cells in enumerate(page.iter_rows(values_only=True), 1)
    ]
    return [row for row in rows if row.filled]
