"""Errors of the force that a hand feels, through the evaluator that the 1 kHz loop uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.learning.touch import hand_coordinates
from palpate.surrogates import TouchModel
from palpate.validation.limits import FORCE_JND
from palpate.validation.region import Worst

__all__ = ["ForceErrors", "ForceSamples", "force_errors", "force_samples"]


@dataclass(frozen=True, eq=False)
class ForceSamples:
    """Forces on the hand, asked for where each finite-element solve puts the hand.

    Attributes
    ----------
    hand : (N, k)
        Coordinates of the hand along the touched loads: the held node's displacement plus the stretch of the
        virtual coupling, m.
    truth, answer : (N, 3)
        Force of the finite-element solve and of the touch model, N.
    inside : (N,) bool
        Whether the model called the hand inside its trained range.
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


def force_errors(touch: TouchModel, test: Dataset, samples: ForceSamples) -> ForceErrors:
    """Judge forces; see `ForceErrors`."""
    size, error, light = samples.size, samples.error, samples.light
    heavy = size > light
    relative = error[heavy] / size[heavy]
    small = error[~heavy] / light
    angles = _angles(samples.truth[heavy], samples.answer[heavy]) if len(touch.touched) > 1 else np.empty(0)
    median, p95 = _quantile(relative, 0.5), _quantile(relative, 0.95)
    largest = _quantile(relative, 1.0)
    return ForceErrors(
        units=touch.networks["force"].units,
        largest=float(size.max()),
        light=light,
        outside=int((~samples.inside).sum()),
        count=int(heavy.sum()),
        light_count=int((~heavy).sum()),
        median=median,
        p95=p95,
        max=largest,
        median_jnd=_jnd(median),
        p95_jnd=_jnd(p95),
        max_jnd=_jnd(largest),
        light_p95=_quantile(small, 0.95),
        direction_p95=_quantile(angles, 0.95),
        worst=_worst(relative, test, heavy),
        light_worst=_worst(small, test, ~heavy),
        direction_worst=_worst(angles, test, heavy),
    )


def _jnd(relative: float | None) -> float | None:
    return None if relative is None else relative / FORCE_JND


def _quantile(values: np.ndarray, q: float) -> float | None:
    return float(np.quantile(values, q)) if values.size else None


def _worst(values: np.ndarray, test: Dataset, rows: np.ndarray) -> Worst | None:
    if not values.size:
        return None
    i = int(np.argmax(values))
    return Worst.of(values[i], test.X[rows][i], test.ranges)


def _angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between vectors (N, 3) in degrees, accurate near zero too (Kahan 2006)."""
    u = a / np.linalg.norm(a, axis=1, keepdims=True)
    length = np.linalg.norm(b, axis=1, keepdims=True)
    v = np.divide(b, length, out=-u, where=length > 0)  # no force at all is as wrong as the opposite one
    half = np.arctan2(np.linalg.norm(u - v, axis=1), np.linalg.norm(u + v, axis=1))
    return np.asarray(np.degrees(2 * half))
