"""∂F/∂x that the hand feels against that of finite elements: their own matrix, or the slope of a curve of loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.units import Range
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject
from palpate.validation.worst import Worst

__all__ = ["StiffnessErrors", "curve_slope", "matrix_errors", "stiffness_matrix"]

METHOD = (
    "the Jacobian of the force network against the slope of a cubic spline through the finite-element loads and "
    "deflections of the test set"
)
MATRIX = "the gradient of the force against that of the finite elements, in Frobenius' norm"
COARSE = 0.02
"""Largest disagreement of the slopes from all points and from every other one: a quarter of the "good" limit."""


@dataclass(frozen=True)
class StiffnessErrors(Figure):
    """‖ΔK‖/‖K‖ of the slope of the force: median, 95th percentile, where it is largest, and how it was found."""

    median: float
    p95: float
    worst: Worst
    method: str = METHOD

    @classmethod
    def of(cls, error: np.ndarray, X: np.ndarray, ranges: Sequence[Range], method: str) -> StiffnessErrors:
        """Return the figures of relative errors (N,) at inputs X (N, n)."""
        i = int(np.argmax(error))
        worst = Worst.of(error[i], X[i], ranges)
        return cls(float(np.median(error)), float(np.quantile(error, 0.95)), worst, method)

    def measured(self) -> Measured:
        """Return the value that is compared with a limit."""
        return {"stiffness_p95": (self.p95, self.worst)}


def matrix_errors(
    truth: np.ndarray, answer: np.ndarray, X: np.ndarray, ranges: Sequence[Range]
) -> StiffnessErrors | str:
    """Return the errors of ∂F/∂c (N, 3, 3), N/m, in Frobenius' norm at inputs X (N, n), or the reason why none exist.

    Rows whose truth is zero (no contact) or unknown are left out.
    """
    size = np.linalg.norm(truth, axis=(1, 2))
    rows = np.isfinite(size) & (size > 0)
    if not rows.any():
        return "Stiffness is not judged: the solves do not know theirs."
    error = np.linalg.norm(answer[rows] - truth[rows], axis=(1, 2)) / size[rows]
    return StiffnessErrors.of(error, X[rows], ranges, MATRIX)


def curve_slope(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return rows (M,) of scattered points x, y (N,) and the slope dy/dx of a curve through them there.

    Points closer than a thousandth of the range to the one before are left out, since their differences would be made
    of round-off. None if every other point alone gives another answer, so that the points are too few for the curve.
    """
    from scipy.interpolate import CubicSpline

    rows: list[int] = []
    gap = 1e-3 * float(np.ptp(x))
    for i in np.argsort(x, kind="stable"):
        if not rows or x[i] - x[rows[-1]] > gap:
            rows.append(int(i))
    if len(rows) < 9:
        return None
    kept = np.array(rows)
    slope = CubicSpline(x[kept], y[kept])(x[kept], 1)
    half = CubicSpline(x[kept[::2]], y[kept[::2]])(x[kept[::2]], 1)
    apart = np.abs(half - slope[::2]) / np.abs(slope[::2])
    return (kept, slope) if float(np.quantile(apart, 0.95)) <= COARSE else None


def stiffness_matrix(subject: Subject) -> StiffnessErrors | str | None:
    """Return the errors of ∂F/∂x, or the reason why there are none."""
    model, solves = subject.function, subject.solves
    if model is None or solves is None:
        return None
    if solves.stiffness is None:
        return "Stiffness is not judged: the solves do not know theirs."
    if model.stiffness is None:
        return "Stiffness is not judged: the model does not answer one."
    return matrix_errors(solves.stiffness, model.stiffness(solves.X), solves.X, model.inputs)
