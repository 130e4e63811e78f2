"""Processes that help this one: how many are worth it, what they find around them, and how they end with it."""

from __future__ import annotations

import os
import sys
import threading

__all__ = ["available_cores", "end_with_input", "helper_environment"]

# Processes are as many as cores: threads of linear algebra within them would only fight
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


def available_cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def helper_environment() -> dict[str, str]:
    """Environment of a process that helps this one: it finds the modules that this one finds, and has one thread."""
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    return {**os.environ, **_ONE_THREAD, "PYTHONPATH": path}


def end_with_input() -> None:
    """In a helper: from now on end the process when its standard input closes, however the one that started it died."""
    threading.Thread(target=_wait_for_end, daemon=True).start()


def _wait_for_end() -> None:
    # the descriptor itself is read: a thread inside `sys.stdin` would stall the interpreter's end
    while os.read(sys.stdin.fileno(), 1024):
        pass
    os._exit(0)
