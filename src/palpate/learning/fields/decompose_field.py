"""A field is decomposed into its growth with depth, what moves with the probe, and modes with their coefficients.

The modes are a proper orthogonal decomposition in the mean square over the surface (Sirovich 1987). With shares m_j of
the surface the inner product is ⟨u, v⟩ = Σ_j m_j u_j·v_j. Of snapshots u_i the modes φ_k are orthonormal in it, and the
best r of them miss (Σ_{k>r} σ_k²/N)^½ of the snapshots in the root mean square.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.errors import UsageError
from palpate.learning.fields.field_search import FOLDS, Coefficients, layer_at_solves
from palpate.learning.fields.fit_local_mode import border_widths, fade_out, fit_local_mode, fit_variation
from palpate.learning.fields.snapshots import Solves
from palpate.learning.folds import fold_masks
from palpate.network.radial import RadialFunction
from palpate.surrogates.fields import DepthAmplitude, LocalMode

__all__ = [
    "Decomposition",
    "SurfaceModes",
    "best_decomposition",
    "left_out",
    "lumped_mass",
]

_ROUND_OFF = 1e-13  # modes below this share of the largest are round-off
_FOLDS = 10


def lumped_mass(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Share (nodes,) of the surface's area that each node stands for: a third of its triangles'.

    Parameters
    ----------
    points : (nodes, 3)
        Corners of the triangles, m.
    triangles : (t, 3) int
        Nodes of each triangle of the surface.

    Raises
    ------
    UsageError
        If the triangles have no area.
    """
    a, b, c = np.moveaxis(np.asarray(points, float)[triangles], 1, 0)
    thirds = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0, 3)
    mass = np.bincount(np.ravel(triangles), thirds, minlength=len(points))
    if not (np.isfinite(mass).all() and mass.sum() > 0):
        raise UsageError(
            "These triangles have no area.", fix="Pass the triangles of a surface and its nodes in m."
        )
    return np.asarray(mass / mass.sum())


@dataclass(frozen=True, eq=False)
class SurfaceModes:
    """Modes of N snapshots."""

    modes: np.ndarray  # (k, nodes, components), φ, the largest first; zero at nodes that stand for no surface
    sizes: np.ndarray  # (k,), σ_k/√N: root mean square of the coefficients, in the field's unit

    @classmethod
    def of(cls, values: np.ndarray, mass: np.ndarray) -> SurfaceModes:
        """Return the modes of fields (N, nodes, components), by singular values in shares of mass (nodes,)."""
        N, nodes, components = values.shape
        root = np.sqrt(mass)[:, None]
        V, sizes = _right((values * root).reshape(N, -1))
        with np.errstate(divide="ignore", invalid="ignore"):
            modes = np.where(root > 0, V.reshape(-1, nodes, components) / root, 0.0)
        return cls(modes, sizes / np.sqrt(N))

    def count(self, tolerance: float) -> int:
        """Fewest modes, one at least, that miss at most a root mean square of the snapshots, in the field's unit."""
        return int(np.clip((self.missed > tolerance).sum(), 1, max(len(self.sizes), 1)))

    @property
    def missed(self) -> np.ndarray:
        """Root mean square (k,) of the snapshots that the first r = 0, 1, … modes miss."""
        return np.asarray(np.sqrt(np.cumsum((self.sizes**2)[::-1])[::-1]))

    def take(self, count: int) -> SurfaceModes:
        """The first so many."""
        return SurfaceModes(self.modes[:count], self.sizes[:count])


