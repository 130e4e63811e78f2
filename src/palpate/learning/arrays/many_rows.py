"""Fits to many rows: the structure is chosen on some of them, units move and weights are fitted on all.

What kind of units serves is seen on a few thousand rows as well as on a million, and candidates are compared there. The
units of the best kind then move by Gauss–Newton steps on four times as many rows, and on all of them; more units are
added, where the network still misses most, while that lowers the error of rows that it has not seen. Of the rows only
sums are kept (`streamed_weights`), so memory grows with them by no more than the rows themselves.

Two parts of the rows are not learnt from until the end: one by which all this is decided, and one that measures the
error and sets the intervals. Then the weights are fitted to every row.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.linalg import cho_solve

from palpate.learning.arrays.array_samples import ArrayProblem
from palpate.learning.arrays.calibration import Finish
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.arrays.held_out import FIRST_RADIAL, RIDGE, HeldOut, carry, start_units
from palpate.learning.arrays.streamed_weights import (
    OutOfTime,
    RowStream,
    UnitFit,
    moments_root,
    newton_steps,
    project_units,
    solve_weights,
    step_work,
)
from palpate.learning.kernel_layer import CENTRES_MAX, Metric
from palpate.learning.search import Candidate, Trial, Work
from palpate.rbf.forms import Centred
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.regressors import Regressors

__all__ = ["MANY_ROWS", "SUBSET", "ManyRows", "RowParts", "Structure"]

MANY_ROWS = 10_000
"""Rows beyond which the structure is chosen on some of them."""

SUBSET = 5_000
"""Rows on which it is chosen."""

_FEW = 4 * SUBSET  # rows on which units take their first steps
_SHARE, _MOST_HELD = 0.1, 4_000  # of the rows, to decide by; as many again measure the error
_FEWEST_PLACES = 50  # that each of these parts has
_MOST_NUMBERS = 2_500  # unknowns of units that move together: their matrix is 50 MB
_STEPS, _FEWEST_STEPS = 15, 2  # on one number of rows
_START_STEPS = 20  # of units that are added, by themselves
_NO_GAIN = 1e-3  # of the error: units that bring less are not worth their time in a query
_HOPELESS = 3.0  # times the kernel layer's error, after steps on few rows
_PATIENCE = 3  # steps of no such gain
_GROWTHS = 12
_RIDGES = tuple(10.0**k for k in range(-14, -3))
_KERNEL_WORK = 0.3  # of the work so far, for a kernel layer where units are behind one of the subset
_FEWEST_CENTRES = 300
_END = 6.0  # passes over all rows that the end takes at most


@dataclass(frozen=True, eq=False)
class Structure:
    """The kind of network that was chosen on the subset."""

    units: Candidate  # the best network's kind and units; without units an affine function suffices
    metric: Metric | None = None  # of the best kernel layer
    mark: float = math.inf  # its error on held-out rows of the subset, per latent output


@dataclass(frozen=True, eq=False)
class RowParts:
    """The rows to learn from, to decide by, and to measure the error by."""

    learn: np.ndarray  # (L,) indices, in a random order
    decide: np.ndarray  # (N,) mask
    judge: np.ndarray  # (N,) mask

    @classmethod
    def of(cls, places: np.ndarray, seed: int) -> RowParts:
        """Deal out rows of places (N,): copies of one place stay together, unless most rows are at few places."""
        wanted, rng = min(_SHARE * len(places), _MOST_HELD), np.random.default_rng(seed)
        sizes = np.bincount(places)
        dealt = rng.permutation(len(sizes))
        dealt = dealt[sizes[dealt] <= wanted / _FEWEST_PLACES]
        if sizes[dealt].sum() < len(places) / 2:
            places, sizes = np.arange(len(places)), np.ones(len(places), dtype=int)
            dealt = rng.permutation(len(places))
        ends = np.searchsorted(np.cumsum(sizes[dealt]), (wanted, 2 * wanted), side="right")
        part = np.zeros(len(sizes), dtype=int)
        part[dealt[: ends[0]]], part[dealt[ends[0] : ends[1]]] = 1, 2
        own, order = part[places], rng.permutation(len(places))
        return cls(order[own[order] == 0], own == 1, own == 2)


class ManyRows:
    """The fit to all rows of a scaled problem, with the work that is left after the structure was chosen.

    The seed decides where new units start, `target` is an error per latent output that is good enough, `workers` are
    threads that add up rows, and `trials` takes records of what was tried.
    """

    def __init__(
        self,
        problem: ArrayProblem,
        parts: RowParts,
        work: Work,
        *,
        seed: int,
        target: float,
        workers: int,
        deadline: float,
        trials: list[Trial],
    ) -> None:
        self.problem, self.parts, self.work = problem, parts, work
        self.seed, self.target, self.deadline, self.trials = seed, target, deadline, trials
        self.rows = RowStream(problem.X[parts.learn], problem.Y[parts.learn], workers)
        self.decide = problem.X[parts.decide], problem.Y[parts.decide]
        self.pace = 0.0  # s for one row and regressor

    def fitted(self, structure: Structure, scales: np.ndarray, finish: Finish) -> Fitted:
        """Return the result for a structure; new units start as wide as scales (n,) say."""
        best, form = self._move_units(structure, scales), None if structure.units.theta.size else "affine"
        ridge, error = self._ridge(best)
        if structure.metric is not None and self.target < error and structure.mark < error:
            self.work = self.work.extended(_KERNEL_WORK * self.work.spent, self.deadline)
            layer = self._kernel_layer(structure.metric)
            own_ridge, missed = self._ridge(layer)
            self._record("kernel layer", layer, missed)
            if missed < error:
                best, form, ridge, error = layer, "kernel layer", own_ridge, missed
        first = structure.units.network
        if first is not None and self._error(first) < error:  # a limit on time came soon
            return self._result(finish, first, first, None, None)
        root = moments_root(best.moments, RIDGE)
        before = solve_weights(self.rows.first(best.moments.rows), best.rows, best.moments, ridge)
        judged = self._stream(~np.isin(np.arange(len(self.problem.X)), self.parts.learn))
        whole = RowStream(self.problem.X, self.problem.Y, self.rows.workers)
        after = before
        if best.moments.rows == len(self.rows.X):
            after = solve_weights(whole, best.rows, best.moments + judged.moments(best.rows), ridge)
        return self._result(finish, _refined(best, before), _refined(best, after), form, root)

    def _move_units(self, structure: Structure, scales: np.ndarray) -> UnitFit:
        """Return the units after steps on more and more rows, and more units while these bring anything.

        Its moments are of all rows to learn from.
        """
        regressors, theta = structure.units.regressors, structure.units.theta
        began = time.monotonic()
        best = project_units(self.rows.first(_FEW), regressors, theta, RIDGE)
        self.pace = (time.monotonic() - began) / (best.moments.rows * best.rows.columns)
        if theta.size:
            best, error = self._take_steps(best, self._error(best), _HOPELESS * structure.mark)
            for k in range(1, _GROWTHS):
                larger = self._add_units(best, scales, k) if error > self.target else None
                if larger is None:
                    break
                new, missed = self._take_steps(larger, self._error(larger))
                gained = missed < (1.0 - _NO_GAIN) * error
                if missed < error:
                    best, error = new, missed
                if not gained:
                    break
        if best.moments.rows == len(self.rows.X):
            return best
        return project_units(self.rows, regressors, best.theta, RIDGE)

    def _take_steps(self, start: UnitFit, error: float, hopeless: float = math.inf) -> tuple[UnitFit, float]:
        """Return the best fit, and its error, after steps on few rows, then more, then all.

        Steps end after the first rows where the error is still above `hopeless`.
        """
        best = start
        for count in sorted({SUBSET, min(_FEW, len(self.rows.X)), len(self.rows.X)}):
            each, idle = step_work(count, best), 0
            most = min(_STEPS, int(self.work.left / each))
            try:
                for fit in self._steps(best, count, most):
                    self.work.spend(each)
                    missed = self._error(fit)
                    idle = 0 if missed < (1.0 - _NO_GAIN) * error else idle + 1
                    if missed < error:
                        best, error = fit, missed
                    if idle == _PATIENCE or error <= self.target:
                        break
            except OutOfTime:
                pass
            self._record(best.regressors.form.name, best, error)
            if error > hopeless:
                break
        return best, error

    def _steps(self, fit: UnitFit, count: int, most: int) -> Iterator[UnitFit]:
        """Yield the fit to so many rows, and that after each step."""
        if most < _FEWEST_STEPS:
            return
        stream = replace(self.rows.first(count), deadline=self._deadline(fit.rows.columns))
        if fit.moments.rows != count:
            fit = project_units(stream, fit.regressors, fit.theta, fit.ridge)
            yield fit
        yield from islice(newton_steps(stream, fit), most)

    def _add_units(self, fit: UnitFit, scales: np.ndarray, k: int) -> UnitFit | None:
        """Return the units and half as many again, refined on what they miss; nothing where no work is left."""
        form, h = fit.regressors.form, max(2, len(fit.theta) // 2)
        count = min(_FEW, len(self.rows.X))
        begin = (k * SUBSET) % max(1, len(self.rows.X) - SUBSET)
        part = self.rows.X[begin : begin + SUBSET], self.rows.Y[begin : begin + SUBSET]
        split = HeldOut(
            *(part[0], part[1] - fit.predict(part[0])),
            (self.decide[0], self.decide[1] - fit.predict(self.decide[0])),
            self.parts.decide,
        )
        start = Candidate(
            Regressors(form, FIRST_RADIAL), start_units(form, part[0], scales, h, self.seed + k), "more"
        )
        start = carry(start, fit.regressors.radial)
        units = len(fit.theta) + h
        work = _START_STEPS * split.work(start) + _FEWEST_STEPS * step_work(count, fit, units)
        left = self._deadline(fit.rows.columns + h) - time.monotonic()
        if units * form.size > _MOST_NUMBERS or work > self.work.left or left <= 0:
            return None
        new = split.evaluate(start, _START_STEPS, None if math.isinf(left) else left)
        self.work.spend(new.iterations * split.work(start))
        return project_units(
            self.rows.first(count), fit.regressors, np.vstack([fit.theta, new.theta]), fit.ridge
        )

    def _kernel_layer(self, metric: Metric) -> UnitFit:
        """Return units of one metric at rows, with weights from as many rows as the work allows."""
        each = max(self.work.left, 1.0)
        h = int(np.clip(math.sqrt(each / len(self.rows.X)), _FEWEST_CENTRES, CENTRES_MAX))
        centres = self.rows.X[:h]
        form = Centred("axis-aligned", centres.shape[1])
        theta = form.of(centres, np.broadcast_to(1.0 / metric.scales, centres.shape))
        count = int(max(each / len(centres) ** 2, 4 * h))
        self.work.spend(count * float(h) ** 2)
        return project_units(self.rows.first(count), Regressors(form, metric.radial), theta, RIDGE)

    def _ridge(self, fit: UnitFit) -> tuple[float, float]:
        """Return the ridge that misses least on the rows to decide by, and its error there."""
        asked, wanted = fit.rows(self.decide[0]), self.decide[1]

        def missed(ridge: float) -> float:
            factor = fit.moments.factor(ridge, fit.rows.tail)
            off = asked @ cho_solve(factor, fit.moments.cross) - wanted
            return float(np.sqrt((off**2).mean()))

        error, best = min((missed(ridge), ridge) for ridge in _RIDGES)
        return best, error

    def _error(self, network: UnitFit | Refined) -> float:
        """Return the error on the rows to decide by, root mean square per latent output."""
        return float(np.sqrt(((network.predict(self.decide[0]) - self.decide[1]) ** 2).mean()))

    def _deadline(self, columns: int) -> float:
        """Return when steps must end so that what comes after them ends in time."""
        return self.deadline - _END * self.pace * len(self.rows.X) * columns

    def _stream(self, mask: np.ndarray) -> RowStream:
        return RowStream(self.problem.X[mask], self.problem.Y[mask], self.rows.workers)

    def _record(self, form: str, fit: UnitFit, error: float) -> None:
        units, seconds = len(fit.theta), 0.0
        self.trials.append(
            Trial("many rows", form, fit.regressors.radial, units, error / self.problem.unit, seconds)
        )

    def _result(
        self,
        finish: Finish,
        before: Refined,
        after: Refined,
        form: str | None,
        root: np.ndarray | None,
    ) -> Fitted:
        """Return the result; what the network misses before its weights saw the rows to judge by counts."""
        rows = np.flatnonzero(self.parts.judge)
        unseen = self.problem.X[rows], self.problem.Y[rows]
        error = float(np.sqrt(((before.predict(unseen[0]) - unseen[1]) ** 2).mean()))
        split = HeldOut(self.rows.X, self.rows.Y, unseen, self.parts.judge)
        return finish.network(after, split, error, before=before, form=form, root=root)


def _refined(fit: UnitFit, coefficients: np.ndarray) -> Refined:
    """Return the units with their coefficients as a refined network."""
    rms = math.sqrt(fit.moments.squares(coefficients) / (fit.moments.rows * coefficients.shape[1]))
    none = np.full(len(fit.theta), math.inf)
    return Refined(fit.regressors, fit.theta, coefficients, rms, math.inf, 1.0, 0, True, none)
