"""Comparison of exported numbers, curves and fields with palpate, by the rule of `palpate.export.check_points`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.export.answer_network import AnswerNetwork
from palpate.export.check_points import Comparison, Difference, Precision, difference, tolerances
from palpate.units import bounds

__all__ = ["MOST_SLOPES", "Replies", "answer_places", "compare_answers"]


_NUMBERS = 5_000_000  # numbers that are compared at most; of a large field at fewer places than 1,000
_END = 0.95  # of the way to the end of a bent scale
MOST_SLOPES = 2_000  # outputs of which derivatives are compared, too

Replies = tuple[np.ndarray, np.ndarray | None, np.ndarray | None]


def answer_places(answers: AnswerNetwork) -> np.ndarray:
    """Return inputs (N, n), in the ranges and outside of them by up to three tenths: 1,000, of a large field fewer.

    Of inputs whose scale is bent that is in the scale: beside its end answers are sums of large terms.
    """
    low, high = bounds(answers.inputs)
    span, most = high - low, _NUMBERS // len(answers.outputs)
    count, scaling = max(20, min(1000, most)), answers.networks[0].scaling
    xi = np.random.default_rng(0).uniform(-1.6, 1.6, (count, len(low)))
    bend = scaling.input_bend
    xi = np.where(bend * xi > _END, _END / np.where(bend == 0.0, 1.0, bend), xi)
    return np.asarray(np.clip(scaling.unscale_inputs(xi), low - 0.3 * span, high + 0.3 * span))


def compare_answers(
    answers: AnswerNetwork, ask: Callable[[np.ndarray], Replies], precision: Precision | None = None
) -> Comparison:
    """Return how far exported answers are from palpate at 1,000 inputs; by default in double precision.

    `ask` takes inputs (N, n) and returns the answers (N, m), whether they are in the trained region (N,), and
    derivatives (N, m, n); None for what the export doesn't tell. The answers of each quantity and field are compared by
    themselves.
    """
    precision = precision or Precision()
    X = answer_places(answers)
    wanted, (got, inside, slopes) = answers.predict(X), ask(X)
    limit = np.max([tolerances(network, X, precision) for network in answers.networks], axis=0)
    parts, first = {}, 0
    pairs = (2 for _ in range(len(answers.runs) // 2))  # largest and least value of a field: of one size
    for count in (*answers.groups, *pairs):
        some = slice(first, first + count)
        parts[answers.outputs[first].name] = difference(wanted[:, some], got[:, some], limit)
        first += count
    if slopes is not None and len(answers.outputs) <= MOST_SLOPES:
        low, high = bounds(answers.inputs)
        rates = np.stack([answers.jacobian(x) for x in X]) * (high - low)
        replies = (slopes * (high - low)).reshape(len(X), -1)
        parts["derivatives"] = difference(rates.reshape(len(X), -1), replies, limit)
    if inside is not None:
        parts["inside"] = _inside(answers, X, inside)
    return Comparison(parts, precision.single)


def _inside(answers: AnswerNetwork, X: np.ndarray, inside: np.ndarray) -> Difference:
    """Compare the flag, but where rounding decides it: beside the border of the region."""
    span = np.ptp(np.array(bounds(answers.inputs)), axis=0)
    wanted, near = answers.inside(X), np.zeros(len(X), dtype=bool)
    for sign in (-1e-11, 1e-11):
        for step in np.diag(sign * span):
            near |= answers.inside(X + step) != wanted
    for doubt in answers.doubts:
        near |= doubt.is_close(X)
    wrong = int(((inside != wanted) & ~near).sum())
    return Difference(float(wrong > 0), 0.0, int((~near).sum()), wrong)
