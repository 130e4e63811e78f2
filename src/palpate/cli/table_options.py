"""Options of commands that read a table: how the file is written, which columns, and missing values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer

from palpate.errors import UsageError

__all__ = [
    "DecimalOption",
    "EncodingOption",
    "HeaderOption",
    "Json",
    "LastOption",
    "MissingOption",
    "SeparatorOption",
    "SheetOption",
    "UnitOption",
    "column_list",
    "reading_options",
]

Json = Annotated[bool, typer.Option("--json", help="Print the results as one JSON object.")]
EncodingOption = Annotated[
    str | None,
    typer.Option("--encoding", help="Encoding of the table, such as latin-1. Default: found from its bytes."),
]
SeparatorOption = Annotated[
    str | None,
    typer.Option(
        "--separator", help="Mark between cells: ';', ',', tab or space. Default: found from the rows."
    ),
]
DecimalOption = Annotated[
    str | None, typer.Option("--decimal", help="Decimal mark: . or , Default: found from the numbers.")
]
HeaderOption = Annotated[
    int | None, typer.Option("--header", min=1, help="Number of the line that names the columns.")
]
LastOption = Annotated[int | None, typer.Option("--last", min=1, help="Number of the last line of data.")]
SheetOption = Annotated[
    str | None, typer.Option("--sheet", help="Sheet of a workbook (.xlsx). Default: its only one.")
]
UnitOption = Annotated[
    list[str] | None,
    typer.Option("--unit", help="Unit of a column, NAME=UNIT, such as x=mm. Can be given several times."),
]
MissingOption = Annotated[
    str, typer.Option("--missing", help="Rows in which a value is missing: leave-out or refuse.")
]


def reading_options(
    encoding: str | None,
    separator: str | None,
    decimal: str | None,
    header: int | None,
    last: int | None,
    sheet: str | None,
    unit: Sequence[str] | None,
) -> dict[str, Any]:
    """Return the options of `palpate.tables.read_table`, from those of a command.

    Raises
    ------
    UsageError
        If a unit is not NAME=UNIT.
    """
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


def column_list(texts: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return names of columns from texts with commas between them; a name that has a comma itself is kept whole."""
    found = []
    for text in texts:
        found += [text] if text in names else [part.strip() for part in text.split(",") if part.strip()]
    return found
