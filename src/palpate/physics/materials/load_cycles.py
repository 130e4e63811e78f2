"""Loadings and unloadings in a record of a test, and the rows of the one that is fitted.

A run goes from one turn of the deformation to the next; turns are those of more than a twentieth of the range, so that
noise makes none. In a loading the deformation grows away from zero, in an unloading it falls; tension and compression
are counted apart. A fall that has hardly a row is the machine's way back between loadings, and no run.
"""

from __future__ import annotations

import itertools
import re
from typing import NamedTuple

import numpy as np

from palpate.errors import UsageError
from palpate.format import count

__all__ = ["Run", "load_runs", "rows_of_cycle", "turning_points"]

TURN = 0.05  # share of the deformation's range by which a run turns back: noise is less
LEAST_ROWS = 4  # rows of a run, with its ends
CHOICE = re.compile(r"(?P<which>first|last|\d+)(?:\s+(?P<kind>loading|unloading))?|(?P<all>all)")


class Run(NamedTuple):
    """First and last row of a run, whether it loads, and its sign: 1 in tension, -1 in compression."""

    first: int
    last: int
    loads: bool
    sign: int


def load_runs(deformation: np.ndarray) -> list[Run]:
    """Return the loadings and unloadings of a deformation (N,) that is 0 at rest, in the order of the rows.

    A record that never turns has none, nor have rows in no order of loading.
    """
    turns = turning_points(deformation, TURN * float(np.ptp(deformation)))
    if len(turns) < 3 or len(deformation) < LEAST_ROWS * (len(turns) - 1):
        return []
    runs = []
    small = TURN * np.ptp(deformation)
    for a, b in itertools.pairwise(turns):
        ends = [a, b]
        if min(abs(deformation[a]), abs(deformation[b])) > small and deformation[a] * deformation[b] < 0:
            ends = [a, a + int(np.abs(deformation[a : b + 1]).argmin()), b]  # through zero
        for i, j in itertools.pairwise(ends):
            while i < j and deformation[i + 1] == deformation[i]:  # a hold belongs to neither side
                i += 1
            if j - i + 1 >= LEAST_ROWS:
                loads = bool(abs(deformation[j]) > abs(deformation[i]))
                runs.append(Run(i, j, loads, 1 if deformation[j if loads else i] > 0 else -1))
    return runs


def rows_of_cycle(deformation: np.ndarray, choice: str | None) -> tuple[np.ndarray, str]:
    """Return the indices of the rows of a cycle, and a sentence where a record has more than one loading.

    `deformation` (N,) is a strain, λ − 1, or a depth; 0 at rest. `choice` is "first", "last", a number or "all", "2
    unloading" for the way back; by default the first loading.
    """
    match = CHOICE.fullmatch((choice or "first").strip().lower())
    if match is None:
        raise UsageError(
            f"{choice!r} is no cycle of a test.",
            fix="Give --cycle first, last, a number, or all; --cycle '2 unloading' for a way back.",
        )
    every = np.arange(len(deformation))
    runs = load_runs(deformation)
    sides = [
        [r for r in runs if (r.loads, r.sign) == (loads, sign)] for loads in (True, False) for sign in (1, -1)
    ]
    loadings, unloadings = max(map(len, sides[:2])), max(map(len, sides[2:]))
    if (
        loadings + unloadings < 2
        and match["kind"] != "unloading"
        and match["which"] in {None, "first", "last", "1"}
    ):
        return every, ""
    what = f"{count(loadings, 'loading')} and {count(unloadings, 'unloading')}"
    if match["all"]:
        return every, f"The record has {what}; all rows are fitted."
    chosen = []
    for side in sides[2:] if match["kind"] == "unloading" else sides[:2]:
        at = {"first": 0, "last": len(side) - 1}.get(match["which"])
        at = int(match["which"]) - 1 if at is None else at
        chosen += side[at : at + 1] if at >= 0 else []
    if not chosen:
        raise UsageError(
            f"The record has no cycle {choice!r}.",
            why=f"It has {what}, counted by turns of more than {TURN:.0%} of the range.",
            fix="Choose one of these, or --cycle all.",
        )
    rows = np.unique(np.concatenate([every[r.first : r.last + 1] for r in chosen]))
    name = f"the {match['kind'] or 'loading'} {match['which']}" if match["which"].isdigit() else ""
    name = name or f"the {match['which']} {match['kind'] or 'loading'}"
    return (
        rows,
        f"The record has {what}: {name} is fitted, {len(rows)} of {len(every)} rows. --cycle takes others.",
    )


def turning_points(x: np.ndarray, threshold: float) -> list[int]:
    """Return the indices of the first row, of every turn by more than a threshold, and of the last row."""
    turns, low, high, way = [0], 0, 0, 0
    for i, value in enumerate(x.tolist()):
        high = i if value > x[high] else high
        low = i if value < x[low] else low
        if way >= 0 and value < x[high] - threshold:
            turns += [high] if high > turns[-1] else []
            way, low, high = -1, i, i
        elif way <= 0 and value > x[low] + threshold:
            turns += [low] if low > turns[-1] else []
            way, low, high = 1, i, i
    return turns if turns[-1] == len(x) - 1 else [*turns, len(x) - 1]
