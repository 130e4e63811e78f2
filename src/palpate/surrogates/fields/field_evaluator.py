"""One touch at a time, without allocation: coefficients in a loop of 1 kHz, the field when a picture is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.network.network_kernels import PRECISIONS, Precision
from palpate.surrogates.arguments import NONE, place_at
from palpate.surrogates.fields.field_kernels import (
    FRAME,
    coefficients_into,
    field_into,
    posed_coefficients_into,
    profile_into,
)
from palpate.surrogates.fields.local_mode import OFFSETS

if TYPE_CHECKING:
    from palpate.surrogates.fields.field_surrogate import FieldSurrogate

__all__ = ["FieldEvaluator"]


class FieldEvaluator:
    """Evaluates one touch at a time into arrays it owns; one evaluator serves one thread at a time.

    Made by `FieldSurrogate.evaluator`. Single precision is for the eye: seven digits of the modes, half the memory
    that each picture reads.

    Attributes
    ----------
    values : (nodes, components)
        What `field` filled last.
    """

    def __init__(self, surrogate: FieldSurrogate, precision: Precision = "single") -> None:
        if precision not in PRECISIONS:
            raise UsageError(
                f"There is no precision {precision!r}.", fix=f"Choose one of {', '.join(PRECISIONS)}."
            )
        kind = np.float32 if precision == "single" else np.float64
        n, k = len(surrogate.inputs), len(surrogate.modes)
        self.values = np.zeros(surrogate.rest.shape, kind)
        self._flat = self.values.reshape(-1)
        self._z, self._place = np.zeros(1 + k, kind), np.zeros(FRAME + n - 3)
        numbers, limits, surface, net = surrogate.compiled()
        scratch = (np.zeros(k), np.zeros((2, n)), np.zeros((2, 3, 3)))
        self._first: tuple[Any, ...] = (self._z, self._place, *scratch, numbers, limits, surface, net)
        rows = np.concatenate([surrogate.rest[None], surrogate.modes]).reshape(1 + k, -1).astype(kind)
        deepest, table, *others = surrogate.profile_arguments()
        self._profile = np.zeros((table.shape[1], OFFSETS, surrogate.rest.shape[1]))
        self._second: tuple[Any, ...] = (self._profile, self._place, deepest, table, *others)
        line = np.zeros(self._profile[0].size)
        arguments = (self._flat, self._z, self._place, np.ascontiguousarray(rows), self._profile, line)
        self._third: tuple[Any, ...] = (*arguments, *surrogate.moving_arguments())
        self._shape = (n - 3,)
        self._shift, self._contact = np.array(surrogate.shift), surrogate.contact
        self._posed = (self._z, self._place, *scratch[:2], numbers, limits, net)
        low = np.array([r.low for r in surrogate.inputs])
        self(low[:3], low[3:])  # compile now, not in the loop
        self.field()

    def __call__(self, position: np.ndarray, parameters: np.ndarray = NONE) -> bool:
        """Find the coefficients at a centre (3,) in m and parameters (p,); whether there is contact.

        Raises
        ------
        UsageError
            If there are not three coordinates and p parameters.
        """
        position, parameters = place_at(position, parameters, self._shape)
        if self._contact is not None:
            s, foot, normal = self._contact.at(np.append(position, parameters)[None])
            touch = (float(s[0]), foot[0], normal[0])
            return bool(posed_coefficients_into(position, parameters, *touch, *self._posed))
        touches = bool(coefficients_into(position, parameters, *self._first))
        if touches:
            self._place[2:5] += self._shift
        return touches

    def field(self) -> np.ndarray:
        """The field (nodes, components) at the last call's touch; the same array each time."""
        profile_into(*self._second)
        field_into(*self._third)
        return self.values

    def profile(self) -> np.ndarray:
        """Profile of the local mode (r, 4, components) at the last call's touch, as in `field_kernels`; one array."""
        profile_into(*self._second)
        return self._profile

    @property
    def coefficients(self) -> np.ndarray:
        """Coefficients (k,) of the modes where the last call evaluated, in the field's unit."""
        return self._z[1:]

    @property
    def place(self) -> np.ndarray:
        """Place of the last call (8 + p,): depth s (m), f, contact point (m), normal, parameters; in air only s."""
        return self._place

    @property
    def depth(self) -> float:
        """s where the last call evaluated, m; negative without contact."""
        return float(self._place[0])
