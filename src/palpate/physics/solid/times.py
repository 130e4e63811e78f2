"""The steps of a march in time, from what its caller gives."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["durations"]

EXAMPLE = "For example march(times=[0.1, 0.2], inputs=[[0.05, 0.05, 0.058], [0.05, 0.05, 0.056]])."


def durations(times: Any, rows: int) -> list[float]:
    """Lengths of the steps in s that end at these times, the first from time 0.

    Parameters
    ----------
    times : (m,) array
        In s.
    rows : int
        How many rows of inputs there are.

    Raises
    ------
    UsageError
        If they are no numbers, not as many as the rows, or don't ascend from above 0.
    """
    try:
        given = np.atleast_1d(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        given = np.empty((0, 0))
    if given.ndim != 1:
        raise UsageError(f"The times are {times!r}.", why="They are a list of numbers in s.", fix=EXAMPLE)
    if len(given) != rows:
        raise UsageError(
            f"There are {len(given)} times and {rows} rows of inputs.",
            why="At each time the body has its own inputs: one row for each time.",
            fix=EXAMPLE,
        )
    steps = np.diff(given, prepend=0.0)
    wrong = np.flatnonzero(~((steps > 0) & np.isfinite(given)))
    if wrong.size:
        i = int(wrong[0])
        before = f"after the time {given[i - 1]:g} s" if i else "first"
        raise UsageError(
            f"The time {given[i]:g} s comes {before}.",
            why="Times are counted from 0, where the body rests, and each is later than the one before.",
            fix=f"Leave 0 out, and let the times ascend. {EXAMPLE}",
        )
    return [float(step) for step in steps]
