"""A search, and the judging of what it found, as one piece of work that a process can be given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from palpate.learning.energy.average import Average
from palpate.learning.energy.judging import judged
from palpate.learning.energy.search import EnergyTrial, Problem, Search
from palpate.learning.energy.strategy import SEARCH_SHARE, searched
from palpate.network.radial import RadialFunction
from palpate.rbf.refinement.refine import Refined

__all__ = ["Answer", "Task"]

_KEPT = 8  # networks that are told: a mean is of four


@dataclass(frozen=True, eq=False)
class Answer:
    """What a process that was given a task found.

    Attributes
    ----------
    trials : list of EnergyTrial
    networks : list of (Refined, (R, 1) array, (R, 1) array)
        The best ones, each with what it misses of every row: refined again without it, and by the closed form.
    """

    trials: list[EnergyTrial]
    networks: list[tuple[Refined, np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Task:
    """A search, and the time that it may take.

    Attributes
    ----------
    problem : Problem
    begun, seconds : float
        When, of `time.monotonic`, and how long, s.
    form, radial, units_max, target, seed
        As in `palpate.learning.energy.learn_surrogate`.
    """

    problem: Problem
    begun: float
    seconds: float
    form: str
    radial: RadialFunction | Literal["auto"]
    units_max: int
    target: float
    seed: int

    def done(self) -> tuple[Search, list[Average]]:
        """The search when it has ended, and its networks judged."""
        until = self.begun + SEARCH_SHARE * self.seconds
        search = searched(self.problem, until, self.form, self.radial, self.units_max, self.target, self.seed)
        return search, judged(search, self.begun + self.seconds)

    def answer(self) -> Answer:
        """What is told to another process, without the large matrices that it can make itself."""
        search, found = self.done()
        best = sorted(found, key=lambda one: one.error)[:_KEPT]
        return Answer(search.trials, [(o.members[0], o.left_out.errors, o.closed.errors) for o in best])

    def with_other_starts(self, number: int) -> Task:
        """The same search by process `number`, from 1."""
        return replace(self, seed=int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0]))
