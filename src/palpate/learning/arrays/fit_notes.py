"""Notes on a fit that its user must have: nothing learnt, a wild sample, an output passed over, idle inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.format import by_number, duration, share

if TYPE_CHECKING:
    from palpate.learning.arrays.array_samples import ArrayProblem, Samples
    from palpate.learning.arrays.fitted import Fitted

__all__ = ["IDLE", "notes_on", "outlook", "wild_note", "wild_rows"]

# of the outputs' standard deviation: a network that misses so much says no more than their mean
_NO_BETTER = 0.95
_WILD = 12.0  # robust standard deviations: once in 10³² samples of a normal law
_GROSS = 0.5  # of the outputs' spread: what misses less is a corner that is hard to learn
_MOST_WILD = 0.02  # of the samples: where more are far off, their law has long tails
_FEWEST_ERRORS = 50  # among fewer a corner that is hard to learn looks wild
_SMALL_OUTPUT = (
    1e-3  # of the largest output's spread: learnt to the large ones' scale it is as good as not learnt
)
_IRRELEVANT = 0.02  # of the largest scale of an input
_LISTED = 5  # outputs that a note names
_EXACT = 1e-4  # of the outputs' spread: nobody waits for less
_NOISY = 0.8  # of the error that is noise, from which the rest is not worth the time
# time at effort 1 over that at the default: five times for some hundred rows, twelve for a thousand
_FULL, _ROWS = (5.0, 12.0), 80.0
IDLE = "Inputs that hardly matter:"  # not worth a warning


def notes_on(
    samples: Samples,
    problem: ArrayProblem,
    fitted: Fitted,
    missed: np.ndarray,
    rows: np.ndarray,
    scales: np.ndarray,
) -> tuple[str, ...]:
    """Return what a user must be told, a sentence or two each, of what was learnt.

    `missed` (J, m) are errors at unseen samples in scaled outputs, `rows` (J,) which samples these are, and `scales`
    (n,) by how much each scaled input matters, as the likelihood of a kernel says.
    """
    notes = []
    if fitted.heldout > _NO_BETTER:
        notes.append(
            f"The network predicts no better than the outputs' mean: its held-out error is {share(fitted.heldout)} of "
            "their spread. The inputs may not decide the outputs, or too few samples show how."
        )
    own = np.arange(len(samples.X)) if samples.rows is None else np.array(samples.rows)
    wild = np.sort(own[rows[wild_rows(missed)]]).tolist()
    if wild:
        notes.append(wild_note(wild, problem.record["training"]["samples"], samples.lines))
    notes += _passed_over(samples, problem)
    if len(scales) > 1 and fitted.units and scales.max() > 0:
        idle = [r.name for r, s in zip(samples.inputs, scales, strict=True) if s < _IRRELEVANT * scales.max()]
        if idle:
            notes.append(f"{IDLE} {', '.join(idle)}.")
    return tuple(notes)


def outlook(rows: int, fitted: Fitted, effort: float, *, noise: float, few: bool, enough: float) -> str:
    """Return what more time, or more rows, may bring, in a sentence.

    No time takes away the noise of the rows, which is relative to the outputs' spread as the errors are. `enough` is
    the error that was asked for, `few` says that every row was left out in turn.
    """
    if fitted.heldout <= max(enough, _EXACT):
        return ""
    if few:
        return (
            f"Only {rows} rows: each was left out in turn to judge by, and the error itself is uncertain by a factor "
            f"of about {1.0 + 2.0 / np.sqrt(2.0 * rows):.1f}. More rows would help; more time hardly does."
        )
    least = min(noise, fitted.heldout)
    if noise > _NOISY * fitted.heldout:
        return f"More time would bring little: the rows themselves seem to scatter by {share(least)}."
    if effort >= 1.0:
        return ""
    factor = float(np.clip(rows / _ROWS, *_FULL))
    took = duration(float(f"{max(factor * fitted.seconds, 1.0):.1g}"))
    return (
        f"More time (effort=1, about {took}) may bring less; not below {share(least)}, by which the rows themselves "
        "seem to scatter."
    )


def wild_note(rows: Sequence[int], count: int, lines: Sequence[int] | None = None) -> str:
    """Return the note on wild rows of `count` samples, by the lines of their table or by their rows."""
    verb, them = ("is", "it") if len(rows) == 1 else ("are", "them")
    where = f"{by_number('row', rows)}, counted from 0"
    if lines is not None:
        where = by_number("line", [lines[row] for row in rows])
    return (
        f"{len(rows)} of {count} samples {verb} far from what the others say: {where}. A wrong number there spoils "
        f"the network and widens its intervals: check {them}, or leave {them} out."
    )


def wild_rows(missed: np.ndarray) -> np.ndarray:
    """Return which rows of errors (J, m) at unseen samples are wild beside all others."""
    if len(missed) < _FEWEST_ERRORS:
        return np.zeros(0, dtype=int)
    size = np.abs(missed)
    typical = np.median(size, axis=0) / 0.6745
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.where((typical > 0) & (size > _GROSS), size / typical, 0.0).max(axis=1)
    rows = np.flatnonzero(off > _WILD)
    return rows if len(rows) <= max(1, _MOST_WILD * len(missed)) else np.zeros(0, dtype=int)


def _passed_over(samples: Samples, problem: ArrayProblem) -> list[str]:
    """Return a sentence for outputs that are small beside the scale to which they are learnt."""
    spread = samples.Y.std(axis=0) / problem.scaling.output_scale
    varied = np.ptp(samples.Y, axis=0) > 1e-12 * np.abs(samples.Y).max(axis=0)  # not by round-off alone
    small = [
        q.name
        for q, few in zip(samples.outputs, varied & (spread < _SMALL_OUTPUT * spread.max()), strict=True)
        if few
    ]
    if not small or len(small) > len(spread) / 2:
        return []
    return [
        f"Outputs small beside the others are as good as not learnt: {', '.join(small[:_LISTED])}. Outputs of other "
        "units are learnt to a scale of their own: declare them, outputs=[palpate.Quantity(name, unit), …]."
    ]
