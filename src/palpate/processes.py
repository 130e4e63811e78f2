"""Helper processes: their number, their environment, and their end when this process ends."""

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
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def helper_environment() -> dict[str, str]:
    """Return environment variables for a helper: it imports what this process can import, and uses one thread."""
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    return {**os.environ, **_ONE_THREAD, "PYTHONPATH": path}


def end_with_input() -> None:
    """End this process when its standard input closes, however the process that started it died; for helpers."""
    threading.Thread(target=_exit_at_end_of_input, daemon=True).start()


def _exit_at_end_of_input() -> None:
    # the descriptor itself is read: a thread inside `sys.stdin` would stall the interpreter's end
    while os.read(sys.stdin.fileno(), 1024):
        pass
    os._exit(0)
