"""Commands that learn from tables: `palpate fit` and `palpate correct`. Heavy packages wait until one is called."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import count_option, number_option, with_options
from palpate.cli.table_options import Json, MissingOption, reading_options
from palpate.options import Discrepancy, FitOptions, Noise

__all__ = ["correct", "fit"]


@with_options(reading=reading_options, options=FitOptions)
def fit(
    table: Annotated[Path, typer.Argument(help="Table of samples: text (CSV and its kin) or .xlsx.")],
    inputs: Annotated[
        list[str],
        typer.Option(help="Columns that are the inputs: NAME,NAME. Can be given several times."),
    ],
    outputs: Annotated[
        list[str],
        typer.Option(help="Columns that are the outputs: NAME,NAME. Can be given several times."),
    ],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File for the model. Default: name of the table, with .palpate."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that exists.")] = False,
    missing: MissingOption = "leave-out",
    reading: Any = None,
    options: Any = None,
    as_json: Json = False,
) -> None:
    """Learn a network from columns of a table, in SI units, and write it to a model file."""
    from palpate.cli.fit_command import Columns, fit_table

    fit_table(
        table,
        Columns(inputs, outputs, missing),
        out,
        Console(as_json),
        reading=reading,
        force=force,
        options=options,
    )


@with_options(reading=reading_options, discrepancy=Discrepancy, noise=Noise)
def correct(
    model: Annotated[Path, typer.Argument(help="Model file (.palpate) of a body that a probe presses.")],
    out: Annotated[Path, typer.Option(help="File for the corrected model.")],
    file: Annotated[Path | None, typer.Option(help="Table of measured positions and forces.")] = None,
    stdin: Annotated[
        bool, typer.Option("--stdin", help="Read the lines of a sensor from standard input.")
    ] = False,
    port: Annotated[
        int | None,
        count_option(
            "--port",
            least=0,
            most=65535,
            help="Read lines from one connection to 127.0.0.1 at this port. 0: any free port. "
            "The first line must be the printed token.",
        ),
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(help="Value of a further input of the model: NAME=VALUE. Can be given several times."),
    ] = None,
    stall: Annotated[
        float,
        number_option("--stall", "s", least=0.1, help="A stream ends after so many seconds without a line."),
    ] = 30.0,
    wait: Annotated[
        float, number_option("--wait", "s", least=0.1, help="Seconds to wait for a connection.")
    ] = 60.0,
    token: Annotated[
        bool,
        typer.Option(
            "--token/--no-token",
            help="For --port: take lines only from who sends the printed token first. "
            "Without a token every user of this machine can send.",
        ),
    ] = True,
    missing: MissingOption = "leave-out",
    reading: Any = None,
    discrepancy: Any = None,
    noise: Any = None,
    as_json: Json = False,
) -> None:
    """Correct a model by forces measured on a specimen, and print the error before and after."""
    from palpate.cli.correct_command import Source, correct_model

    source = Source(file, stdin, port, stall, wait, token=token, missing=missing, options=reading)
    correct_model(model, source, out, parameter or [], discrepancy, noise, Console(as_json))
