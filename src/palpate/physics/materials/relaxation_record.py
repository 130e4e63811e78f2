"""The hold in a record of a relaxation: where it begins, how long the rise before it took, and what force was there.

A machine's clock starts before the deformation rises. Where the rise is in the record, the hold begins where the curve
of the rise and that of the hold meet; the rise begins where its curve leaves the level before it. Where the record
starts within the hold, nobody but the user knows how long ago that began.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.format import count, number
from palpate.physics.materials.load_cycles import turning_points

__all__ = ["HeldRecord", "held_record"]

# shares of the rise between which its curve is taken, for the end of the rise and for its beginning
END_SHARES, START_SHARES = (0.3, 0.9), (0.1, 0.5)
BEFORE_RISE = 0.05  # share of the rise below which a row lies before it
HOLD_START = 0.3  # share of the rise's time over which the hold's curve is taken at its beginning
LEAST_ROWS = 4  # rows of a hold
SECOND_RISE = 0.1  # share of the response's range above which a rise is one of the deformation
RELEASE = 0.05  # share of the first response above which a fall at once ends the hold
LATEST_START = (
    20  # samples that would fit before the first one; a record that starts later has a clock of its own
)


@dataclass(frozen=True, eq=False)
class HeldRecord:
    """The rows of a hold."""

    time: np.ndarray  # (N,) from the begin of the hold, s
    response: np.ndarray  # (N,) without the preload, in the record's unit
    ramp: float  # time of the rise, s; 0 where nothing tells it
    notes: tuple[str, ...]  # what was found in the record


def held_record(
    time: np.ndarray, response: np.ndarray, begin: float | None, ramp: float | None, preload: float | None
) -> HeldRecord:
    """Return the hold of a record, with what is not given found in it.

    `time` (N,) is in s on any clock, in order, `response` (N,) a stress or force. The hold begins at `begin` s, by
    default at the end of the rise; the rise took `ramp` s and began from the response `preload`, by default those of
    the record. All three are 0 where the record has no rise.
    """
    sign = 1.0 if np.median(response) >= 0 else -1.0
    first, peak, stop = _rows_of_hold(time, sign * response, begin)
    rise = _find_ramp(time[first:stop], sign * response[first:stop], peak - first)
    if begin is None and rise is None:
        _check_clock(time)
    start = begin if begin is not None else rise[1] if rise else 0.0
    held = np.flatnonzero(time[:stop] >= start)
    if not held.size or not np.isfinite(start):
        raise UsageError(
            f"The hold begins at {start:g} s, and the record ends at {time[-1]:g} s.",
            fix="Give the begin on the clock of the record: begin= (--begin).",
        )
    length = ramp if ramp is not None else max(start - rise[0], 0.0) if rise else 0.0
    before = sign * rise[2] if rise and rise[2] is not None and not first else None
    notes = []
    if first:
        notes.append(
            "Before this hold the record has another one, which goes on relaxing beneath it: shares are those of both "
            "together. The first hold tells more."
        )
    if rise and (begin is None or ramp is None):
        words = [f"the hold begins at {number(start)} s"] if begin is None else []
        words += [f"the deformation took {number(length)} s to rise"] if ramp is None else []
        notes.append(
            f"Found in the record: {' and '.join(words)}. begin= and ramp= (--begin, --ramp) say it otherwise."
        )
    if preload is None and before:
        notes.append(
            f"Before the rise the response was {number(before)}, a preload: it is subtracted. preload=0 (--preload) "
            "keeps it."
        )
    if not rise and preload is None and begin is not None:
        notes.append(
            "The record has no rows before the rise: a preload, if there was one (preload=, --preload), stays in it."
        )
    rows = held[: _fall(time[held], sign * response[held])]
    if rows[-1] < len(time) - 1:
        what = "falls off" if len(rows) < len(held) else "rises again"
        notes.append(
            f"At {number(time[rows[-1]])} s the response {what}: the hold ends there, and "
            f"{count(len(time) - 1 - int(rows[-1]), 'row')} after it are not fitted."
        )
    level = preload if preload is not None else before or 0.0
    return HeldRecord(time[rows] - start, response[rows] - level, length, tuple(notes))


def _noise(y: np.ndarray) -> float:
    """Return about the deviation of a response, from one sample to the next."""
    return float(np.median(np.abs(np.diff(y)))) if len(y) > 1 else 0.0


def _rows_of_hold(t: np.ndarray, y: np.ndarray, begin: float | None) -> tuple[int, int, int]:
    """Return the first row of the part with the hold, the row of its largest response, and the row behind its end.

    That is the first hold of the record, or the one that begins at `begin`; it ends where the response rises again.
    """
    threshold = max(SECOND_RISE * float(np.ptp(y)), 8 * _noise(y))
    turns = turning_points(y, threshold)
    ups = [(a, b) for a, b in itertools.pairwise(turns) if y[b] - y[a] > threshold]
    if begin is None:
        starts_high = bool(ups) and y[0] - y[ups[0][0]] > threshold
        before = [] if starts_high else ups[:1]
    else:
        before = [(a, b) for a, b in ups if t[a] < begin]
    after = [a for a, b in ups if (a, b) not in before]
    stop = after[0] + 1 if after else len(y)
    first = before[-2][1] if len(before) > 1 else 0
    peak = before[-1][0] + int(y[before[-1][0] : stop].argmax()) if before else 0
    return first, peak, stop


def _fall(t: np.ndarray, y: np.ndarray) -> int:
    """Return the number of rows until the response falls off at once, as it does when the specimen is let go.

    A relaxation only becomes slower: a fall that is several times as fast as the one before it is none.
    """
    least = max(RELEASE * float(y[0]), 8 * _noise(y))
    for width in (1, 4, 16):
        i = np.arange(width, len(y) - width)
        i = i[t[i] - t[0] > 0.2 * (t[-1] - t[0])]
        if not i.size:
            continue
        fall, before = y[i] - y[i + width], y[i - width] - y[i]
        faster = fall * (t[i] - t[i - width]) > 4 * np.maximum(before, 0.0) * (t[i + width] - t[i])
        off = i[(fall > least) & faster]
        if off.size:
            return int(off[0]) + 1
    return len(y)


def _check_clock(time: np.ndarray) -> None:
    """Refuse a record that begins late after 0 for its samples, as that of a machine's clock does."""
    steps = np.diff(np.unique(time))
    count = max(1, len(steps) // 20)
    first, last = float(np.median(steps[:count])), float(np.median(steps[-count:]))
    grows = time[-1] * first / max(time[0] * last, 1e-300)  # 1 for samples even in the logarithm of the time
    if 0 <= time[0] <= LATEST_START * first or (time[0] > 0 and 1 / 3 < grows < 3):
        return
    raise UsageError(
        f"The record begins at {time[0]:g} s, with samples {first:.2g} s apart, and has no rise: when the hold began "
        "is not known.",
        why="Times count from the end of the rise. By the machine's clock each share and time would be wrong.",
        fix=f"Give the time on this clock at which the rise ended, such as begin={time[0]:.3g} (--begin "
        f'"{time[0]:.3g} s"); begin=0 (--begin "0 s") if the times count from there already.',
    )


def _find_ramp(t: np.ndarray, y: np.ndarray, peak: int) -> tuple[float, float, float | None] | None:
    """Return begin and end of the rise to a peak in s, and the level before it, None where no row tells.

    Without a rise, or without rows of a hold after it, all is None.
    """
    if not 1 <= peak <= len(y) - LEAST_ROWS:
        return None
    base = float(y[:peak].min())
    top = float(y[peak])
    bottom = int(np.flatnonzero(y[:peak] <= base + BEFORE_RISE * (top - base))[-1])
    # in a rise it would be shorter
    flat = bottom >= 2 and t[bottom] - t[0] > 3 * BEFORE_RISE * (t[peak] - t[bottom])
    base = float(np.median(y[: bottom + 1])) if flat else base
    share = (y - base) / (top - base)
    span = np.arange(bottom + 1, peak)
    low = span[(share[span] >= START_SHARES[0]) & (share[span] <= START_SHARES[1])]
    begin = float(t[bottom]) if flat else float(t[0])
    if len(low) >= 2:
        begin = _crossing(t, share, low, np.array([0.0]), (2 * t[bottom] - t[low[0]], t[low[0]]))
    middle = span[(share[span] >= END_SHARES[0]) & (share[span] <= END_SHARES[1])]
    end = float(t[peak])
    if len(middle) >= 2:
        near = np.flatnonzero((t >= t[peak]) & (t <= t[peak] + HOLD_START * (t[peak] - begin)))
        end = _crossing(t, share, middle, _curve(t, share, near), (t[middle[-1]], t[peak]))
    return begin, end, base if flat else None


def _curve(t: np.ndarray, share: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the coefficients of a parabola through rows, of a line or a constant where they are few."""
    degree = 2 if len(rows) >= 4 else min(1, len(rows) - 1)
    return np.asarray(np.polyfit(t[rows], share[rows], degree))


def _crossing(
    t: np.ndarray, share: np.ndarray, rows: np.ndarray, other: np.ndarray, ends: tuple[float, float]
) -> float:
    """Return the time between two ends at which the curve through rows meets another one; an end without one."""
    roots = np.roots(np.polysub(_curve(t, share, rows), other))
    times = [float(r.real) for r in roots if abs(r.imag) < 1e-9]
    near = float(t[rows].mean())
    return float(np.clip(min(times, key=lambda x: abs(x - near), default=ends[1]), *ends))