def _right(B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal right singular vectors and singular values of B above round-off; one vector at least."""
    _, sizes, V = np.linalg.svd(B, full_matrices=False)
    k = max(1, int((sizes > _ROUND_OFF * max(float(sizes[0]), 1e-300)).sum()))
    return V[:k], sizes[:k]


def left_out(values: np.ndarray, mass: np.ndarray, count: int, groups: np.ndarray) -> float:
    """Root mean square that so many modes of the other snapshots miss of each tenth of the groups (N,) left out."""
    B = (values * np.sqrt(mass)[:, None]).reshape(len(values), -1)
    _, own = np.unique(groups, return_inverse=True)
    total, folds = 0.0, min(_FOLDS, int(own.max()) + 1)
    if folds < 2:
        return float("nan")
    # all that counts is in the span of the snapshots: their Gram matrix's root is as good, and small
    U, s, _ = np.linalg.svd(B, full_matrices=False)
    small = U * s
    for fold in range(folds):
        out = own % folds == fold
        V = _right(small[~out])[0][:count]
        total += float(((small[out] - small[out] @ V.T @ V) ** 2).sum())
    return float(np.sqrt(total / len(values)))


_PARTS = 2  # of six of the solves: how often all is learnt again, to see whether a local mode varies
_TO_COMPARE: tuple[RadialFunction, ...] = ("matern-5/2",)  # how fields grow


@dataclass(frozen=True, eq=False)
class Decomposition:
    """An amplitude, and what follows from it: moving part, modes, coefficients."""

    amplitude: DepthAmplitude
    free: LocalMode | None  # as fitted, before it fades
    local_mode: LocalMode | None
    modes: SurfaceModes
    problem: Coefficients
    truncation: float
    remainder: np.ndarray  # (N, nodes, components), what the moving part leaves
    mass: np.ndarray

    @cached_property
    def truncation_left_out(self) -> float:
        """Root mean square over surface and solves of what as many modes of other solves miss of some."""
        return left_out(self.remainder, self.mass, len(self.modes.modes), self.problem.groups)

    @cached_property
    def missed(self) -> float:
        """Mean square of what modes, and coefficients by a unit at each solve, miss of solves left out."""
        learnt = layer_at_solves(self.problem, radials=_TO_COMPARE).error
        return float(learnt**2 + np.nan_to_num(self.truncation_left_out) ** 2)

    def missed_of(self, left: Solves) -> float:
        """Squares, averaged over the surface and summed over other solves, that are missed of these."""
        answered = layer_at_solves(self.problem, radials=_TO_COMPARE).layer.predict(left.scaled)
        along = answered * (self.problem.scale * self.amplitude.at(left.depth))[:, None]
        missed = left.remainder(self.local_mode, self.amplitude) - np.tensordot(along, self.modes.modes, 1)
        return float(((missed**2).sum(axis=2) @ left.mass).sum())


def _decomposed(
    solves: Solves, name: str, length: float, tolerance: float, most: int, moving: bool, within: float
) -> Decomposition:
    """Travelling part, modes and coefficients of the fields, as they follow from an amplitude."""
    amplitude = DepthAmplitude(name, float(solves.depth.max()), length if name == "series" else math.inf)
    local_mode = fit_local_mode(solves, amplitude, within) if moving else None
    return _with_modes(solves, amplitude, local_mode, tolerance, most)


def _with_modes(
    solves: Solves, amplitude: DepthAmplitude, free: LocalMode | None, tolerance: float, most: int
) -> Decomposition:
    """Modes and coefficients of what the moving part, once it fades, leaves."""
    local_mode = None if free is None else fade_out(free)
    remainder = solves.remainder(local_mode, amplitude)
    modes = SurfaceModes.of(remainder, solves.mass)
    count = min(modes.count(tolerance), most)
    missed = modes.missed
    truncation = float(missed[count]) if count < len(missed) else 0.0
    modes = modes.take(count)
    weighted = (modes.modes * solves.mass[:, None]).reshape(count, -1)
    along = remainder.reshape(len(remainder), -1) @ weighted.T
    problem = Coefficients(solves.scaled, along, amplitude.at(solves.depth), solves.groups)
    return Decomposition(amplitude, free, local_mode, modes, problem, truncation, remainder, solves.mass)


def _varied(solves: Solves, part: Decomposition, tolerance: float, most: int) -> Decomposition | None:
    """Return the decomposition whose local mode varies with the place; None where solves left out say it does not."""
    if part.free is None:
        return None
    even = solves.moving(part.free, part.amplitude)
    left = [u - one for u, one in zip(solves.values, even, strict=True)]
    variation = fit_variation(solves, left, part.free, part.amplitude)
    if variation is None:
        return None
    return _with_modes(solves, part.amplitude, replace(part.free, variation=variation), tolerance, most)


def _best_of_both(solves: Solves, even: Decomposition, tolerance: float, most: int) -> Decomposition:
    """With a local mode that varies where the whole, learnt without some columns, then misses less of them.

    All of it is learnt again for each part that is left out: a variation has thousands of numbers, and known solves
    say nothing against them.
    """
    varied = _varied(solves, even, tolerance, most)
    if varied is None or even.free is None:
        return even
    within = even.free.within / solves.radius
    missed = np.zeros(2)
    for out in fold_masks(solves.groups, FOLDS)[:_PARTS]:
        kept, left = solves.take(~out), solves.take(out)
        free = fit_local_mode(kept, even.amplitude, within)
        without = _with_modes(kept, even.amplitude, free, tolerance, most)
        missed += [
            one.missed_of(left) for one in (without, _varied(kept, without, tolerance, most) or without)
        ]
    return varied if missed[1] < missed[0] else even


def best_decomposition(
    solves: Solves,
    names: Sequence[str],
    length: float,
    tolerance: float,
    most: int,
    moving: bool,
) -> Decomposition:
    """Return the decomposition that misses least of solves left out.

    First it is decided whether the border moves too, then how the field grows, then whether its local mode varies.
    """

    def of(name: str, within: float) -> Decomposition:
        return _decomposed(solves, name, length, tolerance, most, moving, within)

    every = border_widths(solves)
    both = [of(names[-1], within) for within in every[: None if moving else 1]]
    first = _least_error(both)
    within = every[both.index(first)]
    even = _least_error([first, *(of(name, within) for name in names[:-1])])
    return _best_of_both(solves, even, tolerance, most)


def _least_error(decompositions: list[Decomposition]) -> Decomposition:
    """Return the decomposition that misses least of solves left out."""
    return decompositions[0] if len(decompositions) == 1 else min(decompositions, key=lambda one: one.missed)
