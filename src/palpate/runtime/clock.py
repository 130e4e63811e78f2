"""When the next tick is due: sleep until shortly before, then spin.

A sleeping thread wakes late by what the scheduler makes of it (50 µs of timer slack on a default Linux, more
under load); the last 200 µs are therefore spent asking the clock. A missed tick is skipped, not made up for:
two forces in a burst would be one stale force.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from palpate.runtime.shared import now

__all__ = ["Metronome"]


class Metronome:
    """Beats at a fixed period on a fixed grid.

    Parameters
    ----------
    period : float
        s.
    spin : float
        The last stretch before a beat that is not slept through, s.
    jump : float
        A pause between two beats from which on the clock counts as having jumped, s: the machine slept, or
        the process did. The device has held its last force for all that time.

    Attributes
    ----------
    lateness : float
        The latest beat behind its schedule, s.
    jumped : bool
        Whether the clock ran backwards, or paused for more than `jump`, before the latest beat.
    """

    def __init__(
        self,
        period: float,
        *,
        spin: float = 200e-6,
        jump: float = 0.05,
        clock: Callable[[], float] = now,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.period, self._spin, self._jump = period, spin, jump
        self._clock, self._sleep = clock, sleep
        self.lateness, self.jumped = 0.0, False
        self.start()

    def start(self) -> None:
        """Lay the grid anew from this moment."""
        self._last = self._clock()
        self._due = self._last + self.period

    def wait(self, rehearse: Callable[[], None] = lambda: None) -> float:
        """Return at the next beat, with the time, s; `rehearse` is called once when the sleep is over."""
        clock, due, last = self._clock, self._due, self._last
        rest = due - clock() - self._spin
        if rest > 0.0:
            self._sleep(min(rest, self.period))  # a clock that ran backwards must not put the loop to sleep
            rehearse()
        while last <= (time := clock()) < due:
            pass
        self.lateness = max(0.0, time - due)
        self.jumped = time < last or time - last > self._jump
        self._last = time
        self._due = time + self.period if self.jumped else self._next(time)
        return time

    def _next(self, time: float) -> float:
        missed = int((time - self._due) / self.period)
        return self._due + (1 + missed) * self.period
