"""Placement of the stimuli: which level comes next, for one person who sits there or for many simulated ones at once.

Every placement works on indices of a sorted array of levels. `start` gives the state of N people, `choose` the index of
each one's next level, `learn` takes their answers. Only the state changes, so the answers bring back an
interrupted run.

    Constant    every level equally often, in blocks of random order (method of constant stimuli)
    Staircase   up after a mistake, down after some right answers in a row; with unequal steps it is weighted
    Adaptive    the level from which the answer is expected to lower the entropy of μ and ln σ most

A staircase heads for the proportion correct p at which going up and down balance: ``step_up (1 − pⁿ) = step_down pⁿ``.
Two down, one up: 70.7 %; three down: 79.4 % (Levitt 1971); one down with steps p/(1 − p): p (Kaernbach 1991).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from palpate import checks
from palpate.experiments.psychometric import Psychometric

__all__ = ["Adaptive", "Constant", "Placement", "Staircase"]

_LAPSE = 0.03  # of the person for whom adaptive placement places
_POINTS = 33  # nodes of its grid along μ and along ln σ
_LEAST = 1e-9  # probability that is never certain
_REVERSALS = 4  # that a staircase's estimate leaves out, while it still comes down


class Placement(Protocol):
    """The contract of a placement over levels (L,)."""

    @property
    def levels(self) -> np.ndarray:
        """Levels (L,), rising."""

    def start(self, people: int, rng: np.random.Generator) -> Any:
        """Return the state of so many people before the first trial."""

    def choose(self, state: Any) -> np.ndarray:
        """Return the index (N,) of each one's next level."""

    def learn(self, state: Any, index: np.ndarray, yes: np.ndarray, correct: np.ndarray) -> None:
        """Take in the answers (N,) to the levels of these indices: what p counts, and whether they were right."""


