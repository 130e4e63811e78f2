"""A network from nothing but samples: unit form, radial function, size and ridge are chosen by held-out error.

No form wins everywhere: ridges follow targets made of plane waves, rotated units those made of bumps, and a kernel
layer whatever has no small structure. So a kernel layer sets the mark; every form is refined a little, and the best go
on with more units, more samples and more iterations (see `held_out`). Half of the work goes to networks of the winner's
kind that are learnt crosswise: their mean is handed over, its error measured where they had not learnt (see `members`).

Work is counted in multiplications, so the seed decides the result; a limit on time only ends the search early.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from palpate.errors import FitWarning
from palpate.learning.arrays.array_samples import ArrayProblem, Samples
from palpate.learning.arrays.calibration import Finish
from palpate.learning.arrays.close_copies import better_with_copies, problem_without_copies
from palpate.learning.arrays.few_rows import best_of_few, few_places
from palpate.learning.arrays.fit_notes import IDLE, outlook
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.arrays.held_out import RIDGE, HeldOut, carry, forms_for
from palpate.learning.arrays.many_rows import MANY_ROWS, SUBSET, ManyRows, RowParts, Structure
from palpate.learning.arrays.members import (
    LOOK_SAMPLES,
    ROWS,
    Crossed,
    CrossedLayers,
    Fresh,
    refit_weights,
)
from palpate.learning.folds import fold_masks
from palpate.learning.kernel_layer import CENTRES_MAX, STARTS, KernelLayer, Metric, likely_metric
from palpate.learning.pool import Pool
from palpate.learning.search import Budget, Candidate, Trial, Work, evaluate_all
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.options import FitOptions, takes
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.refine import refine
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

__all__ = ["fit"]

_error = attrgetter("error")  # of a candidate, on held-out samples
_WORK = 5e11  # multiplications at effort 1: half a minute at most
_PLANNED_SECONDS = 30.0  # of that work: a shorter limit on time plans for less
# unknowns in the units of a candidate at effort 1, and at a first look
_FULL_NUMBERS, _LOOK_NUMBERS = 1500, 600
_METRIC_SAMPLES = 500  # of which a likelihood is computed; its work goes with their cube
_CROSSED_FOLDS, _CROSSED_ROUNDS = 5, 2  # of the networks learnt crosswise: ten in all
_QUICK = 0.03  # effort below which one round of folds judges one kind: a first answer in about a second
_CROSSED_SHARE = 0.5  # of all work, for the networks learnt crosswise
_CROSSED_PLACES = 60  # of fewer places no network was ever ahead of a Gaussian process
_LAYER_FOLDS = 10  # of a kernel layer, whose final one learns from all samples: fewer would say too much
_LAYER_STEPS = 15  # of the likelihood without a fold, from the metric of all samples
_CLOSE_TO_LAYER = 1.3  # times the kernel layer's error: a mean of ten networks may still miss less
_HOPELESS = 3.0  # times the kernel layer's error after the first stages: no refinement makes up for that
_BEHIND = 1.2  # times the best form's error: too far for another run
_ROUND_OFF = 1e-9  # of the outputs' spread: nobody asks for less


@takes(FitOptions)
def fit(
    X: Any,
    Y: Any,
    inputs: Sequence[Range] | None = None,
    outputs: Sequence[Quantity] | None = None,
    *,
    lines: Sequence[int] | None = None,
    bends: np.ndarray | None = None,
    options: FitOptions,
) -> Fitted:
    """Choose and fit a network from samples alone.

    Parameters
    ----------
    X : (N, n)
        Inputs; 20 samples at least. Arrays, nested lists or tables (of pandas, Polars, PyArrow, NumPy records); (N,)
        for a single input. Columns of tables are matched by name: to `inputs`, and in whatever is asked later.
    Y : (N, m)
        Outputs, parts of one quantity: what is small beside the others is learnt less closely relative to its own
        size. (N,) for one output, which then comes back as (N,).
    inputs : sequence of n ranges, optional
        Of the data if left out, named x0, x1, … or as a table's columns are.
    outputs : sequence of m quantities, optional
        Named y0, y1, … if left out.
    lines : sequence of N int, optional
        Line of each sample in the file that it comes from; notes name a sample by it. By default they name its row
        in X, counted from 0.
    bends : (n,), optional
        Bends of the inputs' scales, see `palpate.network.Scaling`; all are straight by default.

    Returns
    -------
    Fitted
        Its network, intervals and trained region.

    Notes
    -----
    Of fewer than 100 places each is left out once (`palpate.learning.arrays.few_rows`). Of more samples a fifth (15 %
    of a thousand and more) is held out to choose by. Then ten networks, or five, learn each without a fifth of them,
    and their mean is handed over: error and intervals are those of the networks that had not seen a sample (see
    `calibration`, beside it). Close copies that tell no noise are left out of the search (`close_copies`).

    Of more than 10,000 samples 5,000 decide the kind of network; units and weights learn from all, but for 4,000 that
    decide more units and steps and 4,000 that measure the error and set the intervals. In the end the weights learn
    from every sample (see `palpate.learning.arrays.many_rows`).

    Raises
    ------
    UsageError
        If there are too few samples, shapes disagree, numbers are not finite or all outputs the same, or an option
        can't be.
    """
    from threadpoolctl import threadpool_limits

    began = time.monotonic()
    budget, seconds = Budget.of(options.effort, options.seconds), options.seconds
    samples = replace(Samples.of(X, Y, inputs, outputs, lines), bends=bends)
    if seconds is not None:  # fitting to all samples and freezing come after the search
        planned = seconds / _PLANNED_SECONDS
        asked = 1.0 if budget.effort == FitOptions().effort else budget.effort
        budget = Budget(min(asked, planned), began + 0.85 * seconds)
    with threadpool_limits(1):  # small matrices: threads would cost more than they bring
        some, problem, places = problem_without_copies(samples)
        context = some, problem, places, began, budget, options
        if len(places) > MANY_ROWS:
            chooser = _Chooser(*context, RowParts.of(places, options.seed))
            fitted = chooser.chosen_for_many()
        else:
            chooser = _Chooser(*context)
            fitted = chooser.chosen_of_few() if few_places(places) else chooser.chosen()
            fitted = better_with_copies(fitted, samples, some, options)
        few = len(places) <= MANY_ROWS and few_places(places)
        fitted = replace(fitted, seconds=time.monotonic() - began)
        enough = options.target or 0.0
        words = outlook(len(some.X), fitted, options.effort, noise=chooser.noise(), few=few, enough=enough)
    fitted = replace(fitted, columns=samples.columns, outlook=words)
    for note in fitted.notes:
        if not note.startswith(IDLE):
            warnings.warn(note, FitWarning, stacklevel=3)
    return fitted


class _Chooser:
    """The stages of a choice, and the trials so far."""

    def __init__(
        self,
        samples: Samples,
        problem: ArrayProblem,
        places: np.ndarray,
        began: float,
        budget: Budget,
        options: FitOptions,
        parts: RowParts | None = None,
    ) -> None:
        self.problem, self.options = problem, options
        self.seed, self.pool = options.seed, Pool(options.workers)
        self.parts = parts  # of many rows some are chosen by, in half of the time
        rows = slice(None) if parts is None else parts.learn[:SUBSET]
        self.budget = budget if parts is None else budget.part(0.5)
        self.deadline = budget.deadline
        self.X, self.Y, self.places = problem.X[rows], problem.Y[rows], places[rows]
        self.target = (
            max(options.target or 0.0, _ROUND_OFF) * problem.unit
        )  # per latent output, as all errors
        self.total = _WORK * budget.effort
        self.quick = budget.effort < _QUICK
        self.work = Work(self.total, self.budget.deadline)
        self.size = min(2.0, math.sqrt(budget.effort))
        self.share = 0.15 if len(self.X) >= 1000 else 0.2
        self.split = self._fold(0)
        self.scales, self.known_scales = np.ones(self.X.shape[1]), False
        self.centres = int(np.clip((0.15 * self.total) ** (1 / 3), 300, CENTRES_MAX))
        self._layer = partial(KernelLayer.fit, seed=self.seed, most=self.centres)
        self.trials: list[Trial] = []
        self.ran: list[Candidate] = []
        self.metric: Metric | None = None  # the best of a kernel layer, once it is known
        self.reserve = _CROSSED_SHARE * self.total  # for the networks learnt crosswise
        self._finish_with = partial(Finish, samples, problem, self.trials, began, options.level, places)

    def chosen(self) -> Fitted:
        tail = self._tail()
        if tail.error <= self.target:
            return self._single(tail, form="affine")
        metric, mark = self._kernel()
        winner = self._winner(mark)
        behind = winner.error > max(_CLOSE_TO_LAYER * mark, self.target) or winner.error > _HOPELESS * mark
        if winner.network is None or behind:
            return self._kernel_network(metric, mark)
        self.reserve = 0.0
        crossed = self._finalist(winner)
        if crossed is None:
            return self._kernel_network(metric, mark) if winner.error > mark else self._single(winner)
        if len(self.X) <= self.centres and crossed.error > self.target:
            layers = self._likeliest_layers(metric)
            if not crossed.clearly_ahead(layers.missed, errors=1.0):
                return self._last_stage.kernel_network(layers)
        return self._last_stage.mean_network(crossed)

    def chosen_of_few(self) -> Fitted:
        """Return what misses least of places left out; networks compete where there are enough to learn crosswise."""
        options: dict[str, Any] = {"target": self.target, "unit": self.problem.unit, "trials": self.trials}
        best = best_of_few(self.X, self.Y, self.places, budget=self.budget, **options)
        self.scales = best.layer.metric.scales
        if best.error > self.target and len(np.unique(self.places)) >= _CROSSED_PLACES:
            winner = self._winner(mark := float(np.sqrt((best.missed[self.split.held] ** 2).mean())))
            self.reserve = 0.0
            crossed = self._finalist(winner) if winner.error <= _CLOSE_TO_LAYER * mark else None
            if crossed is not None and crossed.clearly_ahead(best.missed):
                return self._last_stage.mean_network(crossed)
        return self._last_stage.few_network(best)

    def chosen_for_many(self) -> Fitted:
        """Return the network whose kind the subset decides, and whose units and weights learn from all rows."""
        assert self.parts is not None
        structure = Structure(self._tail())
        if structure.units.error > self.target:
            metric, mark = self._kernel()
            structure = Structure(self._winner(mark), metric, mark)
        rows = ManyRows(
            *(self.problem, self.parts, self.work.extended(self.total, self.deadline)),
            seed=self.seed,
            target=self.target,
            workers=self.options.workers,
            deadline=self.deadline,
            trials=self.trials,
        )
        return rows.fitted(structure, self.scales, self._last_stage)

    def noise(self) -> float:
        """Return the noise that the likelihood of a process sees in the samples, relative to the outputs' spread."""
        if self.metric is None:
            return 0.0
        return self.metric.noise(self.X[:_METRIC_SAMPLES], self.Y[:_METRIC_SAMPLES]) / self.problem.unit

    def _winner(self, mark: float) -> Candidate:
        """Return the best form, radial function and size, refined where the kernel layer is not far ahead."""
        winner = self._radials(*self._forms(mark))
        if winner.theta.size < 0.6 * _FULL_NUMBERS * self.size:
            winner = self._sizes(winner)
        if self.target < winner.error <= _HOPELESS * mark:
            winner = self._run([winner], round(120 * self.size), self.split)[0]
        return winner

    @property
    def _last_stage(self) -> Finish:
        return self._finish_with(self.scales if self.known_scales else np.ones(0))

    def _run(
        self, candidates: Sequence[Candidate], iterations: int, split: HeldOut, *, record: bool = True
    ) -> list[Candidate]:
        """Return the candidates after so many more iterations at most, as they were where no work is left."""
        each = sum(split.work(candidate) for candidate in candidates)
        most = min(iterations, int((self.work.left - self.reserve) / max(each, 1.0)))
        if most < 1:
            return list(candidates)
        evaluated = evaluate_all(split, candidates, most, self.budget.deadline, self.pool)
        results = []
        for old, new in zip(candidates, evaluated, strict=True):
            if new is not None:
                self.work.spend((new.iterations - old.iterations + 1) * split.work(old))
                if record:
                    self.ran.append(new)
                    self.trials.append(self._scaled_trial(new.trial))
            results.append(old if new is None else new)
        return results

    def _scaled_trial(self, trial: Trial) -> Trial:
        """Return a record with its error relative to the outputs' standard deviation."""
        return replace(trial, error=trial.error / self.problem.unit)

    def _tail(self) -> Candidate:
        """Return an affine function without units, and its error."""
        form = unit_form("axis-aligned", self.X.shape[1])
        regressors, none = Regressors(form, "gaussian"), np.zeros((0, form.size))
        affine = refine(self.split.X[:ROWS], self.split.Y[:ROWS], none, regressors, heldout=self.split.unseen)
        return Candidate(regressors, none, "affine", affine.heldout, affine)

    def _kernel(self) -> tuple[Metric, float]:
        """Return the kernel layer's metric and error, and take the input scales from which units start."""
        errors: list[tuple[float, Metric]] = []
        samples = min(len(self.split.X), round(_METRIC_SAMPLES * min(1.0, self.size)))
        for name in RADIAL_FUNCTIONS:
            likelihood = len(STARTS) * 80.0 * samples**3
            if errors and self.work.left - self.reserve < 2.0 * likelihood:  # a limit on time is near
                break
            metric = likely_metric(name, self.split.X, self.split.Y, samples=samples)
            self.work.spend(likelihood)
            errors.append((self._kernel_error(metric), metric))
            if name == "inverse-multiquadric":
                self.scales, self.known_scales = metric.scales, True
        error, best = min(errors, key=lambda pair: pair[0])
        # the likelihood was of a part of the samples: more of them may want another width
        for scale, ridge in ((1.25, 1.0), (0.8, 1.0), (1.0, 0.1), (1.0, 10.0)):
            other = best.altered(scale, ridge)
            if self.work.left > 0.7 * self.total and not self.budget.over:
                trial = self._kernel_error(other)
                if trial < error:
                    error, best = trial, other
        self.metric = best
        return best, error

    def _kernel_error(self, metric: Metric) -> float:
        began = time.monotonic()
        (asked, wanted), rows = self.split.unseen, self._kernel_rows(0.03, len(self.split.X))
        layer = self._layer(metric, self.split.X[:rows], self.split.Y[:rows])
        error = float(np.sqrt(((layer.predict(asked) - wanted) ** 2).mean()))
        self.work.spend(rows * float(len(layer.centres)) ** 2)
        took = time.monotonic() - began
        self.trials.append(
            Trial(
                "kernel", "kernel layer", metric.radial, len(layer.centres), error / self.problem.unit, took
            )
        )
        return error

    def _kernel_rows(self, share: float, samples: int) -> int:
        """Return of how many samples a layer is fitted with this share of all work."""
        affordable = min(share * self.total, 0.5 * max(self.work.left, 0.0))
        return min(samples, max(self.centres, int(affordable / self.centres**2)))

    def _kernel_network(self, metric: Metric, error: float) -> Fitted:
        if len(self.X) <= self.centres:
            return self._last_stage.kernel_network(self._likeliest_layers(metric))
        some = self._kernel_rows(0.1, len(self.X))
        rows = np.sort(np.random.default_rng(self.seed).permutation(len(self.X))[:some])
        judging = self._kernel_rows(0.03, len(self.split.X))
        test_layer = self._layer(metric, self.split.X[:judging], self.split.Y[:judging])
        layer = self._layer(metric, self.X[rows], self.Y[rows])
        return self._last_stage.kernel_network(
            CrossedLayers(layer, ((test_layer, self.split.held),), self.X, self.Y), error
        )

    def _likeliest_layers(self, metric: Metric) -> CrossedLayers:
        """Return the layers of the best metric for all samples.

        A metric found without the samples held out is not as good as one of all, where these are few.
        """
        metrics, samples = [metric], len(self.X)
        if samples <= 1.25 * _METRIC_SAMPLES * min(1.0, self.size) and not self.budget.over:
            metrics = [likely_metric(name, self.X, self.Y, samples=samples) for name in RADIAL_FUNCTIONS]
            self.work.spend(len(metrics) * len(STARTS) * 80.0 * samples**3)
        masks = fold_masks(self.places, _LAYER_FOLDS)
        self.work.spend(len(metrics) * len(masks) * float(samples) ** 3)
        best = min(
            (CrossedLayers.of(one, self.X, self.Y, masks) for one in metrics), key=lambda one: one.error
        )
        if len(metrics) == 1 or self.budget.over:
            return best
        self.work.spend(len(masks) * 2.0 * _LAYER_STEPS * samples**3)
        return CrossedLayers.of(best.layer.metric, self.X, self.Y, masks, steps=_LAYER_STEPS)

    def _forms(self, mark: float) -> tuple[Candidate, Candidate]:
        """Return the form that does best, at full size if a look needs less, and it before its last run."""
        few = self.split.first(LOOK_SAMPLES)
        names = forms_for(self.X.shape[1])
        looks = self._run([self._enter(name, _LOOK_NUMBERS) for name in names], 20, few)
        best = min(looks, key=_error)
        # a form that leads by far, and leads the kernel layer too, has won; else the larger size tells
        far = 2.0 if best.error < mark else 3.0
        kept = sorted((one for one in looks if one.error <= far * best.error), key=_error)
        # rotated units show what they can do only when there are many: they and the best other go on
        others = [one for one in kept if one.kind[0] != "rotated"][:1]
        kept = others + [one for one in kept if one.kind[0] == "rotated"]
        larger = [self._enter(one.kind[0], _FULL_NUMBERS) for one in kept]
        larger = [new for new, old in zip(larger, kept, strict=True) if len(new.theta) > 1.5 * len(old.theta)]
        grown = self._run(larger, 10, few) if larger else []
        if not grown or grown[0].network is None:
            best = self._ahead(looks)
            return best, best
        least = min(grown, key=_error).error
        near = [one for one in grown if one.error <= _BEHIND * least]
        pairs = [*zip(self._run(near, 15, few), near, strict=True), (best, best)]
        return min(pairs, key=lambda pair: pair[0].error)

    def _enter(self, form: str, numbers: float) -> Candidate:
        return self.split.enter(form, round(numbers * self.size), self.scales, self.seed)

    def _ahead(self, looks: list[Candidate]) -> Candidate:
        """Return of small networks, soon refined, the one whose form does best on two further folds too."""
        best = min(looks, key=_error)
        close = [one for one in looks if one.error <= 1.5 * best.error]
        if self.quick or len(close) == 1 or best.error <= self.target:
            return best
        squares = np.array([one.error**2 for one in close])
        for k in (1, 2):
            split = self._fold(k)
            fresh = [split.enter(one.kind[0], one.theta.size, self.scales, self.seed + k) for one in close]
            again = evaluate_all(split.first(LOOK_SAMPLES), fresh, 20, self.budget.deadline, self.pool)
            self.work.spend(20 * sum(split.first(LOOK_SAMPLES).work(one) for one in fresh))
            squares += [math.inf if one is None else one.error**2 for one in again]
        return close[int(np.argmin(squares))]

    def _fold(self, k: int) -> HeldOut:
        return HeldOut.of(self.X, self.Y, share=self.share, seed=self.seed, fold=k, places=self.places)

    def _radials(self, winner: Candidate, before: Candidate) -> Candidate:
        """Return the same units with the best radial function; those not far behind go on to all samples."""
        if winner.error <= self.target:
            return winner
        others = [carry(before, name) for name in RADIAL_FUNCTIONS if name != winner.regressors.radial]
        all_three = [winner, *self._run(others, 15, self.split.first(LOOK_SAMPLES))]
        least = min(all_three, key=_error).error
        kept = [one for one in all_three if one.error <= 1.6 * least]
        return kept[0] if len(kept) == 1 else min(self._run(kept, 15, self.split), key=_error)

    def _sizes(self, winner: Candidate) -> Candidate:
        """Return fewer units where samples set their number: the largest network may know too much by heart."""
        tried = [winner]
        for factor in (0.6, 0.35, 0.2):
            if tried[-1].error <= self.target or (len(tried) > 1 and min(tried, key=_error) is not tried[-1]):
                break
            form, numbers = winner.kind[0], round(factor * winner.theta.size)
            fresh = self.split.enter(form, numbers, self.scales, self.seed)
            fresh = self._run([fresh], 10, self.split, record=False)[0]
            fresh = carry(fresh, winner.regressors.radial)
            tried += self._run([fresh], max(30, winner.iterations), self.split)
        return min(tried, key=_error)

    def _finalist(self, winner: Candidate) -> Crossed | None:
        """Return the networks of the best kind, learnt crosswise: the winner's, or a rival's if work allows."""
        best = self._learn_crosswise(winner)
        for rival in self._rivals(winner) if best is not None and not self.quick else ():
            if self.work.left < 1.3 * _CROSSED_ROUNDS * _CROSSED_FOLDS * self._fresh(rival).work(self.split):
                break
            other = self._learn_crosswise(self._run([rival], rival.iterations, self.split, record=False)[0])
            if other is not None and best is not None and other.error < best.error:
                best = other
        return best

    def _rivals(self, winner: Candidate) -> list[Candidate]:
        """Return the best of three other pairs of form and radial function, if they are not far behind."""
        kinds: dict[tuple[str, str], Candidate] = {}
        for one in sorted(self.ran, key=_error):
            if one.error < 2.5 * winner.error:
                kinds.setdefault(one.kind, one)
        return [one for kind, one in kinds.items() if kind != winner.kind][:3]

    def _learn_crosswise(self, winner: Candidate) -> Crossed | None:
        """Return networks of the winner's kind, each learnt without a fold; nothing where the work does not suffice.

        Each stops by other samples than those that it is judged by: on a handful the best iterate is there by luck.
        """
        fresh = self._fresh(winner)
        most = 1 if self.quick else _CROSSED_ROUNDS
        rounds = min(most, int(self.work.left / (1.1 * _CROSSED_FOLDS * fresh.work(self.split))))
        if rounds < 1:
            return None
        masks = [
            (k, mask)
            for k in range(rounds)
            for mask in fold_masks(self.places, _CROSSED_FOLDS, seed=self.seed + k)
        ]
        wholes = [
            HeldOut.without(self.X, self.Y, mask, seed=self.seed + i) for i, (_, mask) in enumerate(masks)
        ]
        parts = [HeldOut.of(whole.X, whole.Y, share=self.share, seed=self.seed) for whole in wholes]
        networks, unseen, own = [], [], []
        candidates = self._refine_afresh(fresh, parts)
        for (k, mask), whole, one in zip(masks, wholes, candidates, strict=True):
            if one is not None and one.network is not None:
                networks.append(refit_weights(one.network, whole.X, whole.Y, RIDGE))
                unseen.append(mask)
                own.append(k)
        if len(networks) < _CROSSED_FOLDS:  # a limit on time
            return None
        crossed = Crossed(tuple(networks), np.array(unseen), np.array(own), self.X, self.Y).without_strays()
        units = sum(len(network.theta) for network in crossed.networks)
        self.trials.append(
            self._scaled_trial(replace(winner.trial, start="mean", units=units, error=crossed.error))
        )
        return crossed

    def _fresh(self, like: Candidate) -> Fresh:
        return Fresh(like, self.scales, self.budget.deadline)

    def _refine_afresh(self, fresh: Fresh, splits: Sequence[HeldOut]) -> list[Candidate | None]:
        seeds = [self.seed + k for k in range(1, len(splits) + 1)]
        networks = self.pool.map(fresh.refined, list(zip(splits, seeds, strict=True)))
        for split, one in zip(splits, networks, strict=True):
            self.work.spend(split.work(fresh.like) * one.iterations if one else 0.0)
        return networks

    def _single(self, one: Candidate, form: str | None = None) -> Fitted:
        assert one.network is not None
        network = refit_weights(one.network, self.X, self.Y, RIDGE)
        return self._last_stage.network(network, self.split, one.error, before=one.network, form=form)
