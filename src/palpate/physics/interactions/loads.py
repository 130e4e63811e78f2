"""Dead loads: forces whose size and direction do not follow the body as it deforms.

With the load vector l of one unit the energy is Π = W - q l·u. The response is -∂U/∂q = l·u: the displacement
(a mean of it, or its integral) that the load does work on.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.arguments import require_positive
from palpate.physics.interactions.arguments import along, direction_of, range_of
from palpate.physics.interactions.footprint import (
    MARGIN,
    QUADRATURE,
    Chart,
    bump,
    chart_at,
    require_on_surface,
)
from palpate.physics.interactions.interaction import Attached
from palpate.physics.shapes.naming import require_known, require_triple
from palpate.physics.words import number
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.mesh import BodyMesh
    from palpate.physics.shapes.meshing import FineMesh

__all__ = ["BodyForce", "PointForce", "SurfaceTraction"]

Ends = tuple[float, float]
Point = tuple[float, float, float]


def dead_load(load: np.ndarray) -> Attached:
    """One input whose load vector is (dof,)."""
    import ngsolve as ng

    return Attached(parameters=(ng.Parameter(0.0),), loads=load[None, :])


@dataclass(frozen=True)
class PointForce:
    """A force at a point of a surface, spread over a small footprint.

    A force on a mathematical point would sink in without bound as the mesh gets finer. So it is spread as a
    traction F ρ/∫ρ dA with the bump ρ of radius a (see `footprint`); the response is the displacement along the
    force, in m, averaged with the same weight.

    Attributes
    ----------
    at : tuple of three floats
        Point of the surface at rest, in m.
    radius : float
        a in m.
    force : range
        (low, high) in N.
    direction : direction
        An axis such as ``"-z"``, or three numbers, taken to length 1.
    surface : str
    element : float, optional
        Size in m of the elements under the footprint; by default a third of the radius.
    name : str
        Name of the input.

    Raises
    ------
    UsageError
        For a radius that is not positive, an empty range or a direction without length.
    """

    at: Point
    radius: float
    force: Ends
    direction: Any = "-z"
    surface: str = "top"
    element: float | None = None
    name: str = "F"

    def __post_init__(self) -> None:
        require_positive("The radius of a point force", self.radius, "m")
        if self.element is not None:
            require_positive("The element under a point force", self.element, "m")
        object.__setattr__(self, "at", require_triple("The point of a force", self.at))
        object.__setattr__(self, "force", range_of("A point force", self.force, "N"))
        direction = direction_of("The direction of a point force", self.direction)
        object.__setattr__(self, "direction", direction)

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """The size of the force, in N.

        Raises
        ------
        UsageError
            If the body has no such surface, the point is not on it or its footprint hangs over the edge.
        """
        self._chart(geometry.rest())
        return (Range(self.name, *self.force, "N"),)

    def __str__(self) -> str:
        at = ", ".join(number(1e3 * x) for x in self.at)
        return f"force along {along(self.direction)} at ({at}) mm of {self.surface!r}"

    def describe(self) -> dict[str, Any]:
        """Everything that decides what it does, as plain data for a JSON file."""
        return {"type": "PointForce", **asdict(self)}

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """Fine elements under the footprint."""
        mesh = geometry.rest()
        chart = self._chart(mesh)
        centre, margin = np.asarray(self.at)[list(chart.across)], MARGIN * self.radius
        element = self.element if self.element is not None else self.radius / 3
        return (chart.refinement(mesh, centre - margin, centre + margin, element),)

    def attach(self, field: Any) -> Attached:
        """Its load on an opened body."""
        import ngsolve as ng

        chart = self._chart(field.rest)
        first, second = chart.across
        weight = bump(chart, (self.at[first], self.at[second]), self.radius)
        surface = ng.ds(definedon=field.surface(self.surface), bonus_intorder=QUADRATURE)
        load = field.load(lambda v: weight * ng.InnerProduct(ng.CF(self.direction), v) * surface)
        # the same quadrature gives the area, so that the force is exact on any mesh
        along = field.interpolate(ng.CF(self.direction))
        return dead_load(load / float(load @ along))

    def _chart(self, mesh: BodyMesh) -> Chart:
        chart = chart_at(mesh, self.surface, self.at)
        centre = np.asarray(self.at)[list(chart.across)]
        require_on_surface(mesh, chart, centre, centre, self.radius)
        return chart


@dataclass(frozen=True)
class SurfaceTraction:
    """A dead traction, per undeformed area, over all of a surface.

    The response is ∫ e·u dA over the surface, in m³.

    Attributes
    ----------
    surface : str
    direction : direction or "normal"
        An axis, three numbers, or the outward normal of the surface at rest.
    traction : range
        (low, high) in Pa.
    name : str
        Name of the input.

    Raises
    ------
    UsageError
        For an empty range or a direction without length.
    """

    surface: str
    direction: Any
    traction: Ends
    name: str = "t"

    def __post_init__(self) -> None:
        object.__setattr__(self, "traction", range_of("A traction", self.traction, "Pa"))
        if self.direction != "normal":
            direction = direction_of("The direction of a traction", self.direction)
            object.__setattr__(self, "direction", direction)

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """The size of the traction, in Pa; `UsageError` if the body has no such surface."""
        require_known("surface", self.surface, geometry.surfaces)
        return (Range(self.name, *self.traction, "Pa"),)

    def __str__(self) -> str:
        return f"traction on {self.surface!r} along {along(self.direction)}"

    def describe(self) -> dict[str, Any]:
        """Everything that decides what it does, as plain data for a JSON file."""
        return {"type": "SurfaceTraction", **asdict(self)}

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """None."""
        return ()

    def attach(self, field: Any) -> Attached:
        """Its load on an opened body."""
        import ngsolve as ng

        direction = ng.specialcf.normal(3) if self.direction == "normal" else ng.CF(self.direction)
        surface = ng.ds(definedon=field.surface(self.surface))
        return dead_load(field.load(lambda v: ng.InnerProduct(direction, v) * surface))


@dataclass(frozen=True)
class BodyForce:
    """A dead force per undeformed volume: a weight whose size varies.

    What is always there, such as the weight of a body at rest, is `Body(..., gravity=...)`. The response is
    ∫ e·u dV, in m⁴.

    Attributes
    ----------
    force : range
        (low, high) in N/m³: a density in kg/m³ times an acceleration in m/s².
    direction : direction
        An axis such as ``"-z"``, or three numbers.
    region : str, optional
        Part of the body; all of it by default.
    name : str
        Name of the input.

    Raises
    ------
    UsageError
        For an empty range or a direction without length.
    """

    force: Ends
    direction: Any = "-z"
    region: str | None = None
    name: str = "b"

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", range_of("A body force", self.force, "N/m³"))
        direction = direction_of("The direction of a body force", self.direction)
        object.__setattr__(self, "direction", direction)

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """The size of the force, in N/m³; `UsageError` if the body has no such region."""
        if self.region is not None:
            require_known("region", self.region, geometry.regions)
        return (Range(self.name, *self.force, "N/m³"),)

    def __str__(self) -> str:
        return f"body force along {along(self.direction)}{f' on {self.region!r}' if self.region else ''}"

    def describe(self) -> dict[str, Any]:
        """Everything that decides what it does, as plain data for a JSON file."""
        return {"type": "BodyForce", **asdict(self)}

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """None."""
        return ()

    def attach(self, field: Any) -> Attached:
        """Its load on an opened body."""
        import ngsolve as ng

        part = ng.dx if self.region is None else ng.dx(definedon=field.mesh.Materials(self.region))
        return dead_load(field.load(lambda v: ng.InnerProduct(ng.CF(self.direction), v) * part))
