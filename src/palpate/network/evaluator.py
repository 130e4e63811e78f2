"""One point at a time, without allocation: what the 1 kHz path calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numba.core.errors import TypingError

from palpate.errors import UsageError
from palpate.network import evaluate
from palpate.network.compiled import Precision

if TYPE_CHECKING:
    from palpate.network.network import Network

__all__ = ["Evaluator"]

_DOUBLE = np.dtype(np.float64)


class Evaluator:
    """Evaluates one point at a time into arrays it owns: `y = evaluator(x)` allocates nothing.

    The returned array (m,), and `jacobian` (m, n) if it was asked for, are overwritten by the next call; copy
    them to keep them. One evaluator serves one thread at a time.

    Parameters
    ----------
    network : Network
    precision : {"double", "single"}
        In single precision units, weights and outputs are 32-bit numbers; how much that costs is for
        `Network.precision_error` to measure, it is not known beforehand.
    jacobian : bool
        Whether each call also renews `jacobian`.
    """

    def __init__(self, network: Network, *, precision: Precision = "double", jacobian: bool = False) -> None:
        compiled = network.compiled(precision)
        self._inputs = network.inputs
        kind = compiled[0].dtype
        self._y = np.zeros(len(network.outputs), kind)
        self._J = np.zeros((len(network.inputs) if jacobian else 0, len(network.outputs)), kind)
        self._kernel: Callable[..., bool]
        self._rest: tuple[np.ndarray, ...]
        if jacobian:
            self._kernel, self._rest = evaluate.value_and_jacobian_into, (self._y, self._J, *compiled)
        else:
            self._kernel, self._rest = evaluate.value_into, (self._y, *compiled)
        self(np.array([r.low for r in network.inputs]))  # compile now, not in the loop

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) at x (n,), in SI units.

        A contiguous float64 array is taken as it is; anything else is converted first.

        Raises
        ------
        UsageError
            If x has not n numbers.
        """
        if type(x) is not np.ndarray or x.dtype is not _DOUBLE:
            x = np.ascontiguousarray(x, dtype=np.float64)
        try:
            fits = self._kernel(x, *self._rest)
        except TypingError:  # not one-dimensional
            fits = False
        if not fits:
            raise refused(x, len(self._inputs))
        return self._y

    @property
    def jacobian(self) -> np.ndarray:
        """∂f/∂x (m, n) where the last call evaluated, in output units per input unit.

        Raises
        ------
        UsageError
            If the evaluator was made without it.
        """
        if not len(self._J):
            raise UsageError(
                "This evaluator gives no Jacobian.", fix="Make it by network.evaluator(jacobian=True)."
            )
        return self._J.T

    def __repr__(self) -> str:
        return f"Evaluator: {len(self._inputs)} inputs → {np.array2string(self._y, threshold=8)}"


def refused(x: np.ndarray, inputs: int) -> UsageError:
    """The error for a point that has another shape than (n,)."""
    return UsageError(
        f"A point of shape {x.shape} can't be evaluated.", fix=f"Pass an array of shape ({inputs},)."
    )
