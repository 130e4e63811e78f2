"""Loads on bodies: dead loads, and a pressure that follows its surface.

Size and direction of a dead load do not follow the body as it deforms. With the load vector l of one unit the energy is
Π = W - q l·u. The response is -∂U/∂q = l·u: the displacement (a mean of it, or its integral) that the load does work
on.

A pressure q exerts the force -q n da on the deformed surface. If the rim of the surface does not move, or there is
none, that force is the derivative of the energy q V with

    V(u) = ⅓ ∫ (X + u) · cof(F) N dA,

the volume under the deformed surface (Nanson's formula for n da; Bonet & Wood 2008, section 8.5). Where a rim
moves freely, the work of a pressure depends on the path, and no energy exists.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import number
from palpate.physics.interactions.bump import (
    MARGIN,
    QUADRATURE,
    Chart,
    bump,
    chart_at,
    require_on_surface,
)
from palpate.physics.interactions.interaction import Attached, Energy, PlainInteraction
from palpate.physics.interactions.interaction_checks import along, direction_of, range_of
from palpate.physics.shapes.naming import require_known
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.mesh import BodyMesh
    from palpate.physics.shapes.meshing import FineMesh

__all__ = ["BodyForce", "PointForce", "Pressure", "SurfaceTraction", "volume_density"]

Ends = tuple[float, float]
Point = tuple[float, float, float]


def _dead_load(load: np.ndarray) -> Attached:
    """Return one input whose load vector is (dof,)."""
    import ngsolve as ng

    return Attached(parameters=(ng.Parameter(0.0),), loads=load[None, :])


@dataclass(frozen=True)
class PointForce(PlainInteraction):
    """A force at a point of a surface, spread over a small disc.

    A force on a mathematical point would sink in without bound as the mesh gets finer. So it is spread as a
    traction F ρ/∫ρ dA with the bump ρ of radius a (see `bump`); the response is the displacement along the
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
        Name of the surface.
    element : float, optional
        Size in m of the elements under the disc; by default a third of the radius.
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
        checks.positive("The radius of a point force", self.radius, "m")
        if self.element is not None:
            checks.positive("The element under a point force", self.element, "m")
        object.__setattr__(self, "at", checks.triple("The point of a force", self.at, "m"))
        object.__setattr__(self, "force", range_of("A point force", self.force, "N"))
        direction = direction_of("The direction of a point force", self.direction)
        object.__setattr__(self, "direction", direction)

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """Return the size of the force, in N.

        Raises
        ------
        UsageError
            If the body has no such surface, the point is not on it or its disc hangs over the edge.
        """
        self._chart(geometry.rest())
        return (Range(self.name, *self.force, "N"),)

    def __str__(self) -> str:
        at = ", ".join(number(1e3 * x) for x in self.at)
        return f"force along {along(self.direction)} at ({at}) mm of {self.surface!r}"

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """Return fine elements under the disc."""
        mesh = geometry.rest()
        chart = self._chart(mesh)
        centre, margin = np.asarray(self.at)[list(chart.across)], MARGIN * self.radius
        element = self.element if self.element is not None else self.radius / 3
        return (chart.refinement(mesh, centre - margin, centre + margin, element),)

    def attach(self, field: Any) -> Attached:
        """Return its load on an opened body."""
        import ngsolve as ng

        chart = self._chart(field.rest)
        first, second = chart.across
        weight = bump(chart, (self.at[first], self.at[second]), self.radius)
        surface = ng.ds(definedon=field.surface(self.surface), bonus_intorder=QUADRATURE)
        load = field.load(lambda v: weight * ng.InnerProduct(ng.CF(self.direction), v) * surface)
        # the same quadrature gives the area, so that the force is exact on any mesh
        along = field.interpolate(ng.CF(self.direction))
        return _dead_load(load / float(load @ along))

    def _chart(self, mesh: BodyMesh) -> Chart:
        chart = chart_at(mesh, self.surface, self.at)
        centre = np.asarray(self.at)[list(chart.across)]
        require_on_surface(mesh, chart, centre, centre, self.radius)
        return chart


