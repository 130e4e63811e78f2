"""`palpate sweep`: the solves of a study, by its design or chosen until a force error is kept."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import count_option, declared_option, number_option
from palpate.cli.table_options import Json, Verbose
from palpate.errors import UsageError
from palpate.options import ImprovementOptions

if TYPE_CHECKING:
    from palpate.sweeps import JobQueue, Scheduler

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
    cluster: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Solve in jobs of a cluster's queue, which a TOML file describes: a table such as slurm, with jobs, "
            "cores, memory and walltime.",
        ),
    ] = None,
    status: Annotated[
        bool, typer.Option("--status", help="Say how far the sweep is, and solve nothing.")
    ] = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Solve the finite-element model of a study over its ranges. An interrupted sweep continues where it stopped.

    A study with a table *solver* runs the program that it names, once for each case; the command is printed first.
    """
    from palpate.cli.study_commands import sweep_file
    from palpate.study.part_study import AUTO
    from palpate.study.solver_study import says_solver

    if status:
        from palpate.cli.sweep_status import print_status

        print_status(study, Console(as_json, verbose))
        return
    if element not in {None, AUTO}:
        raise UsageError(
            f"--element {element} asks a sweep for elements of a size.",
            why="The study file states the size of its elements; only auto lets touches on two meshes decide it.",
            fix=f"Write it there, [sweep] element, or give --element {AUTO}.",
        )
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
    is_solver, console = says_solver(study), Console(as_json, verbose)
    if is_solver and refine:
        raise UsageError(
            "The program of a study with [solver] makes its own mesh.", fix="Leave --element out."
        )
    with _machines(study, scheduler, (tls_ca, tls_cert, tls_key), cluster, console) as own:
        if is_solver:
            from palpate.cli.solver_sweep_command import SolverSweepOptions, sweep_solver_file

            sweep_solver_file(study, SolverSweepOptions(samples, workers, case_limit, own, options), console)
        elif options is not None:
            from palpate.cli.improvement_lines import improve_file

            improve_file(study, options, own, console, refine=refine)
        else:
            sweep_file(study, workers, console, own, case_limit=case_limit, samples=samples, refine=refine)


def _machines(
    study: Path,
    scheduler: str | None,
    certificates: tuple[Path | None, Path | None, Path | None],
    cluster: Path | None,
    console: Console,
) -> contextlib.AbstractContextManager[Scheduler | JobQueue | None]:
    """Return what the options ask to solve on; None for this machine."""
    from palpate.sweeps import JobQueue, Scheduler

    if cluster is not None:
        if scheduler is not None:
            raise UsageError(
                "--cluster and --scheduler ask for two clusters.",
                why="The jobs of a queue have a scheduler of their own.",
                fix="Leave one of them out.",
            )
        queue = JobQueue.of(cluster, folder=study.parent / f"{study.stem}-jobs")
        console.say(f"{queue}; logs in {queue.folder}")
        return queue
    if scheduler is not None:
        return contextlib.nullcontext(Scheduler(scheduler, *certificates))
    if any(certificates):
        raise UsageError("Certificates belong to a scheduler.", fix="Give its address with --scheduler.")
    return contextlib.nullcontext(None)
