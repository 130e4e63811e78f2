"""Helper processes: their number, their environment, and their end when this process ends."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType

__all__ = [
    "CASE_LIMIT",
    "available_cores",
    "become_supervised",
    "end_by_sigterm",
    "end_group",
    "end_with_input",
    "helper_environment",
    "interrupts",
    "is_supervised",
    "kill_group",
    "note_interrupt",
]

CASE_LIMIT = 3600.0
"""Time in s that one solve of a sweep may take, unless the caller says otherwise."""

# Processes are as many as cores: threads of linear algebra within them would only fight
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


def available_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def helper_environment(scratch: Path | None = None) -> dict[str, str]:
    """Return environment variables for a helper: it imports what this process can import, and uses one thread.

    Temporary files go to the folder `scratch`, where one is named.
    """
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    temporary = {} if scratch is None else dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(scratch))
    return {**os.environ, **_ONE_THREAD, **temporary, "PYTHONPATH": path}


def end_with_input() -> None:
    """End this process when its standard input closes, however the process that started it died; for helpers."""
    threading.Thread(target=_exit_at_end_of_input, daemon=True).start()


def _exit_at_end_of_input() -> None:
    # the descriptor itself is read: a thread inside `sys.stdin` would stall the interpreter's end
    while os.read(sys.stdin.fileno(), 1024):
        pass
    os._exit(0)


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """End a process that was started as a session of its own, and all that it started, at once."""
    with contextlib.suppress(OSError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()


def end_group() -> None:
    """End this process, the leader of its group, and all others of the group, at once."""
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


_supervised = threading.Event()


def become_supervised() -> None:
    """Note that this process is a child of `palpate.supervised`: what it does need not be put in another child."""
    _supervised.set()


def is_supervised() -> bool:
    """Return True in a process that may crash or hang without harm, for another one watches it."""
    return _supervised.is_set()


def end_by_sigterm(number: int, frame: FrameType | None) -> None:
    """End this process as SIGTERM asks, but through all clean-up; a handler for `signal.signal`."""
    sys.exit(128 + number)


_interrupts: list[int] = []


def note_interrupt(number: int, frame: FrameType | None) -> None:
    """Interrupt this process as Ctrl-C does, and remember the signal; a handler for `signal.signal`.

    A page or a loop takes the `KeyboardInterrupt` as its end in good order; the program has to know it afterwards.
    """
    _interrupts.append(number)
    raise KeyboardInterrupt


def interrupts() -> tuple[int, ...]:
    """Return the signals by which `note_interrupt` has interrupted this process."""
    return tuple(_interrupts)
