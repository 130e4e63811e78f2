"""The problem whose network is an energy's ℓ: its rows, its units, and what its networks miss of solves left out.

Candidates are compared by the mean over solves of what each one misses when it is left out, not by the root of the
mean square: a solve that alone decides a unit misses anything, and one such would outweigh all others. The closed form
of that error (`palpate.rbf.refinement.leave_one_out`) counts units as unknowns of a linearised problem. It costs
next to nothing, but with few solves a unit that is left without its own could go anywhere in that problem: errors come
out several times too large, and the order of networks is lost. Refining again from the units as they are, without a
fold of the solves, is what cross-validation means (Stone 1974), and takes a few iterations for each fold. Units that
have seen a solve remember it, though, so that of very few solves this says too little: networks are chosen by the
geometric mean of both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.learning.folds import fold_numbers
from palpate.learning.search import Candidate
from palpate.network.radial import RadialFunction
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.leave_one_out import leave_one_out_row_errors
from palpate.rbf.refinement.projection import Fit, project, span_of_units
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors
from palpate.rbf.symmetric_units import Images, SymmetricRegressors

__all__ = ["EnergyProblem", "LeftOut"]

_RIDGE = 3e-6  # with 1e-10 some networks bend wildly between solves, with 1e-4 all miss more
_LARGEST_LEVERAGE = 0.98  # what a solve decides alone is judged by fifty times its residual
_NARROW_ALL_OVER = 8.0  # widths of the finest unit: one that is nowhere wider stands on one solve
# iterations after narrow units are taken out, once and again; with none there can't be new ones
_ITERATIONS_WITHOUT_NARROW = (30, 0)
_FOLDS = 8
# with 60 iterations the errors of ten solves are up to 1.8 times larger, and order networks no better
_FOLD_ITERATIONS = 20


@dataclass(frozen=True, eq=False)
class LeftOut:
    """The errors of solves that are left out."""

    rows: Rows  # of the least-squares problem
    fit: Fit  # of all rows
    errors: np.ndarray  # (R, 1), of every weighted row, when its solve is left out
    together: np.ndarray  # (N,), samples of one number were left out together

    @property
    def mean(self) -> float:
        """Mean over solves of the error of all that is known of one."""
        return mean_error(self.rows, self.errors)


def mean_error(rows: Rows, errors: np.ndarray) -> float:
    """Return the mean over solves of errors (R, 1) of the rows; infinite where one is."""
    if not np.isfinite(errors).all():
        return float("inf")
    squares = np.bincount(rows.samples, (errors**2).sum(axis=1))
    return float(np.sqrt(squares / rows.scale**2) @ rows.scale**2 / rows.total)


@dataclass(frozen=True, eq=False)
class EnergyProblem:
    """The rows that networks of ℓ are learnt from."""

    X: np.ndarray  # (N, n), scaled inputs ξ
    rows: dict[str, np.ndarray]  # what `refine` takes besides them
    images: Images | None  # of every solve
    ridge: float = _RIDGE  # penalty on weights
    # (n,), scaled: the shortest way over which a unit may change, 0 for any; None where all are
    finest: np.ndarray | None = None
    tolerance: float = 1e-5  # relative gain per step of the refinement below which it ends

    def regressors(self, form: str, radial: RadialFunction) -> Regressors:
        """Return the regressors of a form, with their images where there is a symmetry."""
        units = unit_form(form, self.X.shape[1])
        if self.images is None:
            return Regressors(units, radial)
        return SymmetricRegressors(units, radial, "affine", self.images)

    def room(self, regressors: Regressors) -> int:
        """Return how many units the solves can decide on: half as many unknowns as numbers known."""
        known = 1.0
        for weight in (self.rows["slope_weight"], self.rows["curvature_weight"]):
            known += float((weight > 0).sum(1).mean())
        return int(known * len(self.X) / 2 / (1 + regressors.form.size))

    def evaluate(self, candidate: Candidate, iterations: int, seconds: float | None = None) -> Candidate:
        """Refine a candidate's units, without narrow ones; its error is the leave-one-solve-out error.

        What has narrow units is refined once more without them: a unit that stands on one solve alone and misses all
        others costs nothing where solves are left out, and makes the force ripple between them.
        """
        network = self.refined(candidate.theta, candidate.regressors, iterations=iterations, seconds=seconds)
        for more in _ITERATIONS_WITHOUT_NARROW:
            narrow = self.narrow_units(network)
            if not narrow.any():
                break
            network = self.refined(
                network.theta[~narrow], network.regressors, iterations=min(more, iterations), seconds=seconds
            )
        missed = self.missed(network)
        return replace(
            candidate,
            theta=network.theta,
            error=missed.mean,
            network=network,
            iterations=candidate.iterations + network.iterations,
            detail=missed.errors,
        )

    def refined(
        self, theta: np.ndarray, regressors: Regressors, *, iterations: int, seconds: float | None = None
    ) -> Refined:
        """Return the refinement from units θ (h, p)."""
        known: dict[str, Any] = dict(self.rows)
        return refine(
            *(self.X, known.pop("Y"), theta, regressors),
            **known,
            ridge=self.ridge,
            iterations=iterations,
            seconds=seconds,
            tolerance=self.tolerance,
        )

    def narrow_units(self, network: Refined) -> np.ndarray:
        """Return which units (h,) are narrower than a probe can feel: far so in one direction, or in all."""
        if self.finest is None or not len(network.theta):
            return np.zeros(len(network.theta), dtype=bool)
        felt = self.finest > 0
        factors = network.regressors.form.factors(network.theta)[0][:, :, felt] * self.finest[felt]
        sharpness = np.linalg.svd(factors, compute_uv=False)
        all_over = sharpness.shape[1] == felt.sum()
        return np.asarray((sharpness[:, 0] > 1.0) | (all_over & (sharpness[:, -1] > 1.0 / _NARROW_ALL_OVER)))

    def fitted(self, network: Refined) -> tuple[Rows, Fit]:
        """Return the least-squares problem of a network's units, and its solution."""
        known: dict[str, Any] = dict(self.rows)
        rows = Rows.of(network.regressors, self.X, known.pop("Y"), **known)
        return rows, project(rows, network.theta, self.ridge * rows.total)

    def missed(self, network: Refined) -> LeftOut:
        """Return the errors of solves left out, by the closed form; infinite where unknowns could fit all."""
        rows, fit = self.fitted(network)
        if network.theta.size + len(fit.tau) >= len(rows.targets):
            return LeftOut(rows, fit, np.full(rows.targets.shape, np.inf), rows.groups)
        span = span_of_units(rows, network.theta, fit) if len(network.theta) else None
        return LeftOut(
            rows, fit, leave_one_out_row_errors(rows, fit, basis=span, most=_LARGEST_LEVERAGE), rows.groups
        )

    def folds(self, groups: np.ndarray) -> np.ndarray:
        """Return the fold (N,) of every solve; of a single group the groups themselves."""
        fold = fold_numbers(groups, _FOLDS)
        return fold if fold.max() else groups

    def cross_validate(self, network: Refined, *, seconds: float | None = None) -> LeftOut:
        """Return the errors of every row by a network that was refined again without the row's fold.

        Time that is limited is shared by the folds.
        """
        rows, fit = self.fitted(network)
        fold = self.folds(rows.groups)
        if rows.groups.max() == 0:
            return self.missed(network)  # a single group can't be left out
        each = None if seconds is None else seconds / (1 + fold.max())
        of_row, missed = fold[rows.samples], np.empty_like(rows.targets)
        for k in range(fold.max() + 1):
            again = self.taken(fold != k).refined(
                network.theta, network.regressors, iterations=_FOLD_ITERATIONS, seconds=each
            )
            # in the modes of all rows: one output has one, which may only change its sign
            answers = rows.matrix(again.theta)[: len(missed)] @ again.coefficients @ rows.modes.T
            missed[of_row == k] = (rows.targets - answers)[of_row == k]
        return LeftOut(rows, fit, missed, fold)

    def taken(self, kept: np.ndarray) -> EnergyProblem:
        """Return the problem of some samples, (N,) true, alone."""
        count = len(self.X)
        some = {k: v[kept] if np.shape(v)[:1] == (count,) else v for k, v in self.rows.items()}
        return replace(self, X=self.X[kept], rows=some)
