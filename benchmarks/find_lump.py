"""A lump found by an ideal observer with a hand's limits, who decides by a learnt body; the truth is finite elements.

python -m benchmarks --only find_lump [--quick] [--json] [--record]

The body is the prostate that comes with palpate. The observer presses it 30 times, each press with a force noise
of 7 % (10 % below 1 N) and 1 mm of doubt where along the surface it was. He knows the body without a lump, and of each
of several hundred lumps that might be there what it would change: by the learnt contrast. Presses are chosen where what
the lumps predict differs most for its noise. He says "a lump" where the mean likelihood of all lumps, over that of
none, is above a threshold that 5 % of examinations without a lump exceed.
The pressed body is solved with its lump in each of a grid of presses; the same grid is offered to the observer.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.shipped_bodies import BODIES
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.physics.stop import Stop
from palpate.surrogates import Surrogate

__all__ = ["Observer", "Presses", "tables"]

BODY = "prostate"
DEPTH = 0.006  # m, of every press
LATTICE = (5, 4)  # places along x and y, over the box that is touched
MOST, FEW = 30, 12  # presses of an examination, and to locate a lump that is there
FALSE_ALARMS = 0.05
STRONG, FAINT, ONE = 0.07, 0.10, 1.0  # relative noise from 1 N on and below, N
ASTRAY = 0.001  # m along the surface
EXAMINATIONS = 300
COVER = 0.010  # m of tissue over a lump
SIZES = (14.0, 12.0, 10.0, 8.0, 6.0)  # diameters in mm; a larger one does not fit under that in 30 mm


@dataclass(frozen=True, eq=False)
class Presses:
    """A grid of presses: places (P, 3), and the body's forces (P,) along the normals without a lump, N."""

    X: np.ndarray
    normals: np.ndarray  # (P, 3), outward

    def along(self, force: np.ndarray) -> np.ndarray:
        """Return forces (…, P, 3) along the normals."""
        return np.asarray((force * self.normals).sum(axis=-1))


def presses_of(problem: pp.LumpProblem) -> Presses:
    """Return presses of one depth on a lattice over the touched box of a block."""
    probe: Any = problem.base.interactions[0]
    (x0, y0), (x1, y1) = probe.over
    top = problem.base.body.geometry.size[2]  # type: ignore[attr-defined]  # it is a block
    x, y = (np.linspace(low, high, n) for low, high, n in ((x0, x1, LATTICE[0]), (y0, y1, LATTICE[1])))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    X = np.column_stack([places, np.full(len(places), top + probe.radius - DEPTH)])
    return Presses(X, np.tile([0.0, 0.0, 1.0], (len(X), 1)))


