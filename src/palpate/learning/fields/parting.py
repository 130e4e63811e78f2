"""How a field is parted: how it begins, what travels with the probe, modes, coefficients."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.learning.fields.dimples import borders, faded, fitted_dimple
from palpate.learning.fields.kernel import at_solves
from palpate.learning.fields.modes import SurfaceModes, left_out
from palpate.learning.fields.search import Coefficients, parts_of
from palpate.learning.fields.solves import Solves
from palpate.learning.fields.varying import fitted_variation
from palpate.network.radial import RadialFunction
from palpate.surrogates.field import Dimple, Rise

__all__ = ["Parted", "best_part"]

_PARTS = 2  # of six of the solves: how often all is learnt again, to see whether a dimple varies
_TO_COMPARE: tuple[RadialFunction, ...] = ("matern-5/2",)  # how fields rise


@dataclass(frozen=True, eq=False)
class Parted:
    """A rise, and what follows from it: travelling part, modes, coefficients."""

    rise: Rise
    free: Dimple | None  # as fitted, before it fades
    dimple: Dimple | None
    modes: SurfaceModes
    problem: Coefficients
    truncation: float
    remainder: np.ndarray  # (N, nodes, components), what the travelling part leaves
    mass: np.ndarray

    @cached_property
    def truncation_left_out(self) -> float:
        """What as many modes of other solves miss of some: root mean square over surface and solves."""
        return left_out(self.remainder, self.mass, len(self.modes.modes), self.problem.groups)

    @cached_property
    def missed(self) -> float:
        """Mean square of what modes, and coefficients by a unit at each solve, miss of solves left out."""
        learnt = at_solves(self.problem, radials=_TO_COMPARE).error
        return float(learnt**2 + np.nan_to_num(self.truncation_left_out) ** 2)

    def missed_of(self, left: Solves) -> float:
        """Squares, averaged over the surface and summed over other solves, that are missed of these."""
        answered = at_solves(self.problem, radials=_TO_COMPARE).layer.predict(left.scaled)
        along = answered * (self.problem.scale * self.rise.at(left.depth))[:, None]
        missed = left.remainder(self.dimple, self.rise) - np.tensordot(along, self.modes.modes, 1)
        return float(((missed**2).sum(axis=2) @ left.mass).sum())


def _parted(
    solves: Solves, name: str, length: float, tolerance: float, most: int, travelling: bool, within: float
) -> Parted:
    """Travelling part, modes and coefficients of the fields, as they follow from a rise."""
    rise = Rise(name, float(solves.depth.max()), length if name == "series" else math.inf)
    dimple = fitted_dimple(solves, rise, within) if travelling else None
    return _with_modes(solves, rise, dimple, tolerance, most)


def _with_modes(solves: Solves, rise: Rise, free: Dimple | None, tolerance: float, most: int) -> Parted:
    """Modes and coefficients of what the travelling part, once it fades, leaves."""
    dimple = None if free is None else faded(free)
    remainder = solves.remainder(dimple, rise)
    modes = SurfaceModes.of(remainder, solves.mass)
    count = min(modes.count(tolerance), most)
    missed = modes.missed
    truncation = float(missed[count]) if count < len(missed) else 0.0
    modes = modes.take(count)
    weighted = (modes.modes * solves.mass[:, None]).reshape(count, -1)
    along = remainder.reshape(len(remainder), -1) @ weighted.T
    problem = Coefficients(solves.scaled, along, rise.at(solves.depth), solves.groups)
    return Parted(rise, free, dimple, modes, problem, truncation, remainder, solves.mass)


def _varied(solves: Solves, part: Parted, tolerance: float, most: int) -> Parted | None:
    """The same with a dimple that differs from place to place; None where columns left out say that it does not."""
    if part.free is None:
        return None
    even = solves.travelling(part.free, part.rise)
    left = [u - one for u, one in zip(solves.values, even, strict=True)]
    variation = fitted_variation(solves, left, part.free, part.rise)
    if variation is None:
        return None
    return _with_modes(solves, part.rise, replace(part.free, variation=variation), tolerance, most)


def _best_of_both(solves: Solves, even: Parted, tolerance: float, most: int) -> Parted:
    """With a dimple that varies where the whole, learnt without some columns, then misses less of them.

    All of it is learnt again for each part that is left out: a variation has thousands of numbers, and known solves
    say nothing against them.
    """
    varied = _varied(solves, even, tolerance, most)
    if varied is None or even.free is None:
        return even
    within = even.free.within / solves.radius
    missed = np.zeros(2)
    for out in parts_of(solves.groups)[:_PARTS]:
        kept, left = solves.take(~out), solves.take(out)
        free = fitted_dimple(kept, even.rise, within)
        without = _with_modes(kept, even.rise, free, tolerance, most)
        missed += [
            one.missed_of(left) for one in (without, _varied(kept, without, tolerance, most) or without)
        ]
    return varied if missed[1] < missed[0] else even


def best_part(
    solves: Solves,
    names: Sequence[str],
    length: float,
    tolerance: float,
    most: int,
    travelling: bool,
) -> Parted:
    """First whether the border travels too, then the rise: what misses least of solves left out; then how it varies."""

    def of(name: str, within: float) -> Parted:
        return _parted(solves, name, length, tolerance, most, travelling, within)

    every = borders(solves)
    both = [of(names[-1], within) for within in every[: None if travelling else 1]]
    first = _chosen(both)
    within = every[both.index(first)]
    even = _chosen([first, *(of(name, within) for name in names[:-1])])
    return _best_of_both(solves, even, tolerance, most)


def _chosen(parted: list[Parted]) -> Parted:
    """The one that misses least of solves left out."""
    return parted[0] if len(parted) == 1 else min(parted, key=lambda one: one.missed)
