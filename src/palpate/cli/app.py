"""Commands of the command line: each reads arguments, imports the heavy packages it needs, and prints the result."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from palpate.cli.benchmark_command import benchmark_app
from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.device_commands import devices_app
from palpate.cli.exam_command import exam
from palpate.cli.exchange_commands import card, export_dataset
from palpate.cli.experiment_commands import experiment_app
from palpate.cli.export_commands import export_app
from palpate.cli.init_command import init
from palpate.cli.material_commands import material_app
from palpate.cli.number_options import count_option, number_option
from palpate.cli.sweep_command import sweep
from palpate.cli.table_commands import correct, fit
from palpate.cli.table_options import Force, Json, Verbose, with_table_options
from palpate.cli.touch_command import touch
from palpate.cli.touch_options import DeadMan, Device, Friction, MaxForce, MaxTorque, NoController, Unsoftened
from palpate.cli.trace_commands import replay, trace_app
from palpate.cli.umbridge_command import serve_umbridge
from palpate.errors import UsageError
from palpate.processes import CASE_LIMIT

__all__ = ["app"]

app = typer.Typer(
    name="palpate",
    cls=CommandGroup,
    help="Turn a finite-element model into something you can touch.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)

dataset_app = typer.Typer(cls=CommandGroup, help="Datasets of solves.", no_args_is_help=True)
app.add_typer(benchmark_app, name="benchmark")
app.add_typer(dataset_app, name="dataset")
app.add_typer(devices_app, name="devices")
app.add_typer(material_app, name="material")
app.add_typer(trace_app, name="trace")
app.add_typer(export_app, name="export")
app.add_typer(experiment_app, name="experiment")

StudyFile = Annotated[Path, typer.Argument(help="Study file, as [bold]palpate init[/] writes it.")]
ModelFile = Annotated[
    Path, typer.Argument(help="Model file (.palpate), as [bold]palpate learn[/] writes it.")
]
Workers = Annotated[
    int | None, count_option("--workers", least=1, help="Number of worker processes. Default: one per core.")
]
CaseLimit = Annotated[
    float,
    number_option(
        "--case-limit",
        "s",
        least=0.1,
        help="Seconds after which a single solve has failed. It costs that solve; the sweep goes on.",
    ),
]
Port = Annotated[
    int | None,
    count_option(
        "--port",
        least=0,
        most=65535,
        help="Port of the page. Default: that of the study. If it is busy, the next free port is used.",
    ),
]
AskToken = Annotated[
    bool,
    typer.Option(
        "--token/--no-token",
        help="Open the page only to who has its whole address. Without a token every user of this machine can open it.",
    ),
]
StrictPort = Annotated[bool, typer.Option("--strict-port", help="Stop with an error if the port is busy.")]
Browser = Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a web browser.")]

STUDY = Path("study.toml")


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.", is_eager=True)] = False,
) -> None:
    if version:
        from palpate.version import __version__

        typer.echo(f"palpate {__version__}")
        raise typer.Exit


@app.command()
def demo(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Names of studies, such as block or grasp. Default: beam-copper and beam-nylon."),
    ] = None,
    folder: Annotated[Path, typer.Option(help="Folder for all files.")] = Path("palpate-demo"),
    view: Annotated[
        bool, typer.Option("--view/--no-view", help="Show the last model on a page at the end.")
    ] = True,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Use coarse elements and few solves. Takes under two minutes on two idle cores.",
        ),
    ] = False,
    workers: Workers = None,
    case_limit: CaseLimit = CASE_LIMIT,
    port: Port = None,
    browser: Browser = True,
    token: AskToken = True,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Run named studies completely: solve, learn, check, show. The two beams take about a minute on two idle cores."""
    from palpate.cli.demo_command import run_demo

    console = Console(as_json, verbose)
    names = names or ["beam-copper", "beam-nylon"]
    models = run_demo(names, folder, workers, console, quick=quick, case_limit=case_limit)
    if view and not as_json:
        if sys.stdout.isatty():
            _serve(models[-1], port=port, browser=browser, token=token)
        else:
            console.say("No terminal, so no page is served: `palpate view FILE` does it.")


app.command()(init)


@app.command()
def schema() -> None:
    """Print the JSON schema of study files. An editor can use it to check and complete a study file."""
    from palpate.study import study_schema

    typer.echo(study_schema())


app.command()(sweep)


