"""Errors of the force that a hand feels, and of the energy that it gave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.units import Range
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject
from palpate.validation.unseen_solves import ForceSamples
from palpate.validation.worst import Worst

__all__ = [
    "EnergyErrors",
    "ForceErrors",
    "ForceSamples",
    "angles",
    "energy_errors",
    "energy_of_touches",
    "force_errors",
    "force_on_hand",
    "quantile",
]


@dataclass(frozen=True)
class ForceErrors(Figure):
    """Errors of the force on the hand; a touch up to f₀ counts as light."""

    units: int  # units of the force network
    largest: float  # largest ‖F‖ in the test set, N
    light: float  # f₀, N
    outside: int  # samples that the model called outside its trained range
    count: int  # samples above f₀
    light_count: int  # samples up to f₀
    median: float | None  # ‖ΔF‖/‖F‖ above f₀, as the next two
    p95: float | None
    max: float | None
    median_jnd: float | None  # in just noticeable differences of a force, as the next two
    p95_jnd: float | None
    max_jnd: float | None
    light_p95: float | None  # ‖ΔF‖/f₀ up to f₀
    direction_p95: float | None  # angle of the forces above f₀, degrees; None if all have one direction
    worst: Worst | None  # solve with the largest error above f₀
    light_worst: Worst | None  # solve with the largest error up to f₀
    direction_worst: Worst | None  # solve with the largest error in direction

    def measured(self) -> Measured:
        """Return the values that are compared with limits."""
        return {
            "force_median": (self.median, self.worst),
            "force_p95": (self.p95, self.worst),
            "light_force_p95": (self.light_p95, self.light_worst),
            "direction_p95": (self.direction_p95, self.direction_worst),
        }


def force_errors(
    samples: ForceSamples, X: np.ndarray, ranges: Sequence[Range], *, units: int, turning: bool = True
) -> ForceErrors:
    """Return the errors of forces of solves at inputs X (N, n), by a network of so many units.

    `turning` says whether the force can point in more than one direction.
    """
    heavy = samples.heavy
    relative, jnd = samples.relative[heavy], samples.jnd[heavy]
    small = samples.error[~heavy] / samples.light if samples.light > 0 else samples.error[~heavy]
    turned = angles(samples.truth[heavy], samples.answer[heavy]) if turning else np.empty(0)
    return ForceErrors(
        units=units,
        largest=float(samples.size.max()),
        light=samples.light,
        outside=int((~samples.inside).sum()),
        count=int(heavy.sum()),
        light_count=int((~heavy).sum()),
        median=quantile(relative, 0.5),
        p95=quantile(relative, 0.95),
        max=quantile(relative, 1.0),
        median_jnd=quantile(jnd, 0.5),
        p95_jnd=quantile(jnd, 0.95),
        max_jnd=quantile(jnd, 1.0),
        light_p95=quantile(small, 0.95),
        direction_p95=quantile(turned, 0.95),
        worst=_worst(relative, X[heavy], ranges),
        light_worst=_worst(small, X[~heavy], ranges),
        direction_worst=_worst(turned, X[heavy], ranges),
    )


def quantile(values: np.ndarray, q: float) -> float | None:
    """Return a quantile; None of no values."""
    return float(np.quantile(values, q)) if values.size else None


def _worst(values: np.ndarray, X: np.ndarray, ranges: Sequence[Range]) -> Worst | None:
    if not values.size:
        return None
    i = int(np.argmax(values))
    return Worst.of(values[i], X[i], ranges)


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the angles between vectors (N, 3) in degrees, accurate near zero too (Kahan 2006)."""
    u = a / np.linalg.norm(a, axis=1, keepdims=True)
    length = np.linalg.norm(b, axis=1, keepdims=True)
    v = np.divide(b, length, out=-u, where=length > 0)  # no force at all is as wrong as the opposite one
    half = np.arctan2(np.linalg.norm(u - v, axis=1), np.linalg.norm(u + v, axis=1))
    return np.asarray(np.degrees(2 * half))


@dataclass(frozen=True)
class EnergyErrors(Figure):
    """Relative errors |ΔU|/U of the energy of the touches: median and 95th percentile."""

    median: float
    p95: float


def energy_errors(truth: np.ndarray, answer: np.ndarray) -> EnergyErrors | None:
    """Return the errors of energies (N,), J, where there is one; None where there is none."""
    rows = truth > 0
    if not rows.any():
        return None
    error = np.abs(answer[rows] - truth[rows]) / truth[rows]
    return EnergyErrors(float(np.median(error)), float(np.quantile(error, 0.95)))


def force_on_hand(subject: Subject) -> ForceErrors | None:
    """Return the errors of the force, where the model answers one at each solve."""
    if subject.samples is None:
        return None
    return force_errors(
        subject.samples, subject.X, subject.ranges, units=subject.units, turning=subject.turning
    )


def energy_of_touches(subject: Subject) -> EnergyErrors | None:
    """Return the errors of the energy, where the model and the solves know it."""
    model, solves = subject.function, subject.solves
    if model is None or solves is None or model.energy is None or solves.energy is None:
        return None
    return energy_errors(solves.energy, model.energy(solves.X))
