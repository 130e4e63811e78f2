"""The commands. Each parses, calls the study, prints; heavy imports wait until a command needs them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from palpate.cli.console import Console, advice_in_words
from palpate.errors import AccuracyError, PalpateError, UsageError

__all__ = ["app", "main"]

app = typer.Typer(
    name="palpate",
    help="Turn a finite-element model into something you can touch.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)

StudyFile = Annotated[Path, typer.Argument(help="A study file; write one with [bold]palpate init[/].")]
ModelFile = Annotated[Path, typer.Argument(help="A .palpate file, as [bold]palpate learn[/] writes it.")]
Json = Annotated[bool, typer.Option("--json", help="Results as one JSON object on stdout.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Worker processes; by default one per core.")]
Port = Annotated[
    int | None,
    typer.Option(
        min=0, max=65535, help="Port of the page, by default the study's; a busy one moves on to the next."
    ),
]
Browser = Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")]

STUDY = Path("study.toml")
_INTERRUPTED = 130  # the shell's code of a program that Ctrl-C has ended


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.", is_eager=True)] = False,
) -> None:
    if version:
        from palpate import __version__

        typer.echo(f"palpate {__version__}")
        raise typer.Exit


@app.command()
def demo(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Studies to run, such as block; by default both founding beams."),
    ] = None,
    folder: Annotated[Path, typer.Option(help="Where files go.")] = Path("palpate-demo"),
    view: Annotated[bool, typer.Option("--view/--no-view", help="Serve the page at the end.")] = True,
    quick: Annotated[
        bool, typer.Option("--quick", help="Coarse elements and few touches: under two minutes.")
    ] = False,
    workers: Workers = None,
    port: Port = None,
    browser: Browser = True,
    as_json: Json = False,
) -> None:
    """Run studies with a name from finite elements to the fingertip; the founding beams take under a minute."""
    from palpate.cli.demo_command import run_demo

    console = Console(as_json)
    models = run_demo(names or ["beam-copper", "beam-nylon"], folder, workers, console, quick=quick)
    if view and not as_json:
        if sys.stdout.isatty():
            _serve(models[-1], port=port, browser=browser)
        else:
            console.say("No terminal, so no page is served: `palpate view FILE` does it.")


@app.command()
def init(
    path: Annotated[Path, typer.Argument(help="File to write.")] = STUDY,
    preset: Annotated[
        str,
        typer.Option(help="Study to start from, such as block, layered, breast-dome, liver, beam-copper."),
    ] = "beam-nylon",
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    show: Annotated[bool, typer.Option("--print", help="Print it instead of writing a file.")] = False,
) -> None:
    """Write a commented study file."""
    from palpate.study import preset_study, to_toml

    if path.is_dir():
        raise UsageError(f"{path} is a folder.", fix=f"Name a file, such as {path / STUDY}.")
    record = preset_study(preset)
    if (
        path != STUDY and not show
    ):  # a file with a name of its own gives the study, and so its files, that name
        record = record.renamed(path.stem)
    text = to_toml(record)
    if show:
        typer.echo(text, nl=False)
        return
    if path.exists() and not force:
        raise UsageError(f"{path} exists already.", fix="Choose another name, or replace it with --force.")
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"Could not write {path}.", why=str(error)) from error
    typer.echo(f"{path}: a study called {record.name}. Next: palpate sweep {path}")


@app.command()
def schema() -> None:
    """Print the JSON schema of study files, with which an editor checks them."""
    from palpate.study import study_schema

    typer.echo(study_schema())


@app.command()
def sweep(study: StudyFile = STUDY, workers: Workers = None, as_json: Json = False) -> None:
    """Solve the study's model over its ranges; an interrupted sweep goes on where it stopped."""
    from palpate.cli.study_commands import sweep_file

    sweep_file(study, workers, Console(as_json))


@app.command()
def learn(study: StudyFile = STUDY, as_json: Json = False) -> None:
    """Learn the study's dataset: networks that grow and prune themselves, then refinement."""
    from palpate.cli.study_commands import learn_file

    learn_file(study, Console(as_json))


