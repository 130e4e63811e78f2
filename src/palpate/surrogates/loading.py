"""One way to read a learnt body from a file."""

from __future__ import annotations

import os
from pathlib import Path

from palpate.errors import FileFormatError
from palpate.network import load_archive
from palpate.surrogates.surrogate import Surrogate

__all__ = ["load"]

_FORMER = ("touch", "held-body", "touched-body", "touch-surrogate", "grasp-surrogate", "field-surrogate")


def load(path: str | os.PathLike[str]) -> Surrogate:
    """Read a learnt body from a file.

    Networks that `palpate.fit` has made are read by `Fitted.load`.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, from a later version or from 0.1.0, or holds something else.
    """
    path = Path(path)
    if load_archive(path).kind in _FORMER:
        raise FileFormatError(
            f"{path} was written by palpate 0.1.0, which had a file of its own for each kind of body.",
            why="A learnt body is one kind of file now.",
            fix="Learn it again from its solves: `palpate learn STUDY.toml`, or pp.learn(data)[0].save(file).",
        )
    return Surrogate.load(path)
