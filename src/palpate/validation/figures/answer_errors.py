"""Errors of numbers, fields and curves on unseen solves, over the range of each, and what their intervals hold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.format import plain, share
from palpate.learning.dataset_answers import DatasetAnswers, FieldAnswers, NumberAnswers
from palpate.surrogates import LearntQuantities, ModalField
from palpate.validation.figures.coverage import FEWEST
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject
from palpate.validation.worst import Worst

__all__ = ["AnswerError", "AnswerErrors", "answer_errors"]

_SAME_PLACE = 1e-6  # of the mesh's size, or of the axis: rounding of coordinates printed with six digits


@dataclass(frozen=True)
class AnswerError:
    """Errors of one answer, each over the range of its true values in the test."""

    name: str
    unit: str
    span: float  # largest less least true value, in the answer's unit
    median: float
    p95: float  # over solves and places
    largest: float
    coverage: float  # share of the errors within the 90 % interval; not-a-number where it states none
    worst: Worst  # the case, and for a field the place


class AnswerErrors(tuple[AnswerError, ...], Figure):
    """The errors of all answers, in their order."""

    def measured(self) -> Measured:
        """Return the worst 95th percentile, and the mean share that the intervals hold."""
        worst = max(self, key=lambda one: one.p95)
        stated = [one.coverage for one in self if not math.isnan(one.coverage)]
        where = f"{worst.name} {worst.worst}"
        return {
            "answer_p95": (worst.p95, where),
            "answer_coverage": (float(np.mean(stated)) if stated else None, None),
        }

    def lines(self) -> list[str]:
        """Return a line for each answer."""
        found = []
        for one in self:
            held = "" if math.isnan(one.coverage) else f"; {share(one.coverage)} within the 90 % interval"
            found.append(
                f"{one.name}: off by {share(one.median)} (median), {share(one.p95)} (95th percentile), "
                f"{share(one.largest)} at most of its range of {plain(one.span, 3)} {one.unit}".rstrip()
                + f"{held}; worst {one.worst}"
            )
        return found


def answer_errors(subject: Subject) -> AnswerErrors | None:
    """Return the errors of every number, field and curve that the test answers too."""
    surrogate, data = subject.answering, subject.data
    if surrogate is None or data is None:
        return None
    truth = DatasetAnswers.of(data, to_learn=False)
    found = [
        _of_numbers(part, truth.numbers[group], truth.X)
        for group, part in surrogate.quantities.items()
        if group in truth.numbers
    ]
    errors = [one for group in found for one in group]
    errors += [
        _of_field(shown, truth.fields[name], truth.X)
        for name, shown in surrogate.modal_fields.items()
        if name in truth.fields
    ]
    if not errors:
        raise UsageError(
            f"The test answers nothing that {surrogate.name} answers.",
            why=f"It has {', '.join([*truth.numbers, *truth.fields])}.",
            fix="Test with solves of the same quantities and fields.",
        )
    return AnswerErrors(errors)


def _of_numbers(part: LearntQuantities, truth: NumberAnswers, X: np.ndarray) -> list[AnswerError]:
    if [q.name for q in part.outputs] != [q.name for q in truth.outputs]:
        raise UsageError(
            f"The test's {', '.join(q.name for q in truth.outputs)} are not the model's "
            f"{', '.join(q.name for q in part.outputs)}.",
            fix="Test with solves that were imported by the same mapping.",
        )
    answer, deviation = part.predict(X), part.deviation(X)
    return [
        _error(
            q.name, q.unit, truth.values[:, j] - answer[:, j], truth.values[:, j], deviation[:, j], part, X
        )
        for j, q in enumerate(part.outputs)
    ]


def _of_field(shown: ModalField, truth: FieldAnswers, X: np.ndarray) -> AnswerError:
    ours, theirs = shown.places.coordinates, truth.places.coordinates
    size = float(np.ptp(ours, axis=0).max(initial=0.0)) or 1.0
    if ours.shape != theirs.shape or not np.allclose(ours, theirs, rtol=0.0, atol=_SAME_PLACE * size):
        raise UsageError(
            f"The field {shown.name!r} of the test is on another mesh: {truth.places}, not {shown.places}.",
            why="Values of one place can't be compared with those of another.",
            fix="Test with solves on the mesh that it was learnt on.",
        )
    error = truth.values - shown.values(X)
    return _error(
        shown.name, shown.unit, error, truth.values, shown.deviation(X), shown.coefficients, X, shown
    )


def _error(
    name: str,
    unit: str,
    error: np.ndarray,
    truth: np.ndarray,
    deviation: np.ndarray,
    part: LearntQuantities,
    X: np.ndarray,
    shown: ModalField | None = None,
) -> AnswerError:
    """Return the errors (N, …) of one answer, relative to the range of its true values."""
    span = float(np.ptp(truth, axis=tuple(range(min(truth.ndim, 2)))).max()) or 1.0
    size = np.abs(error) if error.ndim < 3 else np.sqrt((error**2).sum(axis=2))
    row, *place = np.unravel_index(int(size.argmax()), size.shape)
    where = "" if shown is None else shown.places.in_words(int(place[0]))
    median, p95 = np.quantile(size / span, (0.5, 0.95))
    coverage = math.nan
    if len(X) >= FEWEST and not np.isnan(deviation).any():
        coverage = float((np.abs(error) <= 1.645 * deviation).mean())
    worst = Worst.of(float(size.max()), X[row], part.inputs, where)
    return AnswerError(name, unit, span, float(median), float(p95), float(size.max() / span), coverage, worst)
