"""Few rows: Gaussian processes, a plane and the mean, each judged by rows that it has not seen.

Of a few dozen rows a fifth is too few to judge by, and all are needed to learn. So nothing is held out: the kind of a
Gaussian process, its widths and its noise follow from the likelihood of all rows (Rasmussen & Williams 2006, chapter
5), and its error from leaving out each place in turn, widths and noise climbing on without it. A process whose metric
has many numbers follows noise, so the mean and a plane compete, and win where it does not miss clearly less.

Rows close together, such as f(x − h), f(x), f(x + h), tell a slope or a noise; where they do neither they only spoil
the likelihood, which takes their agreement for evidence of a smooth function. So the means of close rows compete with
the rows.

The variance of a process says where it knows less, and by how much it says too boldly. A part α of it is therefore
replaced by its mean over the places left out,

    v(x) = α v̄ + (1 − α) v_process(x),

with the α ≥ ¼ that makes the misses likeliest: no deviation is far below the error that is stated.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from palpate.learning.arrays.calibration import covariance_rows, kernel_covariance, kernel_spread
from palpate.learning.arrays.members import clearly_less
from palpate.learning.folds import fold_masks
from palpate.learning.kernel_layer import SCALES, KernelLayer, Metric, negative_likelihood
from palpate.learning.search import Budget, Trial
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction

__all__ = ["FEW", "LeftOut", "best_of_few", "few_places"]

FEW = 100
"""Places below which all rows are needed to learn."""

_CLOSE = 2.0  # rows for each place, from which there are close rows in many places
# noise over signal; of clean rows as little as lets an exported network answer as this one to 1e-9
_RIDGES = (np.log(1e-10), np.log(1e2))
_SLOPES = (np.log(1e-4), np.log(1e4))
_STARTS = ((0.0, 1e-5), (0.0, 0.1), (-1.2, 1e-5))  # scales' logarithms beside 1/√n, and ridges
_CLIMB, _ON = 80, 15  # iterations of a likelihood, and without a fold from the metric of all
_ALONE = 60  # rows up to which a metric without a fold is sought anew: there the metric of all knows too much of it
_PLAIN = 1.0  # nats by which the plainest process is preferred
_FOLD_WORK = 1e8  # cubed rows of all folds
_FOLDS = 10  # at least
_ROWS = 400  # most rows of which a process is made where many are close
_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the mean in a variance


def few_places(places: np.ndarray) -> bool:
    """Return True where samples at these places (N,) are to be learnt as few rows."""
    count = len(np.unique(places))
    return count < FEW and (len(places) < FEW or len(places) >= _CLOSE * count)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """A layer of all rows, and what layers like it miss of rows that they had not seen."""

    form: str  # "kernel layer", "affine" or "mean"
    layer: KernelLayer  # its units may be none
    missed: np.ndarray  # (N, k), of every row, in latent outputs
    spread: np.ndarray  # (N,), variance over s² that such a layer says of the row
    influence: np.ndarray  # (1 + n + h, P), by which the coefficients follow from the outputs of P places
    # M (c, c) of the layer's variance s² (1 + φ̃ᵀ M φ̃); None where it is the same everywhere
    covariance: np.ndarray | None
    means: np.ndarray  # (P, N), by which the means at the places follow from the rows

    @cached_property
    def error(self) -> float:
        """Error to expect, root mean square per latent output."""
        return float(np.sqrt((self.missed**2).mean()))

    def levelled(self) -> LeftOut:
        """Return the same with that part of its variance replaced by the mean which makes the misses likeliest."""
        squares, mean, spread = (self.missed**2).mean(axis=1), float(self.spread.mean()), self.spread

        def surprise(share: float) -> float:
            level = share * mean + (1.0 - share) * spread
            return float(np.log((squares / level).mean() + 1e-300) + np.log(level).mean())

        share = min(_SHARES, key=surprise)
        kept = (1.0 - share) / (share * mean + 1.0 - share)
        M = None if self.covariance is None else kept * self.covariance
        return replace(self, spread=1.0 + kept * (spread - 1.0), covariance=M)


def best_of_few(
    X: np.ndarray,
    Y: np.ndarray,
    places: np.ndarray,
    *,
    target: float,
    budget: Budget,
    trials: list[Trial],
    unit: float,
) -> LeftOut:
    """Return the mean, the plane or the process that misses least of places left out.

    X (N, n) are scaled inputs, Y (N, k) latent outputs. Rows of one of the `places` (N,) are left out together.
    `target` is the error per latent output that is good enough for a plane, `unit` that which is one standard
    deviation; records are added to `trials`.
    """
    search = _Search(X, Y, places, budget)
    tried = [search.left_out_tail("mean"), search.left_out_tail("affine")]
    best = tried[clearly_less(tried[1].missed, tried[0].missed)]
    if best.error > target:
        tried.append(search.left_out_process())
        best = tried[2] if clearly_less(tried[2].missed, best.missed) else best
    took = search.took
    trials += [
        Trial("kind", one.form, one.layer.metric.radial, len(one.layer.centres), one.error / unit, took)
        for one in tried
    ]
    return best.levelled()


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows to learn from, with the place of each, and its noise over that of a single row."""

    X: np.ndarray
    Y: np.ndarray
    places: np.ndarray
    noise: np.ndarray

    def without(self, unseen: np.ndarray) -> _Rows:
        """Return the rows at other places than some."""
        kept = ~np.isin(self.places, unseen)
        return _Rows(self.X[kept], self.Y[kept], self.places[kept], self.noise[kept])


