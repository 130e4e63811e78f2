"""A pad that is glued to a surface, as of a hand that grasps or holds by suction."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres, number
from palpate.physics.interactions.bump import (
    MARGIN,
    QUADRATURE,
    Chart,
    bump,
    chart_at,
    chart_of,
    require_on_surface,
)
from palpate.physics.interactions.interaction import Attached, Energy, PlainInteraction
from palpate.physics.interactions.interaction_checks import AXES, Interval, interval, tag
from palpate.physics.interactions.sphere import RIGID
from palpate.physics.shapes.naming import require_known
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.mesh import BodyMesh
    from palpate.physics.shapes.meshing import FineMesh

__all__ = ["NO_RIGID_GRIP", "GluedPad"]

Corner = tuple[float, float]
NO_RIGID_GRIP = (
    "A rigid one would hold all of its disc, beyond whose rim the stress has no bound, so that its force would follow "
    "the elements; and with a place that varies they would come into its hold by jumps."
)
"""The reason why a glued pad is never rigid, where a ball may be."""


@dataclass(frozen=True)
class GluedPad(PlainInteraction):
    """A soft pad glued to a surface, moved by a displacement d without turning.

    Its energy is ½ ∫ k ρ |d - u|² dA, with the bump ρ of radius a around a point p of the surface; u counts from
    the body under its constant loads. The force on the hand is -∂U/∂d = ∫ k ρ (u - d) dA.

    Attributes
    ----------
    touches : str
        Name of the surface.
    radius : float, optional
        a in m. Without it the pad covers all of the surface evenly: ρ = 1.
    at : tuple of three floats, optional
        p in m, a point of the surface at rest.
    over : pair of corners, optional
        ((low, low), (high, high)) in m: p becomes an input in this rectangle of the two coordinates that tell the
        surface's points, x and y on top. Instead of `at`.
    pad : float
        Stiffness k in N/m³. A number, never "rigid" as a ball's: a rigid disc that is glued has a stress without
        bound at its rim.
    displacement : three of range or zero
        Along x, y and z, in m: a range is an input, a component of 0 stays there.
    facing : str, optional
        Axis such as ``"+z"`` along which a surface is seen that faces all ways; for `over`.
    element : float, optional
        Size in m of the elements under the pad; by default a third of the radius.
    name : str
        Put before the names of the inputs, to tell several pads apart.

    Raises
    ------
    UsageError
        For an empty range, a size that is not positive, or a pad without a place.
    """

    touches: str = "top"
    radius: float | None = None
    at: tuple[float, float, float] | None = None
    over: tuple[Corner, Corner] | None = None
    pad: float = 2e6
    displacement: tuple[Interval, Interval, Interval] = ((-0.005, 0.005),) * 3
    facing: str | None = None
    element: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        if self.pad == RIGID:
            raise UsageError(
                "A glued pad is asked to be rigid.",
                why=NO_RIGID_GRIP,
                fix="Give a stiffness in N/m³, or prescribe the displacement of a part of the surface: "
                "PrescribedDisplacement(…, within=…).",
            )
        checks.positive("The stiffness of a glued pad", self.pad, "N/m³")
        for what, size in (("radius of a glued pad", self.radius), ("element under a pad", self.element)):
            if size is not None:
                checks.positive(f"The {what}", size, "m")
        self._require_place()
        if self.at is not None:
            object.__setattr__(self, "at", checks.triple("The point of a glued pad", self.at, "m"))
        if self.over is not None:
            object.__setattr__(self, "over", _rectangle(self.over))
        object.__setattr__(self, "displacement", _three(self.displacement))

    def _require_place(self) -> None:
        places = (self.at is not None) + (self.over is not None)
        if places == (0 if self.radius is None else 1):
            return
        raise UsageError(
            "A glued pad of a given radius needs one place, a pad without a radius none.",
            why=f"It has the radius {self.radius}, at = {self.at} and over = {self.over}.",
            fix="Give radius and either at=(x, y, z) or over=((low, low), (high, high)), or none of them for a pad "
            "that covers all of the surface.",
        )

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """Return the inputs: the components of d that vary, then the place's two coordinates if it varies.

        Raises
        ------
        UsageError
            If the body has no such surface, the point is not on it, or the pad hangs over its edge.
        """
        chart = _placement(self, geometry.rest())[0]
        ranges = []
        for axis, ends in zip(AXES, self.displacement, strict=True):
            if isinstance(ends, tuple):
                ranges.append(Range(tag(self.name, f"d_{axis}"), *ends, "m"))
        if self.over is not None and chart is not None:
            for axis, low, high in zip(chart.names, *self.over, strict=True):
                ranges.append(Range(tag(self.name, f"p_{axis}"), low, high, "m"))
        return tuple(ranges)

    def __str__(self) -> str:
        size = f" of radius {millimetres(self.radius)}" if self.radius is not None else ""
        return f"pad{size} glued to {self.touches!r}, {number(self.pad)} N/m³"

    def keeps(self, matrix: np.ndarray, about: np.ndarray, geometry: Any) -> bool:
        """Return whether an isometry M about a point (m) of the body leaves the pads' energy and places the same.

        The bump is seen along one axis, so that must stay; a fixed place must stay where it is. A place that
        is an input, and the displacement, turn with M.
        """
        chart = _placement(self, geometry.rest())[0]
        if chart is None:
            return True
        at = about if self.at is None else np.asarray(self.at)
        along = abs(matrix[chart.axis, chart.axis])
        return bool(np.isclose(along, 1.0) and np.allclose(about + matrix @ (at - about), at))

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """Return fine elements wherever the pad may be."""
        chart, lower, upper = _placement(self, geometry.rest())
        if chart is None or self.radius is None:
            return ()
        margin = MARGIN * self.radius
        element = self.element if self.element is not None else self.radius / 3
        return (chart.refinement(geometry.rest(), lower - margin, upper + margin, element),)

    def attach(self, field: Any) -> Attached:
        """Return the pad's energy on an opened body."""
        import ngsolve as ng

        chart, centre, _ = _placement(self, field.rest)
        place = [ng.Parameter(0.0) for _ in range(2)] if self.over is not None else []
        weight: Any = 1.0
        if chart is not None and self.radius is not None:
            p = tuple(place) if place else tuple(map(float, centre))
            weight = bump(chart, (p[0], p[1]), self.radius)
        moves = [ng.Parameter(0.0) if isinstance(ends, tuple) else ends for ends in self.displacement]
        # a pad that always acts was glued before the body settled: each keeps the state in which it was glued
        glued = ng.GridFunction(field.base.space)
        glued.vec.data = field.base.vec
        strain = ng.CF(tuple(moves)) - (field.trial - glued)
        surface = ng.ds(definedon=field.surface(self.touches), bonus_intorder=QUADRATURE)
        energy = Energy(self.pad / 2 * weight * ng.InnerProduct(strain, strain), surface)
        inputs = (*(m for m in moves if isinstance(m, ng.Parameter)), *place)
        moved = len(inputs) - len(place)

        def approach(q: np.ndarray) -> np.ndarray | None:
            return np.concatenate([np.zeros(moved), q[moved:]])

        return Attached(parameters=inputs, energies=(energy,), approach=approach)


