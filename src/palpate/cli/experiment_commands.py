"""`palpate experiment`: plans of experiments with people, their outlook, live sittings, and their analysis."""

from __future__ import annotations

import contextlib
import os
import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.number_options import count_option
from palpate.cli.table_options import Json
from palpate.errors import AccuracyError, DeviceError, UsageError

if TYPE_CHECKING:
    from palpate.experiments.experiment_pages import SittingPage

__all__ = ["experiment_app"]

experiment_app = typer.Typer(
    cls=CommandGroup,
    help="Experiments with people: plan, simulate, run, analyse. Tried on simulated observers only.",
    no_args_is_help=True,
)

PlanFile = Annotated[Path, typer.Argument(help="Plan, as [bold]palpate experiment plan[/] writes it.")]
Who = Annotated[str, typer.Argument(help="Label of the participant, such as sub-01; never a name.")]
_EXAMPLES = ("body.palpate", "other.palpate")  # where no file is named
SIMULATED = "Everything here was tried on simulated observers only, never on people."


@experiment_app.command("plan")
def write_plan(
    bodies: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Model files (.palpate) of the bodies, the reference first; of full-model also a study that is "
            "learnt, whose presses are then solved."
        ),
    ] = None,
    kind: Annotated[
        str,
        typer.Option(help="discrimination, full-model, odd-one-out, detection or rating."),
    ] = "discrimination",
    name: Annotated[str, typer.Option(help="Name of the experiment: letters and digits.")] = "stiffness",
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File to write. Default: NAME.toml.")
    ] = None,
    show: Annotated[bool, typer.Option("--print", help="Print the plan instead of writing a file.")] = False,
) -> None:
    """Write a commented plan for bodies that were learnt. It is a text: edit it, then simulate it."""
    from palpate.experiments.ready_plans import ready_plan
    from palpate.files import write_file

    file = out or Path(f"{name}.toml")
    if file.exists() and not show:
        raise UsageError(
            f"{file} is there already.",
            why="A plan is never overwritten.",
            fix="Give another --name or --out.",
        )
    notes = dict[Path, str]()
    if bodies and kind == "full-model" and [body.suffix for body in bodies] == [".toml"]:
        ready_plan(kind, name, _EXAMPLES)  # a wrong name is refused before the solves
        notes, bodies = {} if show else _solve_full_model(bodies[0], Console()), None
    for body in bodies or ():
        if body.suffix == ".toml":
            raise UsageError(
                f"{body} is a study, and a plan names learnt bodies.",
                why="A study alone, with --kind full-model, is what presses are solved of.",
                fix=f"Name the model file that `palpate learn {body}` writes.",
            )
    files = [_path_from(file.parent, body) for body in notes or bodies or ()]
    text = ready_plan(kind, name, files or _EXAMPLES, tuple(notes.values()))
    if show:
        typer.echo(text)
        return
    write_file(file, text)
    Console().result(f"{file}: edit it, then `palpate experiment simulate {file}`.", {})