class _Search:
    """The rows, their means at each place, and how they are left out."""

    def __init__(self, X: np.ndarray, Y: np.ndarray, places: np.ndarray, budget: Budget) -> None:
        self.X, self.Y, self.budget, self.began = X, Y, budget, time.monotonic()
        _, self.places, counts = np.unique(places, return_inverse=True, return_counts=True)
        self.rows = _Rows(X, Y, self.places, np.ones(len(X)))
        mean = np.zeros((len(counts), len(X)))
        mean[self.places, np.arange(len(X))] = 1.0 / counts[self.places]
        self.mean = mean
        self.means = _Rows(mean @ X, mean @ Y, np.arange(len(counts)), 1.0 / counts)

    @property
    def took(self) -> float:
        """Seconds since the search began."""
        return time.monotonic() - self.began

    def left_out_tail(self, form: str) -> LeftOut:
        """Return the mean or the plane of all places."""
        X, columns = self.means.X, 1 if form == "mean" else 1 + self.X.shape[1]
        one, all_rows = _tail(X), _tail(self.X)
        one[:, columns:] = all_rows[:, columns:] = 0.0
        if columns > 1 and np.linalg.matrix_rank(one) < columns:
            columns = 1  # a plane that the places do not decide
            one[:, 1:] = all_rows[:, 1:] = 0.0
        missed, spread = np.empty_like(self.Y), np.empty(len(self.Y))
        for p in range(len(one)):
            left = np.linalg.pinv(np.delete(one, p, axis=0))
            rows = self.places == p
            missed[rows] = self.Y[rows] - all_rows[rows] @ (left @ np.delete(self.means.Y, p, axis=0))
            spread[rows] = 1.0 + ((all_rows[rows] @ left) ** 2).sum(axis=1)
        G = np.linalg.pinv(one)
        M = None if columns == 1 else G @ G.T
        none = Metric("gaussian", np.ones(self.X.shape[1]), 0.0)
        nothing = np.zeros((0, self.X.shape[1])), np.zeros((0, self.Y.shape[1]))
        return LeftOut(form, KernelLayer(none, *nothing, G @ self.means.Y), missed, spread, G, M, self.mean)

    def left_out_process(self) -> LeftOut:
        """Return the likeliest Gaussian process of the places' means, or of all rows where it misses clearly less."""
        best, least = Metric("gaussian", np.ones(self.X.shape[1]), 1.0), np.inf
        count, k = self.means.Y.shape
        for slopes in (False, True):
            for name in RADIAL_FUNCTIONS:
                if self.budget.over and np.isfinite(least):
                    break
                metric, likelihood = _likely(name, self.means, slopes=slopes)
                plainest = name == "gaussian" and not slopes
                cost = count * k * likelihood + slopes * 0.5 * np.log(count) + (not plainest) * _PLAIN
                if cost < least:
                    best, least = metric, cost
        candidate = self._left_out(best, self.means)
        if len(self.X) == count or len(self.X) > _ROWS or self.budget.over:
            return candidate
        other = self._left_out(_likely(best.radial, self.rows, start=best)[0], self.rows)
        return other if clearly_less(other.missed, candidate.missed) else candidate

    def _metric_of(self, rows: _Rows, metric: Metric) -> Metric:
        """Return the likeliest metric of some rows; of very few one that owes nothing to the metric of all."""
        start = None if len(self.X) <= _ALONE else metric
        return _likely(metric.radial, rows, slopes=metric.slopes > 0.0, start=start)[0]

    def _left_out(self, metric: Metric, rows: _Rows) -> LeftOut:
        """Return the process of a metric, and what processes miss whose metric climbed on without some places."""
        count = len(self.means.X)
        folds = int(np.clip(_FOLD_WORK / len(rows.X) ** 3, _FOLDS, count))
        missed, spread = np.empty_like(self.Y), np.empty(len(self.Y))
        for mask in fold_masks(np.arange(count), folds):
            others = rows.without(np.flatnonzero(mask))
            own = metric if self.budget.over else self._metric_of(others, metric)
            layer = KernelLayer.likely(own, others.X, others.Y, others.noise)
            unseen = mask[self.places]
            missed[unseen] = self.Y[unseen] - layer.predict(self.X[unseen])
            spread[unseen] = kernel_spread(layer, self.X[unseen])
        layer = KernelLayer.likely(metric, rows.X, rows.Y, rows.noise)
        at_places = np.zeros((len(rows.X), count))
        at_places[np.arange(len(rows.X)), rows.places] = 1.0
        G = _root(layer) @ at_places
        return LeftOut("kernel layer", layer, missed, spread, G, kernel_covariance(layer), self.mean)


