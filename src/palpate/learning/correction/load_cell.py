"""The load cell of a record: its offset and drift, and faults that its readings show.

A reading is F + b + d (t − t̄) + noise. In air F is zero, so readings there tell b and d. A record without any tells b
only by what no change of the specimen explains; height and offset then look alike, and how much is said.

Faults are looked for beside the model's own forces: a value that stands still while they move (stuck), a largest value
that is reached again and again (saturated), a component that moves against them (sign), and readings that fit forces of
some readings ago better than those of now (lag).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from palpate.dataset.measured import Measurements
from palpate.learning.correction.touches import Touches

__all__ = ["LoadCell", "cell_from_air", "cell_from_residuals", "leave_out_faults"]

_AXES = "xyz"
_AIR = 5  # readings in air that tell an offset
_DRIFTING = 12  # and a drift
_SURE = 4.0  # deviations from which an offset or a drift is believed
_FAR = 6.0  # robust deviations of a reading in air that is none
_PRIOR = 0.05  # of the largest force: an offset that may be, where no reading in air tells it
_ALIKE = 0.9  # correlation of height and offset from which they are not told apart
_STILL = 8  # equal readings in a row that are no accident
_TOP = 5  # readings at the very largest value that are none
_LATE, _BETTER = 12, 0.5  # readings of lag at most; share of the squared error that it must leave at most
_AGAINST = -0.8  # correlation of a component of the other sign


@dataclass(frozen=True, eq=False)
class LoadCell:
    """Offset and drift of a load cell, and its faults.

    Attributes
    ----------
    offset, deviation : (3,)
        b in N, what it reads without load in the middle of the record, and its standard deviation.
    drift : (3,)
        d in N/s; zero where none is seen.
    middle : float
        t̄ in s.
    readings : int
        Readings in air that told it; 0 where residuals did.
    correlation : float
        Of the offset with the height of the surface, where residuals were all to go by.
    unsure : bool
        True where residuals leave the offset as unsure as one reading is, or tie it to the height.
    faults : tuple of str
        A sentence on each fault.
    """

    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    deviation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    drift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    middle: float = 0.0
    readings: int = 0
    correlation: float = 0.0
    unsure: bool = False
    faults: tuple[str, ...] = ()

    def without_load(self, time: np.ndarray) -> np.ndarray:
        """Readings (N, 3) of no force at times (N,), s."""
        later = np.where(np.isfinite(time), time - self.middle, 0.0)
        return np.asarray(self.offset[None] + np.asarray(later)[:, None] * self.drift)

    def without_offset(self, measured: Measurements) -> Measurements:
        """Return the record without offset and drift."""
        zero = self.without_load(measured.time)
        single = (measured.along != 0.0).any(axis=1)
        along = measured.along * (zero * measured.along).sum(axis=1)[:, None]
        return replace(measured, force=measured.force - np.where(single[:, None], along, zero))

    @property
    def warning(self) -> str:
        """Text on an offset that can't be told from a height; "" where it can."""
        if self.unsure:
            worst = float(self.deviation.max())
            return (
                "Height of the surface and zero offset of the load cell are not told apart: no reading was taken in "
                f"air, and an offset of {1e3 * worst:.2g} mN looks like another height or stiffness (correlation "
                f"with the height {self.correlation:.2f}). Take {_AIR} readings or more in air, some millimetres above "
                "the surface."
            )
        return ""

    def as_dict(self) -> dict[str, Any]:
        """The figures, by name."""
        return {
            "offset": self.offset.tolist(),
            "deviation": self.deviation.tolist(),
            "drift": self.drift.tolist(),
            "readings_in_air": self.readings,
            "height_correlation": self.correlation,
            "unsure": self.unsure,
            "faults": list(self.faults),
        }

    def __str__(self) -> str:
        values = ", ".join(
            f"{1e3 * v:+.1f} ± {1e3 * s:.1f}" for v, s in zip(self.offset, self.deviation, strict=True)
        )
        source = f"{self.readings} readings in air" if self.readings else "residuals"
        drift = "" if not self.drift.any() else f", drift {1e3 * self.drift.round(6)} mN/s"
        return f"load cell {values} mN without load, by {source}{drift}"


