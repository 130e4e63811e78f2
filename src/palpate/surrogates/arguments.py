"""Where a touch is, as the kernels take it."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["NONE", "touch_at"]

NONE = np.zeros(0)
_DOUBLE = np.dtype(np.float64)


def touch_at(position: Any, parameters: Any, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Centre (3,) and further inputs of this shape; float64 arrays are taken as they are, others are converted.

    Raises
    ------
    UsageError
        If there are not three coordinates and that many parameters.
    """
    if type(position) is not np.ndarray or position.dtype is not _DOUBLE:
        position = np.asarray(position, np.float64)
    if type(parameters) is not np.ndarray or parameters.dtype is not _DOUBLE:
        parameters = np.asarray(parameters, np.float64)
    if position.shape != (3,) or parameters.shape != shape:
        raise UsageError(
            f"A probe at {position.shape} with parameters {parameters.shape} can't be answered.",
            fix=f"Give its centre (3,) in m and parameters {shape}.",
        )
    return position, parameters
