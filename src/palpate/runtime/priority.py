"""What the loop asks of the operating system so that it wakes in time, and what it was given.

Nothing here is needed for the loop to run, and nothing fails it: on a machine that grants none of it the
lateness histogram says so.
"""

from __future__ import annotations

import ctypes
import os
import sys

__all__ = ["obtain"]

_FIFO_PRIORITY = 40  # above ordinary work, below the kernel's own interrupt threads (50)
_PR_SET_TIMERSLACK = 29  # Linux, prctl(2)
_MCL_CURRENT = 1  # Linux and macOS, mlockall(2); MCL_FUTURE would make later allocations fail at the limit
_NICE = -10


def obtain() -> dict[str, str]:
    """Ask for real-time scheduling, exact timers and resident memory for the calling thread and process.

    Returns
    -------
    dict of str
        Under ``scheduler``, ``timer slack`` and ``memory`` what was granted, in words.
    """
    return {"scheduler": _scheduler(), "timer slack": _timer_slack(), "memory": _memory()}


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
    """Whether a C library call with unsigned long arguments exists and returned 0."""
    try:
        function = getattr(ctypes.CDLL(None), call)
    except (OSError, AttributeError):
        return False
    return int(function(*map(ctypes.c_ulong, arguments))) == 0
