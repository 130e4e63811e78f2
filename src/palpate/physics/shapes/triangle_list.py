"""Triangles of a surface as a text that a file can hold: "0-17 25 40-80 of 5120"."""

from __future__ import annotations

import re

import numpy as np

from palpate.errors import UsageError

__all__ = ["read_triangles", "triangle_text"]

_FORM = re.compile(r"\s*((?:\d+(?:-\d+)?\s+)+)of\s+(\d+)\s*")


def triangle_text(indices: np.ndarray, count: int) -> str:
    """Return triangles as a text.

    `indices` (k,) count from 0, in any order; `count` is the number of all triangles of the surface.
    """
    chosen = np.unique(indices)
    ends = np.split(chosen, np.flatnonzero(np.diff(chosen) > 1) + 1)
    runs = [f"{run[0]}" if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in ends if len(run)]
    return " ".join([*runs, f"of {count}"])


def read_triangles(text: str) -> tuple[np.ndarray, int]:
    """Return triangles (k,), and the number of all triangles of the surface, from a text."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise _no_list(text, "Its form is runs of numbers from 0 on, and the number of all triangles.")
    count, chosen = int(match.group(2)), list[np.ndarray]()
    for run in match.group(1).split():
        first, _, last = run.partition("-")
        if not int(first) <= int(last or first) < count:
            raise _no_list(text, f"The run {run} is not within 0 … {count - 1}.")
        chosen.append(np.arange(int(first), int(last or first) + 1))
    return np.unique(np.concatenate(chosen)), count


def _no_list(text: str, why: str) -> UsageError:
    shown = text if len(text) < 60 else f"{text[:57]}…"
    return UsageError(
        f"{shown!r} is no list of triangles.", why=why, fix='Write for example "0-17 25 40-80 of 5120".'
    )