@app.command()
def validate(
    study: Annotated[Path, typer.Argument(help="A study file, or a touch surrogate.")] = STUDY,
    test: Annotated[
        Path | None, typer.Option(help="Unseen solves of a surrogate's body, by default NAME-test.zarr.")
    ] = None,
    refined: Annotated[
        Path | None, typer.Option(help="The same on a finer mesh, which tell the mesh's own error.")
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")] = True,
    as_json: Json = False,
) -> None:
    """Judge what was learnt on solves it has never seen; exit code 1 where it misses a limit."""
    from palpate.cli.study_commands import is_archive, validate_model, validate_study_file

    console = Console(as_json)
    if is_archive(study):
        validate_model(study, test, refined, report, console)
        return
    if test is not None or refined is not None:
        raise UsageError(
            "A study file says by itself what it is tested with.", fix="Leave out --test and --refined."
        )
    validate_study_file(study, report, console)


@app.command()
def view(
    model: ModelFile,
    port: Port = None,
    strict_port: Annotated[bool, typer.Option("--strict-port", help="Fail where the port is busy.")] = False,
    browser: Browser = True,
) -> None:
    """Serve the page on which the model can be touched, on this machine only."""
    _serve(model, port=port, browser=browser, strict_port=strict_port)


@app.command()
def show(
    file: Annotated[
        Path, typer.Argument(help="A .vtu or .pvd file, or the .zarr folder of a solid's sweep.")
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page.")] = 8080,
    strict_port: Annotated[bool, typer.Option("--strict-port", help="Fail where the port is busy.")] = False,
    browser: Browser = True,
) -> None:
    """Serve a page on which solved bodies are looked at: deformed, coloured, state by state."""
    from palpate.viewer import show as show_body

    show_body(file, port=port, strict_port=strict_port, open_browser=browser and sys.stdout.isatty())


@app.command()
def ask(
    model: ModelFile,
    at: Annotated[
        list[str] | None,
        typer.Option(help="Inputs with commas between, SI units: 0.05,0.05,0.055. May be given again."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Say what a learnt body's file holds, or the force, stiffness and trust at a place."""
    from palpate.cli.ask_command import ask as ask_model

    ask_model(model, at or [], Console(as_json))


@app.command()
def run(
    model: ModelFile,
    seconds: Annotated[float, typer.Option(min=0.1, help="How long.")] = 5.0,
    device: Annotated[str, typer.Option(help="For example stroke:amplitude=0.02,frequency=1.")] = "stroke",
    rate: Annotated[float | None, typer.Option(min=10, max=10000, help="Hz; by default the study's.")] = None,
    as_json: Json = False,
) -> None:
    """Run the real-time loop without a page, and print how late it was."""
    from palpate.cli.run_command import run_loop

    run_loop(model, seconds, device, rate, Console(as_json))


@app.command()
def correct(
    model: Annotated[Path, typer.Argument(help="The .palpate file of a body that is pressed.")],
    out: Annotated[Path, typer.Option(help="File to write the corrected surrogate to.")],
    file: Annotated[Path | None, typer.Option(help="Table of measured positions and forces.")] = None,
    stdin: Annotated[bool, typer.Option("--stdin", help="Lines of a sensor from standard input.")] = False,
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="Lines from one connection to 127.0.0.1; 0: any port."),
    ] = None,
    parameter: Annotated[
        list[str] | None, typer.Option(help="NAME=VALUE of a further input of the model.")
    ] = None,
    offset: Annotated[
        float, typer.Option(min=0, help="How far the surface's height may be off, m (one deviation).")
    ] = 5e-4,
    constant: Annotated[float, typer.Option(min=0, help="How far ln of the stiffness may be off.")] = 0.5,
    varying: Annotated[float, typer.Option(min=0, help="The same, of what varies with place.")] = 0.3,
    noise: Annotated[float, typer.Option(help="Of a measured component, N (one deviation).")] = 0.005,
    relative: Annotated[float, typer.Option(min=0, help="The same, of the force's size.")] = 0.01,
    jitter: Annotated[float, typer.Option(min=0, help="Of the measured position, m.")] = 0.0,
    stall: Annotated[float, typer.Option(min=0.1, help="Seconds of silence that end a stream.")] = 30.0,
    wait: Annotated[float, typer.Option(min=0.1, help="Seconds that a connection is waited for.")] = 60.0,
    as_json: Json = False,
) -> None:
    """Correct a touch surrogate by forces measured on a specimen; prints the error before and after."""
    from palpate.cli.correct_command import Source, correct_model
    from palpate.learning.correction import Discrepancy, Noise

    source = Source(file, stdin, port, stall, wait)
    differs = Discrepancy(constant=constant, varying=varying, offset=offset)
    correct_model(
        model, source, out, parameter or [], differs, Noise(noise, relative, jitter), Console(as_json)
    )


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what this machine can do, and what to do about each miss."""
    from palpate.cli.doctor import report

    report(Console(as_json))


def _serve(model: Path, *, port: int | None, browser: bool, strict_port: bool = False) -> None:
    from palpate.runtime.touchable import load_touchable
    from palpate.viewer import serve

    settings = load_touchable(model).meta.get("runtime", {})
    serve(
        model,
        port=settings.get("port", 8080) if port is None else port,
        rate=settings.get("rate", 1000.0),
        max_force=settings.get("max_force"),
        open_browser=browser and sys.stdout.isatty(),
        strict_port=strict_port,
    )


def main(arguments: list[str] | None = None) -> None:
    """Entry point: exit codes from the error tree, never a traceback for an error palpate foresaw."""
    words = sys.argv[1:] if arguments is None else arguments
    try:
        with advice_in_words():
            app(words, standalone_mode=True)
    except AccuracyError as error:
        Console().error(error)  # the figures have been printed already, as JSON where asked
        sys.exit(error.exit_code)
    except PalpateError as error:
        Console(as_json="--json" in words).error(error)
        sys.exit(error.exit_code)
    except SystemExit as end:
        if end.code == _INTERRUPTED:  # as which Typer ends by Ctrl-C, without a word
            kept = (
                " What is solved is kept: the same command goes on." if {"sweep", "demo"} & set(words) else ""
            )
            Console().say(f"\nInterrupted.{kept}")
        raise
