"""Options of commands that read a table: how the file is written, which columns, and missing values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer

from palpate.cli.number_options import count_option, with_options
from palpate.errors import UsageError

__all__ = [
    "Force",
    "Json",
    "MissingOption",
    "Verbose",
    "column_list",
    "reading_options",
    "with_table_options",
]

Json = Annotated[bool, typer.Option("--json", help="Print the results as one JSON object.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Print every figure with its limit, and the worst cases.")
]
Force = Annotated[
    bool,
    typer.Option(
        "--force", help="Replace tables, and files of palpate's that were changed since; never others."
    ),
]
MissingOption = Annotated[
    str, typer.Option("--missing", help="Rows in which a value is missing: leave-out or refuse.")
]


def reading_options(
    encoding: Annotated[
        str | None,
        typer.Option(help="Encoding of the table, such as latin-1. Default: found from its bytes."),
    ] = None,
    separator: Annotated[
        str | None,
        typer.Option(help="Mark between cells: ';', ',', tab or space. Default: found from the rows."),
    ] = None,
    decimal: Annotated[
        str | None, typer.Option(help="Decimal mark: . or , Default: found from the numbers.")
    ] = None,
    header: Annotated[
        int | None, count_option("--header", least=1, help="Number of the line that names the columns.")
    ] = None,
    last: Annotated[
        int | None, count_option("--last", least=1, help="Number of the last line of data.")
    ] = None,
    sheet: Annotated[
        str | None, typer.Option(help="Sheet of a workbook (.xlsx). Default: its only one.")
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(help="Unit of a column, NAME=UNIT, such as x=mm. Can be given several times."),
    ] = None,
) -> dict[str, Any]:
    """Return the options of `palpate.tables.read_table`, from those of a command."""
    units = {}
    for text in unit or ():
        name, mark, value = text.rpartition("=")
        if not mark or not name.strip():
            raise UsageError(f"{text!r} is no unit of a column.", fix="Write NAME=UNIT, such as --unit x=mm.")
        units[name.strip()] = value.strip()
    given = {
        "encoding": encoding,
        "separator": separator,
        "decimal": decimal,
        "header": header,
        "last": last,
        "sheet": sheet,
        "units": units or None,
    }
    return {name: value for name, value in given.items() if value is not None}


with_table_options = with_options(reading=reading_options)
"""Decorator of a command that has the options of how a table is written in place of its parameter `reading`."""


def column_list(texts: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return names of columns from texts with commas between them; a name that has a comma itself is kept whole."""
    found = []
    for text in texts:
        found += [text] if text in names else [part.strip() for part in text.split(",") if part.strip()]
    return found
