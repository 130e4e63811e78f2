"""`palpate exam`: find the lumps in a body by touch, and see how well."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import count_option
from palpate.cli.table_options import Json
from palpate.cli.touch_options import Device
from palpate.errors import UsageError

if TYPE_CHECKING:
    from palpate.experiments.exam_folders import PastExamination
    from palpate.experiments.exam_kinds import ExamKind
    from palpate.experiments.exam_page import ExamPage
    from palpate.surrogates import Lump, Surrogate

__all__ = ["exam", "learnt_study"]


def exam(
    what: Annotated[
        str,
        typer.Argument(help="breast, prostate or skin, a model file (.palpate), or a study that is learnt."),
    ] = "breast",
    seed: Annotated[
        int | None, count_option("--seed", least=0, help="Seed of the lumps. Default: at random.")
    ] = None,
    lump: Annotated[
        list[str] | None,
        typer.Option(
            help="Lump in place of drawn ones: x, y, z and radius (m, or with units) and ratio of moduli, with "
            "semicolons between: '5 mm; 0 mm; 22 mm; 6 mm; 10' in the breast. Several times."
        ),
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Folder of the examinations. Default: the user's data directory.")
    ] = None,
    list_them: Annotated[bool, typer.Option("--list", help="List the examinations on this machine.")] = False,
    score: Annotated[str | None, typer.Option(help="Name of an examination whose score is printed.")] = None,
    again: Annotated[
        str | None,
        typer.Option(
            "--replay", help="Name of an examination that is felt again: is every force the recorded one?"
        ),
    ] = None,
    device: Device = "page",
    port: Annotated[int, count_option("--port", least=0, most=65535, help="Port of the page.")] = 8080,
    strict_port: Annotated[bool, typer.Option("--strict-port", help="Stop if the port is busy.")] = False,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a web browser.")
    ] = True,
    token: Annotated[
        bool, typer.Option("--token/--no-token", help="Open the page only to who has its whole address.")
    ] = True,
    as_json: Json = False,
) -> None:
    """Find hidden lumps in a body by touch: practise, then be examined. The score and every touch are kept."""
    from palpate.experiments.exam_folders import exam_directory

    console = Console(as_json)
    directory = folder or exam_directory()
    if list_them:
        _list(directory, console)
    elif score is not None:
        _print_score(_past(directory, score), console)
    elif again is not None:
        _replay(_past(directory, again), console)
    else:
        server: dict[str, Any] = {"port": port, "strict_port": strict_port, "token": token}
        _open(what, directory, seed, lump or [], device, console, browser=browser, **server)


def _open(
    what: str,
    directory: Path,
    seed: int | None,
    lumps: list[str],
    device: str,
    console: Console,
    *,
    browser: bool,
    port: int,
    strict_port: bool,
    token: bool,
) -> None:
    """Serve the page of an examination until Ctrl-C."""
    from palpate.runtime.touchable import aim_device, touchable
    from palpate.runtime.warm_up import WarmUp

    hidden = [_lump(text) for text in lumps] or None
    with WarmUp("pressed", "loop") as warm_up:  # it compiles while the page's parts and the body are loaded
        from palpate.experiments.exam_page import ExamPage, serve_exam

        kind, surrogate = _body(what)
        body = touchable(surrogate)
        words = warm_up.words or WarmUp(body=body).words
        console.say(f"Opening the {kind.title[0].lower()}{kind.title[1:]} … {words}".rstrip())
        warm_up.wait()
    page = ExamPage(
        kind,
        surrogate,
        directory=directory,
        seed=seed,
        lumps=hidden,
        device=aim_device(device, body),
        port=port,
        strict_port=strict_port,
        token=token,
    )

    def say(running: ExamPage) -> None:
        console.say(f"{running.url} shows the {kind.title[0].lower()}{kind.title[1:]}. Ctrl-C ends it.")
        console.say(f"Examinations are kept in {directory}.")

    serve_exam(page, open_browser=browser and sys.stdout.isatty(), on_ready=say)


def _body(what: str) -> tuple[ExamKind, Surrogate]:
    """Return the kind and the body of a name, a model file or a study."""
    from palpate import checks
    from palpate.experiments.exam_kinds import KINDS, kind_of_body
    from palpate.learning.loading import load_surrogate
    from palpate.runtime.touchable import touchable
    from palpate.surrogates.baselines import require_ball
    from palpate.surrogates.shipped_bodies import FOLDER, shipped_body

    if what in KINDS:
        if not (FOLDER / f"{what}.palpate").is_file():
            raise UsageError(
                f"The body of {what} is not in this installation.",
                why="It is learnt from solves that take some minutes.",
                fix=f"In a clone, python -m benchmarks.shipped_bodies {what} makes it; {_there()}",
            )
        return KINDS[what], shipped_body(what)
    path = Path(what)
    if path.suffix == ".toml":
        path = learnt_study(path)
    elif path.suffix != ".palpate":
        checks.one_of("What is examined", what, tuple(KINDS))
    surrogate = load_surrogate(path)
    body = touchable(surrogate)
    require_ball(body.energy.baseline, "be examined")
    if body.holds or body.surface is None or body.parameters:
        raise UsageError(
            f"{path} can't be examined.",
            why="An examination presses the surface of a body by a free ball, without further inputs.",
            fix="Take a body of `palpate touch`, or breast, prostate or skin.",
        )
    return kind_of_body(path.stem, body), surrogate


def _there() -> str:
    """Return which bodies can be examined at once, in words."""
    from palpate.surrogates.shipped_bodies import FOLDER

    names = sorted(path.stem for path in FOLDER.glob("*.palpate"))
    return f"or examine {' or '.join(names)}." if names else "or examine a body of your own."


def learnt_study(path: Path) -> Path:
    """Return the model file of a study."""
    from palpate.study import read_study
    from palpate.study.study_paths import Paths

    model = Paths(path.parent, read_study(path).name).model
    if not model.is_file():
        raise UsageError(
            f"The study {path} is not learnt yet: {model.name} is not there.",
            why="Its solves take minutes to hours; `palpate sweep` says how long as it begins.",
            fix=f"palpate sweep {path} && palpate learn {path}, then give this command again.",
        )
    return model


def _lump(text: str) -> Lump:
    """Return a lump from a person's five numbers."""
    from palpate.surrogates import Lump
    from palpate.units import parse_quantity

    parts = [part.strip() for part in text.split(";")]
    if len(parts) != 5:
        raise UsageError(
            f"--lump {text!r} is no lump.",
            why="A lump has five numbers with semicolons between: x, y, z, radius, ratio.",
            fix="--lump '5 mm; 0 mm; 22 mm; 6 mm; 10'",
        )
    names = ("x", "y", "z", "radius")
    x, y, z, radius = (
        parse_quantity(part, "m", f"The {name} of a lump", bare=True)
        for part, name in zip(parts, names, strict=False)
    )
    return Lump((x, y, z), radius, parse_quantity(parts[4], "", "The ratio of a lump", bare=True))


