"""The refusal of a file that does not describe what it should."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

from palpate.errors import FileFormatError, UsageError
from palpate.network import Archive, load_archive

__all__ = ["read"]

Read = TypeVar("Read")


def read(path: str | os.PathLike[str], kind: str, what: str, build: Callable[[Archive], Read]) -> Read:
    """What `build` makes of a file of that kind; `what` calls it by its name, "a touch surrogate" say.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign or from a later version, or `build` finds that its parts do not fit.
    """
    archive = load_archive(path, kind=kind)
    try:
        return build(archive)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, UsageError) as error:
        raise FileFormatError(
            f"{path} does not describe {what}.",
            why=f"{type(error).__name__}: {error}",
            fix="Copy the file again, or learn it anew.",
        ) from error
