"""The lock on the hand: of several pages one holds it, the others watch.

Whoever grabs while the hand is free holds it until it lets go, leaves, or has not been heard for a second;
the others watch. While nobody holds it, the heartbeats and slider changes of every page count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.viewer.messages import Hand, Hold

__all__ = ["Command", "HandLock"]

FORGOTTEN = 1.0  # s without a word from the holder until another page may take the hand
LONGEST_PERIOD = 0.25  # s; a longer one would let a page promise itself out of the stall rule
SHORTEST_PERIOD = 0.01  # s between two messages of a hand, at least


@dataclass(frozen=True, eq=False)
class Command:
    """A command to the loop: `palpate.runtime.shared_state.COMMAND` in Python values."""

    beat: float
    target: tuple[float, float, float]
    grabbed: bool
    hidden: bool
    period: float
    parameters: np.ndarray


@dataclass(frozen=True, eq=False)
class _Heard:
    at: float
    hidden: bool
    parameters: np.ndarray


class HandLock:
    """The pages heard of, the one that holds the hand, and the `parameters` (p,) in force: the untouched inputs, SI."""

    def __init__(self, parameters: np.ndarray) -> None:
        self.parameters = parameters
        self._heard: dict[int, _Heard] = {}
        self._holder: int | None = None

    def hold(self, page: int) -> Hold:
        """Return who holds the hand, from a page's point of view."""
        if self._holder is None:
            return Hold.FREE
        return Hold.YOURS if self._holder == page else Hold.ANOTHER

    def hear(self, page: int, hand: Hand, at: float) -> Command | None:
        """Take a page's message at time `at` (s); return the command, or None where another page holds the hand."""
        before = self._heard.get(page)
        self._heard[page] = _Heard(at, hand.hidden, hand.parameters)
        if self._silent(at) or self._holder is None:
            self._holder = page if hand.grabbed and not hand.hidden else None
        if self._holder not in {page, None}:
            return None
        grabbed = self._holder == page and hand.grabbed and not hand.hidden
        self._holder = page if grabbed else None
        self._adopt(before, hand.parameters)
        return Command(
            beat=at,
            target=hand.target,
            grabbed=grabbed,
            hidden=all(h.hidden for h in self._heard.values()),
            period=min(max(hand.period, SHORTEST_PERIOD), LONGEST_PERIOD),
            parameters=self.parameters,
        )

    def leave(self, page: int) -> bool:
        """Forget a page; True where it held the hand, which is free now."""
        self._heard.pop(page, None)
        if self._holder != page:
            return False
        self._holder = None
        return True

    def _silent(self, at: float) -> bool:
        return self._holder in self._heard and at - self._heard[self._holder].at > FORGOTTEN

    def _adopt(self, before: _Heard | None, wanted: np.ndarray) -> None:
        """Parameters that a page has moved count; those it merely repeats don't undo another page's."""
        if wanted.shape != self.parameters.shape or before is None:
            return
        if not np.array_equal(wanted, before.parameters):
            self.parameters = wanted.astype(np.float64)
