"""Progress of `palpate learn`: the steps of the search for an energy, each with a guess of the time that is left."""

from __future__ import annotations

import time
from collections.abc import Callable

from palpate.cli.console import Console
from palpate.format import duration

__all__ = ["LearningSteps"]

# Time left over the time since the search began, when a step of it begins: a rough guess from searches on two cores
# with 576 solves of a beam under two loads, where judging takes about half.
_LEFT = {"random starts": 2.0, "judging": 1.3}  # kinds are over too soon to tell of the rest
_SOON = 5.0  # s: what is over sooner needs no guess


class LearningSteps:
    """Printer of the steps of a search; `clock` gives the time in s."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self._console, self._clock = console, clock
        self._began: float | None = None

    def begin(self, step: str) -> None:
        """Hear that a step begins, and print it with the time that is left, as far as it can be guessed."""
        now = self._clock()
        self._began = now if self._began is None else self._began
        left = _LEFT.get(step, 0.0) * (now - self._began)
        guess = f", about {duration(left)} left" if left >= _SOON else ""
        self._console.say(f"  {step}{guess} …")
