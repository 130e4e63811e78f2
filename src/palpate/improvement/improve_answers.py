"""The next solves of numbers, fields and curves, until an error over their range is kept.

A few Sobol places begin. After each batch all answers are learnt and judged by unseen solves at random places, which
choose nothing. The error is the 95th percentile over places and unseen solves, over the range of the answer that misses
most.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.format import count
from palpate.improvement.answer_choice import CANDIDATES, choose_answers
from palpate.improvement.improvement_step import ImprovementStep
from palpate.improvement.kept_solves import KeptSolves
from palpate.improvement.stop_rule import StopRule
from palpate.learning.arrays.array_samples import FEWEST
from palpate.learning.dataset_answers import DatasetAnswers
from palpate.options import ImprovementOptions
from palpate.surrogates import Surrogate
from palpate.sweeps import Space, random, sobol
from palpate.validation.validate import validate

__all__ = ["AnswerImprovement", "unseen_places"]

_EACH = 5  # first solves for each input, and no fewer than a network can be chosen by
_SHARE = 0.15  # of the solves so far: the next batch
_TRIES = 3  # batches of Sobol places until enough first solves have answers
_SEED = 7  # added to the seed for unseen places, so that they are not those of the design


def unseen_places(problem: Any, number: int, seed: int) -> np.ndarray:
    """Return inputs (number, n) to judge by, at random."""
    return random(Space(problem.ranges), number, seed + _SEED)


@dataclass(eq=False)
class AnswerImprovement:
    """One improvement of what no hand feels, and its state."""

    problem: Any
    kept: KeptSolves
    judging: KeptSolves
    unseen: np.ndarray  # (U, n)
    stop: StopRule
    options: ImprovementOptions
    interest: Callable[[np.ndarray], np.ndarray] | None
    size: int  # solves of a batch, at least
    learner: Callable[[Any, float], tuple[Surrogate, Any]]
    log: Callable[[str], None]
    began: float
    best: tuple[Surrogate, Any] | None = None
    error: float = math.nan  # of the surrogate that is kept
    median: float = math.nan
    errors: list[float] = field(default_factory=list)  # of each surrogate that was learnt, kept or not

    def run(self, known: tuple[Surrogate, Any] | None) -> Iterator[ImprovementStep]:
        """Yield a step after each batch and each surrogate, and at the end; begin with a known surrogate."""
        if self._begin():
            yield self._step("solved")
        if len(self.judging) < len(self.unseen):
            left = self.unseen[len(self.judging) :]
            self.log(f"{count(len(left), 'unseen solve')} to judge by")
            self.judging.add([x[None] for x in left])
        self.best = known
        before, tried, _ = self._judge(self._learn() if known is None else known)
        yield replace(self._step("judged", is_new=known is None), before=before, tried=tried)
        while not (reason := self._reason()):
            groups = [x[None] for x in self._choose()]
            self.log(f"{count(len(groups), 'solve')} chosen by {self.options.rule}")
            self.kept.add(groups)
            yield self._step("solved")
            before, tried, is_new = self._judge(self._learn())
            yield replace(self._step("learnt", is_new=is_new), before=before, tried=tried)
        reached = self.stop.is_reached(self.errors, complete=True)
        yield replace(self._step("ended"), reached=reached, reason=reason)

    def _begin(self) -> bool:
        """Solve the first places, where they are not solved yet; return whether any were."""
        space, solved = Space(self.problem.ranges), len(self.kept)
        first = max(FEWEST, _EACH * len(space))
        if self.stop.most < first and len(self.kept) < first:
            raise UsageError(
                f"{count(self.stop.most, 'solve')} can't be chosen one by one.",
                why=f"The first {first} only begin.",
                fix=f"Ask for {first} solves or more, or for a sweep of a design.",
            )
        wanted = first
        for _ in range(_TRIES):
            good = 0 if self.kept.good is None else len(self.kept.good)
            if good >= FEWEST and len(self.kept) >= first:
                break
            wanted = min(wanted, self.stop.most)
            points = sobol(space, wanted, self.options.seed)[len(self.kept) :]
            self.log(f"the first {count(len(points), 'solve')}")
            if len(points):
                self.kept.add([x[None] for x in points])
            wanted += FEWEST
        if self.kept.good is None or len(self.kept.good) < FEWEST:
            raise UsageError(
                f"Of {count(len(self.kept), 'solve')} too few have answers to learn from.",
                why=f"{FEWEST} are needed.",
                fix="Look at the reasons that failed cases give, and narrow the ranges of the inputs.",
            )
        return len(self.kept) > solved

    def _reason(self) -> str:
        spent = time.monotonic() - self.began
        return self.stop.reason(
            self.errors, complete=True, solves=len(self.kept), seconds=spent, kept=self.error
        )

    def _choose(self) -> np.ndarray:
        """Return the inputs (b, n) of the next batch."""
        space, solved = Space(self.problem.ranges), len(self.kept)
        size = min(max(self.size, round(_SHARE * solved)), max(1, self.stop.most - solved))
        if self.options.rule == "sobol":  # the sequence that began, taken further
            return sobol(space, solved + size, self.options.seed)[solved:]
        assert self.kept.good is not None
        assert self.kept.data is not None
        answers = DatasetAnswers.of(self.kept.good)
        places = sobol(space, CANDIDATES, self.options.seed + 7919 * (1 + solved))
        failed = self.kept.X[~self.kept.data.converged]
        weights = None if self.interest is None else self.interest(places)
        with threadpool_limits(1):
            return choose_answers(
                *(answers.tables(), answers.X, answers.inputs, size),
                failed=failed,
                interest=weights,
                candidates=places,
            )

    def _learn(self) -> tuple[Surrogate, Any]:
        assert self.kept.good is not None
        made = self.learner(self.kept.good, 1.0)
        if made[0].can_be_touched:
            raise UsageError(
                f"The solves of {made[0].name!r} can't be chosen one by one.",
                why="It is a body that a hand feels, but not under one probe.",
                fix="Leave --until out; --samples asks for a number of solves.",
            )
        return made

    def _judge(self, made: tuple[Surrogate, Any]) -> tuple[float, float, bool]:
        """Keep the better of the new and the last surrogate; return the errors of both, and whether it is the new."""
        assert self.judging.good is not None
        judged = validate(made[0], self.judging.good)
        error, before = max(one.p95 for one in judged.answers), self.error
        self.errors.append(error)
        is_new = not error > before
        if is_new:
            self.best, self.error = made, error
            self.median = max(one.median for one in judged.answers)
        return before, error, is_new

    def _step(self, phase: str, *, is_new: bool = False) -> ImprovementStep:
        train, test = self.kept.good, self.judging.good
        surrogate, history = self.best or (None, None)
        return ImprovementStep(
            phase,
            solves=0 if train is None else len(train),
            unseen=0 if test is None else len(test),
            error=self.error,
            median=self.median,
            places=np.empty((0, 3)),
            values=np.empty(0),
            seconds=time.monotonic() - self.began,
            surrogate=surrogate,
            train=train,
            test=test,
            history=history,
            is_new=is_new,
        )