def _past(directory: Path, name: str) -> PastExamination:
    from palpate.experiments.exam_folders import PastExamination, past_examinations

    if Path(name).name != name or not (directory / name).is_dir():
        known = [past.name for past in past_examinations(directory)[:5]]
        raise UsageError(
            f"There is no examination {name!r} in {directory}.",
            fix=f"The latest are {', '.join(known)}." if known else "Take one first: palpate exam breast.",
        )
    return PastExamination.read(directory / name)


def _list(directory: Path, console: Console) -> None:
    from palpate.experiments.exam_folders import past_examinations

    past = past_examinations(directory)
    lines = [f"{exam.name}  {exam.words}" for exam in past]
    rows = [{"name": exam.name, "ended": exam.has_end, "words": exam.words} for exam in past]
    console.result(
        "\n".join(lines) or f"No examination in {directory}.",
        {"folder": str(directory), "examinations": rows},
    )


def _print_score(past: PastExamination, console: Console) -> None:
    from palpate.experiments.exam_score import score_examination

    if not past.has_end:
        raise UsageError(
            f"{past.name} has not ended.",
            why="Its score would tell where the lumps are.",
            fix="Go on with it from the list on the page of `palpate exam`, and end it.",
        )
    score = score_examination(past)
    console.result(score.words, score.as_dict())


def _replay(past: PastExamination, console: Console) -> None:
    """Go through all recordings of an examination again."""
    from palpate.devices.trace_file import read_trace
    from palpate.experiments.exam_folders import FELT
    from palpate.runtime.replay import Replay, is_recorded_model
    from palpate.runtime.touchable import load_touchable

    felt = past.folder / FELT
    outcomes = []
    for path in past.traces:
        trace = read_trace(path)
        if not len(trace):
            continue
        same = is_recorded_model(trace, felt)
        outcomes.append((path.name, Replay(trace, load_touchable(felt), same=same).run()))
    if not outcomes:
        raise UsageError(f"{past.name} has no recorded touch.", why="It was killed as it began.")
    console.result(
        "\n".join(f"{name}: {replayed}" for name, replayed in outcomes),
        {"examination": past.name, "recordings": [{"file": n} | r.as_dict() for n, r in outcomes]},
    )