def _solve_full_model(path: Path, console: Console) -> dict[Path, str]:
    """Return the bodies of a study's full model, of few of its solves and of all, each with its force error in words.

    The full model takes part by presses that are solved now; `few` is learnt from an eighth of the study's solves.
    """
    import numpy as np

    from palpate.cli.exam_command import learnt_study
    from palpate.experiments.recorded_presses import body_of_presses, line_errors, solve_presses
    from palpate.learning.loading import load_surrogate
    from palpate.learning.pressed_solves import FEWEST
    from palpate.runtime.touchable import touchable
    from palpate.study import read_study
    from palpate.study.run import learn_study, load_data
    from palpate.study.study_paths import Paths

    model = learnt_study(path)
    study = read_study(path)
    whole, (train, _) = load_surrogate(model), load_data(study, Paths(path.parent, study.name))
    stem = path.parent / study.name
    console.say("The presses of the full model are solved …")
    store = Path(f"{stem}-presses.zarr")
    presses, unseen = solve_presses(study.problem(whole=True), touchable(whole), store)
    reference = body_of_presses(presses, unseen, f"{study.name}, full model", console.say)
    count = max(FEWEST, len(train) // 8)
    few, _ = learn_study(study, train.take(np.arange(min(count, len(train)))), log=console.say)
    files = {"presses": reference, f"{count}-solves": few, "": whole}
    named = {Path(f"{stem}-{end}.palpate") if end else model: body for end, body in files.items()}
    for file, body in named.items():
        if file != model:
            body.save(file)
    errors = line_errors({str(file): body for file, body in named.items()}, unseen)
    return {
        file: f"along the line its force is off by {mean:.2%} on average, {most:.2%} at most"
        for file, (mean, most) in zip(named, errors.values(), strict=True)
    }


def _path_from(folder: Path, body: Path) -> str:
    """Return the path of a body as a plan in a folder names it."""
    if body.is_absolute():
        return str(body)
    try:
        return Path(os.path.relpath(body, folder)).as_posix()
    except ValueError:  # on another drive of Windows
        return str(body.absolute())


@experiment_app.command()
def simulate(
    plan: PlanFile,
    people: Annotated[
        int, count_option("--people", least=50, most=20000, help="Number of simulated people.")
    ] = 1000,
    seed: Annotated[int, count_option("--seed", least=0, help="Seed of the simulation.")] = 0,
    as_json: Json = False,
) -> None:
    """Try a plan on simulated people: coverage, bias, and power. The exit code is 1 if its power is missed."""
    from palpate.experiments.experiment_plan import read_plan
    from palpate.experiments.outlook import foresee

    console = Console(as_json)
    read = read_plan(plan)
    if read.question == "rating":
        raise UsageError(
            "Ratings can't be simulated.", why="No function says how people rate.", fix="Run a pilot instead."
        )
    outlook = foresee(read, people, seed, console.say)
    console.result(f"{outlook}\n{SIMULATED}", outlook.as_dict())
    if not outlook.reaches:
        wanted, enough = read.wanted, outlook.enough
        raise AccuracyError(
            f"{wanted.people} people show equivalence with a power of {outlook.power[wanted.people]:.0%}, "
            f"not {wanted.power:.0%}.",
            why=f"One person's JND has a scatter of {outlook.person.scatter:.0%} after "
            f"{outlook.person.trials} trials, and people differ.",
            fix=f"Plan for {enough} people, more trials, or a wider margin."
            if enough
            else "Not even 64 people reach it: give more trials, or a wider margin.",
        )


@experiment_app.command("run")
def run_one(
    plan: PlanFile,
    participant: Who,
    run: Annotated[int, count_option("--run", least=1, most=99, help="Number of this person's sitting.")] = 1,
    device: Annotated[
        str | None, typer.Option(help="Another device than the plan's; see [bold]palpate devices[/].")
    ] = None,
    port: Annotated[
        int, count_option("--port", least=0, most=65534, help="Port of the participant's page.")
    ] = 8080,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open both pages in a web browser.")
    ] = True,
    token: Annotated[
        bool, typer.Option("--token/--no-token", help="Open the pages only to who has their whole address.")
    ] = True,
    age_band: Annotated[str, typer.Option(help="Band of ten years, such as 20-29.")] = "n/a",
    hand: Annotated[str, typer.Option(help="Hand that touches: left, right or both.")] = "n/a",
    expertise: Annotated[str, typer.Option(help="Experience, as you define it.")] = "n/a",
) -> None:
    """Run a participant's sitting, on a page of theirs and a control page; one that was interrupted goes on."""
    from palpate.experiments.live_sitting import run_sitting
    from palpate.experiments.study_folder import Participant
    from palpate.viewer.web_server import way_in

    console = Console()
    with contextlib.ExitStack() as ways:

        def ready(hers: SittingPage, control: SittingPage) -> None:
            console.say(f"participant: {hers.url}")
            console.say(f"control:     {control.url}")
            console.say("Ctrl-C ends it; what was answered is kept.")
            if browser and sys.stdout.isatty():
                for page in (control, hers):
                    webbrowser.open(ways.enter_context(way_in(page)))

        try:
            conductor = run_sitting(
                plan,
                Participant(participant, age_band, hand, expertise),
                run=run,
                device=device,
                port=port,
                token=token,
                say=console.say,
                on_ready=ready,
            )
        except KeyboardInterrupt:
            console.say("Ended. Run the same command again: the sitting goes on.")
            return
    done, total = conductor.sitting.done, conductor.sitting.total
    if conductor.phase == "failed":
        raise DeviceError(
            f"The sitting stopped after {done} of {total} trials.",
            why=conductor.said,
            fix="See to the device, then run the same command again: the sitting goes on.",
        )
    console.result(f"{done} of {total} trials are in {conductor.files.table}", {"done": done, "total": total})


@experiment_app.command("analyse")
def analyse_folder(plan: PlanFile, as_json: Json = False) -> None:
    """Analyse all sittings of a plan: each person's function, the group, equivalence, and a picture of them."""
    from palpate.experiments.analysis import analyse
    from palpate.experiments.analysis_picture import save_pictures
    from palpate.experiments.study_folder import StudyFolder

    folder = StudyFolder.beside(plan)
    folder.require_plan(plan)
    analysis = analyse(folder)
    pictures = [str(path) for path in save_pictures(analysis, folder)]
    drawn = "".join(f"\n{path}" for path in pictures)
    Console(as_json).result(f"{analysis}{drawn}", analysis.as_dict() | {"pictures": pictures})


@experiment_app.command()
def forget(
    plan: PlanFile,
    participant: Who,
    yes: Annotated[bool, typer.Option("--yes", help="Don't ask.")] = False,
) -> None:
    """Remove a person's data: answers, recordings, notes, and the row in the table of participants."""
    from palpate.experiments.study_folder import Participant, StudyFolder

    who = Participant(participant)
    if not yes and not typer.confirm(f"Remove all data of {who.label}? They can't be brought back."):
        raise typer.Exit(1)
    count = StudyFolder.beside(plan).forget(who)
    Console().result(f"{count} files of {who.label} are removed.", {})
