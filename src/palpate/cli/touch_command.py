"""`palpate touch`: from a part to a surrogate of a wanted force error, by solves that are chosen batch by batch."""

from __future__ import annotations

import contextlib
import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate.cli.changed_options import chosen_words, require_same
from palpate.cli.number_options import count_option, declared_option, number_option, with_options
from palpate.cli.table_options import Json, Verbose
from palpate.errors import UsageError
from palpate.file_kinds import PART_FORMATS
from palpate.options import ImprovementOptions, PartOptions, StopOptions

if TYPE_CHECKING:
    from palpate.cli.console import Console
    from palpate.study import Study
    from palpate.study.run import Paths

__all__ = ["touch"]


@with_options(choices=PartOptions)
def touch(
    part: Annotated[Path, typer.Argument(help="Part: STL, OBJ, STEP, VTU, MSH, INP and others.")],
    choices: Any = None,
    until: Annotated[float, declared_option(StopOptions, "until")] = StopOptions.until,
    minutes: Annotated[
        float,
        number_option("--minutes", least=0, help="Minutes after which no further batch of solves begins."),
    ] = 30,
    workers: Annotated[
        int | None, count_option("--workers", least=1, help="Worker processes. Default: one per core.")
    ] = None,
    view: Annotated[
        bool | None,
        typer.Option(
            "--view/--no-view", help="Choose, watch and touch on a page. Default: where there is a terminal."
        ),
    ] = None,
    start: Annotated[
        bool, typer.Option("--start", help="Begin at once with what is chosen, without a click on the page.")
    ] = False,
    port: Annotated[int, count_option("--port", least=0, most=65535, help="Of the page.")] = 8080,
    device: Annotated[str, typer.Option(help="Device that presses; see [bold]palpate devices[/].")] = "page",
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Open a part on a page, to be touched while solves and learning improve it. Called again, it goes on."""
    from palpate.cli.console import Console
    from palpate.devices import device_traits
    from palpate.study.part_study import study_file
    from palpate.study.run import Paths
    from palpate.study.study_lock import hold_study

    console = Console(as_json, verbose)
    device_traits(device)  # a name that is none is refused before anything is read
    is_shown = sys.stdout.isatty() and not as_json if view is None else view
    if device != "page" and not is_shown:
        raise UsageError(
            f"--device {device} presses on the page, and there is none.",
            why="There is no terminal, or --no-view or --json is given.",
            fix="Add --view, or leave --device out.",
        )
    file = study_file(part, choices.name)
    if not part.exists() and (is_shown or not file.exists()):
        raise UsageError(f"There is no file {part}.", fix=f"Name {PART_FORMATS}.")
    options = ImprovementOptions(until=until, limit=60 * minutes, workers=workers)
    with (
        hold_study(Paths(file.parent, file.stem), "palpate touch") as lock,
        _no_study_of_refusals(part, choices.name),
    ):
        if is_shown:
            page = {
                "at_once": start or file.exists(),
                "port": port,
                "device": device,
                "on_address": lock.set_address,
            }
            _touch_on_page(part, choices, options, console, page)
        else:
            _touch_without_page(part, choices, options, console)


def _touch_on_page(
    part: Path, choices: PartOptions, options: ImprovementOptions, console: Console, page: dict[str, Any]
) -> None:
    """Let a part be set up and touched on its page; `page` are options of `touch_on_page`."""
    from palpate.cli.touch_page import TouchedPart, touch_on_page
    from palpate.study.part_study import AUTO

    notes: list[str] = []
    touched = TouchedPart(
        options.until, options.limit, options.workers, console, refine=choices.element == AUTO
    )
    touch_on_page(
        part.stem,
        lambda unit, wrap: _study_on_page(
            part,
            replace(choices, unit=unit or choices.unit, wrap=choices.wrap if wrap is None else wrap),
            notes,
            console,
        ),
        lambda study: _write(part, study, notes),
        touched,
        recordings=part.parent,
        **page,
    )
    if touched.exit_code == UsageError.exit_code and touched.refusal is not None:
        raise touched.refusal


def _touch_without_page(
    part: Path, choices: PartOptions, options: ImprovementOptions, console: Console
) -> None:
    """Improve the study of a part, and print each surrogate."""
    from palpate.cli.study_commands import refine_elements
    from palpate.study.part_study import AUTO, study_file
    from palpate.study.run import Paths

    study = _study_of(part, choices, console)
    if choices.element == AUTO:
        study = refine_elements(study, study_file(part, choices.name), console, workers=options.workers)
    _carry_on(study.with_workers(options.workers), Paths(part.parent, study.name), options, console)


@contextlib.contextmanager
def _no_study_of_refusals(part: Path, name: str | None) -> Iterator[None]:
    """Remove a study that was not there before, where what it says is refused before anything is solved.

    Else the next command would go on with it, and refuse other options.
    """
    from palpate.study.part_study import study_file
    from palpate.study.run import Paths

    file = study_file(part, name)
    was_there = file.exists()
    try:
        yield
    except UsageError:
        data = Paths(file.parent, file.stem).data
        plan = data.with_name(f"{data.name}.batch")
        if not was_there and not data.exists() and not data.with_name(f"{data.name}.parts").exists():
            file.unlink(missing_ok=True)
            shutil.rmtree(plan, ignore_errors=True)  # places that were chosen, and not solved
        raise


def _study_on_page(
    part: Path, choices: PartOptions, notes: list[str], console: Console
) -> tuple[Study, Path, bool]:
    """Return the study of a part, its file, and whether that was there; a new one is written at the start.

    `notes` becomes what the part's file holds.
    """
    from palpate.study.part_study import part_study, study_file

    file = study_file(part, choices.name)
    if file.exists():
        return _study_of(part, choices, console), file, True
    with console.patience(f"Reading {part}"):
        study, held = part_study(part, options=choices)
    notes[:] = held
    console.say("\n".join(filter(None, notes)))
    console.say(f"{chosen_words(study)} Change it on the page, and press start there.")
    return study, file, False


def _write(part: Path, study: Study, notes: list[str]) -> Path:
    """Write the study of a part beside it, and return the file."""
    from palpate.files import write_file
    from palpate.study.part_study import part_text, study_file

    file = study_file(part, study.name)
    write_file(file, part_text(study, notes))
    return file


def _study_of(part: Path, choices: PartOptions, console: Console) -> Study:
    """Return the study of a part that lies beside it, or write one with these options."""
    from palpate.files import write_file
    from palpate.study import read_study
    from palpate.study.part_study import part_study, part_text, study_file

    file = study_file(part, choices.name)
    if file.exists():
        with console.patience(f"Reading {file} and {part}"):
            study = read_study(file)
        require_same(file, study, choices)
        _require_part(study, file, part)
        console.say(f"Going on with the study {file} …")
        return study
    with console.patience(f"Reading {part}"):
        study, notes = part_study(part, options=choices)
    write_file(file, part_text(study, notes))
    console.say("\n".join(filter(None, notes)))
    console.say(f"{chosen_words(study)} {file} says all of it; change it there.")
    return study


def _require_part(study: Study, file: Path, part: Path) -> None:
    """Refuse a study that lies beside a part under its name, and is one of another part."""
    other = getattr(study.body, "file", None)
    if other is None or Path(other).name != part.name:
        raise UsageError(
            f"{file} exists already, and is no study of {part.name}.",
            why=f"It is one of {'another body' if other is None else Path(other).name}.",
            fix="Give the study of this part another name: --name NAME.",
        )


def _carry_on(study: Study, paths: Paths, options: ImprovementOptions, console: Console) -> None:
    """Improve the study, print each surrogate, and write the report of the last."""
    from palpate.cli.improvement_lines import improve_and_print
    from palpate.cli.verdict_lines import verdict_text
    from palpate.study.run import report_study

    outcome, content, failure = improve_and_print(study, paths, options, console)
    report = report_study(paths.report, [outcome])
    text = verdict_text([outcome.validation], console, report=report, next_step=f"palpate view {paths.model}")
    console.result(text, content | {"report": str(report)})
    if failure is not None:
        raise failure
