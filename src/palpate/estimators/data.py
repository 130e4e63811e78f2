"""Rows and weights as the estimators take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.choosing.automatic import ranges_of
from palpate.network import Network
from palpate.units import Quantity, Range

__all__ = ["BadValue", "Units", "merged", "weights_of"]


class BadValue(UsageError, ValueError):
    """A wrong value, which scikit-learn expects to be a ValueError."""


def weights_of(sample_weight: Any, rows: int) -> np.ndarray:
    """Weights (N,) from what the user gave: nothing, one number, or one number per row.

    Raises
    ------
    BadValue
        If they have another shape, or are negative, not finite, or all zero.
    """
    if sample_weight is None:
        return np.ones(rows)
    weights = np.array(sample_weight, dtype=np.float64)
    if weights.ndim == 0:
        weights = np.full(rows, weights)
    if weights.shape != (rows,):
        raise BadValue(f"sample_weight has shape {weights.shape}; {rows} rows ask for ({rows},).")
    if not np.isfinite(weights).all() or (weights < 0).any():
        raise BadValue("sample_weight holds numbers that are negative or not finite.")
    if not weights.any():
        raise BadValue("All sample weights are zero.", why="Nothing is left to learn from.")
    return weights


def merged(X: np.ndarray, Y: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of X (N, n), Y (N, m) that differ, sorted, and the summed weights, whose mean is then 1.

    So a weight of two is the row given twice, a weight of zero the row left out, and the order of rows is of no
    matter.
    """
    used = weights > 0
    rows = np.hstack([X, Y])[used] + 0.0  # so that −0 is 0
    rows, place = np.unique(rows, axis=0, return_inverse=True)
    summed = np.bincount(place.ravel(), weights[used], len(rows))
    n = X.shape[1]
    return rows[:, :n].copy(), rows[:, n:].copy(), summed / summed.mean()


@dataclass(frozen=True, eq=False)
class Units:
    """The units in which an estimator learns: names, ranges, and one divisor per output.

    Attributes
    ----------
    inputs : n ranges
    outputs : m quantities
    divisor : (m,)
    """

    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    divisor: np.ndarray

    @classmethod
    def of(
        cls,
        X: np.ndarray,
        Y: np.ndarray,
        ranges: Sequence[tuple[float, float]] | None,
        names: Sequence[str] | None,
        *,
        each: bool,
    ) -> Units:
        """From training rows; `each` output gets its own divisor, or all the same.

        Raises
        ------
        BadValue
            If there are not as many ranges as inputs.
        """
        names = [f"x{i}" for i in range(X.shape[1])] if names is None else [str(name) for name in names]
        if ranges is not None and len(ranges) != X.shape[1]:
            raise BadValue(f"{len(ranges)} ranges were given for {X.shape[1]} inputs.")
        inputs = (
            ranges_of(X, names)
            if ranges is None
            else tuple(
                Range(name, float(low), float(high)) for name, (low, high) in zip(names, ranges, strict=True)
            )
        )
        size = np.abs(Y - Y.mean(axis=0)).max(axis=0)
        # a column that is constant but for round-off is not blown up
        size = np.where(size > 1e-12 * np.abs(Y).max(axis=0), size, 0.0)
        if not each:
            size = np.full(Y.shape[1], size.max())
        return cls(inputs, tuple(Quantity(f"y{i}") for i in range(Y.shape[1])), np.where(size > 0, size, 1.0))

    def back(self, network: Network) -> Network:
        """A network that learnt divided outputs, giving them whole."""
        s = network.scaling
        whole = replace(
            s, output_centre=s.output_centre * self.divisor, output_scale=s.output_scale * self.divisor
        )
        return replace(network, scaling=whole)
