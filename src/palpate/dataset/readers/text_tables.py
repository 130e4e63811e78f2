"""Text tables and workbooks as results: a row for each case, or for each place of each case."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.dataset.readers.results import Column, Results
from palpate.tables import read_table

__all__ = ["SUFFIXES", "read_text_table"]

SUFFIXES = (".csv", ".tsv", ".txt", ".asc", ".lvm", ".xlsx")


def read_text_table(path: Path) -> Results:
    """Read the columns of numbers of a table; columns of words are skipped and named."""
    table = read_table(path)
    columns, notes = [], list(table.notes)
    for column in table.columns:
        if not np.isfinite(table.numerals.values(table.cells[column.position - 1])).any():
            notes.append(f"Skipped {column.name}: a column without numbers.")
            continue
        unit = None if not column.unit else "" if column.unit == "1" else column.unit
        columns.append(Column(column.name, table.numbers(column.name), unit))
    return Results.of(path, "text table", len(table), columns, notes=notes)
