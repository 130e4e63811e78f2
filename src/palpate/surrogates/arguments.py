"""Places and inputs as the kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.units import Range

__all__ = ["NONE", "place_at", "rows_of"]

NONE = np.zeros(0)
_DOUBLE = np.dtype(np.float64)


def place_at(position: Any, parameters: Any, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return a place (3,) and further inputs of this shape; all but float64 arrays are converted."""
    if type(position) is not np.ndarray or position.dtype is not _DOUBLE:
        position = np.asarray(position, np.float64)
    if type(parameters) is not np.ndarray or parameters.dtype is not _DOUBLE:
        parameters = np.asarray(parameters, np.float64)
    if position.shape != (3,) or parameters.shape != shape:
        raise UsageError(
            f"A hand at {position.shape} with parameters {parameters.shape} can't be answered.",
            fix=f"Give its place (3,) in m and parameters {shape}.",
        )
    return position, parameters


def rows_of(X: Any, inputs: Sequence[Range], words: str) -> np.ndarray:
    """Return inputs (N, n), all finite, in double precision; `words` calls what they are given to by its name."""
    why = f"They are {', '.join(f'{r.name} ({r.unit})' if r.unit else r.name for r in inputs)}."
    try:
        X = np.ascontiguousarray(X, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(f"Inputs of a {words} are numbers: {error}.", why=why) from error
    if X.ndim != 2 or X.shape[1] != len(inputs):
        raise UsageError(
            f"Inputs of shape {X.shape} came to a {words} of {len(inputs)} inputs.",
            why=why,
            fix=f"Pass an array of shape (N, {len(inputs)}), in SI units; one row for a single place.",
        )
    if not np.isfinite(X).all():
        row = int(np.flatnonzero(~np.isfinite(X).all(axis=1))[0])
        raise UsageError(f"Row {row} of {len(X)} inputs is not finite: {X[row]}.", why=why)
    return np.asarray(X)
