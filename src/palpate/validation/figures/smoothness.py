"""Smoothness of the force along strokes: its second differences at 1 kHz beside those of a reference.

A hand that slides at 0.1 m/s meets the force every 0.1 mm. The reference is a finite-element curve where solves along
a stroke are given (a cubic spline through them), else the model's own course at a coarser scale: a cubic spline
through its forces at every millimetre. The first judges the course, the second only what ripples finer than 1 mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.format import count as counted
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject
from palpate.validation.unseen_solves import TouchFunction, TouchSolves
from palpate.validation.worst import Worst

__all__ = ["Smoothness", "smoothness", "stroke_smoothness"]

STEP = 1e-4  # m: 0.1 m/s at 1 kHz
KNOT = 1e-3  # m: spacing of the coarser course
LEAST = 8  # knots, or finite-element solves, of a stroke, at least
STROKES = 100  # strokes that are drawn at random
FLOOR = 1e-9  # share of the stroke's largest force, below which second differences are rounding
OWN = "the model's own forces at every millimetre, joined by a cubic spline"
SOLVED = "finite-element solves along the stroke, joined by a cubic spline"


@dataclass(frozen=True)
class Smoothness(Figure):
    """Largest ‖Fᵢ₊₁ − 2 Fᵢ + Fᵢ₋₁‖ along each stroke over that of the reference."""

    strokes: int  # number of strokes
    median: float  # of the ratio over the strokes, as the next two
    p95: float
    max: float
    largest: float  # largest second difference of the model, N
    reference: str  # in words
    worst: Worst  # where the stroke with the largest ratio begins

    def measured(self) -> Measured:
        """Return the value that is compared with a limit."""
        return {"smoothness": (self.p95, self.worst)}

    def lines(self) -> list[str]:
        """Return the ratio with its reference."""
        return [
            f"second differences of the force at 0.1 m/s and 1 kHz: at most {self.p95:.2f} times the "
            f"reference's on 95 % of {counted(self.strokes, 'stroke')}; reference: {self.reference}"
        ]


def stroke_smoothness(subject: Subject) -> Smoothness | str | None:
    """Return the smoothness along the strokes that were given, or else along random ones."""
    if subject.function is None or subject.solves is None:
        return None
    return smoothness(subject.function, subject.solves, subject.strokes, seed=subject.seed)


def smoothness(
    model: TouchFunction,
    test: TouchSolves,
    strokes: Sequence[TouchSolves] = (),
    *,
    count: int = STROKES,
    seed: int = 0,
) -> Smoothness | str:
    """Return the roughness along strokes, or the reason why it is not judged.

    `strokes` are solves along strokes, in order, at least eight each: the reference where given. The `count` random
    strokes are straight lines between two touches of the test, without those that lift off on the way.
    """
    found = (
        [_roughness_of_stroke(model, stroke) for stroke in strokes]
        if strokes
        else _random(model, test, count, seed)
    )
    if not found:
        return "Smoothness is not judged: no straight line between two touches is long enough and stays in touch."
    own, other = np.array([f[:2] for f in found]).T
    ratio = own / np.maximum(other, 1e-300)
    i = int(np.argmax(ratio))
    return Smoothness(
        len(found),
        float(np.median(ratio)),
        float(np.quantile(ratio, 0.95)),
        float(ratio.max()),
        float(own.max()),
        SOLVED if strokes else OWN,
        Worst.of(ratio[i], found[i][2], model.inputs),
    )


def _random(
    model: TouchFunction, test: TouchSolves, count: int, seed: int
) -> list[tuple[float, float, np.ndarray]]:
    rng, found = np.random.default_rng(seed), []
    X = test.X[test.touching]
    for _ in range(20 * count if len(X) > 1 else 0):
        a, b = X[rng.choice(len(X), 2, replace=False)]
        length = float(np.linalg.norm((b - a)[:3]))
        knots = int(length / KNOT) + 1
        if knots < LEAST:
            continue
        direction = (b - a)[:3] / length
        at = STEP * np.arange(round((knots - 1) * KNOT / STEP) + 1)
        line = np.repeat(a[None], len(at), axis=0)
        line[:, :3] += at[:, None] * direction
        F = model.force(line)
        if not F.any(axis=1).all():
            continue
        every = round(KNOT / STEP)
        found.append((*_compared(F, at, at[::every], F[::every]), a))
        if len(found) == count:
            break
    return found


def _roughness_of_stroke(model: TouchFunction, stroke: TouchSolves) -> tuple[float, float, np.ndarray]:
    from scipy.interpolate import CubicSpline

    if len(stroke) < LEAST:
        raise UsageError(
            f"A stroke of {len(stroke)} solves has no curve to compare with.",
            fix=f"Solve at {LEAST} places along it, a millimetre or so apart, or leave it out.",
        )
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(stroke.X[:, :3], axis=0), axis=1)))
    at = STEP * np.arange(int(along[-1] / STEP * (1 + 1e-12)) + 1)
    line = np.ascontiguousarray(CubicSpline(along, stroke.X)(at))
    return (*_compared(model.force(line), at, along, stroke.force), stroke.X[0])


def _compared(F: np.ndarray, at: np.ndarray, knots: np.ndarray, at_knots: np.ndarray) -> tuple[float, float]:
    """Largest second difference of F (M, 3) and of the spline through the knots; at least what rounding makes."""
    from scipy.interpolate import CubicSpline

    floor = FLOOR * float(np.linalg.norm(F, axis=1).max())
    course = CubicSpline(knots, at_knots)(at)
    return max(_largest(F), floor), max(_largest(course), floor)


def _largest(F: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(F, 2, axis=0), axis=1).max())
