"""A rigid sphere that presses a surface, by all that it meets of it: U₀ = U₀(s_m), s_m the equivalent depth.

`ContactBaseline` counts U₀ from the depth s at the closest point. Here it is the depth on a plane that has the same
overlap, s_m = R − e(c), with the field e of `palpate.surrogates.surface.ball_overlap`:

    ∇U₀ = −U₀' ∇e        ∇²U₀ = U₀'' ∇e ∇eᵀ − U₀' ∇²e

Everything else is that of the contact: the depth s that is stated, where a touch begins, and the saturated depth at
which ℓ is asked beyond the training.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import part
from palpate.surrogates.baselines.baseline import register_baseline
from palpate.surrogates.baselines.contact_baseline import ContactBaseline, leave_contact
from palpate.surrogates.baselines.graph_form import BaselineForm, Graph, Touch, Value
from palpate.surrogates.contact_law import law_at
from palpate.surrogates.continuation import saturated
from palpate.surrogates.energy_kernels import (
    GRADIENT,
    HESSIAN,
    MORE,
    OTHER,
    OUTWARD,
    ROOT,
    SURFACE,
    VECTORS,
    Compiled,
)
from palpate.surrogates.surface import TouchedSurface, distance_into

__all__ = ["LARGEST", "SMALLEST", "OverlapBaseline"]

_TWICE, _FACTOR, _LENGTH, _RADIUS = range(4)  # places in the numbers of a contact
# bounds of equivalent depth over depth: they count within micrometres of first contact, where e is not as exact as d
SMALLEST, LARGEST = 0.2, 4.0


@register_baseline
@dataclass(frozen=True, eq=False)
class OverlapBaseline(ContactBaseline):
    """The contact law of a rigid sphere at the equivalent depth of its overlap on a touched surface.

    Attributes
    ----------
    law : ContactLaw
        U₀ by the equivalent depth s_m.
    touched : TouchedSurface
        The surface at rest.
    probe_radius : float
        Radius R of the probe, m.
    radius_at : int, optional
        None: the radius is fixed.
    resolved : float, optional
        As that of a `ContactBaseline`, m.
    overlap : (i, j, k) array
        What the coefficients of the field e = R − s_m are more than those of `touched`, m. A file holds this
        difference: the digits of the distance are in `touched`.
    weight : float
        m, the weight of the overlap: 1 for all of it, ½ for Hertz's rule on smooth curved surfaces.

    Raises
    ------
    UsageError
        If there is no overlap, it has another lattice than `touched`, or the radius is an input.
    """

    name: ClassVar[str] = "overlap"

    overlap: np.ndarray | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        if self.overlap is None or self.radius_at is not None:
            raise UsageError(
                "A baseline by the overlap needs an overlap of a ball of one radius.",
                fix="Make it with `ContactBaseline` where the radius is an input.",
            )
        if self.overlap.shape != self.touched.coefficients.shape or not np.isfinite(self.overlap).all():
            raise UsageError(
                f"An overlap of {self.overlap.shape} numbers does not fit a surface of "
                f"{self.touched.coefficients.shape}.",
                fix="Make it with `Overlap.of` on the touched surface.",
            )
        if not math.isclose(self.touched.radius, self.probe_radius, rel_tol=1e-9):
            raise UsageError(
                f"An overlap of a ball of {self.touched.radius:g} m does not fit one of {self.probe_radius:g} m.",
                fix="Make the overlap on a surface of the probe's radius.",
            )

    def __str__(self) -> str:
        return f"{super().__str__()}, by its overlap (weight {self.weight:g})"

    @cached_property
    def pressed(self) -> TouchedSurface:
        """The field e from which the law's depth is counted."""
        assert self.overlap is not None
        return replace(self.touched, coefficients=self.touched.coefficients + self.overlap)

    @property
    def surfaces(self) -> tuple[TouchedSurface, ...]:
        """The touched surface and the field of the overlap."""
        return self.touched, self.pressed

    def law_depth(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return s_m (N,) in m, −∇s_m (N, 3) and −∇²s_m (N, 3, 3) at inputs X (N, n)."""
        distance, slope, bend = self.pressed.at(np.ascontiguousarray(X[:, :3]))
        depth, s = self.probe_radius - distance, self.coordinate(X)
        _, normal, curved = self.touched.at(np.ascontiguousarray(X[:, :3]))
        factor = np.where(depth < SMALLEST * s, SMALLEST, LARGEST)
        off = (s > 0.0) & ((depth < SMALLEST * s) | (depth > LARGEST * s))
        return (
            np.where(off, factor * s, depth),
            np.where(off[:, None], factor[:, None] * normal, slope),
            np.where(off[:, None, None], factor[:, None, None] * curved, bend),
        )

    def compiled(self) -> Compiled:
        """Return the kernels and their arguments."""
        numbers, surface = super().compiled().args
        return Compiled(
            None, (numbers, surface, self.pressed.compiled()), enter=_enter_overlap, leave=_leave_overlap
        )

    def graph_form(self, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
        """Return the contact law at the equivalent depth of the overlap."""
        assert touch is not None  # it has a surface
        e, slope, bend = touch.distance_to(self.pressed)(place)
        measured = self.radius - e
        depth = measured
        ends = (SMALLEST, measured < touch.depth * SMALLEST), (LARGEST, measured > touch.depth * LARGEST)
        for factor, off in ends:
            depth, slope = (
                graph.where(off, touch.depth * factor, depth),
                graph.where(off, touch.normal * factor, slope),
            )
            bend = graph.where(off.spread(2), touch.bend * factor, bend)
        return self._law_form(graph, graph.where(touch.contact, depth, 1.0), slope, bend)

    def c_source(self) -> str:
        """Return the kernels in C99, those of a contact before them."""
        return f"{super().c_source()}\n{Path(__file__).with_suffix('.c').read_text('utf-8')}"


@part
def _enter_overlap(position, parameters, moved, base, small, numbers, args) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the law's energy and derivatives; move the place at which ℓ is asked to the saturated depth."""
    own, surface, overlap = args
    d, D, b, B = small[VECTORS, OUTWARD], small[SURFACE], small[VECTORS, GRADIENT], small[HESSIAN]
    e, E = small[MORE, 0], small[OTHER]
    s = own[_RADIUS] - distance_into(position, d, D, *surface)
    base[1] = s
    if s <= 0.0:
        return False
    equivalent = own[_RADIUS] - distance_into(position, e, E, *overlap)
    if equivalent < SMALLEST * s or equivalent > LARGEST * s:
        factor = SMALLEST if equivalent < SMALLEST * s else LARGEST
        equivalent = factor * s
        for i in range(3):
            e[i] = factor * d[i]
            for j in range(3):
                E[i, j] = factor * D[i, j]
    value, slope, curvature = law_at(equivalent, own[_TWICE], own[_FACTOR], own[_LENGTH])
    base[0], base[2], base[3] = value, 0.0, math.sqrt(2.0 * value)
    for i in range(3):
        b[i] = -slope * e[i]
        small[ROOT, 0, i] = b[i] / base[3]
        for j in range(3):
            B[i, j] = curvature * e[i] * e[j] - slope * E[i, j]
    depth = saturated(s, numbers[1], numbers[2])[0]
    for i in range(3):
        moved[i] += (s - depth) * d[i]
    return True


@part
def _leave_overlap(position, base, small, numbers, args) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take ∇ℓ and ∇²ℓ to those by the place, as a contact does."""
    own, surface, _ = args
    leave_contact(position, base, small, numbers, (own, surface))
