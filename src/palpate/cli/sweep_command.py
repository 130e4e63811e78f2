"""`palpate sweep`: the solves of a study, by its design or chosen until a force error is kept."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import count_option, declared_option, number_option
from palpate.cli.table_options import Json, Verbose
from palpate.errors import UsageError
from palpate.options import ImprovementOptions

__all__ = ["sweep"]


def sweep(
    study: Annotated[Path, typer.Argument(help="Study file, as [bold]palpate init[/] writes it.")] = Path(
        "study.toml"
    ),
    samples: Annotated[
        int | None,
        count_option(
            "--samples",
            least=1,
            help="Solves to learn from. Default: those of the study. A finished sweep is continued, not repeated. "
            "With --until: the most solves.",
        ),
    ] = None,
    until: Annotated[
        float | None,
        declared_option(
            ImprovementOptions,
            "until",
            "Choose solves where the answers are least certain, and learn, until this error is kept at the 95th "
            "percentile of unseen solves, such as 2%: of the force of a body under a probe, or of numbers and fields "
            "over their range.",
        ),
    ] = None,
    minutes: Annotated[
        float | None,
        number_option(
            "--minutes", least=0, help="With --until: minutes after which no further batch begins."
        ),
    ] = None,
    element: Annotated[
        str | None,
        typer.Option(
            metavar="auto",
            help="For a body under a probe, auto: three touches on two meshes decide the size of the elements, which "
            "the file then states. Default: the file's own.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        count_option("--workers", least=1, help="Number of worker processes. Default: one per core."),
    ] = None,
    case_limit: Annotated[float, declared_option(ImprovementOptions, "case_limit")] = (
        ImprovementOptions.case_limit
    ),
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Solve on a running Dask scheduler, such as tls://HOST:8786. Default: processes of this machine.",
        ),
    ] = None,
    tls_ca: Annotated[
        Path | None, typer.Option(help="For --scheduler: certificate of the authority, as a PEM file.")
    ] = None,
    tls_cert: Annotated[
        Path | None, typer.Option(help="For --scheduler: your own certificate, as a PEM file.")
    ] = None,
    tls_key: Annotated[
        Path | None,
        typer.Option(help="For --scheduler: the key of your certificate, if it has a PEM file of its own."),
    ] = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Solve the finite-element model of a study over its ranges. An interrupted sweep continues where it stopped.

    A study with a table *solver* runs the program that it names, once for each case; the command is printed first.
    """
    from palpate.cli.study_commands import sweep_file
    from palpate.study.part_study import AUTO
    from palpate.study.solver_study import says_solver
    from palpate.sweeps import Scheduler

    if element not in {None, AUTO}:
        raise UsageError(
            f"--element {element} asks a sweep for elements of a size.",
            why="The study file states the size of its elements; only auto lets touches on two meshes decide it.",
            fix=f"Write it there, [sweep] element, or give --element {AUTO}.",
        )
    if scheduler is not None:
        own = Scheduler(scheduler, tls_ca, tls_cert, tls_key)
    elif tls_ca or tls_cert or tls_key:
        raise UsageError("Certificates belong to a scheduler.", fix="Give its address with --scheduler.")
    else:
        own = None
    if until is None and minutes is not None:
        raise UsageError(
            "A sweep of a design has no limit on time.", fix="Give --until, or leave --minutes out."
        )
    options = None
    if until is not None:
        limit = math.inf if minutes is None else 60.0 * minutes
        most = samples or ImprovementOptions.most
        options = ImprovementOptions(
            until=until, limit=limit, most=most, workers=workers, case_limit=case_limit
        )
    refine = element is not None
    if says_solver(study):
        from palpate.cli.solver_sweep_command import SolverSweepOptions, sweep_solver_file

        if refine:
            raise UsageError(
                "The program of a study with [solver] makes its own mesh.", fix="Leave --element out."
            )
        wishes = SolverSweepOptions(samples, workers, case_limit, own, options)
        sweep_solver_file(study, wishes, Console(as_json, verbose))
        return
    console = Console(as_json, verbose)
    if options is not None:
        from palpate.cli.improvement_lines import improve_file

        improve_file(study, options, own, console, refine=refine)
        return
    sweep_file(study, workers, console, own, case_limit=case_limit, samples=samples, refine=refine)
