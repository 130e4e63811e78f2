"""Errors of the force in parts of what was tested: shallow and deep touches, the region's edge, the worst cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.format import count, plain, share
from palpate.units import Range
from palpate.validation.figures.figure import Figure
from palpate.validation.figures.force import ForceSamples, quantile
from palpate.validation.subject import Subject
from palpate.validation.unseen_solves import TouchFunction, TouchSolves
from palpate.validation.worst import Worst, outer_part

__all__ = ["Case", "Part", "Parts", "WorstCases", "parts", "parts_of_test", "worst_cases", "worst_of_test"]


@dataclass(frozen=True)
class Part:
    """Errors of the force on some of the solves."""

    name: str  # the part in words
    count: int  # solves
    felt: int  # solves above f₀
    median: float | None  # ‖ΔF‖/‖F‖ above f₀, as the next
    p95: float | None
    light_p95: float | None  # ‖ΔF‖/f₀ up to f₀
    stiffness_p95: float | None  # ‖ΔK‖/‖K‖


@dataclass(frozen=True)
class Case:
    """One solve: where it is, the force that it has and that the model gives (N), and how far apart they are."""

    at: Worst
    depth: float | None
    truth: tuple[float, ...]
    answer: tuple[float, ...]
    relative: float
    jnd: float


class Parts(tuple[Part, ...], Figure):
    """All solves, then the shallow and the deep third, the edge of the ranges, and those outside."""

    def lines(self) -> list[str]:
        """Return one line per part."""
        return [_part_line(part) for part in self]


class WorstCases(tuple[Case, ...], Figure):
    """Solves whose force is farthest off, worst first."""

    def lines(self) -> list[str]:
        """Return one line per case."""
        return [f"worst {i}: {_case_line(case)}" for i, case in enumerate(self, 1)]


def parts_of_test(subject: Subject) -> Parts | None:
    """Return the errors of the force in parts of the test."""
    model, test = subject.function, subject.solves
    if model is None or test is None or subject.samples is None:
        return None
    return Parts(parts(model, test, subject.samples, _relative_stiffness(model, test)))


def worst_of_test(subject: Subject) -> WorstCases | None:
    """Return the worst five cases of the test."""
    if subject.function is None or subject.solves is None or subject.samples is None:
        return None
    return WorstCases(worst_cases(subject.function, subject.solves, subject.samples, subject.function.inputs))


def _relative_stiffness(model: TouchFunction, solves: TouchSolves) -> np.ndarray | None:
    """Return ‖ΔK‖/‖K‖ (N,) of each solve, not-a-number where unknown; None where none is known."""
    if solves.stiffness is None or model.stiffness is None:
        return None
    size = np.linalg.norm(solves.stiffness, axis=(1, 2))
    error = np.linalg.norm(model.stiffness(solves.X) - solves.stiffness, axis=(1, 2))
    return np.asarray(np.divide(error, size, out=np.full(len(size), np.nan), where=size > 0))


def _part_line(part: Part) -> str:
    def text(value: float | None) -> str:
        return "–" if value is None else share(value)

    return (
        f"{part.name}: {count(part.count, 'solve')}, {part.felt} above f₀ with {text(part.median)} median and "
        f"{text(part.p95)} p95; below {text(part.light_p95)} of f₀; stiffness {text(part.stiffness_p95)} p95"
    )


def _case_line(case: Case) -> str:
    deep = "" if case.depth is None else f", {plain(1e3 * case.depth, 3)} mm deep"
    truth, answer = (" ".join(f"{v:.4g}" for v in F) for F in (case.truth, case.answer))
    return f"{share(case.relative)} ({plain(case.jnd)} JND) {case.at}{deep}: answered ({answer}) N, solved ({truth}) N"


def parts(
    model: TouchFunction, test: TouchSolves, samples: ForceSamples, stiffness: np.ndarray | None
) -> tuple[Part, ...]:
    """Return the errors in all solves, the shallow and the deep third, the edge of the ranges, and outside.

    `stiffness` (N,) is ‖ΔK‖/‖K‖ of each solve, not-a-number where unknown.
    """
    some = {"all": np.ones(len(test), dtype=bool)}
    if model.depth is not None:
        depth = model.depth(test.X)
        deepest = float(depth.max())
        some["shallow third"] = (depth > 0) & (depth <= deepest / 3)
        some["deep third"] = depth > 2 * deepest / 3
    some["edge of the ranges (5 %)"] = outer_part(test.X, model.inputs) & test.touching
    some["outside what was trained"] = ~samples.inside
    return tuple(_part(name, rows, samples, stiffness) for name, rows in some.items() if rows.any())


def _part(name: str, rows: np.ndarray, samples: ForceSamples, stiffness: np.ndarray | None) -> Part:
    heavy, light = rows & samples.heavy, rows & ~samples.heavy
    known = np.empty(0) if stiffness is None else stiffness[rows & np.isfinite(stiffness)]
    small = samples.error[light] / samples.light
    return Part(
        name,
        int(rows.sum()),
        int(heavy.sum()),
        quantile(samples.relative[heavy], 0.5),
        quantile(samples.relative[heavy], 0.95),
        quantile(small, 0.95),
        quantile(known, 0.95),
    )


def worst_cases(
    model: TouchFunction, test: TouchSolves, samples: ForceSamples, ranges: Sequence[Range], most: int = 5
) -> tuple[Case, ...]:
    """Return the solves above f₀ whose force is farthest off in just noticeable differences, worst first."""
    rows = np.flatnonzero(samples.heavy)
    order = rows[np.argsort(-samples.jnd[rows], kind="stable")][:most]
    depth = None if model.depth is None else model.depth(test.X[order])
    return tuple(
        Case(
            Worst.of(samples.relative[row], test.X[row], ranges),
            None if depth is None else float(depth[k]),
            tuple(samples.truth[row].tolist()),
            tuple(samples.answer[row].tolist()),
            float(samples.relative[row]),
            float(samples.jnd[row]),
        )
        for k, row in enumerate(order)
    )
