"""The choice of inputs that are scaled by their ratios, as with a logarithm, for what divides by them.

A temperature goes with one over a conductivity and one over a heat transfer coefficient: over a range of one to ten it
bends far more at the low end, and a network whose units are as wide everywhere needs more samples. An input of one sign
whose ends differ by a factor of two or more may take the bend of `log_bend`; which of them do is decided one after the
other, by the error of samples left out of Gaussian processes (`answer_process`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.learning.arrays.answer_process import AnswerProcess, joined_answers
from palpate.units import Range, bounds

__all__ = ["choose_bends", "log_bend", "process_of"]

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
    bends, ends = np.zeros(len(inputs)), np.array(bounds(inputs))
    trials = [log_bend(r.low, r.high) for r in inputs]
    ratio = np.abs(ends).max(axis=0) / np.maximum(np.abs(ends).min(axis=0), 1e-300)
    left = [int(i) for i in np.argsort(-ratio)[:_INPUTS] if trials[i] and ratio[i] >= _RATIO]
    if not left:
        return bends
    some = np.random.default_rng(0).permutation(len(X))[:_ROWS]
    Y = joined_answers(parts, some)
    best = AnswerProcess.likeliest(X[some], Y, inputs, bends).error
    while left:
        errors = []
        for i in left:
            tried = bends.copy()
            tried[i] = trials[i]
            errors.append(AnswerProcess.likeliest(X[some], Y, inputs, tried).error)
        winner = int(np.argmin(errors))
        if errors[winner] >= _CLEARLY * best:
            break
        best = errors[winner]
        bends[left[winner]] = trials[left[winner]]
        left.pop(winner)
    return bends


def process_of(X: np.ndarray, parts: Sequence[np.ndarray], inputs: Sequence[Range]) -> AnswerProcess:
    """Return the process of answers `parts`, each (N, m), at inputs X (N, n), with the bends that suit them."""
    bends = choose_bends(X, parts, inputs)
    return AnswerProcess.likeliest(X, joined_answers(parts, np.arange(len(X))), inputs, bends)
