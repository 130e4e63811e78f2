"""Commands that learn from tables: `palpate fit` and `palpate correct`. Heavy packages wait until one is called."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import count_option, number_option
from palpate.cli.table_options import Json, MissingOption, with_table_options

__all__ = ["correct", "fit"]


@with_table_options
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
    effort: Annotated[
        float,
        number_option(
            "--effort", help="Work of the search; 1 takes about half a minute, 0.1 gives a quick look."
        ),
    ] = 1.0,
    seconds: Annotated[
        float | None, number_option("--seconds", "s", help="Limit on time, in s. Default: none.")
    ] = None,
    workers: Annotated[int, count_option("--workers", least=1, help="Number of worker processes.")] = 1,
    seed: Annotated[int, count_option("--seed", least=0, help="Decides everything that is drawn.")] = 0,
    level: Annotated[
        float, number_option("--level", help="Share of unseen samples that the intervals are to hold.")
    ] = 0.9,
    missing: MissingOption = "leave-out",
    reading: Any = None,
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
        effort=effort,
        seconds=seconds,
        workers=workers,
        seed=seed,
        level=level,
    )


@with_table_options
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
    offset: Annotated[
        float,
        number_option(
            "--offset",
            "m",
            least=0,
            help="Uncertainty of the height of the surface, in m (one standard deviation).",
        ),
    ] = 5e-4,
    constant: Annotated[
        float,
        number_option(
            "--constant",
            least=0,
            help="Uncertainty of the stiffness of the whole body, as a natural logarithm (one standard deviation).",
        ),
    ] = 0.5,
    varying: Annotated[
        float,
        number_option(
            "--varying",
            least=0,
            help="Uncertainty of the stiffness from place to place, as a natural logarithm (one standard deviation).",
        ),
    ] = 0.3,
    noise: Annotated[
        float,
        number_option(
            "--noise", "N", help="Noise of a measured force component, in N (one standard deviation)."
        ),
    ] = 0.005,
    relative: Annotated[
        float,
        number_option(
            "--relative",
            least=0,
            help="Noise of a measured force, as a share of its size (one standard deviation).",
        ),
    ] = 0.01,
    jitter: Annotated[
        float,
        number_option(
            "--jitter", "m", least=0, help="Noise of the measured position, in m (one standard deviation)."
        ),
    ] = 0.0,
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
    as_json: Json = False,
) -> None:
    """Correct a model by forces measured on a specimen, and print the error before and after."""
    from palpate.cli.correct_command import Source, correct_model
    from palpate.learning.correction import Discrepancy, Noise

    source = Source(file, stdin, port, stall, wait, token=token, missing=missing, options=reading)
    differs = Discrepancy(constant=constant, varying=varying, offset=offset)
    correct_model(
        model, source, out, parameter or [], differs, Noise(noise, relative, jitter), Console(as_json)
    )
