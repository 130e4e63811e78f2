"""Does the interval hold what it says: errors of the force against the deviation that the model states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.validation.force import ForceSamples
from palpate.validation.solves import TouchFunction, TouchSolves

__all__ = ["NINE_TENTHS", "Coverage", "coverage"]

NINE_TENTHS = 1.645
"""Standard deviations that hold 90 % of a Gaussian's errors."""

FEWEST = 20
"""Touches below which a share of them says nothing: one of them would be 5 %."""


@dataclass(frozen=True)
class Coverage:
    """How many errors the 90 % interval held.

    Attributes
    ----------
    count : int
        Solves with a force.
    share : float
        Of them with ‖ΔF‖ ≤ 1.645 deviations.
    median_deviation : float
        Relative to the force.
    """

    count: int
    share: float
    median_deviation: float


def coverage(model: TouchFunction, test: TouchSolves, samples: ForceSamples) -> Coverage | str:
    """Coverage of the 90 % interval, or the reason why there is none."""
    if model.deviation is None:
        return "The 90 % interval is not judged: the model states no deviation."
    rows = test.touching
    if rows.sum() < FEWEST:
        return f"The 90 % interval is not judged: it takes {FEWEST} touches, and there are {int(rows.sum())}."
    deviation = model.deviation(test.X[rows])
    held = samples.error[rows] <= NINE_TENTHS * deviation * np.linalg.norm(samples.answer[rows], axis=1)
    return Coverage(int(rows.sum()), float(held.mean()), float(np.median(deviation)))
