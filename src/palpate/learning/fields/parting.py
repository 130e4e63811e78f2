"""How a field is parted: how it begins, what travels with the probe, modes, coefficients."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.learning.fields.dimples import faded, fitted_dimple
from palpate.learning.fields.kernel import at_solves
from palpate.learning.fields.modes import SurfaceModes, left_out
from palpate.learning.fields.search import Coefficients
from palpate.learning.fields.solves import Solves
from palpate.learning.fields.varying import fitted_variation
from palpate.network.radial import RadialFunction
from palpate.surrogates.field import Dimple, Rise

__all__ = ["Parted", "best_part"]

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
    truncation_left_out: float

    @cached_property
    def missed(self) -> float:
        """Mean square of what modes, and coefficients by a unit at each solve, miss of solves left out."""
        learnt = at_solves(self.problem, radials=_TO_COMPARE).error
        return float(learnt**2 + np.nan_to_num(self.truncation_left_out) ** 2)


def _parted(
    solves: Solves, name: str, length: float, tolerance: float, most: int, travelling: bool, border: bool
) -> Parted:
    """Travelling part, modes and coefficients of the fields, as they follow from a rise."""
    rise = Rise(name, float(solves.depth.max()), length if name == "series" else math.inf)
    dimple = fitted_dimple(solves, rise, border=border) if travelling else None
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
    beyond = left_out(remainder, solves.mass, count, solves.groups)
    return Parted(rise, free, dimple, modes, problem, truncation, beyond)


def _varied(solves: Solves, part: Parted, tolerance: float, most: int) -> list[Parted]:
    """The same with a dimple that differs from place to place; none where columns left out say that it does not."""
    if part.free is None:
        return []
    even = solves.travelling(part.free, part.rise)
    left = [u - one for u, one in zip(solves.values, even, strict=True)]
    variation = fitted_variation(solves, left, part.free, part.rise)
    if variation is None:
        return []
    return [_with_modes(solves, part.rise, replace(part.free, variation=variation), tolerance, most)]


def best_part(
    solves: Solves,
    names: Sequence[str],
    length: float,
    tolerance: float,
    most: int,
    travelling: bool,
) -> Parted:
    """First whether the border travels too, then the rise: what misses least of solves left out; then how it varies."""

    def of(name: str, border: bool) -> Parted:
        return _parted(solves, name, length, tolerance, most, travelling, border)

    borders = (True, False) if travelling else (True,)
    both = [of(names[-1], border) for border in borders]
    first = _chosen(both)
    border = first is both[0]
    even = _chosen([first, *(of(name, border) for name in names[:-1])])
    return _chosen([even, *_varied(solves, even, tolerance, most)])


def _chosen(parted: list[Parted]) -> Parted:
    """The one that misses least of solves left out."""
    return parted[0] if len(parted) == 1 else min(parted, key=lambda one: one.missed)
