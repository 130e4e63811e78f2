"""The network of a field's coefficients: a unit at every solve, or a few units that move, whichever misses less.

The targets are b = a/f, smooth down to first touch, with the weights f²: an error then counts as what it is in the
field. All coefficients share their units, and since the modes are orthonormal, the errors' squares add up to the
field's mean square.

A unit at every solve, all with one metric, wins where many small shapes follow the place; its scales and ridge are
those of the largest likelihood (`palpate.learning.kernel_layer`). A small network grows from the affine map upwards.
Both are judged by groups of solves that are left out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.folds import fold_masks
from palpate.learning.kernel_layer import KernelLayer, Metric, likely_metric
from palpate.learning.pool import Pool
from palpate.learning.search import Budget, Candidate, Search, Trial, sizes
from palpate.learning.starts import random_units
from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.options import FieldOptions
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

__all__ = ["FOLDS", "Coefficients", "LayerAtSolves", "layer_at_solves", "search_coefficients"]

FOLDS = 6
"""Parts in which solves are left out."""

_RIDGE = 1e-9
_KINDS: tuple[tuple[str, RadialFunction], ...] = (
    ("axis-aligned", "inverse-multiquadric"),
    ("rotated", "inverse-multiquadric"),
    ("axis-aligned", "gaussian"),
)
_RADIALS: tuple[RadialFunction, ...] = ("matern-5/2", "inverse-multiquadric", "gaussian")
_WIDTHS = (0.5, 2.0)  # of first units, in scaled inputs
_ITERATIONS = 100
_PATIENCE = 3  # sizes without a gain
_GAIN = 0.99


@dataclass(frozen=True, eq=False)
class Coefficients:
    """The coefficients that are to be learnt."""

    X: np.ndarray  # (N, n), scaled inputs
    along: np.ndarray  # (N, k), a, coefficients in the field's unit
    amplitude: np.ndarray  # (N,), f > 0, depth amplitude of each solve
    groups: np.ndarray  # (N,), solves that are left out together

    @property
    def scale(self) -> float:
        """Root mean square of b, in the field's unit."""
        b = self.along / self.amplitude[:, None]
        return max(float(np.sqrt((self.amplitude**2 @ b**2).sum() / (self.amplitude**2).sum())), 1e-300)

    @property
    def targets(self) -> np.ndarray:
        """b over its scale (N, k)."""
        return np.asarray(self.along / self.amplitude[:, None] / self.scale)

    def evaluate(self, candidate: Candidate, iterations: int, seconds: float | None = None) -> Candidate:
        """Refine a candidate's units; its error is the leave-one-out error of the closed form."""
        every = np.ones(len(self.X), dtype=bool)
        network = self._refined(candidate.theta, candidate.regressors, iterations, seconds, every)
        # where it starts is kept: folds are refined from there, so that no unit remembers what is left out
        return replace(candidate, error=network.loo, network=network, iterations=network.iterations)

    def cross_validate(self, candidate: Candidate, iterations: int, budget: Budget) -> Candidate:
        """Return the candidate with its error at solves left out, its units refined from their start on the others.

        Leaving rows out of the linear weights alone would be cheaper, but says too little of few solves: there units
        overfit. The error is infinite where the time does not suffice.
        """
        began = time.monotonic()

        def answers(kept: np.ndarray, out: np.ndarray) -> np.ndarray | None:
            if budget.over:
                return None
            seconds = None if np.isinf(budget.deadline) else budget.left
            network = self._refined(candidate.theta, candidate.regressors, iterations, seconds, kept)
            return network.predict(self.X[out])

        error = self.left_out(answers)
        return replace(candidate, error=error, seconds=candidate.seconds + time.monotonic() - began)

    def left_out(self, answers: Callable[[np.ndarray, np.ndarray], np.ndarray | None]) -> float:
        """Return the root mean square error over surface and solves, in the field's unit, of each fold of the solves.

        Infinite for a single group, or where `answers`, given masks of the solves to learn from and of those asked,
        has none.
        """
        folds, total = fold_masks(self.groups, FOLDS), 0.0
        if len(folds) < 2:
            return float("inf")
        for out in folds:
            answered = answers(~out, out)
            if answered is None:
                return float("inf")
            errors = answered * (self.scale * self.amplitude[out])[:, None] - self.along[out]
            total += float((errors**2).sum())
        return float(np.sqrt(total / len(self.X)))

    def _refined(
        self,
        theta: np.ndarray,
        regressors: Regressors,
        iterations: int,
        seconds: float | None,
        kept: np.ndarray,
    ) -> Refined:
        return refine(
            *(self.X[kept], self.targets[kept], theta, regressors),
            weights=self.amplitude[kept] ** 2,
            groups=self.groups[kept],
            ridge=_RIDGE,
            iterations=iterations,
            tolerance=1e-5,
            seconds=seconds,
        )


