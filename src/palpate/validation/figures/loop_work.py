"""Work of the force around closed paths: what a hand could draw from a body that should give nothing away.

The work around a polygon is found by a quadrature that goes on until it has converged. The integrand F·(b − a) along
an edge is smooth in pieces: it begins at first touch and bends where training ends. An interval is halved while its
8-point Gauss–Lobatto rule and those of its halves disagree, so only the places where it bends are resolved finely.
Lobatto's rule has points at both ends, so that a bend near an end isn't passed over.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.format import share
from palpate.units import bounds
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject
from palpate.validation.unseen_solves import TouchFunction, TouchSolves

__all__ = [
    "BorderLoopWork",
    "LoopWork",
    "Work",
    "border_work",
    "closed_path_work",
    "function_work",
    "work_of_polygons",
]

LOOPS = 100  # loops that are drawn at random
BEYOND = 0.3  # share of each range of position, by which loops across the border go beyond it
GRAZING = 1e-6  # share of the median energy, below which a loop hardly touches
ORDER = 8  # points of the rule of quadrature
FIRST = 32  # intervals of an edge to begin with: a touch shorter than that may be passed over
LEVELS = 24  # halvings at most: an interval of an edge of 10 mm is then 10 picometres
TOLERANCE = 1e-13  # disagreement that an interval may keep, over the energy of its loop


@dataclass(frozen=True)
class LoopWork(Figure):
    """Net work around random closed polygons, over the energy that the hand gives on the way."""

    loops: int  # number of polygons
    median: float  # |∮F·dx| / ½∮|F·dx|, as the next two
    p95: float
    max: float
    energy: float  # median energy ½∮|F·dx| of a loop, J
    open: float = 0.0  # largest share of that energy that the quadrature left open

    def measured(self) -> Measured:
        """Return the value that is compared with a limit."""
        return {"loop_work": (self.max, None)}

    def notes(self) -> list[str]:
        """Return a sentence where the quadrature did not converge."""
        if self.open <= max(0.1 * self.max, 1e-10):
            return []
        return [
            f"The quadrature around closed paths left {share(self.open)} open: the force jumps somewhere."
        ]


@dataclass(frozen=True)
class BorderLoopWork(LoopWork):
    """Net work around random closed polygons that cross the border of the trained region; see `LoopWork`."""

    def measured(self) -> Measured:
        """Return the value that is compared with a limit."""
        return {"border_loop_work": (self.max, None)}


def closed_path_work(subject: Subject) -> LoopWork | str | None:
    """Return the work around closed paths between places of the test, or the reason why there is none."""
    if subject.function is None or subject.solves is None:
        return None
    return function_work(subject.function, subject.solves, seed=subject.seed)


def border_work(subject: Subject) -> LoopWork | str | None:
    """Return the work around paths across the border of what was trained, or the reason why there is none."""
    if subject.function is None or subject.solves is None:
        return None
    return function_work(subject.function, subject.solves, border=True, seed=subject.seed)


def function_work(
    model: TouchFunction, test: TouchSolves, *, border: bool = False, loops: int = LOOPS, seed: int = 0
) -> LoopWork | str:
    """Return the work around random triangles to pentagons of a function of place, or the reason why there is none.

    Quadrature is converged. Corners are where the test's solves are; with `border` they lie at random in a box 30 %
    beyond the ranges, some trained and some not.
    """
    rng = np.random.default_rng(seed)
    drawn = (_across(model, test, rng) if border else _between(test, rng) for _ in range(50 * loops))
    corners = []
    for polygon in drawn:
        touching = int(model.force(polygon).any(axis=1).sum())
        if touching >= 2 and (not border or 0 < int(model.within(polygon).sum()) < len(polygon)):
            corners.append(polygon)
        if len(corners) == loops:
            break
    name = "paths across the trained border" if border else "closed paths"
    if len(corners) < 10:
        return f"Work around {name} is not judged: too few loops touch the body."
    work = work_of_polygons(model.force, corners)
    rows = work.energy > GRAZING * np.median(work.energy)
    if int(rows.sum()) < 10:
        return f"Work around {name} is not judged: the places of the test lie too near to each other."
    net, energy = np.abs(work.net[rows]), work.energy[rows]
    ratio = net / energy
    kind = BorderLoopWork if border else LoopWork
    return kind(
        len(ratio),
        float(np.median(ratio)),
        float(np.quantile(ratio, 0.95)),
        float(ratio.max()),
        float(np.median(energy)),
        float((work.open[rows] / energy).max()),
    )


def _between(test: TouchSolves, rng: np.random.Generator) -> np.ndarray:
    """Return a polygon between places of solves; the further inputs are those of the first."""
    rows = rng.choice(len(test), min(len(test), int(rng.integers(3, 6))), replace=False)
    polygon = test.X[rows].copy()
    polygon[:, 3:] = polygon[0, 3:]
    return polygon


def _across(model: TouchFunction, test: TouchSolves, rng: np.random.Generator) -> np.ndarray:
    """Return a polygon in the box of the ranges made larger; the further inputs are those of some solve."""
    low, high = bounds(model.inputs)
    more = BEYOND * (high - low)
    polygon = rng.uniform(low - more, high + more, (int(rng.integers(3, 6)), len(low)))
    polygon[:, 3:] = test.X[int(rng.integers(len(test))), 3:]
    return polygon


@dataclass(frozen=True, eq=False)
class Work:
    """Net work ∮F·dx of each polygon, energy given on the way ½∮|F·dx|, and what the quadrature left open, all J."""

    net: np.ndarray
    energy: np.ndarray
    open: np.ndarray


def work_of_polygons(
    force: Callable[[np.ndarray], np.ndarray], corners: list[np.ndarray], most: int = 40_000
) -> Work:
    """Return the work around polygons under a force, (M, n) inputs in m → (M, 3) N, or (M, 4) with an effort.

    Each polygon's corners are inputs (c, n); the last leads back to the first, and inputs beyond the third must not
    change. At most `most` intervals are halved at a time; the others are left open.
    """
    begin, end = np.concatenate(corners), np.concatenate([np.roll(c, -1, axis=0) for c in corners])
    loop = np.repeat(np.arange(len(corners)), [len(c) for c in corners])
    edge = np.repeat(np.arange(len(begin)), FIRST)
    low, width = np.tile(np.arange(FIRST) / FIRST, len(begin)), np.full(len(edge), 1.0 / FIRST)

    def rule(edge: np.ndarray, low: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _rule(force, begin[edge], end[edge], low, width)

    value, size = rule(edge, low, width)
    net, energy, left = (np.zeros(len(corners)) for _ in range(3))
    for _ in range(LEVELS):
        scale = energy + np.bincount(loop[edge], size, len(corners))
        halves = (np.repeat(edge, 2), _halves(low, width), np.repeat(width / 2, 2))
        fine, fine_size = rule(*halves)
        apart = np.abs(fine.reshape(-1, 2).sum(axis=1) - value)
        done = apart <= TOLERANCE * scale[loop[edge]]
        if (~done).sum() > most:
            done |= apart < np.partition(apart, -most)[-most]
            left += np.bincount(loop[edge], np.where(done, apart, 0.0), len(corners))
        both = np.repeat(done, 2)
        polygon = loop[halves[0][both]]
        net += np.bincount(polygon, fine[both], len(corners))
        energy += np.bincount(polygon, fine_size[both], len(corners))
        edge, low, width = (part[~both] for part in halves)
        value, size = fine[~both], fine_size[~both]
        if not len(edge):
            break
    polygon = loop[edge]
    net, energy = (
        net + np.bincount(polygon, value, len(corners)),
        energy + np.bincount(polygon, size, len(corners)),
    )
    return Work(net, energy / 2, left + np.bincount(polygon, size, len(corners)))


def _halves(low: np.ndarray, width: np.ndarray) -> np.ndarray:
    return np.stack([low, low + width / 2], axis=1).ravel()


def _rule(
    force: Callable[[np.ndarray], np.ndarray],
    begin: np.ndarray,
    end: np.ndarray,
    low: np.ndarray,
    width: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return ∫F·dx and ∫|F·dx| over pieces (M,) of edges from begin to end (M, n)."""
    x, w = _lobatto()
    t = low[:, None] + width[:, None] * (x + 1) / 2
    X = begin[:, None] + t[:, :, None] * (end - begin)[:, None]
    # of two jaws the effort stands beside the force: the opening does not change, so it does no work
    F = force(np.ascontiguousarray(X.reshape(-1, X.shape[2])))[:, :3].reshape(len(t), ORDER, 3)
    power = np.einsum("mqi,mi->mq", F, (end - begin)[:, :3]) * w / 2 * width[:, None]
    return power.sum(axis=1), np.abs(power).sum(axis=1)


@functools.cache
def _lobatto() -> tuple[np.ndarray, np.ndarray]:
    """Return points in [−1, 1] and weights.

    The ends and the roots of P'₇, 2/(n (n − 1) P₇²) (Abramowitz & Stegun 25.4.32).
    """
    last = np.polynomial.legendre.Legendre.basis(ORDER - 1)
    x = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    return x, 2.0 / (ORDER * (ORDER - 1) * last(x) ** 2)
