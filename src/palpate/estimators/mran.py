"""The sequential filter as an estimator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.estimators.radial_regressor import (
    BadValue,
    RadialRegressor,
    Units,
    refused_as_bad_value,
    weights_of,
)
from palpate.learning import PRESETS, Observation, Settings, freeze, initial, learn, observe
from palpate.learning.learn import UNITS_MAX, automatic
from palpate.network import Scaling
from palpate.rbf.filter.prediction import predictive_deviation
from palpate.rbf.filter.state import State
from palpate.rbf.output_modes import output_modes

__all__ = ["MRANRegressor"]


class MRANRegressor(RadialRegressor):
    """Network of radial basis functions that grows, prunes and tunes itself, one sample at a time.

    Lu, Sundararajan & Saratchandran 1997. `fit` presents all samples several times in shuffled order;
    `partial_fit` presents each one once, in the order given.

    Parameters
    ----------
    target : float
        Error wanted, relative to the outputs' spread: root mean square error over root mean square deviation from
        the mean. Thresholds and size follow from it and from the data (see `palpate.learning.learn`).
    settings : Settings or str, optional
        The filter's settings, or the name of a preset, in place of automatic ones; then `target` has no effect.
    form, radial, tail, update, units_max : optional
        Single settings that take the place of the automatic or given ones (see `Settings`).
    passes : int
        How often `fit` presents each sample.
    ranges : sequence of (low, high), optional
        Trained interval of each input; of the data if left out.
    scale_outputs : {"each", "together"}
        Whether outputs are quantities of their own, each learnt relative to its spread, or parts of one quantity,
        such as a displacement, whose errors are to be compared as they are.
    random_state : int, RandomState or None
        Decides the order of samples in `fit`, and which ones the automatic settings are judged by.

    Attributes
    ----------
    network_ : Network
        What predicts.
    settings_ : Settings
        Those that were used.
    state_ : State
        The filter's own, in scaled quantities; `partial_fit` goes on from it.
    history_ : History
        Of `fit`; it plots itself.
    n_features_in_ : int
        Number of inputs n.
    feature_names_in_ : (n,)
        Where X was a table with named columns.

    Notes
    -----
    Rows that are equal in X and y count as one with the sum of their weights, and rows are sorted before they are
    shuffled: a weight of two is the same as the row given twice, and the order of rows does not matter. Weights
    are relative to their mean. In `partial_fit` all of this is otherwise: rows count as they come, and a weight is
    the number of ordinary samples that one stands for.

    The first call of `partial_fit` fixes the ranges (unless given), the outputs' scales and the automatic settings,
    so it should bring at least some dozens of samples that span the inputs. How the rest is cut into batches makes
    no difference to the last bit.

    `predict(X, return_std=True)` tells what the filter's own covariance says, which is not calibrated: about right for
    the full and the shared-weight rule, several times too much for the decoupled and the winner rule, whose blocks
    know nothing of how units correlate. The gradient rule has none.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.linspace(-1, 1, 60)[:, None]
    >>> model = MRANRegressor(target=0.05, random_state=0).fit(X, np.sin(3 * X[:, 0]))
    >>> bool(model.score(X, np.sin(3 * X[:, 0])) > 0.99)
    True
    """

    def __init__(
        self,
        *,
        target: float = 0.05,
        settings: Settings | str | None = None,
        form: str | None = None,
        radial: str | None = None,
        tail: str | None = None,
        update: str | None = None,
        units_max: int | None = None,
        passes: int = 5,
        ranges: Sequence[tuple[float, float]] | None = None,
        scale_outputs: Literal["each", "together"] = "each",
        random_state: Any = None,
    ) -> None:
        self.target = target
        self.settings = settings
        self.form = form
        self.radial = radial
        self.tail = tail
        self.update = update
        self.units_max = units_max
        self.passes = passes
        self.ranges = ranges
        self.scale_outputs = scale_outputs
        self.random_state = random_state

    def _check_parameters(self) -> None:
        checks.fits("The parameter passes", self.passes, least=1, whole=True)
        super()._check_parameters()

    def _learn(self, X: np.ndarray, Y: np.ndarray, weights: np.ndarray, units: Units, seed: int) -> None:
        settings = self._settings(X, Y, units, seed, weights)
        learned = learn(
            *(X, Y, units.inputs, units.outputs),
            settings=settings,
            passes=self.passes,
            seed=seed,
            weights=weights,
        )
        self._keep(learned.state, settings, units, learned.scaling)
        self.history_ = learned.history

    def partial_fit(self, X: Any, y: Any, sample_weight: Any = None) -> MRANRegressor:
        """Learn from some more samples, each presented once, in the order given.

        Parameters
        ----------
        X : array-like (N, n)
            Inputs, one row a sample.
        y : array-like (N,) or (N, m)
            Outputs, as in the first call.
        sample_weight : array-like (N,), optional
            Number of ordinary samples that each one counts as; those of weight zero are passed over.

        Raises
        ------
        ValueError
            If arrays do not fit together or hold values that are not finite.
        """
        first = not hasattr(self, "state_")
        X, Y = self._checked(X, y, first=first)
        weights = weights_of(sample_weight, len(X))
        if first:
            self._begin(X[weights > 0], Y[weights > 0])
        if Y.shape[1] != self.state_.outputs:
            raise BadValue(f"{Y.shape[1]} outputs came; the network learns {self.state_.outputs}.")
        xs = self._scaling.scale_inputs(X)
        ys = self._scaling.scale_outputs(Y / self._units_.divisor)
        state = self.state_
        with threadpool_limits(1):
            for i in np.flatnonzero(weights > 0):
                state = observe(state, Observation(xs[i], ys[i], float(weights[i])), self.settings_)[0]
        self._keep(state, self.settings_, self._units_, self._scaling)
        return self

    def _deviation(self, X: np.ndarray) -> np.ndarray:
        scaled = predictive_deviation(self.state_, self._scaling.scale_inputs(X), self.settings_)
        return np.asarray(scaled * self._scaling.output_scale * self._units_.divisor)

    def _begin(self, X: np.ndarray, Y: np.ndarray) -> None:
        units = self._units_of(X, Y)
        scaled = Y / units.divisor
        settings = self._settings(X, scaled, units, self._seed(), None)
        if self.settings is None and self.units_max is None:
            # what the first batch has data for says nothing about the stream
            settings = replace(settings, units_max=UNITS_MAX)
        scaling = Scaling.of(units.inputs, scaled)
        modes = (
            output_modes(scaling.scale_outputs(scaled), settings.modes)
            if settings.update == "shared"
            else None
        )
        self._keep(initial(X.shape[1], Y.shape[1], settings, modes), settings, units, scaling)

    def _settings(
        self, X: np.ndarray, Y: np.ndarray, units: Units, seed: int, weights: np.ndarray | None
    ) -> Settings:
        names = ("form", "radial", "tail", "update", "units_max")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        with refused_as_bad_value():
            if self.settings is not None:
                settings = replace(self._chosen_settings(), **given)
            else:
                options = {"target": self.target, "passes": self.passes, "seed": seed, "weights": weights}
                settings = automatic(X, Y, units.inputs, **options, **given)
            settings.regressors(X.shape[1])  # whether there is such a form for so many inputs
        return settings

    def _chosen_settings(self) -> Settings:
        """The settings given, or those of the preset named."""
        if isinstance(self.settings, Settings):
            return self.settings
        if not isinstance(self.settings, str) or self.settings not in PRESETS:
            raise BadValue(
                f"There is no preset {self.settings!r}.",
                fix=f"Give Settings(…), or choose one of {', '.join(PRESETS)}.",
            )
        return PRESETS[self.settings]()

    def _keep(self, state: State, settings: Settings, units: Units, scaling: Scaling) -> None:
        self.state_, self.settings_ = state, settings
        self._units_, self._scaling = units, scaling
        self.network_ = units.whole(freeze(state, settings, units.inputs, units.outputs, scaling))