def cell_from_air(measured: Measurements, air: np.ndarray, noise: float) -> LoadCell | None:
    """Return offset and drift by readings in air, a mask (N,); none where they are too few.

    `noise` is the least standard deviation of a component, N.
    """
    usable = air & np.isfinite(measured.force).all(axis=1)
    if usable.sum() < _AIR:
        return None
    rows, values, times = _equations(measured, usable)
    middle = float(np.nanmedian(measured.time)) if np.isfinite(measured.time).any() else 0.0
    timed = bool(np.isfinite(times).all()) and usable.sum() >= _DRIFTING and np.ptp(times) > 0
    timed = timed and np.ptp(times) > 0.3 * np.ptp(measured.time[np.isfinite(measured.time)])
    A = np.hstack([rows, rows * (times - middle)[:, None]]) if timed else rows
    z, sure, right = _least_squares(A, values, noise)
    if timed and not (np.abs(z[3:]) > _SURE * sure[3:]).any():
        z, sure, right = _least_squares(rows, values, noise)
        timed = False
    drift = np.where(np.abs(z[3:]) > _SURE * sure[3:], z[3:], 0.0) if timed else np.zeros(3)
    return LoadCell(z[:3], sure[:3], drift, middle, int(usable.sum() * right))


def cell_from_residuals(touches: Touches, theta: np.ndarray, largest: float, noise: float) -> LoadCell:
    """Return the offset that touches (of known θ) leave beside all that the specimen may be.

    Offset and θ are estimated together, about θ; what is not significant is zero. `largest` is the largest force and
    `noise` the standard deviation of a component, N.
    """
    H = touches.rows(theta).reshape(-1, len(theta))
    W = touches.whitening.reshape(-1, 3)
    r = touches.residuals(theta).ravel() + H @ theta
    J = np.hstack([H, W])
    size = _PRIOR * max(largest, 1e-6)
    prior = np.concatenate([np.ones(len(theta)), np.full(3, size**-2)])
    P = np.linalg.inv(J.T @ J + np.diag(prior))
    b, sure = (P @ (J.T @ r))[-3:], np.sqrt(np.diag(P)[-3:])
    height = len(theta) - 1
    correlation = np.abs(P[height, -3:]) / np.maximum(np.sqrt(P[height, height]) * sure, 1e-300)
    known = np.abs(W).max(axis=0) > 0  # components that were measured at all
    significant = known & (np.abs(b) > _SURE * sure) & (np.abs(b) < _SURE * size)
    unsure = known & ((sure > noise) | (correlation > _ALIKE)) & (size > noise)
    return LoadCell(
        np.where(significant, b, 0.0),
        np.where(known, sure, 0.0),
        correlation=float(correlation[known].max(initial=0.0)),
        unsure=bool(unsure.any()),
    )


