"""A table of results as a value, printed on a terminal or as plain data."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rich.console import Console
from rich.table import Table as RichTable

__all__ = ["Claim", "Column", "Table", "quick_mark"]


def quick_mark(quick: bool) -> str:
    """Return what ends the title of a table whose figures mean nothing, since only few things were measured."""
    return " (quick)" if quick else ""


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    key : str
        Of the rows' mappings.
    title : str
    form : str
        Format of a number, as in ``format(value, form)``.
    """

    key: str
    title: str
    form: str = ""

    def text(self, row: Mapping[str, Any]) -> str:
        """One cell; a missing or undefined number is a dash."""
        value = row.get(self.key)
        if value is None or (isinstance(value, float) and math.isnan(value)):
            return "–"
        return format(value, self.form) if self.form and not isinstance(value, str) else str(value)


@dataclass(frozen=True)
class Claim:
    """Figures beside the bound that was set for them.

    Attributes
    ----------
    what : str
    values : tuple of float
        One for each seed; a single one where nothing is left to chance.
    bound : float
        The claim holds for a value where value ≤ bound.
    form : str
        Format of the values.
    """

    what: str
    values: tuple[float, ...]
    bound: float
    form: str = ".1e"

    @property
    def met(self) -> float:
        """Share of the values for which it holds; not-a-number never does."""
        return sum(value <= self.bound for value in self.values) / len(self.values)

    def __str__(self) -> str:
        verdict = "met" if self.met == 1.0 else "MISSED"
        count = len(self.values)
        if count == 1:
            return f"{verdict}: {self.what}: {self.values[0]:{self.form}} (wanted ≤ {self.bound:g})"
        kept = (
            f"met on {round(self.met * count)} of {count} seeds"
            if self.met < 1.0
            else f"met on all {count} seeds"
        )
        median, worst = statistics.median(self.values), max(self.values)
        return f"{kept}: {self.what}: median {median:{self.form}}, worst {worst:{self.form}} (wanted ≤ {self.bound:g})"


@dataclass(frozen=True)
class Table:
    """Rows under a title, what was claimed of them, and what a reader has to know.

    Attributes
    ----------
    name : str
        Of its record in benchmarks/records.
    title : str
    columns : sequence of Column
    rows : sequence of mappings
    claims : sequence of Claim
    notes : sequence of str
    """

    name: str
    title: str
    columns: Sequence[Column]
    rows: Sequence[Mapping[str, Any]]
    claims: Sequence[Claim] = field(default_factory=tuple)
    notes: Sequence[str] = field(default_factory=tuple)

    def show(self, console: Console) -> None:
        """Print on a terminal."""
        table = RichTable(title=self.title, title_justify="left")
        for i, column in enumerate(self.columns):
            table.add_column(column.title, justify="left" if i == 0 else "right")
        for row in self.rows:
            table.add_row(*(column.text(row) for column in self.columns))
        console.print(table)
        for line in (*map(str, self.claims), *self.notes):
            console.print(f"  {line}", highlight=False, markup=False, soft_wrap=True)

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON, numbers unrounded."""
        return {
            "name": self.name,
            "title": self.title,
            "rows": [dict(row) for row in self.rows],
            "claims": [{**vars(claim), "met": claim.met} for claim in self.claims],
            "notes": list(self.notes),
        }
