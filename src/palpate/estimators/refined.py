"""The refined network as an estimator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.errors import UsageError
from palpate.estimators.radial_regressor import RadialRegressor, Units, refused_as_bad_value
from palpate.learning.arrays.array_samples import constant
from palpate.learning.arrays.calibration import Evidence, calibrated, regressor_root, spread_of
from palpate.learning.arrays.fit import fit as fit_arrays
from palpate.learning.search import Budget, Candidate, Trial
from palpate.learning.starts import units_at_residuals
from palpate.network import Scaling, Uncertainty
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.rbf.forms import unit_form
from palpate.rbf.freezing import freeze_refined
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.regressors import Regressors, Tail

__all__ = ["RBFNetworkRegressor"]

_ITERATIONS = 60  # iterations for each size: the next one moves all units again
_PATIENCE = 3  # sizes in a row that may bring nothing
_FEWEST = 20  # samples from which a fifth of them can judge
_LEVEL = 0.9  # level at which deviations are calibrated
_GAIN = 0.98  # factor down to which a size must lower the error, to have brought something


class RBFNetworkRegressor(RadialRegressor):
    """Network of radial basis functions refined all at once: centres, widths and weights by variable projection.

    Golub & Pereyra 1973. A fifth of the samples is kept apart while units are added, until the error on them meets
    the target or no longer falls; then the weights are fitted to all samples. Below 20 samples the leave-one-out
    error judges.

    Parameters
    ----------
    target : float
        Error wanted on samples kept apart, relative to the outputs' spread: root mean square error over root mean
        square deviation from the mean.
    form : str, optional
        Of a unit (see `palpate.rbf.forms`); if left out rotated up to three inputs, ridges above.
        "auto" tries forms, radial functions and sizes against each other (`palpate.learning.fit`);
        `radial`, `tail` and `units_max` then have no effect. Where weights differ, or below 20
        samples, it is as if left out.
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2"}
        Radial function of the units.
    tail : {"affine", "constant", "none"}
        Function added to the units: T·[1, x], T, or nothing.
    units_max : int
        Most units; growth stops there.
    effort : float
        Multiplies the iterations per size, and the work of "auto"; 0.1 gives a quick look.
    seconds : float, optional
        Time after which no more units are added; by default there is no limit.
    ranges : sequence of (low, high), optional
        Trained interval of each input; of the data if left out.
    scale_outputs : {"each", "together"}
        Whether outputs are quantities of their own, each learnt relative to its spread, or parts of one quantity,
        such as a displacement, whose errors are to be compared as they are.
    random_state : int, RandomState or None
        Decides which samples are kept apart, and directions where units have them.

    Attributes
    ----------
    network_ : Network
        What predicts.
    error_ : float
        Its error on the samples that judged, relative as `target`.
    trials_ : tuple of Trial
        What was tried.
    uncertainty_ : Uncertainty
        Behind `predict(X, return_std=True)`: ±1.64 deviations hold nine in ten of the samples kept apart.
    n_features_in_ : int
        Number of inputs n.
    feature_names_in_ : (n,)
        Where X was a table with named columns.

    Notes
    -----
    Rows that are equal in X and y count as one with the sum of their weights, so a weight of two is the same as
    the row given twice, and the order of rows does not matter.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.linspace(-1, 1, 60)[:, None]
    >>> model = RBFNetworkRegressor(target=1e-3, random_state=0).fit(X, np.sin(3 * X[:, 0]))
    >>> bool(model.score(X, np.sin(3 * X[:, 0])) > 0.99999)
    True
    """

    error_: float
    trials_: tuple[Trial, ...]
    uncertainty_: Uncertainty

    def __init__(
        self,
        *,
        target: float = 1e-3,
        form: str | None = None,
        radial: str = "gaussian",
        tail: str = "affine",
        units_max: int = 100,
        effort: float = 1.0,
        seconds: float | None = None,
        ranges: Sequence[tuple[float, float]] | None = None,
        scale_outputs: Literal["each", "together"] = "each",
        random_state: Any = None,
    ) -> None:
        self.target = target
        self.form = form
        self.radial = radial
        self.tail = tail
        self.units_max = units_max
        self.effort = effort
        self.seconds = seconds
        self.ranges = ranges
        self.scale_outputs = scale_outputs
        self.random_state = random_state

    def _check_parameters(self) -> None:
        checks.one_of("The parameter radial", self.radial, RADIAL_FUNCTIONS)
        checks.one_of("The parameter tail", self.tail, get_args(Tail))
        checks.fits("The parameter units_max", self.units_max, least=0, whole=True)
        if not (self.form is None or isinstance(self.form, str)):
            raise UsageError(f"form is {self.form!r}.", fix='Give a name, such as "rotated", or "auto".')
        Budget.of(self.effort, self.seconds)
        super()._check_parameters()

    def _learn(self, X: np.ndarray, Y: np.ndarray, weights: np.ndarray, units: Units, seed: int) -> None:
        if self.form == "auto" and len(X) >= _FEWEST and not np.ptp(weights) and not constant(Y):
            self._choose(X, Y, units, seed)
        else:
            self._grow(X, Y, weights, units, seed)

    def _deviation(self, X: np.ndarray) -> np.ndarray:
        return self.uncertainty_.deviation(X)

    def _choose(self, X: np.ndarray, Y: np.ndarray, units: Units, seed: int) -> None:
        options: dict[str, Any] = {"seed": seed, "target": self.target, "level": _LEVEL}
        options |= {"effort": self.effort, "seconds": self.seconds}
        with refused_as_bad_value():
            fitted = fit_arrays(X, Y, units.inputs, units.outputs, **options)
        self.error_, self.trials_ = fitted.heldout, fitted.trials
        self.network_ = units.whole(fitted.network)
        self.uncertainty_ = replace(fitted.uncertainty, network=self.network_)

    def _grow(self, X: np.ndarray, Y: np.ndarray, weights: np.ndarray, units: Units, seed: int) -> None:
        scaling = Scaling.of(units.inputs, Y)
        xs, ys = scaling.scale_inputs(X), scaling.scale_outputs(Y)
        spread = float(np.sqrt((ys**2).mean())) or 1.0
        with threadpool_limits(1), refused_as_bad_value():
            growth = self._growth(xs, ys, weights, self.target * spread, seed)
            root = regressor_root(growth.network, xs, weights)
        self.error_, self.trials_ = growth.error / spread, growth.trials
        self.network_ = units.whole(freeze_refined(growth.network, units.inputs, units.outputs, scaling))
        self.uncertainty_ = calibrated(self.network_, root @ root.T, [growth.evidence], _LEVEL)

    def _growth(self, X: np.ndarray, Y: np.ndarray, weights: np.ndarray, target: float, seed: int) -> _Growth:
        """The first size that meets the target, or the best until more units bring nothing, or time is up."""
        budget = Budget.of(self.effort, self.seconds)
        regressors, most = self._regressors(X.shape[1], Y)
        learns = _learns(len(X), seed)
        unseen = None if learns.all() else (X[~learns], Y[~learns])
        xs, ys = X[learns], Y[learns]
        fit = partial(refine, weights=weights[learns], iterations=budget.count(_ITERATIONS), heldout=unseen)
        best = fit(xs, ys, np.zeros((0, regressors.form.size)), regressors)
        least, trials, worse = _error(best), [_trial(best)], 0
        while least > target and len(best.theta) + worse < most and worse < _PATIENCE:
            if budget.over:
                break
            # where a size brought nothing, the next one sets out from the same units with one more
            h = len(best.theta)
            new = units_at_residuals(xs, ys, best, min(max(1, h // 4) + worse, most - h), seed)
            now = fit(
                xs,
                ys,
                np.vstack([best.theta, new]),
                regressors,
                seconds=None if np.isinf(budget.left) else budget.left,
            )
            trials.append(_trial(now))
            worse = 0 if _error(now) < _GAIN * least else worse + 1
            if _error(now) < least:
                best, least = now, _error(now)
        # units stay, weights learn from all samples
        whole = refine(X, Y, best.theta, regressors, weights=weights, iterations=0)
        return _Growth(whole, least, tuple(trials), _evidence(best, xs, ys, weights[learns], unseen))

    def _regressors(self, n: int, Y: np.ndarray) -> tuple[Regressors, int]:
        """The kind of units, and how many of them leave some data over."""
        form = (
            self.form
            if self.form not in {None, "auto"}
            else ("axis-aligned" if n == 1 else "rotated" if n <= 3 else "rank-1")
        )
        made = Regressors(unit_form(form, n), self.radial, self.tail)  # type: ignore[arg-type]
        m = Y.shape[1]
        room = max(0.0, Y.size / 1.25 - m * made.tail_size) / (m + made.form.size)
        return made, min(self.units_max, int(room), len(Y) // 2)


@dataclass(frozen=True, eq=False)
class _Growth:
    """A network of all samples, its error and its residuals on those kept apart, and the sizes tried."""

    network: Refined
    error: float
    trials: tuple[Trial, ...]
    evidence: Evidence


def _evidence(
    best: Refined,
    X: np.ndarray,
    Y: np.ndarray,
    weights: np.ndarray,
    unseen: tuple[np.ndarray, np.ndarray] | None,
) -> Evidence:
    """Errors on samples kept apart of a network that learnt from X (N, n), Y (N, m); or its leave-one-out errors.

    Where so few samples say not even that, it is the outputs' own size.
    """
    root = regressor_root(best, X, weights)
    if unseen is not None:
        places, wanted = unseen
        return Evidence(wanted - best.predict(places), spread_of(best, root, places))
    # leaving one out divides by 1 − leverage; the whole is as large as the error that counts the units' numbers too
    left = np.maximum(1.0 - weights * (spread_of(best, root, X) - 1.0), 0.02)
    missed = (Y - best.predict(X)) / left[:, None]
    size = float(np.sqrt((missed**2).mean()))
    if not size or not np.isfinite(best.loo):
        return Evidence(Y, np.ones(len(Y)))
    return Evidence(missed * (best.loo / size), 1.0 / left)


def _learns(rows: int, seed: int) -> np.ndarray:
    """Mask (N,) of the samples that choose the units; the others judge, where there are enough."""
    learns = np.ones(rows, dtype=bool)
    if rows >= _FEWEST:
        learns[np.random.default_rng(seed).permutation(rows)[: rows // 5]] = False
    return learns


def _trial(network: Refined) -> Trial:
    """Return the record of a size."""
    return Candidate(network.regressors, network.theta, "grown", _error(network), network).trial


def _error(network: Refined) -> float:
    """The error on samples it has not seen; by leaving one out where all were needed."""
    return network.loo if np.isnan(network.heldout) else network.heldout
