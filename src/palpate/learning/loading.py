"""`palpate.load`: one way to read a file that palpate has written, whatever it holds."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from palpate.errors import FileFormatError, UsageError
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.plastic.load_histories import KIND as HISTORIES
from palpate.learning.plastic.load_histories import LoadHistories
from palpate.network import Archive, Network, load_archive
from palpate.surrogates import Surrogate

__all__ = ["Loaded", "load", "load_surrogate"]

Loaded: TypeAlias = Surrogate | Fitted | Network | LoadHistories


def load(path: str | os.PathLike[str]) -> Loaded:
    """Read a learnt body, a network, or load histories from a file.

    Parameters
    ----------
    path : path
        A ``.palpate`` file.

    Returns
    -------
    Surrogate, Fitted, Network or LoadHistories
        A learnt body; what `palpate.fit` has made, or a network alone; or the histories that a body with memory is
        learnt from.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, from a later version, or a body of 0.1.0.
    """
    kind = load_archive(path).kind
    if kind == HISTORIES:
        return LoadHistories.load(path)
    if kind != Archive.kind:
        return Surrogate.load(path)
    try:
        return Fitted.load(path)
    except FileFormatError:
        return Network.load(path)


def load_surrogate(path: str | os.PathLike[str]) -> Surrogate:
    """Return what a file holds as a surrogate: of a network its quantities ``outputs``; histories are refused."""
    learnt, name = load(path), Path(path).stem
    if isinstance(learnt, Fitted):
        made = learnt.surrogate(name)
        (part,) = made.quantities.values()
        return replace(made, quantities={"outputs": part})
    if isinstance(learnt, LoadHistories):
        raise UsageError(
            f"{path} holds no learnt body and no network.",
            why="These are what other tools can evaluate.",
            fix="Give a file of `palpate learn` or `palpate fit`.",
        )
    return Surrogate.of(learnt, name)
