"""Pressure that follows a surface, where it has a potential.

A pressure q exerts the force -q n da on the deformed surface. If the rim of the surface does not move, or there is
none, that force is the derivative of the energy q V with

    V(u) = ⅓ ∫ (X + u) · cof(F) N dA,

the volume under the deformed surface (Nanson's formula for n da; Bonet & Wood 2008, section 8.5). Where a rim
moves freely, the work of a pressure depends on the path, and no energy exists.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.arguments import range_of
from palpate.physics.interactions.interaction import Attached, Energy
from palpate.physics.shapes.naming import require_known, require_triple
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.meshing import FineMesh

__all__ = ["Pressure", "volume_density"]

Point = tuple[float, float, float]
POTENTIAL = 1e-8  # largest difference, relative to the force, that round-off may leave


def volume_density(displacement: Any, origin: Point) -> Any:
    """⅓ (X + u - origin) · cof(F) N on a surface, as a coefficient function in m.

    Parameters
    ----------
    displacement : ngsolve.CoefficientFunction
        u (3,), a trial function or a grid function.
    origin : tuple of three floats
        In m.
    """
    import ngsolve as ng

    # the tangential part of F decides cof(F) N
    gradient = ng.Id(3) + ng.Grad(displacement).Trace()
    place = ng.CF((ng.x, ng.y, ng.z)) + displacement - ng.CF(origin)
    return ng.InnerProduct(ng.Cof(gradient) * ng.specialcf.normal(3), place) / 3


@dataclass(frozen=True)
class Pressure:
    """A pressure that pushes on a surface and follows it as it deforms.

    The response is the volume in m³ by which the pressure pushes the surface in, -∂U/∂q = V(base) - V(u).

    Attributes
    ----------
    surface : str
    pressure : range
        (low, high) in Pa; a negative pressure sucks.
    symmetry : tuple of three floats, optional
        A point of all planes of symmetry in which the rim slides, in m: a statement of the user's, who also has
        to see to it that the rim is held in these planes. Without it the rim must be fixed.
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
            symmetry = require_triple("The point of a pressure's planes of symmetry", self.symmetry)
            object.__setattr__(self, "symmetry", symmetry)

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """The pressure, in Pa; `UsageError` if the body has no such surface."""
        require_known("surface", self.surface, geometry.surfaces)
        return (Range(self.name, *self.pressure, "Pa"),)

    def __str__(self) -> str:
        return f"pressure on {self.surface!r}"

    def describe(self) -> dict[str, Any]:
        """Everything that decides what it does, as plain data for a JSON file."""
        return {"type": "Pressure", **asdict(self)}

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """None."""
        return ()

    def attach(self, field: Any) -> Attached:
        """Its energy on an opened body.

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
        form, found = ng.BilinearForm(space), image.vec.CreateVector()
        form += ng.Variation(volume_density(space.TrialFunction(), (0.0, 0.0, 0.0)) * surface)
        form.Apply(image.vec, found)
        normal = ng.Cof(ng.Id(3) + ng.Grad(image).Trace()) * ng.specialcf.normal(3)
        force = ng.LinearForm(space)
        force += ng.InnerProduct(normal, space.TestFunction()) * surface
        force.Assemble()
        wanted = force.vec.FV().NumPy()
        if np.abs((found.FV().NumPy() - wanted)[free]).max() > POTENTIAL * np.abs(wanted).max():
            raise UsageError(
                f"A pressure that follows the surface {self.surface!r} has no potential.",
                why="The rim of this surface can move, so the work of the pressure would depend on the path.",
                fix="Fix the surfaces around it; or use SurfaceTraction(..., 'normal', ...), which does not follow; or "
                "give symmetry=(x, y, z) if the rim slides in planes of symmetry through that point.",
            )
