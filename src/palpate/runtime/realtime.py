"""Everything that makes the loop punctual: its metronome, and what the system grants it.

The metronome sleeps until shortly before a tick is due and then spins. A sleeping thread wakes late by what the
scheduler makes of it (50 µs of timer slack on a default Linux, more under load); the last 200 µs are therefore spent
asking the clock. A missed tick is skipped, not made up for: two forces in a burst would be one stale force.

Where nobody touches, no tick is urgent: `Rest` says so, and the metronome then beats every 8 ms and doesn't spin, which
takes a loop from a fifth of a core to a few per cent. A hand in the air is at rest only while it is at least 10 mm, and
at its speed four such beats, from the body: the loop is back at its rate, and rehearsed, before there is a force. A
page's grab is heard 8 ms later at most, half a frame.

`obtain` asks the operating system for real-time scheduling. Nothing of it is needed for the loop to run, and nothing
fails it: on a machine that grants none of it the lateness histogram says so.
"""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import sys
import time
from collections.abc import Callable

from palpate.runtime.shared_state import now

__all__ = ["SLOW", "Metronome", "Rest", "obtain", "obtain_beside"]

SLOW = 8e-3  # s between two beats where nobody touches
_CLEAR, _BEATS = 0.010, 4.0  # m from the body, and slow beats away from it at its speed: a hand at rest
_SETTLED = 0.25  # s without a touch after which the loop rests: taps come faster


class Metronome:
    """Beats at a fixed `period`, s, on a fixed grid.

    `spin` is the last stretch before a beat that is not slept through, s. A pause of `jump`, s, between two beats
    counts as a jump of the clock: the machine slept, or the process did, and the device has held its last force for all
    that time. `lateness` is the latest beat's behind its schedule, s; `jumped` says whether the clock ran backwards, or
    paused for more than `jump`, before it.
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
        self._slow = max(period, SLOW)
        self.lateness, self.jumped = 0.0, False
        self.start()

    def start(self) -> None:
        """Lay the grid anew from this moment."""
        self._last = self._clock()
        self._due = self._last + self.period

    def wait(self, rehearse: Callable[[], None] = lambda: None, *, resting: bool = False) -> float:
        """Return at the next beat, with the time, s; `rehearse` is called once when the sleep is over.

        Where the loop is `resting`, the next beat comes after 8 ms, and neither spin nor rehearsal before it.
        """
        if resting:
            return self._rest()
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

    def _rest(self) -> float:
        """Sleep through a slow beat; the grid is laid anew behind it."""
        due, last = self._last + self._slow, self._last
        rest = due - self._clock()
        if rest > 0.0:
            self._sleep(min(rest, self._slow))
        time = self._clock()
        self.lateness = max(0.0, time - due)
        self.jumped = time < last or time - last > self._jump
        self._last, self._due = time, time + self.period
        return time

    def _next(self, time: float) -> float:
        missed = int((time - self._due) / self.period)
        return self._due + (1 + missed) * self.period


class Rest:
    """Says by `resting` when the loop may tick slowly: nobody touches, and nobody is about to."""

    def __init__(self, period: float) -> None:
        self.resting = False
        self._slow, self._free = max(period, SLOW), 0.0

    def see(self, elapsed: float, distance: float, way: float) -> None:
        """Take one tick, `elapsed` s after the one before, in which the hand went a `way`, m.

        `distance` is from the hand to the body, m; infinite where there is no hand, zero where it touches.
        """
        near = max(_CLEAR, _BEATS * self._slow * way / elapsed) if elapsed > 0.0 else math.inf
        self._free = self._free + elapsed if distance > near else 0.0
        self.resting = self._free > _SETTLED


_FIFO_PRIORITY = 40  # above ordinary work, below the kernel's own interrupt threads (50)
_PR_SET_TIMERSLACK = 29  # Linux, prctl(2)
_MCL_CURRENT = 1  # Linux and macOS, mlockall(2); MCL_FUTURE would make later allocations fail at the limit
_NICE = -10  # where there is no real-time scheduling: before ordinary work, at 0


def obtain() -> dict[str, str]:
    """Ask for real-time scheduling, exact timers and resident memory for the calling thread and process.

    It returns what was granted, in words, under ``scheduler``, ``timer slack`` and ``memory``.
    """
    return {"scheduler": _scheduler(), "timer slack": _timer_slack(), "memory": _memory()}


def obtain_beside() -> None:
    """Ask for real-time scheduling one step below the loop's for the calling thread, which shares its interpreter.

    A thread that holds the interpreter while other programs keep it from running would keep the loop from running, too.
    """
    if sys.platform == "linux" and (os.cpu_count() or 1) > 1:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_FIFO_PRIORITY - 1))


def _scheduler() -> str:
    if sys.platform == "win32":
        return _windows_class()
    if sys.platform == "linux" and (os.cpu_count() or 1) > 1:  # on one CPU the spin would starve the rest
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_FIFO_PRIORITY))
        except OSError:
            pass
        else:
            return f"SCHED_FIFO {_FIFO_PRIORITY}"
    try:
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)
    except OSError:
        return "normal"
    return f"nice {_NICE}"


def _windows_class() -> str:
    kernel = getattr(ctypes, "windll").kernel32  # noqa: B009 exists on Windows alone
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    high = 0x80  # HIGH_PRIORITY_CLASS; the real-time class needs an administrator and starves the mouse
    granted = kernel.SetPriorityClass(ctypes.c_void_p(kernel.GetCurrentProcess()), high)
    return "high priority" if granted else "normal"


def _timer_slack() -> str:
    if sys.platform != "linux":
        return "not adjustable"
    return "1 ns" if _granted("prctl", _PR_SET_TIMERSLACK, 1, 0, 0, 0) else "default"


def _memory() -> str:
    if sys.platform == "win32":
        return "pageable"
    return "locked" if _granted("mlockall", _MCL_CURRENT) else "pageable"


def _granted(call: str, *arguments: int) -> bool:
    """Return whether a C library call with unsigned long arguments exists and returned 0."""
    try:
        function = getattr(ctypes.CDLL(None), call)
    except (OSError, AttributeError):
        return False
    return int(function(*map(ctypes.c_ulong, arguments))) == 0
