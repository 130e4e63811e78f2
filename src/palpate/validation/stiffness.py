"""∂F/∂x that the hand feels against the slope of the finite-element load–deflection curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import TouchModel
from palpate.validation.region import Worst

__all__ = ["StiffnessErrors", "curve_slope", "stiffness_errors"]

METHOD = (
    "the Jacobian of the force network against the slope of a cubic spline through the finite-element loads and "
    "deflections of the test set"
)
COARSE = 0.02
"""Largest disagreement of the slopes from all points and from every other one: a quarter of the "good" limit."""


@dataclass(frozen=True)
class StiffnessErrors:
    """|ΔK|/K of the slope of the force: median, 95th percentile, where it is largest, and how it was found."""

    median: float
    p95: float
    worst: Worst
    method: str = METHOD


def stiffness_errors(touch: TouchModel, test: Dataset, hand: np.ndarray) -> StiffnessErrors | str:
    """Errors of the stiffness, or the reason why none can be derived.

    Parameters
    ----------
    touch : TouchModel
    test : Dataset
    hand : (N, k)
        Coordinates of the hand; see `palpate.validation.force.ForceSamples`.
    """
    if len(test.ranges) > 1:
        return (
            "Stiffness is not judged: solves scattered over several loads have no curve to take a slope of."
        )
    found = curve_slope(test.X[:, 0], hand[:, 0])
    if found is None:
        return "Stiffness is not judged: the test loads lie too far apart to take a slope from."
    rows, slope = found
    truth = 1.0 / slope
    force = touch.networks["force"]
    answer = np.array([force.jacobian(hand[i])[0, 0] for i in rows])
    error = np.abs(answer - truth) / np.abs(truth)
    i = int(np.argmax(error))
    worst = Worst.of(error[i], test.X[rows[i]], test.ranges)
    return StiffnessErrors(float(np.median(error)), float(np.quantile(error, 0.95)), worst)


def curve_slope(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Slope dy/dx of a curve through scattered points.

    Parameters
    ----------
    x, y : (N,)
        In any order; points closer than a thousandth of the range to the one before are left out, since their
        differences would be made of round-off.

    Returns
    -------
    rows (M,), slope (M,)
        Indices of the points kept, and the slope there; None if every other point alone gives another answer,
        so that the points are too few for the curve.
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
