"""Errors of the force that a hand feels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.learning.touch import hand_coordinates
from palpate.surrogates import TouchModel
from palpate.units import Range
from palpate.validation.limits import FAINT, FAINT_JND, FORCE_JND
from palpate.validation.region import Worst

__all__ = [
    "ForceErrors",
    "ForceSamples",
    "angles",
    "force_errors",
    "force_samples",
    "hand_positions",
    "quantile",
]


def force_jnd(size: np.ndarray) -> np.ndarray:
    """Just noticeable relative difference of forces of these sizes (N,), N."""
    return np.where(np.asarray(size) < FAINT, FAINT_JND, FORCE_JND)


@dataclass(frozen=True, eq=False)
class ForceSamples:
    """Forces on the hand or probe, asked for where each finite-element solve has it.

    Attributes
    ----------
    hand : (N, k)
        Where it is, m: the centre of a probe; or coordinates along the touched loads, the held node's displacement
        plus the stretch of the virtual coupling.
    truth, answer : (N, 3)
        Force of the finite-element solve and of the model, N.
    inside : (N,) bool
        Whether the model called the place inside its trained range.
    """

    hand: np.ndarray
    truth: np.ndarray
    answer: np.ndarray
    inside: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """‖F‖ of the finite-element solves (N,), N."""
        return np.asarray(np.linalg.norm(self.truth, axis=1))

    @property
    def error(self) -> np.ndarray:
        """‖ΔF‖ (N,), N."""
        return np.asarray(np.linalg.norm(self.answer - self.truth, axis=1))

    @property
    def light(self) -> float:
        """f₀ = min(0.5 N, 5 % of the largest ‖F‖): below it relative errors say little."""
        return float(min(0.5, 0.05 * self.size.max()))

    @property
    def heavy(self) -> np.ndarray:
        """Which touches are stronger than that (N,)."""
        return np.asarray(self.size > self.light)

    @property
    def relative(self) -> np.ndarray:
        """‖ΔF‖/‖F‖ (N,); not-a-number without force, infinite where there should be none."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.error / self.size)

    @property
    def jnd(self) -> np.ndarray:
        """The same in just noticeable differences of a force of that size."""
        return np.asarray(self.relative / force_jnd(self.size))


@dataclass(frozen=True)
class ForceErrors:
    """Errors of the force on the hand.

    Attributes
    ----------
    units : int
        Units of the force network.
    largest, light : float
        Largest ‖F‖ in the test set, and f₀ below which a touch counts as light, N.
    outside : int
        Samples that the model called outside its trained range.
    count, light_count : int
        Samples above f₀ and up to it.
    median, p95, max : float or None
        ‖ΔF‖/‖F‖ above f₀.
    median_jnd, p95_jnd, max_jnd : float or None
        The same in just noticeable differences of a force.
    light_p95 : float or None
        ‖ΔF‖/f₀ up to f₀.
    direction_p95 : float or None
        Angle between the forces in degrees above f₀; None where the hand feels one direction only.
    worst, light_worst, direction_worst : Worst or None
    """

    units: int
    largest: float
    light: float
    outside: int
    count: int
    light_count: int
    median: float | None
    p95: float | None
    max: float | None
    median_jnd: float | None
    p95_jnd: float | None
    max_jnd: float | None
    light_p95: float | None
    direction_p95: float | None
    worst: Worst | None
    light_worst: Worst | None
    direction_worst: Worst | None


def force_samples(touch: TouchModel, test: Dataset) -> ForceSamples:
    """Put the hand where each solve has it, and ask for the force."""
    touched = list(touch.touched)
    others = [i for i in range(len(test.ranges)) if i not in touch.touched]
    hand = hand_coordinates(test, touch.touch_node, touch.touched, touch.compliance)
    evaluate = touch.evaluator()
    answer, inside = np.empty((len(test), 3)), np.empty(len(test), dtype=bool)
    places = hand_positions(touch, hand)
    for i, (place, x) in enumerate(zip(places, test.X, strict=True)):
        evaluate(place, np.ascontiguousarray(x[others]))
        answer[i], inside[i] = evaluate.force, evaluate.inside
    return ForceSamples(hand, -test.X[:, touched] @ touch.directions, answer, inside)


def hand_positions(touch: TouchModel, hand: np.ndarray) -> np.ndarray:
    """Positions (N, 3) whose components along the touched loads are `hand` (N, k), m."""
    return np.ascontiguousarray(hand @ np.linalg.pinv(touch.directions).T)


def force_errors(
    samples: ForceSamples, X: np.ndarray, ranges: Sequence[Range], *, units: int, turning: bool = True
) -> ForceErrors:
    """Judge forces; see `ForceErrors`.

    Parameters
    ----------
    samples : ForceSamples
    X : (N, n)
        Inputs of the solves.
    ranges : n ranges
    units : int
        Of the network.
    turning : bool
        Whether the force can point in more than one direction.
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
    """A quantile; None of nothing."""
    return float(np.quantile(values, q)) if values.size else None


def _worst(values: np.ndarray, X: np.ndarray, ranges: Sequence[Range]) -> Worst | None:
    if not values.size:
        return None
    i = int(np.argmax(values))
    return Worst.of(values[i], X[i], ranges)


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between vectors (N, 3) in degrees, accurate near zero too (Kahan 2006)."""
    u = a / np.linalg.norm(a, axis=1, keepdims=True)
    length = np.linalg.norm(b, axis=1, keepdims=True)
    v = np.divide(b, length, out=-u, where=length > 0)  # no force at all is as wrong as the opposite one
    half = np.arctan2(np.linalg.norm(u - v, axis=1), np.linalg.norm(u + v, axis=1))
    return np.asarray(np.degrees(2 * half))
