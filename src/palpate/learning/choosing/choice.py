"""A network from nothing but samples: unit form, radial function, size and ridge are chosen by held-out error.

No form wins everywhere: ridges follow targets made of plane waves, rotated units those made of bumps, and a kernel
layer whatever has no small structure. So a kernel layer sets the mark, the forms race against it (see `race`), and
what time is left goes to the winner, or to a committee where that is worth more (see `committee`).

Work is counted in iterations and samples, so the seed decides; the time limit is only the last resort.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.learning.choosing.arrays import Samples, check_search
from palpate.learning.choosing.calibration import Evidence
from palpate.learning.choosing.committee import Member, expected_error, refitted
from palpate.learning.choosing.finish import Finish
from palpate.learning.choosing.fitted import Choice, Fitted
from palpate.learning.choosing.kernel_layer import KernelLayer, Metric, likely_metric
from palpate.learning.choosing.problem import Problem
from palpate.learning.choosing.race import RIDGE, Race, Runner, Split, best_of, carried, forms_for
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.refine import refine
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

__all__ = ["Choice", "Fitted", "fit"]

_NUMBERS = 1500  # unknowns in the units of a full-size runner for 30 s
_SMALL = 600  # and of one that is only looked at
_SAMPLES = 1000  # to learn from while choosing
_MEMBERS = 5
_CROSSED_BELOW = 500  # samples: intervals then rest on networks of their own
_BEHIND = 1.2  # times the best error: too far for another ten iterations
_ROUND_OFF = 1e-9  # of the outputs: nobody asks for less
_ASTRAY = 3.0  # times the best member's error: not of its kind
_HOPELESS = 3.0  # times the kernel layer's error after the race: no refinement will make up for that


def fit(
    X: Any,
    Y: Any,
    inputs: Sequence[Range] | None = None,
    outputs: Sequence[Quantity] | None = None,
    *,
    seconds: float = 30.0,
    seed: int = 0,
    target: float | None = None,
    level: float = 0.9,
) -> Fitted:
    """Choose and fit a network from samples alone.

    Parameters
    ----------
    X : (N, n)
        Inputs; 20 samples at least. Arrays, nested lists or tables; (N,) for a single input.
    Y : (N, m)
        Outputs, parts of one quantity: what is small beside the others is learnt less closely relative to its own
        size. (N,) for one output, which then comes back as (N,).
    inputs : sequence of n ranges, optional
        Of the data if left out, named x0, x1, … or as a table's columns are.
    outputs : sequence of m quantities, optional
        Named y0, y1, … if left out.
    seconds : float
        Limit on time, on one core.
    seed : int
        Decides everything but where the clock ends the search.
    target : float, optional
        Held-out error relative to the outputs' standard deviation that is good enough.
    level : float
        Share of unseen samples that the intervals are to hold.

    Returns
    -------
    Fitted
        Its network, intervals and trained region.

    Notes
    -----
    A fifth of the samples (15 % of a thousand and more) is held out to choose by, and its errors, before any
    weights saw it, set the intervals' widths. Then the weights are fitted to all samples: no sample is lost to the
    calibration, and its guarantee is approximate (see `palpate.learning.choosing.calibration`). Below 500 samples,
    where time allows, networks learnt without a fold are judged on it too, and the wider widths count.

    Raises
    ------
    UsageError
        If there are too few samples, shapes disagree, numbers are not finite or all outputs the same, or an option
        can't be.
    """
    from threadpoolctl import threadpool_limits

    began = time.monotonic()
    check_search(seconds, seed, target, level)
    samples = Samples.of(X, Y, inputs, outputs)
    with threadpool_limits(1):  # small matrices: threads would cost more than they bring
        return _Chooser(samples, began, seconds, seed, target, level).chosen()


class _Chooser:
    """The stages of a choice, and the trials so far."""

    def __init__(
        self,
        samples: Samples,
        began: float,
        seconds: float,
        seed: int,
        target: float | None,
        level: float,
    ) -> None:
        problem = Problem.of(samples.X, samples.Y, samples.inputs, samples.outputs)
        self.problem, self.began, self.seed = problem, began, seed
        self.X, self.Y = problem.X, problem.Y
        # errors are per latent output until they are told
        self.target = max(target or 0.0, _ROUND_OFF) * problem.unit
        # refitting on all samples and freezing come after the race
        self.deadline = began + 0.85 * seconds
        self.size = min(2.0, np.sqrt(seconds / 30.0))
        self.share = 0.15 if len(self.X) >= 1000 else 0.2
        self.split = Split.of(self.X, self.Y, share=self.share, seed=seed)
        self.trials: list[Choice] = []
        self.finish = Finish(samples, problem, self.split, self.trials, began, seed, level)
        self.ran: list[Runner] = []

    def chosen(self) -> Fitted:
        tail, error = self._tail()
        if error <= self.target:
            return self.finish.network([self._member(tail, self.split)], error, form="affine")
        layer, mark, scales = self._kernel()
        race = Race(self.split, scales, self.seed, self.deadline)
        winner = self._radials(race, *self._forms(race, mark))
        if winner.theta.size < 0.6 * _NUMBERS * self.size:
            winner = self._sizes(race, winner)
        if winner.heldout > _HOPELESS * mark:
            return self.finish.kernel_network(layer, mark)
        began = time.monotonic()
        if winner.heldout > self.target:
            winner = race.run(winner, round(120 * self.size))
            self._note(winner)
        if winner.found is None or winner.heldout > max(mark, self.target):
            return self.finish.kernel_network(layer, mark)
        spent = time.monotonic() - began
        members, error = self._finalists(race, winner, spent)
        return self.finish.network(members, error, evidence=self._crossed(race, winner))

    def _kernel(self) -> tuple[Metric, float, np.ndarray]:
        """The kernel layer's metric and error, and the input scales from which units start."""
        found, scales = [], np.ones(self.X.shape[1])
        for name in RADIAL_FUNCTIONS:
            metric = likely_metric(name, self.split.X, self.split.Y, samples=round(500 * min(1.0, self.size)))
            found.append((self._judged(metric), metric))
            if name == "inverse-multiquadric":
                scales = metric.scales
        error, best = min(found, key=lambda pair: pair[0])
        # the likelihood was of a part of the samples: more of them may want another width
        for scale, ridge in ((1.25, 1.0), (0.8, 1.0), (1.0, 0.1), (1.0, 10.0)):
            other = best.altered(scale, ridge)
            if time.monotonic() < self.began + 0.2 * (self.deadline - self.began):
                trial = self._judged(other)
                if trial < error:
                    error, best = trial, other
        return best, error, scales

    def _judged(self, metric: Metric) -> float:
        held, wanted = self.split.unseen
        layer = KernelLayer.fit(metric, self.split.X, self.split.Y, seed=self.seed)
        error = float(np.sqrt(((layer.predict(held) - wanted) ** 2).mean()))
        self._noted(f"kernel layer {metric.radial}", len(layer.centres), error)
        return error

    def _forms(self, race: Race, mark: float) -> tuple[Runner, Runner]:
        """The form that does best, at full size if that is more than a look needs, and it before its last run."""
        looks = [
            self._ran(race, race.entered(name, round(_SMALL * self.size)), 20, _SAMPLES)
            for name in forms_for(self.X.shape[1])
        ]
        best = best_of(looks)
        # a form that leads by far, and leads the kernel layer too, has won; else the larger size tells
        far = 2.0 if best.heldout < mark else 3.0
        kept = sorted((r for r in looks if r.heldout <= far * best.heldout), key=lambda r: r.heldout)
        # rotated units show what they can do only when there are many: they and the best other go on
        others = [r for r in kept if r.regressors.form.name != "rotated"][:1]
        kept = others + [r for r in kept if r.regressors.form.name == "rotated"]
        larger = [race.entered(r.regressors.form.name, round(_NUMBERS * self.size)) for r in kept]
        grown = [
            self._ran(race, r, 10, _SAMPLES)
            for r, old in zip(larger, kept, strict=True)
            if len(r.theta) > 1.5 * len(old.theta)
        ]
        if not grown:
            best = self._ahead(race, looks)
            return best, best
        least = best_of(grown).heldout
        pairs = [(self._ran(race, r, 15, _SAMPLES), r) for r in grown if r.heldout <= _BEHIND * least]
        return min([*pairs, (best, best)], key=lambda pair: pair[0].heldout)

    def _ahead(self, race: Race, looks: list[Runner]) -> Runner:
        """Of small networks, which are soon refined, the one whose form does best on two further folds as well."""
        best = best_of(looks)
        close = [r for r in looks if r.heldout <= 1.5 * best.heldout]
        if len(close) == 1 or best.heldout <= self.target:
            return best
        squares = {}
        for runner in close:
            errors = [runner.heldout]
            for k in (1, 2):
                split = Split.of(self.X, self.Y, share=self.share, seed=self.seed, fold=k)
                other = Race(split, race.scales, self.seed + k, race.deadline)
                fresh = other.entered(runner.regressors.form.name, runner.theta.size)
                errors.append(other.run(fresh, 20, samples=_SAMPLES).heldout)
            squares[runner] = sum(error**2 for error in errors)
        return min(close, key=squares.__getitem__)

    def _radials(self, race: Race, winner: Runner, before: Runner) -> Runner:
        """The same units with each radial function; those not far behind go on to all samples."""
        if winner.heldout <= self.target:
            return winner
        others = [carried(before, name) for name in RADIAL_FUNCTIONS if name != winner.regressors.radial]
        both = [winner, *(self._ran(race, other, 15, _SAMPLES) for other in others)]
        least = best_of(both).heldout
        kept = [r for r in both if r.heldout <= 1.6 * least]
        return kept[0] if len(kept) == 1 else best_of([self._ran(race, r, 15) for r in kept])

    def _sizes(self, race: Race, winner: Runner) -> Runner:
        """Fewer units where samples, not time, set their number: the largest network may know too much by heart."""
        tried = [winner]
        for factor in (0.6, 0.35, 0.2):
            if tried[-1].heldout <= self.target or (len(tried) > 1 and best_of(tried) is not tried[-1]):
                break
            fresh = race.entered(winner.regressors.form.name, round(factor * winner.theta.size))
            fresh = race.run(fresh, 10)
            tried.append(
                self._ran(race, carried(fresh, winner.regressors.radial), max(30, winner.iterations))
            )
        return best_of(tried)

    def _ran(self, race: Race, runner: Runner, iterations: int, samples: int | None = None) -> Runner:
        if race.deadline < time.monotonic():
            return runner
        runner = race.run(runner, iterations, samples=samples)
        self._note(runner)
        return runner

    def _finalists(self, race: Race, winner: Runner, spent: float) -> tuple[list[Member], float]:
        """Members of the best committee and its error: the winner's, or a rival's where time allows to compare."""
        began = time.monotonic()
        best = self._committee(race, winner, spent)
        each = time.monotonic() - began
        if len(best[0]) == _MEMBERS:
            for rival in self._rivals(winner):
                if race.deadline - time.monotonic() < 2.0 * each:
                    break
                other = self._committee(race, race.run(rival, rival.iterations), each / _MEMBERS)
                if len(other[0]) == _MEMBERS and other[1] < best[1]:
                    best = other
        members, error = best
        least = min(member.heldout for member in members)
        # folds differ, but not so much: such a member was caught in another minimum, and would spoil the average
        near = [member for member in members if member.heldout <= _ASTRAY * least]
        if len(near) < len(members):
            members, error = near, expected_error(near, self.X)
        single = float(np.sqrt(np.mean([member.heldout**2 for member in members])))
        if len(members) == 1 or error > 0.9 * single:
            return members[:1], single
        return members, error

    def _rivals(self, winner: Runner) -> list[Runner]:
        """The best of three other pairs of form and radial function, if they are not far behind."""
        found: dict[Regressors, Runner] = {}
        for runner in sorted(self.ran, key=lambda r: r.heldout):
            if runner.found is not None and runner.heldout < 2.5 * winner.heldout:
                found.setdefault(runner.regressors, runner)
        return [runner for pair, runner in found.items() if pair != winner.regressors][:3]

    def _committee(self, race: Race, winner: Runner, spent: float) -> tuple[list[Member], float]:
        """The winner, with others of its kind from other starts and folds if time allows, and the error to expect."""
        members = [self._member(winner, race.split)]
        while len(members) < _MEMBERS and race.deadline - time.monotonic() > 1.3 * spent:
            began, k = time.monotonic(), len(members)
            split = Split.of(self.X, self.Y, share=self.share, seed=self.seed, fold=k)
            other = Race(split, race.scales, self.seed + k, race.deadline)
            fresh = self._fresh(other, winner)
            spent = max(spent, time.monotonic() - began)
            if fresh.found is None:
                break
            members.append(self._member(fresh, split))
        error = expected_error(members, self.X)
        if len(members) > 1:
            self._noted(f"{len(members)} × {winner.name}", len(members) * len(winner.theta), error)
        return members, error

    def _fresh(self, race: Race, like: Runner) -> Runner:
        """One of the same kind from another start."""
        fresh = race.entered(like.regressors.form.name, like.theta.size)
        fresh = carried(race.run(fresh, 15, samples=_SAMPLES), like.regressors.radial)
        return race.run(fresh, max(30, like.iterations))

    def _member(self, runner: Runner, split: Split) -> Member:
        assert runner.found is not None
        return Member(refitted(runner.found, self.X, self.Y, RIDGE), runner.heldout, runner.found, split)

    def _crossed(self, race: Race, winner: Runner) -> Sequence[Evidence]:
        """What networks of the winner's kind miss on folds of which they have seen nothing; of few samples only.

        Each stops by other samples than those that it is judged by: on a handful the best iterate is there by luck.
        """
        if len(self.X) >= _CROSSED_BELOW:
            return ()
        parts = []
        for k in range(_MEMBERS):
            whole = Split.of(self.X, self.Y, share=1.0 / _MEMBERS, seed=self.seed, fold=k)
            part = Split.of(whole.X, whole.Y, share=self.share, seed=self.seed)
            found = self._fresh(Race(part, race.scales, self.seed + k, race.deadline), winner).found
            if found is None or time.monotonic() > race.deadline:  # cut short, it would say too much
                return ()
            parts.append(self.finish.evidence(refitted(found, whole.X, whole.Y, RIDGE), whole))
        return (Evidence.together(parts),)

    def _tail(self) -> tuple[Runner, float]:
        """An affine function without units, and its error."""
        form = unit_form("axis-aligned", self.X.shape[1])
        regressors, none = Regressors(form, "gaussian"), np.zeros((0, form.size))
        found = refine(self.split.X, self.split.Y, none, regressors, heldout=self.split.unseen)
        return Runner(regressors, none, found.heldout, found=found), found.heldout

    def _note(self, runner: Runner) -> None:
        self.ran.append(runner)
        self._noted(runner.name, len(runner.theta), runner.heldout)

    def _noted(self, what: str, units: int, error: float) -> None:
        self.trials.append(Choice(what, units, error / self.problem.unit, time.monotonic() - self.began))
