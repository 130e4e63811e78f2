"""`palpate init`: a study file, of a named study or of a part that the user has, and a part to try things with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import with_options
from palpate.errors import UsageError
from palpate.file_kinds import PART_FORMATS, file_kind, way_for
from palpate.files import require_regular, write_file
from palpate.input_files import plain_text
from palpate.options import PartOptions, declarations
from palpate.output_files import is_marked

__all__ = ["init", "part_line"]

_STUDY = Path("study.toml")  # where no file is named
_PRESET = "beam-nylon"


@with_options(choices=PartOptions)
def init(
    path: Annotated[
        Path,
        typer.Argument(
            help="File to write, NAME.toml. Or a part (STL, OBJ, STEP, VTU, MSH, INP and others): its study is written "
            "beside it."
        ),
    ] = _STUDY,
    more: Annotated[list[str] | None, typer.Argument(hidden=True)] = None,
    preset: Annotated[
        str,
        typer.Option(
            help="Named study to start from, such as block, layered, liver, grasp, beam-copper or beam-plastic."
        ),
    ] = _PRESET,
    sample: Annotated[
        bool,
        typer.Option(
            "--sample",
            help="Write a part to try, NAME.stl: an organ called kidney, liver, heart or prostate. Default: kidney.",
        ),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a study, or a sample, that palpate wrote; nothing else.")
    ] = False,
    show: Annotated[bool, typer.Option("--print", help="Print the study instead of writing a file.")] = False,
    choices: Any = None,
) -> None:
    """Write a study file with a comment for every key: of a named study, or of a part with its options."""
    if more:
        raise _one_file_too_many(path, more[0])
    if path.is_dir():
        raise UsageError(f"{path} is a folder.", fix="Name the file of a part, or of a study, NAME.toml.")
    if sample:
        _write_sample(path, force=force)
    elif file_kind(path) == "a part":
        _init_part(path, choices, preset, force=force, show=show)
    else:
        _init_preset(path, preset, choices, force=force, show=show)


def _init_part(path: Path, choices: PartOptions, preset: str, *, force: bool, show: bool) -> None:
    """Write the study of a part beside it, or print it."""
    from palpate.study.part_study import part_study, part_text, study_file

    if preset != _PRESET:
        raise UsageError(
            f"The study of {path} does not start from a named one.",
            fix="Leave out --preset, or leave out the part.",
        )
    with Console().patience(f"Reading {path}"):
        study, notes = part_study(path, options=choices)
    text = part_text(study, notes)
    if show:
        typer.echo(text, nl=False)
        return
    target = study_file(path, study.name)
    named = f" --name {study.name}" if target != study_file(path) else ""
    way = f"another name with --name NAME, go on with palpate touch {path}{named}"
    _require_free(target, force=force, other=way)
    write_file(target, text)
    typer.echo(plain_text(f"{part_line(notes)}\n{target}: a study called {study.name}."))
    typer.echo(plain_text(f"Next: palpate touch {path}{named}, or palpate sweep {target}"))


def _init_preset(path: Path, preset: str, choices: PartOptions, *, force: bool, show: bool) -> None:
    """Write the study of a name under a path, or print it."""
    from palpate.study import preset_study, to_toml

    _require_toml(path)
    if given := [
        f"--{name}" for name in declarations(PartOptions) if getattr(choices, name) not in (None, ())
    ]:
        raise UsageError(
            f"{' and '.join(given)} {'belongs' if len(given) == 1 else 'belong'} to a part.",
            why=f"{path} is the name of a study.",
            fix="Name the part's file, or leave this out and change the study once it is written.",
        )
    study = preset_study(preset)
    # a file with a name of its own gives the study, and so its files, that name
    study = study if path == _STUDY or show else study.renamed(path.stem)
    text = to_toml(study)
    if show:
        typer.echo(text, nl=False)
        return
    _require_free(path, force=force)
    write_file(path, text)
    why = "" if study.name == path.stem else ", as the one that it starts from; `name` in the file says so"
    typer.echo(plain_text(f"{path}: a study called {study.name}{why}. Next: palpate sweep {path}"))


def _one_file_too_many(path: Path, other: str) -> UsageError:
    """Return the error of a second file: that of a part's study is named by an option."""
    if file_kind(path) != "a part":
        return UsageError(
            f"{other} is one file too many.", fix="Name one file: a part, or the study to write."
        )
    return UsageError(
        f"{other} is one file too many: the study of a part is written beside it, as NAME.toml.",
        fix=f"Say the name of the study: palpate init {path} --name {Path(other).stem}",
    )


def part_line(notes: Sequence[str]) -> str:
    """Return the line about a part that says its size, and in which unit its numbers were taken."""
    return next(note for note in notes if note)


def _require_toml(path: Path) -> None:
    """Refuse a study file of another ending: the file may be one that somebody has, and holds no study."""
    if path.suffix.lower() == ".toml":
        return
    if kind := file_kind(path).replace("a study file", ""):
        raise UsageError(
            f"A study file can't be called {path}: that is the name of {kind}.",
            fix=f"Name the study NAME.toml, or a part. {way_for(path)}",
        )
    raise UsageError(
        f"{path} is neither a part that can be read nor the name of a study.",
        why=f"Its name ends in {path.suffix or 'nothing'}. Parts are {PART_FORMATS}.",
        fix="Name the study NAME.toml, or export the part in one of these formats.",
    )


def _write_sample(path: Path, *, force: bool) -> None:
    """Write the sample part whose name a path has."""
    from palpate.physics.shapes.sample_part import SAMPLES, sample_name, sample_surface, write_sample_part

    path = Path("kidney.stl") if path == _STUDY else path.with_suffix(".stl") if not path.suffix else path
    name = sample_name(path.stem)
    _require_free(path, force=force)
    write_sample_part(path, name)
    size = len(sample_surface(name)[1])
    typer.echo(plain_text(f"{path}: {SAMPLES[name]}, {size:,} triangles, in mm. Next: palpate touch {path}"))


def _require_free(path: Path, *, force: bool, other: str = "another name") -> None:
    """Refuse to write over a file, unless palpate wrote it and it is given up; `other` is what to choose."""
    require_regular(path)
    if not path.exists() or (force and is_marked(path)):
        return
    if is_marked(path):
        raise UsageError(f"{path} exists already.", fix=f"Choose {other}, or replace it with --force.")
    raise UsageError(
        f"{path} exists already, and palpate did not write it.",
        why="It does not begin as what `palpate init` writes, and has not the tables of a study.",
        fix=f"Choose {other}, or remove the file yourself.",
    )
