"""The choice of inputs that are scaled by their ratios or their inverse, for what divides by them.

A temperature goes with one over a conductivity and one over a heat transfer coefficient: over a range of one to ten it
bends far more at the low end, and a network whose units are as wide everywhere needs more samples. An input of one sign
whose ends differ by a factor of two or more may take the bend of `log_bend` or `inverse_bend`; which of them do is
decided one after the other, by the error of samples left out of Gaussian processes (`answer_process`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.learning.arrays.answer_process import AnswerProcess, joined_answers
from palpate.units import Range, bounds

__all__ = ["choose_bends", "inverse_bend", "log_bend", "process_of"]

_RATIO = 2.0  # of the ends of a range, below which a logarithm is as good as straight
_CLEARLY = 0.9  # times the error of samples left out: a bend is worth it
_ROWS = 300  # of which the error is told; its work goes with their cube
_INPUTS = 8  # inputs of the largest ratios that are tried


def log_bend(low: float, high: float) -> float:
    """Return the bend by which the geometric mean of an input's ends is in the middle; 0 where they differ in sign."""
    if low * high <= 0.0:
        return 0.0
    first, last = np.sqrt(abs(low)), np.sqrt(abs(high))
    return float((last - first) / (last + first))


def inverse_bend(low: float, high: float) -> float:
    """Return the bend by which one over an input is even; 0 where its ends differ in sign."""
    return (abs(high) - abs(low)) / (abs(high) + abs(low)) if low * high > 0.0 else 0.0


def choose_bends(X: np.ndarray, parts: Sequence[np.ndarray], inputs: Sequence[Range]) -> np.ndarray:
    """Return the bends (n,) of inputs, zero for those that stay straight.

    Parameters
    ----------
    X : (N, n)
        Inputs of the samples, SI units.
    parts : sequence of (N, m)
        What is to be learnt of them; each part counts by its errors over its own spread.
    inputs : n ranges
        Of the columns of X.
    """
    bends, ends = np.zeros(len(inputs)), np.abs(np.array(bounds(inputs)))
    ratio = ends.max(axis=0) / np.maximum(ends.min(axis=0), 1e-300)
    positive = [r.low * r.high > 0.0 for r in inputs]
    bent = [int(i) for i in np.argsort(-ratio)[:_INPUTS] if positive[i] and ratio[i] >= _RATIO]
    if not bent:
        return bends
    some = np.random.default_rng(0).permutation(len(X))[:_ROWS]
    Y = joined_answers(parts, some)
    best = AnswerProcess.likeliest(X[some], Y, inputs, bends).error
    for _ in range(2 * len(bent)):
        trials = []
        for i in bent:
            for bend in (log_bend, inverse_bend):
                tried = bends.copy()
                tried[i] = bend(inputs[i].low, inputs[i].high)
                if tried[i] != bends[i]:
                    trials.append((AnswerProcess.likeliest(X[some], Y, inputs, tried).error, tried))
        error, tried = min(trials, key=lambda one: one[0])
        if error >= _CLEARLY * best:
            break
        best, bends = error, tried
    return bends


def process_of(X: np.ndarray, parts: Sequence[np.ndarray], inputs: Sequence[Range]) -> AnswerProcess:
    """Return the process of answers `parts`, each (N, m), at inputs X (N, n), with the bends that suit them."""
    bends = choose_bends(X, parts, inputs)
    return AnswerProcess.likeliest(X, joined_answers(parts, np.arange(len(X))), inputs, bends)
