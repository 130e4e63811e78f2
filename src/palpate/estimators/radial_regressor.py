"""The base of both estimators: scikit-learn's conventions about rows, weights, parameters and predictions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from palpate import checks
from palpate.errors import UsageError
from palpate.learning.learn import check_target, ranges_of
from palpate.network import Network
from palpate.units import Quantity, Range

__all__ = ["BadValue", "RadialRegressor", "Units", "merge_rows", "refused_as_bad_value", "weights_of"]


class BadValue(UsageError, ValueError):
    """A wrong value, which scikit-learn expects to be a ValueError."""


@contextmanager
def refused_as_bad_value() -> Iterator[None]:
    """Turn an error of palpate's into the ValueError that scikit-learn expects."""
    try:
        yield
    except UsageError as error:
        raise BadValue(error.what, why=error.why, fix=error.fix) from error


class RadialRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A regressor that holds a network; a subclass learns it in `_learn`."""

    target: Any
    ranges: Any
    scale_outputs: str
    random_state: Any
    network_: Network  # in the units of the data
    _one_output: bool

    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> Self:
        """Learn anew from all samples.

        Parameters
        ----------
        X : array-like (N, n)
            Inputs, one row a sample.
        y : array-like (N,) or (N, m)
            Outputs; (N,) for one output, which predictions then have too.
        sample_weight : array-like (N,), optional
            Number of ordinary samples that each one counts as; one by default.

        Raises
        ------
        ValueError
            If arrays do not fit together or hold values that are not finite.
        UsageError
            If a parameter is out of its range.
        """
        with refused_as_bad_value():
            self._check_parameters()
        X, Y = self._checked(X, y, first=True)
        X, Y, weights = merge_rows(X, Y, weights_of(sample_weight, len(X)))
        units = self._units_of(X, Y)
        self._learn(X, Y / units.divisor, weights, units, self._seed())
        return self

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Predict outputs.

        Parameters
        ----------
        X : array-like (N, n)
            Inputs, one row a place.
        return_std : bool
            True for the standard deviations too, of what would be measured.

        Returns
        -------
        (N, m) or (N,), or a pair of them
            As y was when fitting.

        Raises
        ------
        sklearn.exceptions.NotFittedError
            If nothing has been learnt yet.
        UsageError
            If deviations are asked of the gradient rule, which has none.
        """
        check_is_fitted(self, "network_")
        X = validate_data(self, X, dtype=np.float64, reset=False)
        Y = self._shaped(self.network_.predict(X))
        return (Y, self._shaped(self._deviation(X))) if return_std else Y

    def _learn(self, X: np.ndarray, Y: np.ndarray, weights: np.ndarray, units: Units, seed: int) -> None:
        """Learn from different rows X (N, n) and divided outputs Y (N, m), with weights (N,)."""
        raise NotImplementedError

    def _deviation(self, X: np.ndarray) -> np.ndarray:
        """Standard deviations (N, m) at X (N, n) in the units of the data."""
        raise NotImplementedError

    def _check_parameters(self) -> None:
        check_target(self.target)

    def _shaped(self, Y: np.ndarray) -> np.ndarray:
        return Y[:, 0] if self._one_output else Y

    def _checked(self, X: Any, y: Any, *, first: bool) -> tuple[np.ndarray, np.ndarray]:
        """X (N, n) and Y (N, m) as finite doubles; the first data say how many columns there are."""
        X, y = validate_data(self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, reset=first)
        y = np.asarray(y, dtype=np.float64)
        if first:
            self._one_output = y.ndim == 1
        return X, y[:, None] if y.ndim == 1 else y

    def _seed(self) -> int:
        return int(check_random_state(self.random_state).randint(2**31 - 1))

    def _units_of(self, X: np.ndarray, Y: np.ndarray) -> Units:
        with refused_as_bad_value():
            checks.one_of("The parameter scale_outputs", self.scale_outputs, ("each", "together"))
        names = getattr(self, "feature_names_in_", None)
        return Units.of(X, Y, self.ranges, names, each=self.scale_outputs == "each")


def weights_of(sample_weight: Any, rows: int) -> np.ndarray:
    """Return weights (N,) ≥ 0 from what the user gave: nothing, one number, or one number per row."""
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


def merge_rows(
    X: np.ndarray, Y: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
    """The units in which an estimator learns: names, ranges, and one divisor per output."""

    inputs: tuple[Range, ...]  # n ranges, names and trained intervals
    outputs: tuple[Quantity, ...]  # m names
    divisor: np.ndarray  # (m,), largest deviation of each output from its mean, or of all of them

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
        """Return the units of training rows; `each` output gets its own divisor, or all the same."""
        names = [f"x{i}" for i in range(X.shape[1])] if names is None else [str(name) for name in names]
        inputs = ranges_of(X, names) if ranges is None else _declared(ranges, names)
        size = np.abs(Y - Y.mean(axis=0)).max(axis=0)
        # a column that is constant but for round-off is not blown up
        size = np.where(size > 1e-12 * np.abs(Y).max(axis=0), size, 0.0)
        if not each:
            size = np.full(Y.shape[1], size.max())
        return cls(inputs, tuple(Quantity(f"y{i}") for i in range(Y.shape[1])), np.where(size > 0, size, 1.0))

    def whole(self, network: Network) -> Network:
        """A network of divided outputs as one of the outputs themselves."""
        s = network.scaling
        centre, scale = s.output_centre * self.divisor, s.output_scale * self.divisor
        return replace(network, scaling=replace(s, output_centre=centre, output_scale=scale))


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
