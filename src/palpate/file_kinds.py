"""Kinds of files by the endings of their names, and the commands that take them, for messages about a wrong file."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["file_kind", "way_for"]

_TABLES = (".csv", ".tsv", ".txt", ".dat", ".xlsx", ".parquet", ".npz", ".npy", ".json")
_PARTS = (".stl", ".step", ".stp", ".msh", ".vtu", ".inp")
_KINDS = {
    **dict.fromkeys(_TABLES, "a file of data"),
    **dict.fromkeys(_PARTS, "a part"),
    ".palpate": "a model file",
    ".zarr": "a dataset of solves",
    ".toml": "a study file",
}
_WAYS = {
    "a file of data": "`palpate fit {0} --inputs … --outputs …` learns from a table.",
    "a part": "`palpate touch {0}` opens a part, `palpate init {0}` writes a study of it.",
    "a model file": "`palpate view {0}` shows a model, `palpate ask {0}` says what it holds.",
    "a dataset of solves": "`palpate learn {0}` learns from a dataset.",
    "a study file": "`palpate sweep {0}` and `palpate learn {0}` carry out a study.",
}


def file_kind(path: str | os.PathLike[str]) -> str:
    """Return what a file is by its name's ending, such as "a study file"; "" for an ending that tells nothing."""
    return _KINDS.get(Path(path).suffix.lower(), "")


def way_for(path: str | os.PathLike[str]) -> str:
    """Return a sentence that names the command for such a file; "" where its ending tells nothing."""
    return _WAYS.get(file_kind(path), "").format(path)