@app.command()
def learn(
    study: Annotated[Path, typer.Argument(help="Study file, or a dataset (NAME.zarr).")] = STUDY,
    effort: Annotated[
        float | None,
        number_option("--effort", least=0.01, help="Of a dataset: how much is tried; 0.1 is a quick look."),
    ] = None,
    leave_out: Annotated[
        list[int] | None,
        typer.Option(help="Number of a solve that is not learnt from, as learning names it. Several times."),
    ] = None,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch",
            help="Show the units as they appear, move and vanish, and write a page that plays it, NAME.growth.html. "
            "For beams under loads.",
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Learn a surrogate from the solves of a study, check it, and write it to a model file."""
    from palpate.cli.study_commands import learn_path

    learn_path(study, effort, Console(as_json), watch=watch, leave_out=tuple(leave_out or ()))


@app.command()
def validate(
    study: Annotated[Path, typer.Argument(help="Study file or model file.")] = STUDY,
    test: Annotated[
        Path | None,
        typer.Option(
            help="For a model file: dataset of solves that it was not learnt from. Default: NAME-test.zarr."
        ),
    ] = None,
    refined: Annotated[
        Path | None,
        typer.Option(
            help="For a model file: solves at some of these places on a finer mesh. They show the error of the mesh."
        ),
    ] = None,
    trace: Annotated[
        list[Path] | None,
        typer.Option(
            help="For a study file: recorded touch; the full model is solved under the same hand. Several times."
        ),
    ] = None,
    report: Annotated[
        bool, typer.Option("--report/--no-report", help="Write a report as an HTML page.")
    ] = True,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Check a surrogate with solves that it was not learnt from. The exit code is 1 if a limit is missed."""
    from palpate.cli.study_commands import is_archive, validate_model, validate_study_file

    console = Console(as_json, verbose)
    if is_archive(study):
        if trace:
            raise UsageError(
                "A recorded touch is compared with the full model of a study.",
                fix="Name the study file instead of the model.",
            )
        validate_model(study, test, refined, report, console)
        return
    if test is not None or refined is not None:
        raise UsageError(
            "A study file already names the solves that test it.", fix="Leave out --test and --refined."
        )
    validate_study_file(study, report, console, trace or ())


@app.command()
def view(
    model: ModelFile,
    port: Port = None,
    strict_port: StrictPort = False,
    browser: Browser = True,
    token: AskToken = True,
    device: Device = "page",
    unsoftened: Unsoftened = False,
    no_controller: NoController = False,
    dead_man: DeadMan = False,
    friction: Friction = None,
    max_force: MaxForce = None,
    max_torque: MaxTorque = None,
) -> None:
    """Open a page on which you can touch the model, or set its inputs by sliders. Only this machine can reach it."""
    if _shows_answers(model, port=port, browser=browser, strict_port=strict_port, token=token):
        return
    _serve(
        model,
        port=port,
        browser=browser,
        strict_port=strict_port,
        token=token,
        device=device,
        unsoftened=unsoftened,
        controller=not no_controller,
        dead_man=dead_man,
        friction=friction,
        max_force=max_force,
        max_torque=max_torque,
    )


@app.command()
def show(
    file: Annotated[Path, typer.Argument(help="File (.vtu or .pvd) or dataset (.zarr) with solved bodies.")],
    port: Annotated[int, count_option("--port", least=0, most=65535, help="Port of the page.")] = 8080,
    strict_port: StrictPort = False,
    browser: Browser = True,
    token: AskToken = True,
) -> None:
    """Open a page that shows solved bodies: their deformation, in colour, one state after the other."""
    from palpate.viewer import show as show_body

    open_browser = browser and sys.stdout.isatty()
    show_body(file, port=port, strict_port=strict_port, token=token, open_browser=open_browser)


@app.command()
@with_table_options
def ask(
    model: ModelFile,
    at: Annotated[
        list[str] | None,
        typer.Option(
            help="Values of all inputs in SI units, with commas between: 0.05,0.05,0.055. Can be given several times."
        ),
    ] = None,
    table: Annotated[
        Path | None, typer.Option(help="Table whose rows are asked for; its columns are matched by name.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="For --table: file for the answers, as CSV. Default: stdout."),
    ] = None,
    force: Force = False,
    reading: Any = None,
    as_json: Json = False,
) -> None:
    """Ask a model for its answers at places or at all rows of a table; without them, say which inputs it takes."""
    if table is None:
        if out is not None or reading:
            raise UsageError("These options are for a table.", fix="Give the table with --table.")
        from palpate.cli.ask_command import ask as ask_model

        ask_model(model, at or [], Console(as_json))
        return
    if at:
        raise UsageError("Places come from --at or from --table.", fix="Give one of them.")
    from palpate.cli.ask_table import ask_table

    ask_table(model, table, out, Console(as_json), reading, force=force)


@app.command()
def run(
    model: ModelFile,
    seconds: Annotated[float, number_option("--seconds", "s", least=0.1, help="Duration in seconds.")] = 5.0,
    device: Device = "stroke",
    rate: Annotated[
        float | None,
        number_option(
            "--rate", "Hz", least=10, most=10000, help="Ticks per second (Hz). Default: that of the study."
        ),
    ] = None,
    unsoftened: Unsoftened = False,
    no_controller: NoController = False,
    dead_man: DeadMan = False,
    friction: Friction = None,
    max_force: MaxForce = None,
    max_torque: MaxTorque = None,
    record: Annotated[
        Path | None, typer.Option(help="New file that takes every tick; see [bold]palpate replay[/].")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run the real-time loop without a page, and print how late its ticks were. In a terminal, Esc stops the force."""
    from palpate.cli.run_command import run_loop

    run_loop(
        model,
        seconds,
        device,
        rate,
        Console(as_json),
        unsoftened=unsoftened,
        controller=not no_controller,
        dead_man=dead_man,
        record=record,
        friction=friction,
        max_force=max_force,
        max_torque=max_torque,
    )


app.command()(replay)
app.command()(touch)
app.command()(exam)
app.command()(fit)
app.command()(correct)
app.command()(card)
app.command("serve-umbridge")(serve_umbridge)
dataset_app.command("export")(export_dataset)


@dataset_app.command("import")
def import_dataset(
    files: Annotated[list[Path], typer.Argument(help="Results of another solver: all files of one model.")],
    mapping: Annotated[
        Path | None,
        typer.Option(help="TOML file that says which columns are inputs, outputs and coordinates."),
    ] = None,
    inputs: Annotated[
        list[str] | None, typer.Option("--input", help="Input and its column: NAME=COLUMN. Several times.")
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option("--output", help="Output and its column, or components with commas. Several times."),
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option(
            "--unit", help="Unit of a column, or of length, force and time of the model: NAME=UNIT."
        ),
    ] = None,
    coordinates: Annotated[
        list[str] | None, typer.Option("--coordinate", help="Axis of the body's coordinates. Several times.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Dataset to write. Default: the first file's name with .zarr.")
    ] = None,
    test: Annotated[
        float,
        number_option("--test", least=0, most=0.9, help="Share of the cases for a test set, NAME-test.zarr."),
    ] = 0.0,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print what the files hold and what would be written.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace datasets that exist.")] = False,
    as_json: Json = False,
) -> None:
    """Make a dataset of another solver's results: COMSOL, CalculiX, VTK, and arrays or tables of your own."""
    from palpate.cli.dataset_command import import_files

    options = (inputs or [], outputs or [], units or [], coordinates or [])
    import_files(files, mapping, options, out, test, dry_run, overwrite, Console(as_json))


@app.command()
def doctor(
    seconds: Annotated[
        float,
        number_option(
            "--seconds",
            "s",
            least=0,
            most=3600,
            help="Duration of the timing test in seconds; 0 leaves it out.",
        ),
    ] = 10.0,
    as_json: Json = False,
) -> None:
    """Check this machine: software, timing of the real-time loop, and devices, with advice for what is missing."""
    from palpate.cli.doctor import report

    report(Console(as_json), seconds)


def _shows_answers(model: Path, *, port: int | None, browser: bool, strict_port: bool, token: bool) -> bool:
    """Serve the page of a surrogate without touch until interrupted; False, at once, for anything else."""
    from palpate.learning.loading import load_surrogate
    from palpate.viewer.answer_viewer import show_answers

    thing = load_surrogate(model)
    if thing.can_be_touched:
        return False
    show_answers(
        thing,
        name=model.stem,
        port=8080 if port is None else port,
        strict_port=strict_port,
        token=token,
        open_browser=browser and sys.stdout.isatty(),
    )
    return True


def _serve(
    model: Path,
    *,
    port: int | None,
    browser: bool,
    token: bool,
    strict_port: bool = False,
    device: str = "page",
    unsoftened: bool = False,
    controller: bool = True,
    dead_man: bool = False,
    friction: float | None = None,
    max_force: float | None = None,
    max_torque: float | None = None,
) -> None:
    from palpate.runtime.touchable import aim_device, load_touchable
    from palpate.runtime.warm_up import WarmUp
    from palpate.viewer import serve

    body = load_touchable(model, friction)
    device = aim_device(device, body)  # a name that is none is refused before anything is compiled
    with WarmUp("loop", body=body) as warm_up:
        Console().say(f"Opening the page of {model} … {warm_up.words}".rstrip())
        warm_up.wait()
    settings = body.meta.get("runtime", {})
    serve(
        model,
        port=settings.get("port", 8080) if port is None else port,
        rate=settings.get("rate", 1000.0),
        max_force=max_force or settings.get("max_force"),
        max_torque=max_torque or settings.get("max_torque"),
        open_browser=browser and sys.stdout.isatty(),
        strict_port=strict_port,
        token=token,
        device=device,
        unsoftened=unsoftened,
        controller=controller,
        dead_man=dead_man,
        friction=friction,
    )
