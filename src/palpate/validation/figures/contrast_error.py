"""Error of what a hidden lump changes: the learnt change of force against the solved one, over the solved one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.format import share
from palpate.learning.lumps import LumpPresses
from palpate.learning.lumps.learn_lumps import FEWEST, change_errors
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject

__all__ = ["ContrastError", "contrast_error"]


@dataclass(frozen=True)
class ContrastError(Figure):
    """Errors of the change of force over the change, of presses where that is above 1 % of the force."""

    count: int  # presses solved with a lump whose change of force counts
    median: float
    p95: float

    def measured(self) -> Measured:
        """Return the value that is compared with a limit."""
        return {"contrast_p95": (self.p95, None)}

    def lines(self) -> list[str]:
        """Return the median and the number of presses."""
        return [f"Contrast of lumps: median error {share(self.median)} on {self.count} presses with a lump"]


def contrast_error(subject: Subject) -> ContrastError | str | None:
    """Return the contrast error on unseen presses, or the reason why there is none."""
    lumps, data = subject.lumps, subject.data
    if lumps is None or data is None or "lump_energy" not in data:
        return None
    presses = LumpPresses.of(data)
    contrast_rows = presses.contrast_rows
    if len(contrast_rows) < FEWEST:
        return (
            f"The contrast of lumps is not judged: it takes {FEWEST} unseen presses whose lump changes the force by "
            f"1 % or more, and there are {len(contrast_rows)}."
        )
    errors = change_errors(lumps, presses.take(contrast_rows))
    median, p95 = np.quantile(errors, [0.5, 0.95])
    return ContrastError(len(contrast_rows), float(median), float(p95))