def leave_out_faults(
    measured: Measurements, predicted: np.ndarray, noise: float
) -> tuple[Measurements, tuple[str, ...]]:
    """Return the record without readings that say nothing, and a sentence on each fault.

    `predicted` (N, 3) are the model's forces, and `noise` the standard deviation of a component, N.
    """
    force, faults = measured.force.copy(), []
    single = measured.along.any(axis=1)
    if single.all():
        columns = [("force", (force * measured.along).sum(axis=1), (predicted * measured.along).sum(axis=1))]
    else:
        columns = [(f"F{a}", force[:, i], predicted[:, i]) for i, a in enumerate(_AXES)]
    for name, values, model in columns:
        usable = np.isfinite(values) & np.isfinite(model)
        if usable.sum() < 2 * _STILL or np.ptp(model[usable]) < 20.0 * noise:
            continue
        stuck = _stuck(values, model, noise)
        top = _saturated(values, noise) & ~stuck
        for rows, what in ((stuck, "is stuck"), (top, "is saturated")):
            if rows.any():
                faults.append(
                    f"{name} {what} at {values[rows][0]:.4g} N in {rows.sum()} readings, which are left out."
                )
        force[stuck | top] = np.nan
        rest = ~(stuck | top) & usable
        if rest.sum() < 2 * _STILL or stuck.any():
            continue
        if np.corrcoef(values[rest], model[rest])[0, 1] < _AGAINST and len(columns) > 1:
            faults.append(f"{name} has the other sign than the model's: change it.")
        elif lag := _lag(values, model, rest):
            steps = np.diff(measured.time)
            known = steps[np.isfinite(steps) & (steps > 0)]
            late = f", about {1e3 * lag * float(np.median(known)):.3g} ms" if known.size else ""
            faults.append(
                f"{name} lags by {lag} readings{late}: align it with the positions, or press more slowly."
            )
    return replace(measured, force=force), tuple(faults)


def _equations(measured: Measurements, which: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows (K, 3), values (K,) and times (K,) of the components that were measured."""
    rows, values, times = [], [], []
    for i in np.flatnonzero(which):
        own = measured.along[i : i + 1] if measured.along[i].any() else np.eye(3)
        rows.append(own)
        values.append(own @ measured.force[i])
        times.append(np.full(len(own), measured.time[i]))
    return np.concatenate(rows), np.concatenate(values), np.concatenate(times)


def _least_squares(A: np.ndarray, y: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Solution, its deviations, and the share of equations that agree; the others are left out."""
    right = np.abs(y - np.median(y, axis=0)) < np.inf
    for _ in range(4):
        z = np.linalg.lstsq(A[right], y[right], rcond=None)[0]
        error = y - A @ z
        spread = max(1.4826 * float(np.median(np.abs(error[right]))), noise)
        right = np.abs(error) <= _FAR * spread
    P = np.linalg.pinv(A[right].T @ A[right])
    return z, spread * np.sqrt(np.diag(P)), float(right.mean())


def _stuck(values: np.ndarray, model: np.ndarray, noise: float) -> np.ndarray:
    """Mask (N,) of runs of equal readings during which the model's force moves."""
    stuck = np.zeros(len(values), bool)
    edges = np.flatnonzero(np.append(np.append(True, values[1:] != values[:-1]), True))
    for a, b in itertools.pairwise(edges):
        largest = np.nanmax(np.abs(values))
        moves = np.ptp(model[a:b]) > 20.0 * noise
        if b - a >= _STILL and moves and (abs(values[a]) < 0.999 * largest or b - a > len(values) / 2):
            stuck[a:b] = True
    return stuck


def _saturated(values: np.ndarray, noise: float) -> np.ndarray:
    """Mask (N,) of readings at the very largest size, where noise would hardly bring them again and again."""
    size = np.where(np.isfinite(values), np.abs(values), 0.0)
    top = size >= size.max() * (1.0 - 1e-9)
    return top if top.sum() >= _TOP and size.max() > 20.0 * noise else np.zeros(len(values), bool)


def _lag(values: np.ndarray, model: np.ndarray, right: np.ndarray) -> int:
    """Readings by which the values come late; 0 where no lag leaves at most half of the squared error."""

    def left(lag: int) -> float:
        past = model[_LATE - lag : len(model) - lag]
        rows, now = right[_LATE:], values[_LATE:]
        A = np.column_stack([past, np.ones(len(past))])[rows]
        z = np.linalg.lstsq(A, now[rows], rcond=None)[0]
        return float(((now[rows] - A @ z) ** 2).sum())

    if len(values) < 4 * _LATE:
        return 0
    errors = [left(k) for k in range(_LATE + 1)]
    best = int(np.argmin(errors))
    return best if best and errors[best] < _BETTER * errors[0] else 0
