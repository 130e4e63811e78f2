"""Solves of a field, and how it is parted: how it begins, what travels with the probe, modes, coefficients."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from palpate.learning.fields.dimples import fitted_dimple, touched_nodes, travelling_values
from palpate.learning.fields.kernel import at_solves
from palpate.learning.fields.modes import SurfaceModes, left_out
from palpate.learning.fields.search import Coefficients
from palpate.learning.fields.varying import fitted_variation
from palpate.network.radial import RadialFunction
from palpate.surrogates import TouchedSurface
from palpate.surrogates.field import Dimple, Rise
from palpate.units import Range, bounds

__all__ = ["Parted", "Solves", "best_part"]

_TO_COMPARE: tuple[RadialFunction, ...] = ("matern-5/2",)  # how fields rise


@dataclass(frozen=True, eq=False)
class Solves:
    """Checked solves in contact, the field less its rest, and all that is known beside them."""

    X: np.ndarray
    values: np.ndarray
    depth: np.ndarray
    groups: np.ndarray
    inputs: tuple[Range, ...]
    surface: TouchedSurface
    radius: float
    points: np.ndarray
    mass: np.ndarray
    radius_input: int | None = None

    @property
    def scaled(self) -> np.ndarray:
        """Inputs (N, n) over the ranges, −1 to 1."""
        low, high = bounds(self.inputs)
        return np.asarray((2.0 * self.X - low - high) / (high - low))


@dataclass(frozen=True, eq=False)
class Parted:
    """A rise, and what follows from it: travelling part, modes, coefficients."""

    rise: Rise
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
    deepest = float(solves.depth.max())
    rise = Rise(name, deepest, length if name == "series" else math.inf)
    C, remainder, dimple = np.ascontiguousarray(solves.X[:, :3]), solves.values, None
    probe = {"surface": solves.surface, "points": solves.points}
    if travelling:
        known: dict[str, Any] = {**probe, "mass": solves.mass, "radius": solves.radius, "border": border}
        dimple = fitted_dimple(remainder, C, solves.depth, rise=rise, **known)
    if dimple is not None:
        remainder = remainder - travelling_values(dimple, C, solves.depth, rise, **probe)  # type: ignore[arg-type]
    return _with_modes(solves, rise, dimple, remainder, tolerance, most)


def _with_modes(
    solves: Solves, rise: Rise, dimple: Dimple | None, remainder: np.ndarray, tolerance: float, most: int
) -> Parted:
    """Modes and coefficients of what the travelling part leaves."""
    modes = SurfaceModes.of(remainder, solves.mass)
    count = min(modes.count(tolerance), most)
    missed = modes.missed
    truncation = float(missed[count]) if count < len(missed) else 0.0
    modes = modes.take(count)
    weighted = (modes.modes * solves.mass[:, None]).reshape(count, -1)
    along = remainder.reshape(len(remainder), -1) @ weighted.T
    problem = Coefficients(solves.scaled, along, rise.at(solves.depth), solves.groups)
    beyond = left_out(remainder, solves.mass, count, solves.groups)
    return Parted(rise, dimple, modes, problem, truncation, beyond)


def _varied(solves: Solves, part: Parted, tolerance: float, most: int) -> list[Parted]:
    """The same with a dimple that differs from place to place; none where columns left out say that it does not."""
    if part.dimple is None:
        return []
    C = np.ascontiguousarray(solves.X[:, :3])
    remainder = solves.values - travelling_values(
        part.dimple, C, solves.depth, part.rise, solves.surface, solves.points
    )
    found = fitted_variation(
        *(remainder, solves.X, solves.depth, solves.groups),
        dimple=part.dimple,
        rise=part.rise,
        surface=solves.surface,
        points=solves.points,
        mass=solves.mass,
    )
    if found is None:
        return []
    variation, shown = found
    dimple = replace(part.dimple, variation=variation)
    return [_with_modes(solves, part.rise, dimple, remainder - shown, tolerance, most)]


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
    first = _chosen([of(names[-1], border) for border in borders])
    border = first.dimple is None or bool(_same_touched(first, solves))
    even = _chosen([first, *(of(name, border) for name in names[:-1])])
    return _chosen([even, *_varied(solves, even, tolerance, most)])


def _same_touched(part: Parted, solves: Solves) -> bool:
    """Whether the border's nodes are in a travelling part."""
    assert part.dimple is not None
    return bool((part.dimple.touched == touched_nodes(solves.surface, solves.points, solves.radius)).all())


def _chosen(parted: list[Parted]) -> Parted:
    """The one that misses least of solves left out."""
    return parted[0] if len(parted) == 1 else min(parted, key=lambda one: one.missed)
