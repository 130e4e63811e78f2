"""What all surrogates' files have in common: numbers that JSON can hold, and how a file that is none is refused."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.network import Archive, load_archive

__all__ = ["doubles", "finite", "number", "read"]

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


def finite(value: float) -> float | None:
    """What JSON can hold: None for a number that is not finite."""
    return value if math.isfinite(value) else None


def number(meta: Mapping[str, Any], key: str, missing: float | None = None) -> float:
    """A finite number; None stands for `missing`, if that is given.

    Raises
    ------
    TypeError
        If it is something else.
    KeyError
        If it is not there.
    """
    found = meta[key]
    if found is None and missing is not None:
        return missing
    if type(found) not in {int, float} or not math.isfinite(found):
        raise TypeError(f"its {key} is {found!r:.40}, not a finite number")
    return float(found)


def doubles(array: np.ndarray) -> np.ndarray:
    """An array in double precision, of any shape.

    Raises
    ------
    TypeError
        If it is of another kind.
    """
    if array.dtype != np.float64:
        raise TypeError(f"it holds {array.dtype} numbers; double precision is needed")
    return array
