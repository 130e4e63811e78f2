"""Memory that a call keeps."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import palpate

__all__ = ["kept_by"]

OURS = [
    tracemalloc.Filter(True, str(folder / "*"))
    for folder in (Path(palpate.__file__).parent, Path(__file__).parent)
]


def kept_by(call: Callable[[], object], times: int = 1000) -> int:
    """Bytes that so many calls have left behind, by lines of palpate or of its tests: the least of five such runs.

    Threads that other libraries keep from earlier tests allocate now and then, and are not counted; what a call keeps
    it keeps in every run.
    """
    found = []
    for _ in range(5):
        tracemalloc.start()
        try:
            for _ in range(times):
                call()
            kept = tracemalloc.take_snapshot().filter_traces(OURS)
            found.append(sum(trace.size for trace in kept.traces))
        finally:
            tracemalloc.stop()
    return min(found)
