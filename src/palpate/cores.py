"""How many processes can work at a time, and the environment of one that helps."""

from __future__ import annotations

import os
import sys

__all__ = ["available_cores", "helper_environment"]

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
