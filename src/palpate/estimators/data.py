"""Rows and weights as the estimators take them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.choosing.automatic import ranges_of
from palpate.network import Network
from palpate.units import Quantity, Range

__all__ = [
    "BadValue",
    "Units",
    "check_count",
    "check_one_of",
    "merged",
    "refused_as_bad_value",
    "weights_of",
]


class BadValue(UsageError, ValueError):
    """A wrong value, which scikit-learn expects to be a ValueError."""


@contextmanager
def refused_as_bad_value() -> Iterator[None]:
    """Turn what palpate refuses into the ValueError that scikit-learn expects."""
    try:
        yield
    except UsageError as error:
        raise BadValue(error.what, why=error.why, fix=error.fix) from error


def check_count(name: str, value: Any, least: int) -> None:
    """Refuse what is no whole number, or less than `least`.

    Raises
    ------
    BadValue
        Then.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or value < least:
        raise BadValue(f"{name} is {value!r}.", fix=f"Give a whole number, {least} or more.")


def check_one_of(name: str, value: Any, known: Sequence[str]) -> None:
    """Refuse what is none of the known names.

    Raises
    ------
    BadValue
        Then.
    """
    if not isinstance(value, str) or value not in known:
        raise BadValue(f"{name} is {value!r}.", fix=f"Choose one of {', '.join(known)}.")


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
            If there are not as many ranges as inputs, or one of them is none.
        """
        names = [f"x{i}" for i in range(X.shape[1])] if names is None else [str(name) for name in names]
        inputs = ranges_of(X, names) if ranges is None else _declared(ranges, names)
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


def _declared(ranges: Any, names: Sequence[str]) -> tuple[Range, ...]:
    """Ranges from one (low, high) for each name."""
    try:
        ends = np.array(ranges, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise _no_ranges(ranges, f"{error}.") from error
    if ends.ndim != 2 or ends.shape[1] != 2:
        raise _no_ranges(ranges, f"As an array they have shape {ends.shape}.")
    if len(ends) != len(names):
        raise BadValue(
            f"{len(ends)} ranges were given for {len(names)} inputs.",
            fix="Give one (low, high) for each input.",
        )
    with refused_as_bad_value():
        return tuple(
            Range(name, float(low), float(high)) for name, (low, high) in zip(names, ends, strict=True)
        )


def _no_ranges(ranges: Any, why: str) -> BadValue:
    return BadValue(
        f"ranges is {ranges!r:.80}.",
        why=why,
        fix="Give one (low, high) for each input, such as [(0, 5), (1, 2)].",
    )
