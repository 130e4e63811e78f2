"""Two answers to the same hand, side by side: forces along a stroke, and their difference as a hand feels it.

A difference counts in just noticeable differences (JND) of a force of that size: 7 %, and 10 % below 1 N (Jones 1989;
Pang, Tan & Durlach 1991; see `limits`). Forces below f₀ = min(0.5 N, 5 % of the largest) are judged against f₀, as
everywhere in palpate.

References
----------
L. A. Jones (1989), Matching forces: constant errors and differential thresholds, Perception 18(5), 681–687.
X. D. Pang, H. Z. Tan, N. I. Durlach (1991), Manual discrimination of force using active finger motion, Perception &
Psychophysics 49(6), 531–540.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate.devices.trace_file import Trace
from palpate.errors import UsageError
from palpate.format import plain, share
from palpate.validation.unseen_solves import ForceSamples, TouchSolves, force_jnd

__all__ = ["TouchComparison", "compare_traces", "solves_beside"]

_NEAR = 0.05  # distance in half ranges of the inputs, within which a solve lies beside a stroke
_AT_LEAST = 20  # solves beside a stroke that are shown, though none may be so near


@dataclass(frozen=True, eq=False)
class TouchComparison:
    """Forces of two answers along one stroke."""

    names: tuple[str, str]  # of the reference and of the other
    time: np.ndarray  # (N,), s, since the stroke began
    depth: np.ndarray  # (N,), m; of the probe in the surface at rest, or how far what is held was displaced
    reference: np.ndarray  # (N, 3), force on the hand, N
    other: np.ndarray  # (N, 3), N
    note: str = ""  # what must be known of the comparison

    @cached_property
    def samples(self) -> ForceSamples:
        """Both forces as samples, of which the reference is the truth."""
        count = len(self.time)
        return ForceSamples(np.zeros((count, 3)), self.reference, self.other, np.ones(count, dtype=bool))

    @property
    def error(self) -> np.ndarray:
        """‖ΔF‖ (N,), N."""
        return self.samples.error

    @cached_property
    def jnd(self) -> np.ndarray:
        """‖ΔF‖ (N,) in just noticeable differences."""
        samples = self.samples
        size = np.maximum(samples.size, samples.light)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.nan_to_num(samples.error / (size * force_jnd(size)), nan=0.0))

    @property
    def felt(self) -> np.ndarray:
        """Mask (N,) of the moments at which either force is more than zero."""
        return np.asarray(self.reference.any(axis=1) | self.other.any(axis=1))

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as data for a program."""
        jnd, error = self.jnd[self.felt], self.error
        worst = int(np.argmax(self.jnd)) if len(self.jnd) else 0
        some = bool(jnd.size)
        return {
            "reference": self.names[0],
            "other": self.names[1],
            "moments": len(self.time),
            "felt": int(jnd.size),
            "largest_force": float(self.samples.size.max(initial=0.0)),
            "largest_difference": float(error.max(initial=0.0)),
            "jnd_median": float(np.median(jnd)) if some else None,
            "jnd_p95": float(np.quantile(jnd, 0.95)) if some else None,
            "jnd_max": float(jnd.max()) if some else None,
            "worst_time": float(self.time[worst]) if some else None,
            "noticeable": float(np.mean(jnd > 1.0)) if some else 0.0,
        }

    def verdict(self) -> str:
        """Return in one line how much of the touch a person notices, and the largest difference in newtons."""
        values = self.as_dict()
        head = f"{self.names[1]} beside {self.names[0]}"
        if not values["felt"]:
            return f"{head}: neither is felt"
        noticed, largest = share(values["noticeable"]), plain(values["largest_difference"], 3)
        return f"{head}: a person notices {noticed} of the touch; the largest difference is {largest} N"

    def __str__(self) -> str:
        values = self.as_dict()
        head = f"{self.names[1]} beside {self.names[0]}, {len(self.time)} moments"
        if not values["felt"]:
            return f"{head}: neither is felt"
        lines = [
            head,
            f"  largest force       {plain(values['largest_force'], 3)} N",
            f"  largest difference  {plain(values['largest_difference'], 3)} N",
            f"  in JND              {plain(values['jnd_median'])} median, {plain(values['jnd_p95'])} for 95 of 100, "
            f"{plain(values['jnd_max'])} at most, at {values['worst_time']:.3f} s",
            f"  a person notices    {share(values['noticeable'])} of the touch (1 JND = 7 %, 10 % below 1 N)",
        ]
        return "\n".join(lines + ([f"  {self.note}"] if self.note else []))


def compare_traces(reference: Trace, other: Trace) -> TouchComparison:
    """Compare two traces moment by moment, both since their first ticks, at the times of the reference.

    The other's forces are taken in straight lines between its ticks.
    """
    for trace in (reference, other):
        if len(trace) < 2:
            raise UsageError(f"{trace.path.name} holds no stroke.", fix="Record a longer touch.")
    shared = reference.time <= other.time[-1]
    time = reference.time[shared]
    force = np.stack([np.interp(time, other.time, other.ticks["force"][:, k]) for k in range(3)], axis=1)
    apart = np.stack([np.interp(time, other.time, other.ticks["contact"][:, k]) for k in range(3)], axis=1)
    apart = np.linalg.norm(apart - reference.ticks["contact"][shared], axis=1)
    note = (
        f"the two hands are up to {1e3 * apart.max():.3g} mm apart" if apart.max(initial=0.0) > 1e-6 else ""
    )
    return TouchComparison(
        (reference.path.name, other.path.name),
        time,
        reference.ticks["depth"][shared].astype(float),
        reference.ticks["force"][shared],
        force,
        note,
    )


def solves_beside(
    trace: Trace, solves: TouchSolves, half: np.ndarray, most: int = 200
) -> tuple[np.ndarray, float]:
    """Return rows (k,) of the solves beside a stroke, the nearest first, and the distance of the last, in half ranges.

    `half` (n,) are the half ranges of the inputs, by which distances count; at most `most` rows are returned.
    """
    held = trace.flag("grabbed") & (trace.ticks["fault"] == 0)
    places = np.hstack([trace.ticks["contact"], trace.parameters])[held]
    if not len(places):
        return np.zeros(0, dtype=int), 0.0
    places = places[:: max(1, len(places) // 2000)] / half
    distance = np.array([np.linalg.norm(places - row, axis=1).min() for row in solves.X / half])
    order = np.argsort(distance, kind="stable")
    near = order[distance[order] <= _NEAR][:most]
    rows = near if len(near) >= _AT_LEAST else order[: min(_AT_LEAST, most)]
    return rows, float(distance[rows[-1]])
