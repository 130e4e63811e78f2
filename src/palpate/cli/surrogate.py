"""`palpate validate FILE` where the file is a touch surrogate and no study."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli.console import Console
from palpate.errors import AccuracyError, UsageError

if TYPE_CHECKING:
    from palpate.dataset import Dataset

__all__ = ["is_archive", "validate_file"]

_CORRECTED = (
    "Corrected by {} measured touches: it is of the specimen, and differs from solves of the model on purpose. "
    "How well it follows the specimen `palpate correct` tells, as left out."
)
FOLDERS = ("-test.zarr", "-random.zarr")


def is_archive(path: Path) -> bool:
    """Whether a file is something learnt and not a study: told by its first bytes, or by its name if there is none.

    A study is text; an archive begins with eight bytes of a length, the last of them zero (safetensors).
    """
    if not path.is_file():
        return path.suffix == ".palpate"
    with path.open("rb") as file:
        return b"\0" in file.read(8)


def validate_file(
    path: Path, test: Path | None, refined: Path | None, report: bool, console: Console
) -> None:
    """Judge a surrogate by the solves of a dataset, print, and write the report beside the file.

    Raises
    ------
    UsageError
        If the file is no surrogate, or there is no test set.
    AccuracyError
        If a limit is missed; everything has been printed and written then.
    """
    from palpate.dataset import Dataset
    from palpate.network import load_archive
    from palpate.surrogates import TouchedBody, TouchSurrogate
    from palpate.surrogates.grasp import GraspSurrogate
    from palpate.surrogates.learnt_energy import corrected_by
    from palpate.validation import SurrogateChapter, validate, write_report
    from palpate.validation.surrogate import unseen_solves

    kinds: dict[str, Any] = {
        "touch-surrogate": TouchSurrogate,
        "touched-body": TouchedBody,
        "grasp-surrogate": GraspSurrogate,
    }
    if (kind := load_archive(path).kind) not in kinds:
        raise UsageError(
            f"{path} holds {kind!r}, which is not judged by itself.",
            why="A touch model of a beam is judged together with its study; a body that remembers by histories.",
            fix="Give the study file, palpate validate study.toml; of a ready-made study run `palpate demo NAME` "
            "again, or judge it in Python: palpate.validation.validate_held(body, HeldPaths.load(file)).",
        )
    model = kinds[kind].load(path)
    surrogate = model.touch if isinstance(model, TouchedBody) else model
    data, fine = _test(path, test), None if refined is None else Dataset.open(refined)
    validation = replace(validate(model, data, refined=fine), name=path.stem)
    if touches := corrected_by(surrogate.meta):
        validation = replace(validation, notes=(*validation.notes, _CORRECTED.format(touches)))
    text, target = str(validation), path.with_suffix(".html") if report else None
    if isinstance(surrogate, GraspSurrogate):
        target = None  # the report's pictures are of touches on a surface
    if target is not None:
        solves, _ = unseen_solves(surrogate, data)
        told = {"settings": surrogate.meta, "provenance": data.provenance}
        write_report(target, [SurrogateChapter(path.stem, surrogate, solves, validation, **told)])
        text += f"\nreport: {target}"
    console.result(text, validation.as_dict() | {"report": str(target) if target else None})
    try:
        validation.raise_if_failed()
    except AccuracyError as error:
        if not touches:
            raise
        raise AccuracyError(error.what, why=error.why, fix=_CORRECTED.format(touches)) from None


def _test(path: Path, test: Path | None) -> Dataset:
    from palpate.dataset import Dataset

    if test is not None:
        return Dataset.open(test)
    beside = [path.with_name(path.stem + end) for end in FOLDERS]
    for folder in beside:
        if folder.exists():
            return Dataset.open(folder)
    raise UsageError(
        f"There are no solves to judge {path} by.",
        why=f"Neither {beside[0].name} nor {beside[1].name} lies beside it.",
        fix="Name a dataset of solves that it was not learnt from: --test DATA.zarr",
    )