def _likely(
    name: RadialFunction, rows: _Rows, *, slopes: bool = False, start: Metric | None = None
) -> tuple[Metric, float]:
    """Return the metric of the largest likelihood, and the negative logarithm of that per number observed.

    From a metric near the optimum, `start`, the likelihood is climbed a few steps only.
    """
    n = rows.X.shape[1]
    starts = [np.r_[np.full(n, a - 0.5 * np.log(n)), np.log(ridge), [0.0] * slopes] for a, ridge in _STARTS]
    if start is not None:
        slopes = np.isfinite(start.slopes) and start.slopes > 0.0
        starts = [np.r_[np.log(start.scales), np.log(start.ridge), [np.log(start.slopes)] if slopes else []]]
    optima = [
        minimize(
            negative_likelihood,
            logs,
            args=(name, rows.X, rows.Y - rows.Y.mean(axis=0), rows.noise),
            jac=True,
            method="L-BFGS-B",
            bounds=[SCALES] * n + [_RIDGES] + [_SLOPES] * slopes,
            options={"maxiter": _CLIMB if start is None else _ON},
        )
        for logs in starts
    ]
    best = min(optima, key=lambda one: float(one.fun))
    own = np.exp(best.x)
    return Metric(name, own[:n], float(own[n]), float(own[n + 1]) if slopes else 0.0), float(best.fun)


def _root(layer: KernelLayer) -> np.ndarray:
    """Return G (1 + n + h, h) by which the coefficients follow from the outputs."""
    h = len(layer.centres)
    C = layer.metric.covariance(layer.centres, layer.noise)
    C[np.diag_indices(h)] += 1e-12 * np.trace(C) / h
    G = covariance_rows(layer) @ np.linalg.inv(C)
    G -= G.mean(axis=1, keepdims=True)
    G[0] += 1.0 / h
    return np.asarray(G)


def _tail(X: np.ndarray) -> np.ndarray:
    return np.hstack([np.ones((len(X), 1)), X])
