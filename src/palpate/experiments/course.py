"""The course of trials of a sitting: which stimulus comes next, in which order, and where an obvious one is mixed in.

A course is drawn from a seed and moved on by the answers alone. The same seed and answers give the same course, so that
a sitting that was interrupted goes on where it was. It works on many people at once, for simulation, or on one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.experiments.placement import Placement, Staircase
from palpate.experiments.psychometric import Answers, Psychometric

__all__ = ["Course", "Next", "Progress"]


@dataclass(frozen=True, eq=False)
class Next:
    """The next stimulus of N people: its index among all levels, its level x, its order ±1, and whether it is a catch.

    All are (N,). The order is +1 where the comparison, or the signal, comes second.
    """

    index: np.ndarray
    level: np.ndarray
    order: np.ndarray
    catch: np.ndarray


@dataclass(eq=False)
class Progress:
    """The state of a course of N people after some trials."""

    placed: Any  # state of the placement
    orders: np.ndarray  # (N, T) ±1, drawn
    signs: np.ndarray  # (N, T) ±1, drawn
    catch: np.ndarray  # (N, T) bool
    pending: np.ndarray  # (N, L) order still owed to a level, 0 where none is
    index: list[np.ndarray]
    order: list[np.ndarray]
    answers: list[np.ndarray]

    @property
    def trial(self) -> int:
        """Number of the trials that were answered."""
        return len(self.answers)


@dataclass(frozen=True, eq=False)
class Course:
    """Trials of one condition: a placement, the function that is fitted, and how many trials.

    `catch` is the number of obvious trials among them, at the easiest level; they tell whether a person attends, move
    no placement and enter no fit. Each level comes as often with the comparison first as second, within one.

    Attributes
    ----------
    placement : Placement
        The rule by which levels follow one another.
    function : Psychometric
        The form that is fitted to the answers.
    trials : int
        Number of the counted trials.
    catch : int
        Number of the catch trials beside them; none by default.
    """

    placement: Placement
    function: Psychometric
    trials: int
    catch: int = 0

    @property
    def total(self) -> int:
        """Number of all trials."""
        return self.trials + self.catch

    @property
    def mirrors(self) -> bool:
        """True where a placement's levels are strengths, whose sign is drawn: a staircase of signed differences."""
        return isinstance(self.placement, Staircase) and self.function.form == "signed"

    @property
    def levels(self) -> np.ndarray:
        """All levels (L,), rising."""
        own = self.placement.levels
        return np.concatenate([-own[::-1], own]) if self.mirrors else own

    def begin(self, people: int, rng: np.random.Generator) -> Progress:
        """Draw all that chance decides of so many people."""
        shape = (people, self.total)
        orders, signs = rng.choice([-1, 1], shape), rng.choice([-1, 1], shape)
        catch = np.zeros(shape, bool)
        catch[:, : self.catch] = True
        catch = rng.permuted(catch, axis=1)
        pending = np.zeros((people, len(self.levels)), int)
        return Progress(self.placement.start(people, rng), orders, signs, catch, pending, [], [], [])

    def next(self, state: Progress) -> Next:
        """Return the next stimulus of everyone."""
        t, rows = state.trial, np.arange(len(state.catch))
        own = self.placement.choose(state.placed)
        catch, sign, count = state.catch[:, t], state.signs[:, t], len(self.placement.levels)
        if self.function.form == "signed":
            last = len(self.levels) - 1
            index = np.where(sign > 0, own + count, count - 1 - own) if self.mirrors else own
            index = np.where(catch, np.where(sign > 0, last, 0), index)
        else:
            index = np.where(catch, count - 1, own)
        owed = state.pending[rows, index]
        order = np.where(owed != 0, owed, state.orders[:, t])
        return Next(index, self.levels[index], order, catch)

    def answer(self, state: Progress, stimulus: Next, yes: np.ndarray) -> None:
        """Take the answers (N,) that p counts, and move on."""
        rows = np.arange(len(yes))
        owed = state.pending[rows, stimulus.index]
        state.pending[rows, stimulus.index] = np.where(owed != 0, 0, -stimulus.order)
        signed = self.function.form == "signed"
        correct = np.where(stimulus.level >= 0.0, yes, ~yes) if signed else yes
        own = self.placement.choose(state.placed)
        if stimulus.catch.any():
            self._learn_some(state, own, yes, correct, ~stimulus.catch)
        else:
            self.placement.learn(state.placed, own, yes, correct)
        state.index.append(stimulus.index)
        state.order.append(stimulus.order)
        state.answers.append(yes)

    def _learn_some(
        self, state: Progress, own: np.ndarray, yes: np.ndarray, correct: np.ndarray, use: np.ndarray
    ) -> None:
        """Let those people's placement learn whose trial was no catch."""
        before = {k: np.copy(v) for k, v in state.placed.items()}
        self.placement.learn(state.placed, own, yes, correct)
        for key, old in before.items():
            new = np.asarray(state.placed[key])
            mask = use.reshape(-1, *[1] * (new.ndim - 1))
            state.placed[key] = np.where(mask, new, old)

    def counts(self, state: Progress) -> Answers:
        """Return the counted answers, without the catch trials."""
        index, order = np.stack(state.index, axis=1), np.stack(state.order, axis=1)
        yes = np.stack(state.answers, axis=1)
        use = ~state.catch[:, : index.shape[1]]
        signed = self.function.form == "signed" and self.function.side
        return Answers.of_trials(self.levels, index, order if signed else 0 * order, yes, use)

    def caught(self, state: Progress) -> np.ndarray:
        """Return the share (N,) of the catch trials that were answered rightly; not-a-number without any."""
        index, yes = np.stack(state.index, axis=1), np.stack(state.answers, axis=1)
        catch = state.catch[:, : index.shape[1]]
        right = yes == (self.levels[index] > 0) if self.function.form == "signed" else yes
        with np.errstate(invalid="ignore"):
            return np.asarray((right & catch).sum(axis=1) / catch.sum(axis=1))
