"""Refinement: all units at once by Levenberg–Marquardt, weights and tail by least squares inside.

Variable projection (Golub & Pereyra 1973): for given units θ the best weights and tail are a linear least-squares
solution, so only θ is searched (see `projection`). The sequential filter says how many units are needed and where;
this buys the last digits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.refinement.leave_one_out import errors_without_each_unit, leave_one_out_row_errors
from palpate.rbf.refinement.levenberg import DAMPING, MORE, DampedSystem, damped_step
from palpate.rbf.refinement.projection import (
    Fit,
    Solver,
    gauss_newton,
    leverage_of_units,
    project,
    span_of_units,
)
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors
from palpate.rbf.sample_checks import samples

__all__ = ["Refined", "refine"]

_SINGLE_FROM = 300  # unknowns from which single precision saves time
_SINGLE_DAMPING = 1e-5  # below this the damped matrix may be singular to single precision
_COUNTED = 2500  # unknowns up to which each row's share of them is counted; beyond, all share alike
_MOST_LEVERAGE = 0.98  # a sample that decides its own fit says little; its residual counts fifty times


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined network in scaled quantities."""

    regressors: Regressors  # kind of units and tail
    theta: np.ndarray  # (h, p), its units
    coefficients: np.ndarray  # (p_t + h, m), the tail's, then the units' weights
    rms: float  # weighted root mean square training error per scaled output, of values only
    # leave-one-sample-out error per scaled output: the root of Σ of the weighted squared errors of all that
    # is known of a sample, its value, slopes and curvatures, when the sample (or its group) is left out,
    # over Σ w. In closed form for weights and tail (Allen 1974), with the units' own numbers counted as
    # leverage in the linearised problem. Infinite where there are as many unknowns as known numbers: what
    # can fit anything says nothing of samples it has not seen
    loo: float
    condition: float  # 2-norm condition number of the regressors; large values mean that units nearly cancel
    iterations: int  # accepted steps that were taken
    converged: bool  # whether the last steps brought no more gain; False means that a limit came first
    # (h,), the leave-one-out error were one unit removed and the others left as they are, for each unit,
    # with the units' degrees of freedom spread over all rows alike; it ranks them even where `loo` is
    # infinite
    without: np.ndarray
    # root mean square error per scaled output on the held-out samples; not-a-number without them
    heldout: float = float("nan")
    rows: int = 0  # numbers known of each output: N values, and the slopes and curvatures that counted too

    @property
    def tail(self) -> np.ndarray:
        """(p_t, m)."""
        return self.coefficients[: self.regressors.tail_size]

    @property
    def weights(self) -> np.ndarray:
        """(h, m)."""
        return self.coefficients[self.regressors.tail_size :]

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Scaled outputs (N, m) at scaled inputs X (N, n)."""
        r = self.regressors
        return np.asarray(r.tail_rows(X) @ self.tail + r.phi(X, self.theta) @ self.weights)


def refine(
    X: np.ndarray,
    Y: np.ndarray,
    theta: np.ndarray,
    regressors: Regressors,
    *,
    weights: np.ndarray | None = None,
    slopes: np.ndarray | None = None,
    slope_weight: float | np.ndarray = 1.0,
    curvatures: np.ndarray | None = None,
    curvature_weight: float | np.ndarray = 1.0,
    groups: np.ndarray | None = None,
    ridge: float = 1e-13,
    iterations: int = 200,
    seconds: float | None = None,
    solver: Solver = "kaufman",
    heldout: tuple[np.ndarray, np.ndarray] | None = None,
    patience: int = 20,
    tolerance: float = 1e-9,
) -> Refined:
    """Refine a network from a start.

    The cost is Σ_i w_i (‖y_i − f(x_i)‖² + Σ_l s_il ‖∂_l (y_i − f(x_i))‖² + Σ_lk c_ilk ‖∂_l∂_k (y_i − f(x_i))‖²)
    + ridge · Σ_i w_i · ‖W‖².

    Parameters
    ----------
    X : (N, n)
        Scaled inputs.
    Y : (N, m)
        Scaled outputs.
    theta : (h, p)
        Start; h = 0 fits the tail alone.
    regressors : Regressors
        Kind of units and tail.
    weights : (N,), optional
        w; a weight of two is the sample given twice.
    slopes : (N, m, n), optional
        ∂y/∂x, scaled as outputs over inputs.
    slope_weight : float, (N,) or (N, n)
        s; zero where no slopes are known.
    curvatures : (N, m, n(n+1)/2), optional
        ∂²y/∂x_l∂x_k, l ≤ k (see `pairs` of `palpate.rbf.regressors`).
    curvature_weight : float, (N,) or (N, n(n+1)/2)
        c; zero where no curvatures are known.
    groups : (N,) int, optional
        Samples of one group are left out together when the fit is judged.
    ridge : float
        Penalty on squared weights: it holds near-cancelling units together.
    iterations : int
        Limit on Levenberg–Marquardt iterations.
    seconds : float, optional
        Limit on the search's time; the iteration under way is finished.
    solver : {"kaufman", "full"}
        Gauss–Newton matrix: Kaufman's approximation, or that of Golub and Pereyra in full.
    heldout : (X (N', n), Y (N', m)), optional
        Unseen samples: the iterate with the least error on them is returned.
    patience : int
        Iterations without a better one on `heldout` after which to stop.
    tolerance : float
        Relative gain of the cost below which it has converged.

    Returns
    -------
    Refined

    Raises
    ------
    UsageError
        If shapes disagree, numbers are not finite, or an option is not one.
    """
    _check_options(ridge, iterations, patience, tolerance, seconds, solver)
    deadline = np.inf if seconds is None else time.monotonic() + seconds
    theta = np.array(theta, float)
    p = regressors.form.size
    if theta.ndim != 2 or theta.shape[1] != p or not np.isfinite(theta).all():
        raise UsageError(
            f"Units of shape {theta.shape} are not finite {regressors.form.name} units of {p} numbers each.",
            fix="Make them with the form's own `unit`.",
        )
    rows = Rows.of(
        *(regressors, X, Y),
        weights=weights,
        slopes=slopes,
        slope_weight=slope_weight,
        curvatures=curvatures,
        curvature_weight=curvature_weight,
        groups=groups,
    )
    # the floor keeps the triangle regular where units coincide
    penalty = max(ridge, 1e-30) * rows.total
    judge = _judge(rows, heldout)
    search = _Search(rows, penalty, solver, tolerance, deadline)
    now = _Point(theta, project(rows, theta, penalty))
    best, error, since, count = now, judge(now), 0, 0
    while not now.done and count < iterations and time.monotonic() < deadline and since < patience:
        now, count = search.improved(now), count + 1
        if heldout is None:
            best = now
        elif (found := judge(now)) < error:
            # a gain in the fifth digit is no reason to go on
            since = 0 if found < error * (1.0 - 1e-3) else since + 1
            best, error = now, found
        else:
            since += 1
    return _result(rows, best, count, now.done, error)


@dataclass(frozen=True, eq=False)
class _Point:
    """The state of the search: units, their fit, and the damping to begin with."""

    theta: np.ndarray
    fit: Fit
    damping: float = 1e-2
    single: bool = True
    done: bool = False

    def __post_init__(self) -> None:
        if not len(self.theta):
            object.__setattr__(self, "done", True)


@dataclass(frozen=True, eq=False)
class _Search:
    """The problem that Levenberg–Marquardt solves, and when it may stop."""

    rows: Rows
    penalty: float
    solver: Solver
    tolerance: float
    deadline: float

    def improved(self, now: _Point) -> _Point:
        """The point after one accepted step; `done` where none helps or hardly any is gained."""
        single = now.single and now.theta.size >= _SINGLE_FROM and now.damping > _SINGLE_DAMPING
        system = DampedSystem(*gauss_newton(self.rows, now.theta, now.fit, self.solver, single=single))
        damping = now.damping
        while damping < DAMPING[1]:
            step = damped_step(self.rows, now.theta, now.fit, self.penalty, system, damping)
            if step is not None:
                done = step.gain < self.tolerance * now.fit.cost and not single
                single = now.single and step.gain > 1e-7 * step.fit.cost
                return _Point(step.theta, step.fit, step.damping, single, done)
            damping *= MORE
            if time.monotonic() > self.deadline:
                return replace(now, damping=damping)
        # rounding may have hidden a step; double precision has the last word
        return replace(now, damping=1e-2, single=False, done=not single)


def _judge(rows: Rows, heldout: tuple[np.ndarray, np.ndarray] | None) -> Callable[[_Point], float]:
    """The error of a point on held-out samples; not-a-number without them."""
    if heldout is None:
        return lambda point: float("nan")
    n, m = rows.X.shape[1], rows.modes.shape[1]
    X, Y, _, _, _ = samples(*heldout, inputs=n, outputs=m)
    latent = Y @ rows.modes.T
    beyond = max(float((Y**2).sum() - (latent**2).sum()), 0.0)  # what no mode of the training data reaches
    tail = rows.regressors.tail_rows(X)

    def judge(point: _Point) -> float:
        predicted = np.hstack([tail, rows.regressors.phi(X, point.theta)]) @ point.fit.coefficients
        return float(np.sqrt((((predicted - latent) ** 2).sum() + beyond) / Y.size))

    return judge


def _result(rows: Rows, point: _Point, count: int, done: bool, error: float) -> Refined:
    fit, m = point.fit, rows.modes.shape[1]
    # of k modes each has its coefficients, and a share in the units' numbers
    unknowns = len(fit.tau) + point.theta.size / rows.targets.shape[1]
    judges = unknowns < len(rows.targets)
    # units were fitted too: their h p numbers count as leverage
    even = point.theta.size / rows.targets.size
    counted = judges and 0 < point.theta.size <= _COUNTED
    if counted and rows.targets.shape[1] == 1:
        span = span_of_units(rows, point.theta, fit)
        missed = leave_one_out_row_errors(rows, fit, basis=span, most=_MOST_LEVERAGE)
    else:
        shared = leverage_of_units(rows, point.theta, fit) if counted else even
        missed = leave_one_out_row_errors(rows, fit, shared=shared, most=_MOST_LEVERAGE)
    reduced = errors_without_each_unit(rows, fit, len(point.theta), shared=even, most=_MOST_LEVERAGE)
    F = rows.matrix(point.theta)
    squares = float((fit.residual[: len(rows.X)] ** 2).sum())
    test_error = float(np.sqrt((missed**2).sum() / (rows.total * m)))
    return Refined(
        rows.regressors,
        point.theta,
        fit.coefficients @ rows.modes,
        float(np.sqrt(squares / (rows.total * m))),
        test_error if judges else float("inf"),
        float(np.linalg.cond(F)) if F.size else 1.0,
        count,
        done,
        np.sqrt(reduced / (rows.total * m)),
        error,
        len(rows.targets),
    )


def _check_options(
    ridge: float, iterations: int, patience: int, tolerance: float, seconds: float | None, solver: str
) -> None:
    if solver not in get_args(Solver):
        raise UsageError(
            f"There is no solver {solver!r}.",
            why="It decides which Gauss–Newton matrix the steps are made of.",
            fix=f"Choose one of {', '.join(get_args(Solver))}.",
        )
    most = {"iterations": iterations, "patience": patience, "tolerance": tolerance, "ridge": ridge}
    for name, limit in (most | {"seconds": 0.0 if seconds is None else seconds}).items():
        largest = np.inf if name == "ridge" else None  # a limit may be none; a penalty may not
        if not isinstance(limit, (int, float, np.number)) or not limit >= 0 or limit == largest:
            raise UsageError(
                f"{name} is {limit!r}; it must be a number, not negative.",
                why="A negative penalty rewards large weights, and a negative limit ends nothing.",
                fix="Leave it out for its default.",
            )
