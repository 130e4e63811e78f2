"""What every shape offers, and the shapes that are made of solids."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, cast, runtime_checkable

from palpate.errors import UsageError
from palpate.physics.arguments import require_positive
from palpate.physics.geometry.checks import require_known
from palpate.physics.geometry.faces import Face, faces_of
from palpate.physics.geometry.isometries import NO_ISOMETRIES, Isometry
from palpate.physics.geometry.mesh import BodyMesh, body_mesh
from palpate.physics.geometry.refinement import FineMesh

if TYPE_CHECKING:
    from collections.abc import Hashable

__all__ = ["Geometry", "Shape", "Solid"]


@runtime_checkable
class Geometry(Protocol):
    """A body's shape: a value that can be compared, hashed, pickled and meshed.

    Attributes
    ----------
    surfaces : tuple of str
        Names of the parts of its boundary, which can be fixed or touched.
    regions : tuple of str
        Names of the parts of its volume, which can have materials of their own.
    """

    @property
    def surfaces(self) -> tuple[str, ...]: ...  # noqa: D102

    @property
    def regions(self) -> tuple[str, ...]: ...  # noqa: D102

    def mesh(self, refinements: tuple[FineMesh, ...] = ()) -> Any:
        """Tetrahedra in m as an `ngsolve.Mesh`, with the names set; curved where the shape is."""

    def rest(self, refinements: tuple[FineMesh, ...] = ()) -> BodyMesh:
        """The same mesh as plain arrays."""

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data for a JSON file."""


class Shape:
    """Base of the shapes: the mesh is made once in a process for each value.

    A shape is a frozen dataclass that gives `surfaces`, `regions` and `generate`.
    """

    curved: ClassVar[bool] = False  # whether elements shall follow the surface between their vertices

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names of the parts of the boundary."""
        raise NotImplementedError

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the parts of the volume."""
        return ("body",)

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Rotations and reflections that leave it where it is; the identity alone unless a shape knows more."""
        return NO_ISOMETRIES

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        raise NotImplementedError

    def mesh(self, refinements: tuple[FineMesh, ...] = ()) -> Any:
        """Tetrahedra for NGSolve.

        The same value gives the same mesh, bit for bit, in any process.

        Parameters
        ----------
        refinements : tuple of FineMesh
            Parts of surfaces that shall have smaller elements.

        Returns
        -------
        ngsolve.Mesh
            In m, with names of boundaries and materials; of curved elements of second order where the shape is
            round. It is the caller's own.

        Raises
        ------
        UsageError
            If a refinement names no surface of the shape, or would take too many elements.
        """
        import ngsolve

        ngsolve.SetNumThreads(1)
        mesh = ngsolve.Mesh(_generated(cast("Hashable", self), self._checked(refinements)).Copy())
        if self.curved:
            mesh.Curve(2)
        return mesh

    def rest(self, refinements: tuple[FineMesh, ...] = ()) -> BodyMesh:
        """The same mesh as plain arrays, with straight faces.

        Raises
        ------
        UsageError
            As for `mesh`.
        """
        return _plain(cast("Hashable", self), self._checked(refinements))

    @property
    def faces(self) -> tuple[Face, ...]:
        """Place, size and direction of each surface: what to print to tell which is which."""
        return faces_of(self.rest())

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data for a JSON file."""
        return {"type": type(self).__name__, **asdict(cast("Any", self))}

    def _checked(self, refinements: tuple[FineMesh, ...]) -> tuple[FineMesh, ...]:
        if isinstance(refinements, FineMesh):
            return self._checked((refinements,))
        for refinement in refinements:
            require_known("surface", refinement.surface, self.surfaces)
        return tuple(refinements)


class Solid(Shape):
    """Base of the shapes that are built from boxes, cylinders and other solids of the CAD kernel.

    Such a shape gives `surfaces`, `regions`, `size`, `solid` and has a field `element`.
    """

    element: float | None

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y and z in m."""
        raise NotImplementedError

    @property
    def coarse(self) -> float:
        """Largest element size in m: `element`, or a third of the least extent."""
        return self.element if self.element is not None else min(self.size) / 3

    def solid(self) -> Any:
        """The shape as `netgen.occ.TopoDS_Shape` in m, whose faces and solids carry the names."""
        raise NotImplementedError

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        from palpate.physics.geometry.meshing import mesh_solid

        return mesh_solid(self.solid(), self.coarse, refinements)

    def _check_element(self) -> None:
        """Refuse an element size that the body has no room for."""
        if self.element is None:
            return
        require_positive("The element size", self.element, "m")
        if self.element > max(self.size):
            raise UsageError(
                f"The element size is {self.element:g} m, the body's longest side {max(self.size):g} m.",
                why="An element can't be larger than the body.",
                fix="Leave it out for a third of the least extent, or give a smaller one, in m.",
            )


# a body is meshed with and without refinements, and a sweep holds a few bodies
@lru_cache(maxsize=32)
def _generated(shape: Hashable, refinements: tuple[FineMesh, ...]) -> Any:
    return cast("Shape", shape).generate(refinements)


@lru_cache(maxsize=32)
def _plain(shape: Hashable, refinements: tuple[FineMesh, ...]) -> BodyMesh:
    geometry = cast("Shape", shape)
    return body_mesh(_generated(shape, refinements), geometry.surfaces, geometry.regions)
