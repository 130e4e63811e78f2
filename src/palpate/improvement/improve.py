"""`palpate.improve`: solve, learn and judge in turn, each batch of solves where the force is least certain.

A few Sobol places of one depth each begin. A Gaussian process of ℓ, which is fitted anew for each batch, chooses the
next, whatever network is learnt. Unseen solves, which nothing is learnt from and which choose nothing, say when to
stop.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.format import count
from palpate.improvement.choice_rules import choose_by_disagreement, choose_by_variance, choose_farthest
from palpate.improvement.force_model import ForceModel
from palpate.improvement.improve_answers import AnswerImprovement, unseen_places
from palpate.improvement.improvement_step import ImprovementStep
from palpate.improvement.kept_solves import KeptSolves
from palpate.improvement.stop_rule import AnswerStopRule, StopRule, relative_errors
from palpate.learning.learn_dataset import learn as learn_dataset
from palpate.learning.pressed_solves import PROBES, TOOL, PressedSolves
from palpate.options import ImprovementOptions, declarations, takes
from palpate.processes import available_cores
from palpate.surrogates import Surrogate
from palpate.sweeps import Problem, local_cluster

__all__ = ["RULES", "ImprovementStep", "improve"]

RULES = declarations(ImprovementOptions)["rule"].choices
"""Rules that choose the next solves; the last three are there to compare with."""

FIRST = 12  # Sobol places to begin with, of one depth each
CANDIDATES = 384  # places of one depth each among which a batch is chosen
SERIES, DEPTHS = 48, 3  # depth series among which a batch is chosen too, towards the end, and depths of each
# cost of a further depth of a series, which starts from the last, over that of a solve of its own
FOLLOWS = 0.6
SMALLEST_BATCH, LARGEST_BATCH = 4, 8  # solves of a batch
NEAR = 2.0  # factor of the wanted error, below which networks are searched properly and depth series offered
QUICK, PROPER = 0.1, 0.5  # effort of learning far from the wanted error, and near it
BETTER = 1.0  # error of a new surrogate over that of the last one, up to which it is kept
UNSEEN_FIRST, UNSEEN_EACH = 8, 2  # unseen solves at the first judgement, and with each batch

Learner = Callable[[Dataset, float], tuple[Surrogate, Any]]
"""From solves and an effort to a surrogate and the record of its learning."""

Interest = Callable[[np.ndarray], np.ndarray]
"""From inputs (C, n) of places to how much an error at each of them counts, (C,)."""

Log = Callable[[str], None]


@takes(ImprovementOptions)
def improve(
    problem: Problem,
    *,
    unseen: int | np.ndarray = 40,
    interest: Interest | None = None,
    path: Path | str | None = None,
    unseen_path: Path | str | None = None,
    learner: Learner | None = None,
    known: tuple[Surrogate, Any] | None = None,
    cluster: Any = None,
    progress: Any = True,
    log: Log = lambda _: None,
    options: ImprovementOptions,
) -> Iterator[ImprovementStep]:
    """Solve where the answers are least certain, learn, and yield each step, until an error is kept.

    Of a body under a probe the error is that of the force, over the force; of numbers, fields and curves it is that
    over the range of the answer that misses most. Either is the 95th percentile of unseen solves.

    Parameters
    ----------
    problem : Problem
        A body under a probe, ``body.problem(SphereProbe(…))``, or a family of bodies; or a problem without touch, such
        as an `ExternalProblem`.
    unseen : int or (U, n) array
        Number of solves to judge by: of a body in depth series of two at places of their own, else at random places; or
        their inputs, in the order in which they are solved.
    interest : callable, optional
        From inputs (C, n) of places to weights (C,) of at least zero: how much an error at each of them counts, such as
        where a hand goes. It is asked anew for each batch; by default all places count the same.
    path, unseen_path : path, optional
        Datasets (``NAME.zarr``) that keep the solves to learn from and to judge by. A later call goes on with them.
    learner : callable, optional
        From solves and an effort to a surrogate and its record; by default `palpate.learn`.
    known : (surrogate, record), optional
        A surrogate of just these solves, to go on from.
    cluster : optional
        A running `local_cluster`, or what else `palpate.sweep` takes.
    progress : bool or callable
        Of each batch: a bar on standard error, or a function (done, total).
    log : callable
        Gets one line when a part of the work begins.

    Yields
    ------
    ImprovementStep
        After each batch, after each surrogate, and at the end.

    Raises
    ------
    UsageError
        For a wrong argument, a body that acts otherwise than under one probe, or paths that hold another problem's
        solves.
    SolverError
        If more than half of the first solves fail.
    """
    is_pressed = _is_pressed(problem)
    if not is_pressed and options.rule not in {"variance", "sobol"}:
        raise UsageError(
            f"The rule {options.rule!r} is for bodies under a probe.",
            why="It asks for the force that a hand feels.",
            fix='Use rule="variance" or rule="sobol".',
        )
    if isinstance(unseen, int | np.integer):
        checks.fits("The number of unseen solves", unseen, least=1, whole=True)
        unseen = (
            problem.design(int(unseen), options.seed + 7, depths=2)  # type: ignore[attr-defined]
            if is_pressed
            else unseen_places(problem, int(unseen), options.seed)
        )
    count_of_workers = options.workers or available_cores()
    size = options.batch or int(
        np.clip(count_of_workers * -(-SMALLEST_BATCH // count_of_workers), SMALLEST_BATCH, LARGEST_BATCH)
    )
    began = time.monotonic()
    with contextlib.ExitStack() as stack:
        if cluster is None:
            cluster = stack.enter_context(local_cluster(options.workers))
        solving = {"cluster": cluster, "progress": progress, "case_limit": options.case_limit}
        kind, rule = (_Improvement, StopRule) if is_pressed else (AnswerImprovement, AnswerStopRule)
        work = kind(
            problem,
            KeptSolves.open(problem, None if path is None else Path(path), **solving),
            KeptSolves.open(
                problem, None if unseen_path is None else Path(unseen_path), design="points", **solving
            ),
            np.asarray(unseen, dtype=float),
            rule(options.until, options.limit, options.most),
            options,
            interest,
            size,
            learner or partial(_learn, workers=options.workers, log=log),
            log,
            began,
        )
        yield from work.run(known)


def _learn(data: Dataset, effort: float, *, workers: int | None, log: Log) -> tuple[Surrogate, Any]:
    return learn_dataset(data, effort=effort, workers=workers, log=log)


def _is_pressed(problem: Any) -> bool:
    """Return whether a problem is a body under one probe, or without touch; any other is refused."""
    acting = problem.describe().get("interactions", ()) if hasattr(problem, "describe") else ()
    kinds = [entry.get("type") for entry in acting if isinstance(entry, dict)]
    if len(kinds) == 1 and kinds[0] in (*PROBES, TOOL) and hasattr(problem, "design"):
        return True
    if kinds or not hasattr(problem, "describe"):
        raise UsageError(
            "Solves can be chosen for a body under one probe or tool, or for a problem without touch.",
            why=f"On this body act: {', '.join(map(str, kinds)) or 'nothing that its description tells'}.",
            fix="Use body.problem(SphereProbe(…)) or a SurfaceTool; `palpate.sweep` takes any other problem.",
        )
    return False


@dataclass(eq=False)
class _Improvement:
    """One improvement and its state."""

    problem: Any
    kept: KeptSolves
    judging: KeptSolves
    unseen: np.ndarray
    stop: StopRule
    options: ImprovementOptions
    interest: Interest | None
    size: int
    learner: Learner
    log: Log
    began: float
    model: ForceModel | None = None
    pressed: PressedSolves | None = None
    best: tuple[Surrogate, Any] | None = None
    learnt_from: int = 0
    values: np.ndarray = field(default_factory=lambda: np.empty(0))
    error: float = math.nan  # of the surrogate that is kept
    errors: list[float] = field(default_factory=list)  # of each surrogate that was learnt, kept or not

    def run(self, known: tuple[Surrogate, Any] | None) -> Iterator[ImprovementStep]:
        if len(self.kept) < FIRST:
            self.log(f"the first {FIRST} solves")
            points = self.problem.design(FIRST, self.options.seed, depths=1)
            self.kept.add([point[None] for point in points[len(self.kept) :]])
            yield self._step("solved")
        if known is not None:
            self._take(known)
        else:
            self._learn(QUICK)
        yield self._step("learnt", is_new=True)  # a hand can feel it before it is judged
        self._judge_by(max(UNSEEN_FIRST, len(self.judging)))
        self.error = self._error(self.best)
        self.errors.append(self.error)
        yield self._step("judged")
        while not (reason := self._reason()):
            below = self.errors[-1] <= self.stop.until
            self._solve_batch()
            more = len(self.unseen) if below else min(len(self.judging) + UNSEEN_EACH, len(self.unseen))
            self._judge_by(more)
            yield self._step("solved")
            before, tried, is_new = self._learn_and_judge()
            yield replace(self._step("learnt", is_new=is_new), before=before, tried=tried)
        reached = self.stop.is_reached(self.errors, complete=self._is_complete)
        yield replace(self._step("ended"), reached=reached, reason=reason)

    @property
    def _is_complete(self) -> bool:
        return len(self.judging) >= len(self.unseen)

    def _reason(self) -> str:
        keeps = not self._is_complete and not self.errors[-1] > self.stop.until
        if keeps and len(self.errors) == 1:
            # a surrogate of an earlier run: all unseen solves judge it before anything else
            self._judge_by(len(self.unseen))
            self.error = self.errors[-1] = self._error(self.best)
        return self.stop.reason(
            self.errors,
            kept=self.error,
            complete=self._is_complete,
            solves=len(self.kept),
            seconds=time.monotonic() - self.began,
        )

    def _judge_by(self, number: int) -> None:
        """Solve unseen places until there are so many."""
        have, number = len(self.judging), min(number, len(self.unseen))
        if have < number:
            self.log(f"{count(number - have, 'unseen solve')} to judge by")
            self.judging.add(_series_of(self.unseen[have:number]))

    def _solve_batch(self) -> None:
        groups = self._choose()
        self.log(f"{count(sum(map(len, groups)), 'solve')} chosen by {self.options.rule}")
        self.kept.add(groups)

    def _choose(self) -> list[np.ndarray]:
        """Return the points of the next batch, in groups that are solved in order."""
        solved = len(self.kept)
        if self.options.rule == "sobol":  # the sequence that began, taken further
            return [
                x[None] for x in self.problem.design(solved + self.size, self.options.seed, depths=1)[solved:]
            ]
        model = self._fit()
        near = self.error <= NEAR * self.stop.until
        singles = self.problem.design(CANDIDATES, self.options.seed + 7919 * (1 + solved), depths=1)
        parts = [singles]
        if near and self.options.rule == "variance":
            parts.append(
                self.problem.design(
                    SERIES * DEPTHS, self.options.seed + 7919 * (1 + solved) + 1, depths=DEPTHS
                )
            )
        X = np.concatenate(parts)
        groups = [np.array([i]) for i in range(len(singles))]
        groups += list(np.arange(len(singles), len(X)).reshape(-1, DEPTHS))
        touching = model.baseline.coordinate(X) > 0
        groups = [g for g in groups if touching[g].all()]
        rows = np.concatenate(groups)
        place = np.full(len(X), -1)
        place[rows] = np.arange(len(rows))
        X, groups = X[rows], [place[g] for g in groups]
        with threadpool_limits(1):
            picks = self._picks(model, X, groups)
        return [X[groups[i]] for i in picks]

    def _picks(self, model: ForceModel, X: np.ndarray, groups: list[np.ndarray]) -> list[int]:
        taken = self.kept.X
        if self.options.rule == "farthest":
            return choose_farthest(model.scaled(X), model.scaled(taken), model.half, model.images, self.size)
        if self.options.rule == "disagreement":
            return choose_by_disagreement(model, X, self.size)
        costs = np.array([1.0 + FOLLOWS * (len(g) - 1) for g in groups])
        return choose_by_variance(
            model,
            X,
            groups,
            costs,
            self.size,
            taken=taken,
            failed=self._failed(model),
            interest=None if self.interest is None else self.interest(X),
        )

    def _failed(self, model: ForceModel) -> np.ndarray:
        """Return the inputs of solves that failed: nothing is to be chosen beside them."""
        assert self.kept.data is not None
        X = self.kept.X[~self.kept.data.converged]
        return np.asarray(X[model.baseline.coordinate(X) > 0]) if len(X) else X

    def _fit(self) -> ForceModel:
        train = self.kept.good
        assert train is not None
        self.pressed = self._pressed(train)
        # counted from what the surrogate counts from: over grooves that is the overlap
        baseline = self.pressed.baseline if self.best is None else self.best[0].hand_energy.baseline
        with threadpool_limits(1):
            self.model = ForceModel.fit(self.pressed.solves, baseline, self.model, seed=self.options.seed)
        return self.model

    def _pressed(self, train: Dataset) -> PressedSolves:
        # the touched surface is the same for all batches, and takes seconds
        return PressedSolves.of(train) if self.pressed is None else replace(self.pressed, data=train)

    def _learn(self, effort: float) -> tuple[Surrogate, Any]:
        train = self.kept.good
        assert train is not None
        result = self.learner(train, effort)
        if self.best is None:
            self._take(result)
        return result

    def _take(self, result: tuple[Surrogate, Any]) -> None:
        train = self.kept.good
        assert train is not None
        self.best, self.learnt_from = result, len(train)
        self.pressed = self._pressed(train)
        self.values = np.full(len(train), np.nan)
        errors = getattr(getattr(result[1], "energy", None), "errors", None)
        touching = np.flatnonzero(result[0].hand_energy.baseline.coordinate(train.X) > 0)
        if errors is not None and len(errors) == len(touching):
            self.values[touching] = errors

    def _learn_and_judge(self) -> tuple[float, float, bool]:
        """Learn from all solves, and keep the better of the new and the last surrogate.

        Returns the error of the last and of the new one on the same unseen solves, and whether the new one is kept.
        """
        near = self.error <= NEAR * self.stop.until
        result = self._learn(PROPER if near else QUICK)
        error, before = self._error(result), self._error(self.best)
        if not near and error <= NEAR * self.stop.until:
            proper = self._learn(PROPER)
            if (other := self._error(proper)) <= error:
                result, error = proper, other
        is_new = not error > BETTER * before
        if is_new:
            self._take(result)
        self.errors.append(error)  # its own: one lucky surrogate, kept after a miss, would count as two
        self.error = error if is_new else before
        return before, error, is_new

    def _error(self, result: tuple[Surrogate, Any] | None) -> float:
        assert result is not None
        errors = relative_errors(result[0], self.judging.data)
        return float(np.quantile(errors, 0.95)) if errors.size else math.nan

    def _step(self, phase: str, *, is_new: bool = False) -> ImprovementStep:
        train, test = self.kept.good, self.judging.good
        surrogate, history = self.best or (None, None)
        errors = relative_errors(surrogate, test) if surrogate is not None else np.empty(0)
        places = np.empty((0, 3))
        if train is not None and len(train):
            self.pressed = self._pressed(train)
            C = np.ascontiguousarray(train.X[:, :3])
            distance, normal, _ = self.pressed.surface.at(C)
            places = C - distance[:, None] * normal
        values = np.full(len(places), np.nan)
        values[: len(self.values)] = self.values
        median, p95 = np.quantile(errors, (0.5, 0.95)) if errors.size else (math.nan, math.nan)
        return ImprovementStep(
            phase,
            0 if train is None else len(train),
            0 if test is None else len(test),
            float(p95),
            float(median),
            places,
            values,
            time.monotonic() - self.began,
            surrogate,
            train,
            test,
            history,
            is_new,
        )


def _series_of(points: np.ndarray) -> list[np.ndarray]:
    """Split unseen points (U, n) into pairs that are solved in order: each is a depth series or a part of one."""
    return [points[i : i + 2] for i in range(0, len(points), 2)]