@dataclass(frozen=True)
class SurfaceTraction(PlainInteraction):
    """A dead traction, per undeformed area, over all of a surface.

    The response is ∫ e·u dA over the surface, in m³.

    Attributes
    ----------
    surface : str
        Name of the surface.
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
        """Return the size of the traction, in Pa; `UsageError` if the body has no such surface."""
        require_known("surface", self.surface, geometry.surfaces)
        return (Range(self.name, *self.traction, "Pa"),)

    def __str__(self) -> str:
        return f"traction on {self.surface!r} along {along(self.direction)}"

    def attach(self, field: Any) -> Attached:
        """Return its load on an opened body."""
        import ngsolve as ng

        direction = ng.specialcf.normal(3) if self.direction == "normal" else ng.CF(self.direction)
        surface = ng.ds(definedon=field.surface(self.surface))
        return _dead_load(field.load(lambda v: ng.InnerProduct(direction, v) * surface))


@dataclass(frozen=True)
class BodyForce(PlainInteraction):
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
        """Return the size of the force, in N/m³; `UsageError` if the body has no such region."""
        if self.region is not None:
            require_known("region", self.region, geometry.regions)
        return (Range(self.name, *self.force, "N/m³"),)

    def __str__(self) -> str:
        return f"body force along {along(self.direction)}{f' on {self.region!r}' if self.region else ''}"

    def attach(self, field: Any) -> Attached:
        """Return its load on an opened body."""
        import ngsolve as ng

        part = ng.dx if self.region is None else ng.dx(definedon=field.mesh.Materials(self.region))
        return _dead_load(field.load(lambda v: ng.InnerProduct(ng.CF(self.direction), v) * part))


POTENTIAL = 1e-8  # largest difference, relative to the force, that round-off may leave


def volume_density(displacement: Any, origin: Point) -> Any:
    """Return ⅓ (X + u - origin) · cof(F) N on a surface, as a coefficient function in m.

    u (3,) is a trial function or a grid function of NGSolve, the origin is in m.
    """
    import ngsolve as ng

    # the tangential part of F decides cof(F) N
    gradient = ng.Id(3) + ng.Grad(displacement).Trace()
    place = ng.CF((ng.x, ng.y, ng.z)) + displacement - ng.CF(origin)
    return ng.InnerProduct(ng.Cof(gradient) * ng.specialcf.normal(3), place) / 3


@dataclass(frozen=True)
class Pressure(PlainInteraction):
    """A pressure that pushes on a surface and follows it as it deforms.

    The response is the volume in m³ by which the pressure pushes the surface in, -∂U/∂q = V(base) - V(u).

    Attributes
    ----------
    surface : str
        Name of the surface.
    pressure : range
        (low, high) in Pa; a negative pressure sucks.
    symmetry : tuple of three floats, optional
        A point of all planes of symmetry in which the rim slides, in m: a statement of the user's, who also has
        to see to it that the rim stays in these planes. Without it the rim must be fixed.
    name : str
        Name of the input.

    Raises
    ------
    UsageError
        For an empty range.
    """

    surface: str
    pressure: tuple[float, float]
    symmetry: Point | None = None
    name: str = "p"

    def __post_init__(self) -> None:
        object.__setattr__(self, "pressure", range_of("A pressure", self.pressure, "Pa"))
        if self.symmetry is not None:
            symmetry = checks.triple("The point of a pressure's planes of symmetry", self.symmetry, "m")
            object.__setattr__(self, "symmetry", symmetry)

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """Return the pressure, in Pa; `UsageError` if the body has no such surface."""
        require_known("surface", self.surface, geometry.surfaces)
        return (Range(self.name, *self.pressure, "Pa"),)

    def __str__(self) -> str:
        return f"pressure on {self.surface!r}"

    def attach(self, field: Any) -> Attached:
        """Return its energy on an opened body.

        Raises
        ------
        UsageError
            If the rim of the surface is neither fixed nor said to lie in planes of symmetry.
        """
        import ngsolve as ng

        if self.symmetry is None:
            self._require_potential(field)
        origin = self.symmetry or (0.0, 0.0, 0.0)
        q = ng.Parameter(0.0)
        start = ng.GridFunction(field.base.space)
        start.vec.data = field.base.vec
        volume = volume_density(field.trial, origin) - volume_density(start, origin)
        surface = ng.ds(definedon=field.surface(self.surface))
        return Attached(parameters=(q,), energies=(Energy(q * volume, surface),))

    def _require_potential(self, field: Any) -> None:
        """Compare the volume's derivative with the force n da, at a displacement that is zero where fixed."""
        import ngsolve as ng

        space = field.base.space
        image, free = ng.GridFunction(space), np.fromiter(space.FreeDofs(), dtype=bool, count=space.ndof)
        size = float(np.linalg.norm(field.rest.corners[1] - field.rest.corners[0]))
        image.vec.FV().NumPy()[:] = 0.01 * size * np.random.default_rng(0).standard_normal(space.ndof) * free
        surface = ng.ds(definedon=field.surface(self.surface))
        form, derivative = ng.BilinearForm(space), image.vec.CreateVector()
        form += ng.Variation(volume_density(space.TrialFunction(), (0.0, 0.0, 0.0)) * surface)
        form.Apply(image.vec, derivative)
        normal = ng.Cof(ng.Id(3) + ng.Grad(image).Trace()) * ng.specialcf.normal(3)
        force = ng.LinearForm(space)
        force += ng.InnerProduct(normal, space.TestFunction()) * surface
        force.Assemble()
        exact = force.vec.FV().NumPy()
        if np.abs((derivative.FV().NumPy() - exact)[free]).max() > POTENTIAL * np.abs(exact).max():
            raise UsageError(
                f"A pressure that follows the surface {self.surface!r} has no potential.",
                why="The rim of this surface can move, so the work of the pressure would depend on the path.",
                fix="Fix the surfaces around it; or use SurfaceTraction(..., 'normal', ...), which does not follow; or "
                "give symmetry=(x, y, z) if the rim slides in planes of symmetry through that point.",
            )