def _placement(pad: GluedPad, mesh: BodyMesh) -> tuple[Chart | None, np.ndarray, np.ndarray]:
    """Return the chart of the touched surface, and the corners (2,) in m between which the pad's place is.

    No chart, and corners that mean nothing, for a pad that covers all of the surface.
    """
    nowhere = np.zeros(2)
    if pad.radius is None:
        require_known("surface", pad.touches, mesh.surfaces)
        return None, nowhere, nowhere
    if pad.at is not None:
        chart = chart_at(mesh, pad.touches, pad.at)
        lower = upper = np.asarray(pad.at)[list(chart.across)]
    else:
        chart = chart_of(mesh, pad.touches, pad.facing)
        lower, upper = (np.asarray(corner) for corner in pad.over or (nowhere, nowhere))
    require_on_surface(mesh, chart, lower, upper, pad.radius)
    return chart, lower, upper


def _rectangle(value: Any) -> tuple[Corner, Corner]:
    corners = np.asarray(value, dtype=float)
    if corners.shape != (2, 2) or not np.isfinite(corners).all() or (corners[0] >= corners[1]).any():
        raise UsageError(
            f"The places of a glued pad are {value!r}.",
            why="They are a rectangle that is not empty: a lower and an upper corner, of two coordinates each.",
            fix="For example over=((0.03, 0.03), (0.07, 0.07)), in m; or at=(x, y, z) for a fixed place.",
        )
    (a, b), (c, d) = corners.tolist()
    return (a, b), (c, d)


def _three(value: Any) -> tuple[Interval, Interval, Interval]:
    parts = tuple(value) if isinstance(value, Iterable) else (value,)
    if len(parts) != 3:
        raise UsageError(
            f"The displacement of a glued pad is {value!r}.",
            why="It has three components, along x, y and z.",
            fix="Give a range or a number for each, for example (0.0, 0.0, (-0.005, 0.005)).",
        )
    names = [f"The displacement of a glued pad along {axis}" for axis in AXES]
    x, y, z = (_from_rest(name, interval(name, part, "m")) for name, part in zip(names, parts, strict=True))
    return x, y, z


def _from_rest(what: str, ends: Interval) -> Interval:
    """Return a component of the displacement; one that is no input is zero, as the pad is glued at rest."""
    if isinstance(ends, tuple) or ends == 0.0:
        return ends
    raise UsageError(
        f"{what} is fixed at {ends:g} m.",
        why="The pad is glued to a body that it does not move yet; a component that stays, stays at 0.",
        fix="Give a range that contains the value, and hold that input of the solve.",
    )
