"""What both estimators share: scikit-learn's conventions about X, y and predictions."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from palpate.estimators.data import Units, check_one_of, merged, refused_as_bad_value, weights_of
from palpate.learning.choosing.automatic import check_target
from palpate.network import Network

__all__ = ["RadialRegressor"]


class RadialRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A regressor that holds a network; subclasses fit it.

    Attributes
    ----------
    network_ : Network
        In the units of the data.
    n_features_in_ : int
    feature_names_in_ : (n,)
        Where X was a table with named columns.
    """

    target: Any
    ranges: Any
    scale_outputs: str
    random_state: Any
    network_: Network
    _one_output: bool

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Predicted outputs.

        Parameters
        ----------
        X : array-like (N, n)
        return_std : bool
            Whether to return standard deviations too, of what would be measured.

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

    def _deviation(self, X: np.ndarray) -> np.ndarray:
        """Standard deviations (N, m) at X (N, n) in the units of the data."""
        raise NotImplementedError

    def _shaped(self, Y: np.ndarray) -> np.ndarray:
        return Y[:, 0] if self._one_output else Y

    def _prepared(
        self, X: Any, y: Any, sample_weight: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, Units]:
        """Different rows X (N, n), Y (N, m), their weights (N,) and units, for a fit that begins anew."""
        with refused_as_bad_value():
            check_target(self.target)
        X, Y = self._checked(X, y, first=True)
        X, Y, weights = merged(X, Y, weights_of(sample_weight, len(X)))
        return X, Y, weights, self._units(X, Y)

    def _checked(self, X: Any, y: Any, *, first: bool) -> tuple[np.ndarray, np.ndarray]:
        """X (N, n) and Y (N, m) as finite doubles; the first data say how many columns there are."""
        X, y = validate_data(self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, reset=first)
        y = np.asarray(y, dtype=np.float64)
        if first:
            self._one_output = y.ndim == 1
        return X, y[:, None] if y.ndim == 1 else y

    def _seed(self) -> int:
        return int(check_random_state(self.random_state).randint(2**31 - 1))

    def _units(self, X: np.ndarray, Y: np.ndarray) -> Units:
        check_one_of("scale_outputs", self.scale_outputs, ("each", "together"))
        names = getattr(self, "feature_names_in_", None)
        return Units.of(X, Y, self.ranges, names, each=self.scale_outputs == "each")