@dataclass(frozen=True, eq=False)
class Constant:
    """A placement of every level equally often: blocks in each of which every level comes once, in random order.

    Attributes
    ----------
    levels : (L,) array
        Levels, rising.
    trials : int
        Number of trials.
    """

    levels: np.ndarray
    trials: int

    def start(self, people: int, rng: np.random.Generator) -> dict[str, Any]:
        """Draw the whole sequence."""
        blocks = -(-self.trials // len(self.levels))
        order = rng.permuted(np.tile(np.arange(len(self.levels)), (people, blocks, 1)), axis=2)
        return {"sequence": order.reshape(people, -1), "trial": np.zeros(people, int)}

    def choose(self, state: dict[str, Any]) -> np.ndarray:
        """Return the next of the sequence."""
        sequence, trial = state["sequence"], state["trial"]
        return np.asarray(sequence[np.arange(len(trial)), np.minimum(trial, sequence.shape[1] - 1)])

    def learn(self, state: dict[str, Any], index: np.ndarray, yes: np.ndarray, correct: np.ndarray) -> None:
        """Go on to the next."""
        state["trial"] = state["trial"] + 1


@dataclass(frozen=True, eq=False)
class Staircase:
    """A staircase over levels that are strengths, rising from the hardest to the easiest.

    `down` right answers in a row lead `step_down` levels down, a mistake `step_up` up. It begins at the easiest.

    Attributes
    ----------
    levels : (L,) array
        Levels, rising.
    down : int
        Right answers in a row before it goes down, from 1.
    step_up, step_down : int
        Numbers of levels of a step, from 1.
    """

    levels: np.ndarray
    down: int = 2
    step_up: int = 1
    step_down: int = 1

    def __post_init__(self) -> None:
        for what in ("down", "step_up", "step_down"):
            checks.fits(f"The staircase's {what}", getattr(self, what), least=1, whole=True)

    @property
    def target(self) -> float:
        """Proportion correct that it heads for."""
        return float((self.step_up / (self.step_up + self.step_down)) ** (1.0 / self.down))

    def start(self, people: int, rng: np.random.Generator) -> dict[str, Any]:
        """Put everyone at the easiest level."""
        top = np.full(people, len(self.levels) - 1)
        zeros = np.zeros(people)
        return {
            "index": top,
            "row": zeros.astype(int),
            "way": zeros,
            "turns": zeros,
            "sum": zeros,
            "count": zeros,
        }

    def choose(self, state: dict[str, Any]) -> np.ndarray:
        """Return where everyone stands."""
        return np.asarray(state["index"])

    def learn(self, state: dict[str, Any], index: np.ndarray, yes: np.ndarray, correct: np.ndarray) -> None:
        """Step up or down, and note the levels at which the direction turned."""
        row = np.where(correct, state["row"] + 1, 0)
        goes_down = row >= self.down
        way = np.where(~correct, 1.0, np.where(goes_down, -1.0, 0.0))
        turned = (way != 0) & (state["way"] != 0) & (way != state["way"])
        state["turns"] = state["turns"] + turned
        late = turned & (state["turns"] > _REVERSALS)
        state["sum"] = state["sum"] + np.where(late, self.levels[state["index"]], 0.0)
        state["count"] = state["count"] + late
        state["way"] = np.where(way != 0, way, state["way"])
        state["row"] = np.where(goes_down, 0, row)
        step = np.where(way > 0, self.step_up, np.where(way < 0, -self.step_down, 0))
        state["index"] = np.clip(state["index"] + step, 0, len(self.levels) - 1)

    def threshold(self, state: dict[str, Any]) -> np.ndarray:
        """Return the mean level of the reversals after the fourth (N,); not-a-number where there are none."""
        with np.errstate(invalid="ignore"):
            return np.asarray(state["sum"] / state["count"])


class Adaptive:
    """Bayesian adaptive placement (Kontsevich & Tyler 1999): the answer's expected information decides.

    `about` says on what: ``"both"`` μ and ln σ, or ``"spread"``, ln σ alone, with μ unknown too.
    """

    def __init__(self, levels: np.ndarray, function: Psychometric, about: str = "both") -> None:
        self.levels = levels
        self._spread_alone = checks.one_of("What placement is about", about, ("both", "spread")) == "spread"
        coarse = Psychometric(
            function.form,
            guess=float(np.mean(function.guess)),
            lapse=min(_LAPSE, float(np.max(function.lapse))),
            side=False,
            points=_POINTS,
        )
        mu, spread, lapse, guess, _ = coarse.axes(levels)
        m, s = (a.ravel() for a in np.meshgrid(mu, spread, indexing="ij"))
        yes = coarse.probability(levels[:, None], m, np.exp(s), lapse, guess)
        self._yes = np.clip(yes, _LEAST, 1.0 - _LEAST)  # without lapses some would be certain
        self._doubt = _entropy(self._yes)
        self._log_yes, self._log_no = np.log(self._yes), np.log1p(-self._yes)

    def start(self, people: int, rng: np.random.Generator) -> dict[str, Any]:
        """Begin with a uniform posterior."""
        return {"log": np.zeros((people, self._yes.shape[1]))}

    def choose(self, state: dict[str, Any]) -> np.ndarray:
        """Return the level whose answer says most: its entropy less what stays of it when the unknowns are known."""
        log = state["log"]
        weights = np.exp(log - log.max(axis=1, keepdims=True))
        weights /= weights.sum(axis=1, keepdims=True)
        stays = self._doubt_by_spread(weights) if self._spread_alone else weights @ self._doubt.T
        return np.asarray((_entropy(weights @ self._yes.T) - stays).argmax(axis=1))

    def _doubt_by_spread(self, weights: np.ndarray) -> np.ndarray:
        """Return the mean entropy (N, L) of the answer where σ is known, and μ as uncertain as it is then."""
        by_spread = weights.reshape(-1, _POINTS, _POINTS).transpose(2, 0, 1)  # σ, people, μ
        yes = self._yes.reshape(-1, _POINTS, _POINTS).transpose(2, 1, 0)  # σ, μ, level
        total = by_spread.sum(axis=2)
        mean = by_spread @ yes / np.maximum(total, 1e-300)[:, :, None]
        return np.asarray((total[:, :, None] * _entropy(mean)).sum(axis=0))

    def learn(self, state: dict[str, Any], index: np.ndarray, yes: np.ndarray, correct: np.ndarray) -> None:
        """Multiply the posterior by the answer's likelihood."""
        state["log"] = state["log"] + np.where(yes[:, None], self._log_yes[index], self._log_no[index])


def _entropy(p: np.ndarray) -> np.ndarray:
    p = np.clip(p, 1e-12, 1.0 - 1e-12)
    return np.asarray(-(p * np.log(p) + (1.0 - p) * np.log1p(-p)))
