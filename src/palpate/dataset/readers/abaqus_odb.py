"""Abaqus's output databases, ``.odb``: only Abaqus's own Python reads them, so a script of ours does it there."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

from palpate.dataset.readers.results import refuse

__all__ = ["SCRIPT", "refuse_odb"]

SCRIPT = Path(__file__).with_name("odb_to_npz.py")
"""The script that `abaqus python` runs."""


def refuse_odb(path: Path) -> NoReturn:
    """Refuse an ``.odb``, and say how to make an ``.npz`` of it."""
    raise refuse(
        path,
        None,
        "an .odb is read by Abaqus alone.",
        why="Its layout is Abaqus's own, and differs from version to version.",
        fix=f"Run `abaqus python {SCRIPT} {path} U NT11`, with the names of your fields, and import the .npz.",
    )
