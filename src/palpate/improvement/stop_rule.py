"""When to stop: a force error on unseen solves that holds twice, a limit on time, or on the number of solves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from palpate.dataset import Dataset
from palpate.format import duration, share
from palpate.options import StopOptions
from palpate.surrogates import Surrogate
from palpate.validation.unseen_solves import ForceSamples, TouchFunction, TouchSolves

__all__ = ["AnswerStopRule", "StopRule", "relative_errors"]


def relative_errors(surrogate: Surrogate, unseen: Dataset | None) -> np.ndarray:
    """Return the relative force errors (N,) of a surrogate on unseen solves that are stronger than a light touch."""
    if unseen is None or not len(unseen.ok):
        return np.empty(0)
    function = TouchFunction.of(surrogate)
    solves = TouchSolves.of(unseen, function.inputs)
    inside = np.ones(len(solves), dtype=bool)
    samples = ForceSamples(solves.X[:, :3], solves.force, function.force(solves.X), inside)
    return np.asarray(samples.relative[samples.heavy])


@dataclass(frozen=True)
class StopRule(StopOptions):
    """The rule that ends an improvement.

    A single error below the wanted one may be luck: many surrogates are judged by the same solves, and the search for
    each scatters. So the error must hold for two surrogates in a row, whether the second is kept or not, and the second
    is judged by all unseen solves.
    """

    what: ClassVar[str] = "force error"  # name of the error in sentences

    def reason(
        self,
        errors: Sequence[float],
        *,
        complete: bool,
        solves: int,
        seconds: float,
        kept: float | None = None,
    ) -> str:
        """Return why to stop, as a sentence; empty to go on.

        `errors` are those of the surrogates so far, at the 95th percentile, not-a-number where none was judged;
        `complete` says whether all unseen solves have judged the last one. `solves` are those to learn from, `seconds`
        the time since the beginning, `kept` the error of the surrogate that is kept, by default that of the last.
        """
        if self.is_reached(errors, complete=complete):
            told = errors[-1] if kept is None else kept
            return f"The {self.what} is {share(told)} on unseen solves, {share(self.until)} were asked for."
        if seconds >= self.limit:
            return f"The limit of {duration(self.limit)} is over."
        if solves >= self.most:
            return f"The limit of {self.most} solves is reached."
        return ""

    def is_reached(self, errors: Sequence[float], *, complete: bool) -> bool:
        """Return whether the last two surrogates keep the error, or the only one; see `reason`."""
        return complete and bool(errors) and all(e <= self.until for e in errors[-2:])


@dataclass(frozen=True)
class AnswerStopRule(StopRule):
    """The rule that ends an improvement of numbers, fields and curves."""

    what: ClassVar[str] = "error"
