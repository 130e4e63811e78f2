"""`palpate init`: a study file, of a named study or of a part that the user has, and a part to try things with."""

from __future__ import annotations

from pathlib import Path

import typer

from palpate.errors import UsageError
from palpate.file_kinds import file_kind, way_for
from palpate.files import write_file
from palpate.input_files import plain_text

__all__ = ["init_study"]


def init_study(
    path: Path, preset: str, unit: str | None, *, default: bool, sample: bool, force: bool, show: bool
) -> None:
    """Write or print a study, or write the sample part.

    Parameters
    ----------
    path : Path
        File to write, or a part, whose study is written beside it.
    preset : str
        Named study to start from, for a path that is no part.
    unit : str, optional
        Unit of a part's file.
    default : bool
        Whether the path is the default one, which gives the study no name.
    sample : bool
        Whether to write the sample part to the path.
    force : bool
        Whether to replace a file that exists.
    show : bool
        Whether to print the study instead.

    Raises
    ------
    UsageError
        If the file exists, is a folder or can't be read as a part.
    """
    from palpate.study import preset_study, to_toml
    from palpate.study.part_records import CAD_ENDINGS, MESH_ENDINGS
    from palpate.study.part_study import part_study, part_text, study_file

    if path.is_dir():
        raise UsageError(f"{path} is a folder.", fix=f"Name a file, such as {path / 'study.toml'}.")
    if sample:
        _write_sample(path, force=force)
        return
    if path.suffix.lower() in (*CAD_ENDINGS, *MESH_ENDINGS):
        record, notes = part_study(path, unit=unit)
        text = part_text(record, notes)
        target = study_file(path)
    else:
        if (kind := file_kind(path)) not in ("", "a study file"):
            raise UsageError(
                f"A study file can't be called {path}: that is the name of {kind}.",
                fix=f"Name the study NAME.toml, or a part. {way_for(path)}",
            )
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
    typer.echo(plain_text(f"{target}: a study called {record.name}. Next: palpate sweep {target}"))


def _write_sample(path: Path, *, force: bool) -> None:
    from palpate.physics.shapes.sample_part import write_sample_part

    path = Path("kidney.stl") if path == Path("study.toml") else path
    _require_free(path, force=force)
    write_sample_part(path)
    typer.echo(plain_text(f"{path}: a kidney-like organ, 5,120 triangles, in mm. Next: palpate init {path}"))


def _require_free(path: Path, *, force: bool) -> None:
    if path.exists() and not force:
        raise UsageError(f"{path} exists already.", fix="Choose another name, or replace it with --force.")
