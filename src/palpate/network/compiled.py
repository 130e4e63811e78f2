"""What the kernels of `evaluate` take: a network's numbers in the order and precision in which they are read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from palpate.errors import UsageError
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.network.radial_kernels import HEAD, constants

if TYPE_CHECKING:
    from palpate.network.network import Network

__all__ = ["PRECISIONS", "Precision", "packed", "pattern", "workspace"]

Precision = Literal["double", "single"]
PRECISIONS: tuple[Precision, ...] = get_args(Precision)
_TYPES: dict[str, tuple[type[np.floating], type[np.signedinteger]]] = {
    "double": (np.float64, np.int64),
    "single": (np.float32, np.int32),
}


def pattern(factors: np.ndarray) -> np.ndarray:
    """Row and column (e, 2) of every entry of the factors (h, r, n) that is not zero in all units, row by row."""
    return np.argwhere((factors != 0).any(axis=0))


def packed(network: Network, precision: Precision) -> tuple[np.ndarray, ...]:
    """(layout, scales, units, rows, modes, constants), described in `evaluate`.

    The inputs are scaled in double precision in either case: where a range is narrow beside its distance from
    zero, single precision could not tell its points apart.

    Raises
    ------
    UsageError
        If there is no such precision.
    """
    if precision not in PRECISIONS:
        raise UsageError(
            f"There is no precision {precision!r}.", fix=f"Choose one of {', '.join(PRECISIONS)}."
        )
    s, entries = network.scaling, pattern(network.factors)
    layout = np.vstack([[[RADIAL_FUNCTIONS.index(network.radial), 0]], entries])
    units = np.vstack([network.factors[:, entries[:, 0], entries[:, 1]].T, network.shifts.T])
    rows, modes = np.vstack([network.tail.T, network.weights.T]), np.zeros((0, 0))
    if network.basis is None:
        rows = rows * s.output_scale
        rows[0] += s.output_centre
    else:
        modes = np.vstack([s.output_centre, network.basis.T * s.output_scale])
    kind = _TYPES[precision][0]
    return (
        np.ascontiguousarray(layout, dtype=np.int64),
        np.ascontiguousarray([s.input_centre, s.input_half], dtype=np.float64),
        *(np.ascontiguousarray(a, dtype=kind) for a in (units, rows, modes)),
        constants(kind),
    )


def workspace(parts: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:
    """(work, steps) for what `packed` made: for one thread at a time."""
    layout, scales, units, rows = parts[:4]
    r, n = units.shape[0] - (layout.shape[0] - 1), scales.shape[1]
    width = max(rows.shape[0], 1 + rows.shape[1])
    work: np.ndarray[Any, Any] = np.zeros((HEAD + r + 2 * (1 + n), width), units.dtype)
    return work, work.view(_TYPES["double" if units.dtype == np.float64 else "single"][1])
