"""The state of the work on a part in a user's words, and the time until the next surrogate can be touched."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

__all__ = ["WorkEstimate"]

_LEARNING = 20.0  # s that a first surrogate of twelve solves takes on two cores; later ones say it themselves
_NAMES = (
    "first solves",
    "finer solves",
    "more solves",
)  # before the first surrogate, before the second, after


class WorkEstimate:
    """Follows a process that solves and learns in turn: how far the present round is, in words and in seconds.

    A round is a batch of solves and what is learnt from it; it ends with a surrogate. `clock` gives the time in s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._rounds, self._words = 0, "starting"
        self._began = self._batch = self._learns_since = clock()
        self._done, self._total = 0, 0
        self._learning, self._learns = _LEARNING, False

    @property
    def words(self) -> str:
        """The part of the work that goes on now."""
        if not self._total:
            return self._words
        solves = f"{self._done} of {self._total} {_NAMES[min(self._rounds, len(_NAMES) - 1)]}"
        return f"{solves}; learning" if self._learns else solves

    @property
    def remaining(self) -> float:
        """The time until the next surrogate, s; not-a-number before the first solve of a round says its pace."""
        now = self._clock()
        if self._learns:
            return max(0.0, self._learning - (now - self._learns_since))
        if not self._done:
            return math.nan
        pace = (now - self._batch) / self._done
        return pace * (self._total - self._done) + self._learning

    @property
    def share(self) -> float:
        """The share of the present round that is over, 0 to 1."""
        elapsed, remaining = self._clock() - self._began, self.remaining
        return elapsed / max(elapsed + remaining, 1e-9) if math.isfinite(remaining) else 0.0

    def begin(self, words: str) -> None:
        """Hear that another part of the work begins; its words are shown until a solve is done."""
        self._words = words

    def count_solves(self, done: int, total: int) -> None:
        """Hear how many solves of the present batch are done."""
        if self._learns or done < self._done or total != self._total:
            self._batch = self._clock()
            self._learns = False
        self._done, self._total = done, total

    def learn(self) -> None:
        """Hear that a batch is solved, and that learning from it begins."""
        self._learns, self._learns_since = True, self._clock()

    def end_round(self) -> None:
        """Hear that a surrogate has come of it, and that the next round begins."""
        now = self._clock()
        if self._learns:
            self._learning = now - self._learns_since
        self._rounds, self._began, self._batch, self._learns = self._rounds + 1, now, now, False
        self._words = "choosing the next solves"
        self._done, self._total = 0, 0
