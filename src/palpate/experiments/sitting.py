"""The sitting of one participant as a value: which trial comes next, by the plan's seed and the answers so far.

A sitting knows no device and no file. `Sitting.next` says what to present, `Sitting.answer` takes the answer; the same
answers lead to the same trials, so that a sitting that was interrupted is brought back from its table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.experiments.course import Next
from palpate.experiments.experiment_plan import Plan

__all__ = ["Sitting", "Trial"]


@dataclass(frozen=True)
class Trial:
    """A trial to be presented.

    `kind` is practice, trial or catch; `bodies` are "reference" or the comparison's name, one for each interval;
    `value` is the ratio or the input's value at the level.
    """

    number: int  # from 1, practice included
    kind: str
    condition: str
    level: float
    value: float
    bodies: tuple[str, ...]
    absolute: bool = False  # the level is no signed difference

    @property
    def target(self) -> int:
        """Interval, from 1, of the comparison; 0 where it plays no part."""
        return next((k for k, body in enumerate(self.bodies, 1) if body != "reference"), 0)

    def stands_in(self, row: Mapping[str, Any]) -> bool:
        """Return whether a row of a table is of this trial."""
        bodies, level = row.get("intervals", ",".join(self.bodies)), float(row.get("level", self.level))
        return bodies == ",".join(self.bodies) and abs(level - self.level) <= 1e-6

    def is_correct(self, response: int) -> bool:
        """Return whether an answer, the number of an interval, is right."""
        return (response == self.target) == (self.level >= 0.0 or self.absolute)


class Sitting:
    """The course of a participant's sitting over all conditions of a plan, whose trials are mixed."""

    def __init__(self, plan: Plan, participant: str, run: int = 1) -> None:
        self.plan, self.participant, self.run = plan, participant, run
        names = [c.name for c in plan.comparison]
        self._course = plan.course()
        self._rating = plan.question == "rating"
        self._progress = {
            name: self._course.begin(1, plan.seed_of(participant, f"{run}/{name}")) for name in names
        }
        chance = plan.seed_of(participant, f"{run}/mix")
        shown = ["reference", *names] if self._rating else names
        each = plan.placement.trials if self._rating else self._course.total
        self._mix = [shown[k] for _ in range(each) for k in chance.permutation(len(shown))]
        count = plan.sitting.practice + len(self._mix)
        self._places = chance.integers(1, plan.intervals + 1, count)
        self._signs = chance.choice([-1, 1], count)
        self._done = 0
        self._pending: tuple[Trial, Next | None] | None = None

    @property
    def total(self) -> int:
        """Number of all trials, practice included."""
        return self.plan.sitting.practice + len(self._mix)

    @property
    def done(self) -> int:
        """Number of the trials that were answered."""
        return self._done

    def next(self) -> Trial | None:
        """Return the next trial, the same until it is answered; None at the end."""
        if self._done >= self.total:
            return None
        if self._pending is None:
            practice = self._done < self.plan.sitting.practice
            self._pending = self._practice() if practice else self._drawn()
        return self._pending[0]

    def _practice(self) -> tuple[Trial, None]:
        """Return an obvious trial, whose answer is told."""
        names = list(self._progress)
        levels = self._course.levels
        stiffer = self._signs[self._done] > 0 or self._course.function.form != "signed"
        level = float(levels[-1] if stiffer else levels[0])
        place = int(self._places[self._done])
        return self._trial("practice", names[self._done % len(names)], level, place), None

    def _drawn(self) -> tuple[Trial, Next | None]:
        name = self._mix[self._done - self.plan.sitting.practice]
        if self._rating:
            return self._trial("trial", name, 0.0, 1), None
        stimulus = self._course.next(self._progress[name])
        place = int(self._places[self._done])  # of the odd one out; of two intervals the course balances
        if self.plan.intervals == 2:
            place = 2 if stimulus.order[0] > 0 else 1
        kind = "catch" if stimulus.catch[0] else "trial"
        return self._trial(kind, name, float(stimulus.level[0]), place), stimulus

    def _trial(self, kind: str, name: str, level: float, place: int) -> Trial:
        bodies = tuple(name if k == place else "reference" for k in range(1, self.plan.intervals + 1))
        if self._rating:
            return Trial(self._done + 1, kind, name, 0.0, 1.0, bodies, True)
        absolute = self._course.function.form != "signed"
        return Trial(self._done + 1, kind, name, level, self.plan.value(level), bodies, absolute)

    def answer(self, response: int) -> Trial:
        """Take the answer to the pending trial, the number of an interval, and return that trial."""
        trial = self.next()
        assert trial is not None
        assert self._pending is not None
        _, stimulus = self._pending
        if stimulus is not None:
            signed = self._course.function.form == "signed"
            yes = response == trial.target if signed else trial.is_correct(response)
            self._course.answer(self._progress[trial.condition], stimulus, np.array([yes]))
        self._done, self._pending = self._done + 1, None
        return trial

    def restore(self, rows: list[dict[str, Any]]) -> None:
        """Bring back a sitting from the rows of its table; rows of other trials than are drawn again are refused."""
        for row in rows:
            trial = self.next()
            if trial is None or not trial.stands_in(row):
                raise UsageError(
                    f"The sitting of {self.participant} can't go on.",
                    why=f"Row {self.done + 1} of its table is of another trial than the plan draws: the table was "
                    "changed, or another version or processor chose its levels.",
                    fix=f"Go on where it was begun, or begin another sitting with --run {self.run + 1}.",
                )
            self.answer(int(row["response"]) if str(row["response"]).isdigit() else 0)

    @property
    def break_is_due(self) -> bool:
        """True where a break comes before the next trial."""
        counted = self._done - self.plan.sitting.practice
        return 0 < counted < len(self._mix) and counted % self.plan.sitting.break_every == 0