def lumps_of(body: Surrogate, radii: Sequence[float], ratio: float, spacing: float = 0.006) -> list[pp.Lump]:
    """Return lumps on a lattice in the room of a body, those that stay under its skin."""
    assert body.lumps is not None
    room = body.lumps.room
    axes = [np.arange(low, high + 1e-9, spacing) for low, high in zip(room.lower, room.upper, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return [
        pp.Lump(tuple(place.tolist()), radius, ratio)
        for radius in radii
        for place in places[room.hold(places, np.full(len(places), radius))]
    ]


@dataclass(frozen=True, eq=False)
class Observer:
    """The observer: what it knows of each press, and how he goes on.

    Attributes
    ----------
    plain : (P,)
        Forces of the learnt body without a lump, N.
    changes : (H, P)
        What each lump that might be there changes, by the learnt contrast, N.
    astray : (P,)
        Deviation of a press's force by 1 mm along the surface, N.
    """

    plain: np.ndarray
    changes: np.ndarray
    astray: np.ndarray

    @property
    def noise(self) -> np.ndarray:
        """Deviation (P,) of what one press feels, N."""
        own = np.where(np.abs(self.plain) < ONE, FAINT, STRONG) * np.abs(self.plain)
        return np.asarray(np.hypot(own, self.astray))

    def examine(
        self, truth: np.ndarray, presses: int, rng: np.random.Generator, *, chosen: bool = True
    ) -> tuple[float, np.ndarray]:
        """Return the log of the mean likelihood ratio after so many presses, and the posterior (H,) of the lumps.

        `truth` (P,) is the force of the body that is pressed; without `chosen` the presses are drawn at random.
        """
        noise, log = self.noise, np.zeros(len(self.changes))
        for _ in range(presses):
            weight = np.exp(log - log.max())
            weight /= weight.sum()
            if chosen:
                mean = weight @ self.changes
                spread = weight @ (self.changes - mean) ** 2 + mean**2  # against each other, and against none
                press = int(np.argmax(spread / noise**2 * rng.uniform(0.8, 1.0, len(noise))))
            else:
                press = int(rng.integers(len(noise)))
            felt = truth[press] + noise[press] * rng.normal() - self.plain[press]
            log += (felt**2 - (felt - self.changes[:, press]) ** 2) / (2 * noise[press] ** 2)
        most = log.max()
        weight = np.exp(log - most)
        return float(most + np.log(weight.mean())), weight / weight.sum()


def observer_of(body: Surrogate, grid: Presses, lumps: Sequence[pp.Lump]) -> Observer:
    """Return the observer who knows a learnt body."""
    assert body.lumps is not None
    energy = body.hand_energy
    U, force, stiffness = energy.response(grid.X)
    changes = []
    for lump in lumps:
        value, slopes = body.lumps.added(lump, grid.X)
        changes.append(grid.along(force * value[:, None] - U[:, None] * slopes))
    # the force along the normal changes along the surface by that part of the stiffness
    rows = np.einsum("pij,pj->pi", stiffness, grid.normals)
    across = rows - (rows * grid.normals).sum(axis=1, keepdims=True) * grid.normals
    return Observer(grid.along(force), np.array(changes), ASTRAY * np.linalg.norm(across, axis=1))


def solved_changes(solver: Any, grid: Presses, lumps: Sequence[pp.Lump]) -> np.ndarray:
    """Return what lumps change (H, P) in each press by finite elements, N; not-a-number where a press folds."""
    changes = np.full((len(lumps), len(grid.X)), np.nan)
    for p, x in enumerate(grid.X):
        free = solver.press(x)
        for h, lump in enumerate(lumps):
            with_lump = solver.press_with(free, lump)
            if with_lump.stop is Stop.CONVERGED:
                changes[h, p] = with_lump.force @ grid.normals[p]
    return changes


def threshold_of(observer: Observer, count: int) -> tuple[float, float]:
    """Return the log that 5 % of examinations without a lump exceed, and how many of as many others do."""
    rng = np.random.default_rng(0)
    none = np.array([observer.examine(observer.plain, MOST, rng)[0] for _ in range(4 * count)])
    threshold = float(np.quantile(none[::2], 1 - FALSE_ALARMS))
    return threshold, float(np.mean(none[1::2] > threshold))


def detection(observer: Observer, truths: np.ndarray, threshold: float, count: int, seed: int) -> float:
    """Return the share found of lumps that change the forces by (T, P) in N."""
    rng = np.random.default_rng(seed)
    felt = [observer.plain + truths[i % len(truths)] for i in range(count)]
    return float(np.mean([observer.examine(force, MOST, rng)[0] > threshold for force in felt]))


def location_errors(
    observer: Observer,
    lumps: Sequence[pp.Lump],
    truths: np.ndarray,
    hidden: Sequence[pp.Lump],
    count: int,
    *,
    chosen: bool,
) -> np.ndarray:
    """Return how far (count,) in m along the base the mean place is from the hidden lump, after a few presses."""
    rng, errors = np.random.default_rng(1), []
    places = np.array([lump.place for lump in lumps])
    for i in range(count):
        own = i % len(hidden)
        _, weight = observer.examine(observer.plain + truths[own], FEW, rng, chosen=chosen)
        errors.append(float(np.linalg.norm((weight @ places - hidden[own].place)[:2])))
    return np.array(errors)


def tables(*, quick: bool = False) -> list[Table]:
    """Return what was found and how well it was located."""
    problem, body = BODIES[BODY](), pp.shipped_body(BODY)
    grid, count = presses_of(problem), EXAMINATIONS // 4 if quick else EXAMINATIONS
    radii = (0.004, 0.0055, 0.007)
    observer = observer_of(body, grid, lumps_of(body, radii, 8.0, spacing=0.005))
    solver = problem.open()
    top = problem.base.body.geometry.size[2]  # type: ignore[attr-defined]  # it is a block
    largest = SIZES[0] / 2e3
    places = ((0.025, 0.020), (0.021, 0.017))[: 1 if quick else 2]
    hidden = [pp.Lump((x, y, top - COVER - largest), largest, 10.0) for x, y in places]
    print("solving the presses with lumps", file=sys.stderr)
    truths = solved_changes(solver, grid, hidden)
    learnt = observer_of(body, grid, hidden).changes
    threshold, alarms = threshold_of(observer, count)
    rows = [_row("finite elements", SIZES[0], observer, truths, threshold, count)]
    for size in SIZES:
        lump = pp.Lump((*places[0], top - COVER - size / 2e3), size / 2e3, 10.0)
        rows.append(
            _row("learnt body", size, observer, observer_of(body, grid, [lump]).changes, threshold, count)
        )
    contrast = _contrast(learnt, truths, observer)
    found = Table(
        "find_lump",
        f"A lump of ten times the modulus under 10 mm of tissue, {MOST} presses{quick_mark(quick)}",
        [
            Column("truth", "what is pressed"),
            Column("size", "⌀ in mm", "g"),
            Column("change", "largest change of force", ".1%"),
            Column("found", "found", ".0%"),
        ],
        rows,
        [
            Claim("share of lumps of ⌀14 mm that are missed", (1.0 - rows[0]["found"],), 0.1, ".2f"),
            Claim(
                "contrast error of the learnt body in these presses, 95th percentile",
                (contrast,),
                0.12,
                ".3f",
            ),
        ],
        [
            f"False alarms: {alarms:.1%} of examinations without a lump.",
            "As context: in published tests people found 78 % of lumps of 1.0 cm and 38 % of 0.3 cm.",
        ],
    )
    finder_lumps = lumps_of(body, (SIZES[0] / 2e3,), 10.0, spacing=0.004)
    finder = observer_of(body, grid, finder_lumps)
    located = []
    for name, chosen in (("chosen by the observer's variance", True), ("random", False)):
        errors = 1e3 * location_errors(finder, finder_lumps, truths, hidden, count, chosen=chosen)
        median, p95 = np.quantile(errors, [0.5, 0.95])
        located.append({"presses": name, "median": float(median), "p95": float(p95)})
    return [
        found,
        Table(
            "find_lump_place",
            f"Distance along the base of the place that is said from the lump's, {FEW} presses{quick_mark(quick)}",
            [
                Column("presses", "presses"),
                Column("median", "median, mm", ".1f"),
                Column("p95", "95th percentile, mm", ".1f"),
            ],
            located,
        ),
    ]


def _row(
    truth: str, size: float, observer: Observer, changes: np.ndarray, threshold: float, count: int
) -> dict[str, Any]:
    """Return a row of the table of lumps found."""
    share = detection(observer, changes, threshold, count, seed=int(size))
    return {
        "truth": truth,
        "size": size,
        "change": float(np.nanmax(changes / observer.plain)),
        "found": share,
    }


def _contrast(learnt: np.ndarray, truths: np.ndarray, observer: Observer) -> float:
    counts = np.abs(truths) > 0.01 * np.abs(observer.plain)
    return float(np.quantile(np.abs(learnt / truths - 1)[counts], 0.95))
