"""What both estimators share: scikit-learn's conventions about X, y and predictions."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from palpate.estimators.data import BadValue, Units
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

    ranges: Any
    scale_outputs: str
    random_state: Any
    network_: Network
    _one_output: bool

    def predict(self, X: Any) -> np.ndarray:
        """Predicted outputs.

        Parameters
        ----------
        X : array-like (N, n)

        Returns
        -------
        (N, m) or (N,)
            As y was when fitting.

        Raises
        ------
        sklearn.exceptions.NotFittedError
            If nothing has been learnt yet.
        """
        check_is_fitted(self, "network_")
        X = validate_data(self, X, dtype=np.float64, reset=False)
        Y = self.network_.predict(X)
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

    def _units(self, X: np.ndarray, Y: np.ndarray) -> Units:
        if self.scale_outputs not in {"each", "together"}:
            raise BadValue(f"scale_outputs is {self.scale_outputs!r}.", fix='Choose "each" or "together".')
        names = getattr(self, "feature_names_in_", None)
        return Units.of(X, Y, self.ranges, names, each=self.scale_outputs == "each")
