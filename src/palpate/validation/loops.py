"""Work of the force around closed paths: what a hand could draw from a body that should give nothing away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import TouchEvaluator, TouchModel
from palpate.units import bounds
from palpate.validation.force import hand_positions
from palpate.validation.quadrature import work_of_polygons
from palpate.validation.solves import TouchFunction, TouchSolves

__all__ = ["LoopWork", "function_work", "loop_work", "work_around"]

LOOPS = 100
PANELS, ORDER = 6, 8  # panels per edge; Gauss–Legendre points per panel
BEYOND = 0.3  # of each range of position: how far the loops that cross the border go beyond it
GRAZING = 1e-6  # of the median energy: loops below hardly touch


@dataclass(frozen=True)
class LoopWork:
    """Net work around random closed polygons, over the energy that the hand gives on the way.

    Attributes
    ----------
    loops : int
    median, p95, max : float
        |∮F·dx| / ½∮|F·dx|.
    energy : float
        Median energy ½∮|F·dx| of a loop, J.
    open : float
        Largest share of that energy that the quadrature left open.
    """

    loops: int
    median: float
    p95: float
    max: float
    energy: float
    open: float = 0.0


def loop_work(
    touch: TouchModel, test: Dataset, hand: np.ndarray, *, loops: int = LOOPS, seed: int = 0
) -> LoopWork | str:
    """Work around random triangles to pentagons between places where test solves have the hand.

    Loops that leave the trained region are left out: there the force is held at its limits on purpose.

    Parameters
    ----------
    touch : TouchModel
    test : Dataset
    hand : (N, k)
        Coordinates of the hand; see `palpate.validation.force.ForceSamples`.
    loops, seed : int

    Returns
    -------
    LoopWork, or the reason why there is none
    """
    if len(touch.touched) == 1:
        return "Work around closed paths is zero by construction: the hand moves along one coordinate."
    others = [i for i in range(len(test.ranges)) if i not in touch.touched]
    evaluate, rng = touch.evaluator(), np.random.default_rng(seed)
    places, found = hand_positions(touch, hand), []
    for _ in range(50 * loops):
        rows = rng.choice(len(hand), min(len(hand), int(rng.integers(3, 6))), replace=False)
        work = work_around(evaluate, places[rows], np.ascontiguousarray(test.X[rows[0], others]))
        if work is not None:
            found.append(work)
        if len(found) == loops:
            break
    if len(found) < 10:
        return "Work around closed paths is not judged: too few loops stay inside the trained region."
    net, energy = np.abs([f[0] for f in found]), np.array([f[1] for f in found])
    ratio = np.divide(net, energy, out=np.zeros_like(net), where=energy > 0)  # no force, no work
    p95 = float(np.quantile(ratio, 0.95))
    return LoopWork(len(found), float(np.median(ratio)), p95, float(ratio.max()), float(np.median(energy)))


def work_around(
    evaluate: TouchEvaluator, corners: np.ndarray, parameters: np.ndarray, panels: int = PANELS
) -> tuple[float, float] | None:
    """Net work ∮F·dx and energy ½∮|F·dx| around a polygon in J; None where it leaves the trained region.

    Parameters
    ----------
    evaluate : TouchEvaluator
    corners : (c, 3)
        Hand positions, m; the last one leads back to the first.
    parameters : (p,)
        Loads that the hand does not supply, N.
    panels : int
        Pieces of each edge, with an 8-point Gauss–Legendre rule on each.
    """
    at, weight = _rule(panels)
    net = energy = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        for t, w in zip(at, weight, strict=True):
            evaluate(a + t * (b - a), parameters)
            if not evaluate.inside:
                return None
            power = w * float(evaluate.force @ (b - a))
            net, energy = net + power, energy + abs(power) / 2
    return net, energy


def function_work(
    model: TouchFunction, test: TouchSolves, *, border: bool = False, loops: int = LOOPS, seed: int = 0
) -> LoopWork | str:
    """Work around random triangles to pentagons of a function of the probe's centre, by converged quadrature.

    Parameters
    ----------
    model : TouchFunction
    test : TouchSolves
        Corners are where its solves are.
    border : bool
        Corners instead at random in a box 30 % beyond the ranges, some trained and some not.
    loops, seed : int

    Returns
    -------
    LoopWork, or the reason why there is none
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
    net, energy = np.abs(work.net[rows]), work.energy[rows]
    ratio = net / energy
    return LoopWork(
        len(ratio),
        float(np.median(ratio)),
        float(np.quantile(ratio, 0.95)),
        float(ratio.max()),
        float(np.median(energy)),
        float((work.open[rows] / energy).max()),
    )


def _between(test: TouchSolves, rng: np.random.Generator) -> np.ndarray:
    """A polygon between places of solves; the further inputs are those of the first."""
    rows = rng.choice(len(test), min(len(test), int(rng.integers(3, 6))), replace=False)
    polygon = test.X[rows].copy()
    polygon[:, 3:] = polygon[0, 3:]
    return polygon


def _across(model: TouchFunction, test: TouchSolves, rng: np.random.Generator) -> np.ndarray:
    """A polygon in the box of the ranges made larger; the further inputs are those of some solve."""
    low, high = bounds(model.inputs)
    more = BEYOND * (high - low)
    polygon = rng.uniform(low - more, high + more, (int(rng.integers(3, 6)), len(low)))
    polygon[:, 3:] = test.X[int(rng.integers(len(test))), 3:]
    return polygon


def _rule(panels: int) -> tuple[np.ndarray, np.ndarray]:
    """Points in [0, 1] and weights of the composite rule."""
    x, w = np.polynomial.legendre.leggauss(ORDER)
    at = (np.arange(panels)[:, None] + (x + 1) / 2).ravel() / panels
    return at, np.tile(w / 2, panels) / panels
