"""The next solves of numbers and fields: where a Gaussian process of all answers is least sure, and misses most.

All answers share one process on their leading modes, over scaled inputs. A solve at x lowers the variance at every
other place x' by k(x, x')²/(k(x, x) + λ), k being the covariance after the solves so far; the next one lowers the sum
over all places most (Cohn 1996). Places count by what the process misses of the solves beside them when these are left
out, over what it expects to miss: where the answers bend more than elsewhere, more is solved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.learning.arrays.input_bends import process_of
from palpate.units import Range

__all__ = ["CANDIDATES", "choose_answers"]

CANDIDATES = 400  # places among which a batch is chosen
_CALM = 4.0  # solves whose misses are as expected, added to those beside a place: few say little
_MOST = 10.0  # times the mean that a place may count


@dataclass(eq=False)
class _Variance:
    """Covariance (C, C) of a process at candidates, conditioned on solves as they are chosen."""

    P: np.ndarray
    ridge: float

    def falls(self, weights: np.ndarray) -> np.ndarray:
        """Return the fall (C,) of the weighted variances by a solve at each candidate."""
        return np.asarray((weights @ self.P**2) / (np.diagonal(self.P) + self.ridge))

    def condition(self, row: int) -> None:
        """Condition it on a solve at a candidate, whatever it will answer."""
        gain = self.P[row] / (self.P[row, row] + self.ridge)
        self.P -= np.outer(self.P[row], gain)


def choose_answers(
    parts: Sequence[np.ndarray],
    X: np.ndarray,
    inputs: Sequence[Range],
    number: int,
    *,
    failed: np.ndarray,
    interest: np.ndarray | None = None,
    candidates: np.ndarray,
) -> np.ndarray:
    """Return the inputs (number, n) of the next solves, the best first, among `candidates` (C, n).

    `parts`, each (N, m), are the answers of the solves at X (N, n); each counts by its own spread. Nothing is chosen
    beside the inputs `failed` (F, n), whose solves failed. `interest` (C,) is how much an error counts at each
    candidate, by default all the same.
    """
    process = process_of(X, parts, inputs)
    places, solved = process.scale(candidates), process.scale(np.vstack([X, failed]))
    state = _Variance(process.covariance_after(places, solved), process.metric.ridge)
    weights = process.surprise(places, calm=_CALM).clip(max=_MOST)
    weights = weights if interest is None else weights * interest
    chosen: list[int] = []
    for _ in range(min(number, len(candidates))):
        score = state.falls(weights)
        score[chosen] = -np.inf
        chosen.append(int(np.argmax(score)))
        state.condition(chosen[-1])
    return np.asarray(candidates[chosen])
