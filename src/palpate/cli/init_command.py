"""`palpate init`: a study file, of a named study or of a part that the user has, and a part to try things with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer

from palpate.cli.console import Console
from palpate.errors import UsageError
from palpate.file_kinds import PART_FORMATS, file_kind, way_for
from palpate.files import require_regular, write_file
from palpate.input_files import plain_text
from palpate.output_files import is_marked

__all__ = ["init_study", "part_line"]


def init_study(
    path: Path, preset: str, unit: str | None, *, default: bool, sample: bool, force: bool, show: bool
) -> None:
    """Write or print a study, or write the sample part.

    The path is the file to write, or a part in `unit`, whose study is written beside it; a preset is the named study to
    start from where it is no part. A default path gives the study no name. `force` replaces a file that palpate wrote,
    `show` prints the study instead.
    """
    if path.is_dir():
        raise UsageError(f"{path} is a folder.", fix="Name the file of a part, or of a study, NAME.toml.")
    if sample:
        _write_sample(path, default=default, force=force)
        return
    from palpate.study import preset_study, to_toml

    said = ""
    if file_kind(path) == "a part":
        from palpate.study.part_study import part_study, part_text, study_file

        with Console().patience(f"Reading {path}"):
            record, notes = part_study(path, unit=unit)
        text, target, said = part_text(record, notes), study_file(path), f"{part_line(notes)}\n"
    else:
        _require_toml(path)
        if unit is not None:
            raise UsageError("A unit belongs to a part.", fix="Name the part's file, or leave out --unit.")
        record, target = preset_study(preset), path
        # a file with a name of its own gives the study, and so its files, that name
        record = record if default or show else record.renamed(path.stem)
        text = to_toml(record)
    if show:
        typer.echo(text, nl=False)
        return
    _require_free(target, force=force)
    write_file(target, text)
    typer.echo(plain_text(f"{said}{target}: a study called {record.name}. Next: palpate sweep {target}"))


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


def _write_sample(path: Path, *, default: bool, force: bool) -> None:
    from palpate.physics.shapes.sample_part import write_sample_part

    path = Path("kidney.stl") if default else path.with_suffix(".stl") if not path.suffix else path
    if path.stem != "kidney" or path.suffix != ".stl":
        raise UsageError(
            f"There is no sample part called {path.name}.",
            why="There is one: kidney.stl, a kidney-like organ.",
            fix=f"Name {path.with_name('kidney.stl')}, or leave the name out.",
        )
    _require_free(path, force=force)
    write_sample_part(path)
    typer.echo(plain_text(f"{path}: a kidney-like organ, 5,120 triangles, in mm. Next: palpate init {path}"))


def _require_free(path: Path, *, force: bool) -> None:
    """Refuse to write over a file, unless palpate wrote it and it is given up."""
    require_regular(path)
    if not path.exists() or (force and is_marked(path)):
        return
    if is_marked(path):
        raise UsageError(f"{path} exists already.", fix="Choose another name, or replace it with --force.")
    raise UsageError(
        f"{path} exists already, and palpate did not write it.",
        why="It does not begin as what `palpate init` writes, and has not the tables of a study.",
        fix="Choose another name, or remove the file yourself.",
    )
