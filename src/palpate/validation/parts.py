"""Errors of the force in parts of what was tested: shallow and deep touches, the region's edge, the worst cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.units import Range
from palpate.validation.force import ForceSamples, quantile
from palpate.validation.region import Worst, outer_part
from palpate.validation.solves import TouchFunction, TouchSolves

__all__ = ["Case", "Part", "parts", "worst_cases"]


@dataclass(frozen=True)
class Part:
    """Some of the solves.

    Attributes
    ----------
    name : str
    count, felt : int
        Solves, and how many of them above f₀.
    median, p95 : float or None
        ‖ΔF‖/‖F‖ above f₀.
    light_p95 : float or None
        ‖ΔF‖/f₀ up to f₀.
    stiffness_p95 : float or None
        ‖ΔK‖/‖K‖.
    """

    name: str
    count: int
    felt: int
    median: float | None
    p95: float | None
    light_p95: float | None
    stiffness_p95: float | None


@dataclass(frozen=True)
class Case:
    """One solve: where it is, the force that it has and that the model gives (N), and how far apart they are."""

    at: Worst
    depth: float | None
    truth: tuple[float, ...]
    answer: tuple[float, ...]
    relative: float
    jnd: float


def parts(
    model: TouchFunction, test: TouchSolves, samples: ForceSamples, stiffness: np.ndarray | None
) -> tuple[Part, ...]:
    """All solves, then the shallow and the deep third, the edge of the ranges, and what counts as outside.

    Parameters
    ----------
    model : TouchFunction
    test : TouchSolves
    samples : ForceSamples
    stiffness : (N,), optional
        ‖ΔK‖/‖K‖, not-a-number where unknown.
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
    model: TouchFunction, test: TouchSolves, samples: ForceSamples, ranges: Sequence[Range], count: int = 5
) -> tuple[Case, ...]:
    """The solves above f₀ whose force is farthest off in just noticeable differences, worst first."""
    rows = np.flatnonzero(samples.heavy)
    order = rows[np.argsort(-samples.jnd[rows], kind="stable")][:count]
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