@dataclass(frozen=True, eq=False)
class LayerAtSolves:
    """A fitted kernel layer, and its left-out error in the field's unit."""

    layer: KernelLayer  # of scaled inputs and b over its scale
    # root mean square over surface and solves that is missed of groups left out; infinite for one group
    error: float
    trials: tuple[Trial, ...]  # of the layers that were compared

    def network(self, inputs: tuple[Range, ...], names: list[Quantity], scaling: Scaling) -> Network:
        """Return the layer as a network value; its tail and scaling are in scaled inputs."""
        factors, shifts = self.layer.units()
        weights, tail = self.layer.weights.T, self.layer.tail.T
        radial = self.layer.metric.radial
        return Network(inputs, tuple(names), factors, shifts, weights, tail, scaling, radial=radial)


def layer_at_solves(
    problem: Coefficients, *, radials: tuple[RadialFunction, ...] = _RADIALS
) -> LayerAtSolves:
    """Return the layer of the radial function that misses least of solves left out."""
    b = problem.targets
    errors: list[tuple[float, Metric]] = []
    trials: list[Trial] = []
    for name in radials:
        began = time.monotonic()
        metric = likely_metric(name, problem.X, b)

        def answers(kept: np.ndarray, out: np.ndarray, metric: Metric = metric) -> np.ndarray:
            return KernelLayer.fit(metric, problem.X[kept], b[kept]).predict(problem.X[out])

        error = problem.left_out(answers)
        errors.append((error, metric))
        trials.append(Trial("at solves", "axis-aligned", name, len(b), error, time.monotonic() - began))
    error, metric = min(errors, key=lambda pair: pair[0])
    return LayerAtSolves(KernelLayer.fit(metric, problem.X, b), error, tuple(trials))


def search_coefficients(
    problem: Coefficients, *, budget: Budget, target: float, options: FieldOptions
) -> tuple[Refined, float, tuple[Trial, ...]]:
    """Return the best small network, its left-out error in the field's unit, and the records of all sizes.

    Of each size the closed form picks the start, and sizes are compared by what is missed of solves left out.
    """
    search = Search(problem, budget, Pool(options.workers))
    iterations = budget.count(_ITERATIONS, 10)

    def judge(winner: Candidate) -> Candidate:
        first = not winner.theta.size
        return problem.cross_validate(winner, iterations, Budget() if first else budget)

    best = search.grow(
        lambda units, last: _starts(problem.X, units, last, options.seed),
        [0, *sizes(1, options.units_max)],
        iterations,
        target=target,
        patience=_PATIENCE,
        gain=_GAIN,
        judge=judge,
    )
    assert best is not None  # the affine map was tried
    assert best.network is not None
    return best.network, best.error, search.trials


def _starts(X: np.ndarray, units: int, last: Candidate | None, seed: int) -> Iterator[Candidate]:
    """Yield the affine map alone, or units of every kind at solves drawn; and the last size's with some more."""
    rng = np.random.default_rng([seed, units])
    if last is not None and last.network is not None and 0 < len(last.theta) < units:
        more = random_units(last.regressors.form, X, units - len(last.theta), rng, widths=_WIDTHS)
        yield Candidate(last.regressors, np.vstack([last.network.theta, more]), "grown")
    for form, radial in _KINDS[:1] if units == 0 else _KINDS:
        regressors = Regressors(unit_form(form, X.shape[1]), radial, "affine")
        start = "random" if units else "affine"
        yield Candidate(regressors, random_units(regressors.form, X, units, rng, widths=_WIDTHS), start)
