"""One way to read a file, whatever it holds."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from palpate.errors import FileFormatError
from palpate.network import load_archive
from palpate.surrogates.plastic.held_body import HeldBody
from palpate.surrogates.plastic.held_file import KIND as HELD
from palpate.surrogates.surrogate import KIND as SURROGATE
from palpate.surrogates.surrogate import Surrogate
from palpate.surrogates.touch import TouchModel

__all__ = ["Loaded", "load"]

Loaded: TypeAlias = TouchModel | HeldBody | Surrogate

_LOAD: dict[str, Callable[[Path], Loaded]] = {SURROGATE: Surrogate.load, HELD: HeldBody.load}
_FORMER = ("touched-body", "touch-surrogate", "grasp-surrogate", "field-surrogate")


def load(path: str | os.PathLike[str]) -> Loaded:
    """Read a learnt body from a file.

    Networks that `palpate.fit` has made are read by `Fitted.load`.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, from a later version or from 0.1.0, or holds something else.
    """
    path = Path(path)
    kind = load_archive(path).kind
    if kind in _FORMER:
        raise FileFormatError(
            f"{path} was written by palpate 0.1.0, which had a file of its own for each kind of body.",
            why="A learnt body is one kind of file now.",
            fix="Learn it again from its solves: `palpate learn STUDY.toml`, or pp.learn(data)[0].save(file).",
        )
    return _LOAD.get(kind, TouchModel.load)(path)
