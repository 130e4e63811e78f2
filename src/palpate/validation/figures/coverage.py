"""Coverage of the interval that a model states: its force errors against its own standard deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject

__all__ = ["NINE_TENTHS", "Coverage", "coverage"]

NINE_TENTHS = 1.645
"""Standard deviations that hold 90 % of a Gaussian's errors."""

FEWEST = 20
"""Touches below which a share of them says nothing: one of them would be 5 %."""


@dataclass(frozen=True)
class Coverage(Figure):
    """Share of the errors that the 90 % interval holds."""

    count: int  # solves with a force
    share: float  # of them with ‖ΔF‖ ≤ 1.645 deviations
    median_deviation: float  # median of the standard deviation, relative to the force

    def measured(self) -> Measured:
        """Return the value that is compared with a limit."""
        return {"interval_coverage": (self.share, None)}


def coverage(subject: Subject) -> Coverage | str | None:
    """Return the coverage of the 90 % interval, or the reason why there is none."""
    model, test, samples = subject.function, subject.solves, subject.samples
    if model is None or test is None or samples is None:
        return None
    if model.deviation is None:
        return "The 90 % interval is not judged: the model states no deviation."
    rows = test.touching
    if rows.sum() < FEWEST:
        return f"The 90 % interval is not judged: it takes {FEWEST} touches, and there are {int(rows.sum())}."
    deviation = model.deviation(test.X[rows])
    covered = samples.error[rows] <= NINE_TENTHS * deviation * np.linalg.norm(samples.answer[rows], axis=1)
    return Coverage(int(rows.sum()), float(covered.mean()), float(np.median(deviation)))
