"""The contract of shapes: names, a mesh that is made once, and the rotations and reflections that keep it.

Geometry   the contract: a value with names that can be meshed
Shape      base of all shapes here
Solid      base of those that are built from solids of the CAD kernel
Isometry   a rotation or reflection, and which surface it takes where
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, cast, runtime_checkable

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.shapes.mesh import BodyMesh, Face, body_mesh, faces_of
from palpate.physics.shapes.meshing import INSIDE, FineMesh
from palpate.physics.shapes.naming import require_known

if TYPE_CHECKING:
    from collections.abc import Hashable

__all__ = [
    "NO_ISOMETRIES",
    "Geometry",
    "Isometry",
    "Shape",
    "Solid",
    "box_isometries",
    "mirror_isometries",
    "require_size",
    "round_isometries",
]

IMAGES = 16  # of a body of revolution, which has no end of them: eight turns, each with its mirror image
EQUAL = 1e-12  # relative difference of two lengths that count as one
BOX_FACES = {
    (2, 1): "top",
    (2, -1): "bottom",
    (0, -1): "x_min",
    (0, 1): "x_max",
    (1, -1): "y_min",
    (1, 1): "y_max",
}
LARGEST, SMALLEST = 10.0, 1e-3  # m, longest side of a body that a hand or a tool would press


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
        """Plain arrays of the same mesh."""

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data for a JSON file."""


def require_size(
    what: str, longest: float, unit: str = "", kind: str = "body to be touched", most: float = LARGEST
) -> None:
    """Refuse a body or another `kind` of thing whose longest side tells of mistaken units.

    The side must be 1 mm to `most`, given in m; `what` is the body as the message begins, `unit` that of the file it
    was read from, empty where the user gives lengths in m.
    """
    if SMALLEST <= longest <= most:
        return
    taken = f"Its lengths were taken as {unit}" if unit else "Lengths are in m"
    guess = "mm" if longest > most else "m"
    advice = f'Pass unit="{guess}" if the file is in {guess}' if unit else "Pass 0.1 for 100 mm"
    raise UsageError(
        f"{what} would be {longest:.4g} m long.",
        why=f"{taken}, and a {kind} measures between {SMALLEST:g} and {most:g} m.",
        fix=f"{advice}.",
    )


class Shape:
    """Base of the shapes: the mesh is made once in a process for each value.

    A shape is a frozen dataclass that gives `surfaces`, `regions` and `generate`.
    """

    curved: ClassVar[bool] = False  # whether elements shall follow the surface between their vertices
    drawn_apart: ClassVar[bool] = False  # whether pictures show a surface of its own, `drawn`
    foreign: ClassVar[bool] = False  # whether another program's file decides it, which may crash the mesher

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
        """Plain arrays of the same mesh, with straight faces.

        Raises
        ------
        UsageError
            As for `mesh`.
        """
        return _plain(cast("Hashable", self), self._checked(refinements))

    @property
    def skin(self) -> BodyMesh:
        """Triangles of the outer surface, with the names of the surfaces."""
        return self.rest()

    @property
    def drawn(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Points (p, 3) in m and triangles (q, 3) of its own surface for pictures, where elements are coarser."""
        return None

    @property
    def faces(self) -> tuple[Face, ...]:
        """Place, size and direction of each surface: what to print to tell which is which."""
        return faces_of(self.skin)

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data for a JSON file."""
        return {"type": type(self).__name__, **asdict(cast("Any", self))}

    def _checked(self, refinements: tuple[FineMesh, ...]) -> tuple[FineMesh, ...]:
        if isinstance(refinements, FineMesh):
            return self._checked((refinements,))
        for refinement in refinements:
            if refinement.surface != INSIDE:
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
        from palpate.physics.shapes.meshing import mesh_solid

        return mesh_solid(self.solid(), self.coarse, refinements)

    def check_extent(self, what: str) -> None:
        """Refuse sizes that tell of mistaken units, and elements that the body has no room for.

        Parameters
        ----------
        what : str
            The shape in words, as the message begins: ``"The block"``.

        Raises
        ------
        UsageError
            If the body is shorter than 1 mm or longer than 10 m, or an element is longer than the body.
        """
        require_size(what, max(self.size))
        if self.element is not None and checks.positive("The element size", self.element, "m") > max(
            self.size
        ):
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


@dataclass(frozen=True, eq=False)
class Isometry:
    """A rotation or reflection M about a point p: a place X goes to p + M (X − p)."""

    matrix: np.ndarray  # (3, 3), orthogonal matrix M
    about: np.ndarray  # (3,), point p, m
    goes: Mapping[str, str] = field(default_factory=dict)  # surface onto which each goes; others stay

    def surface(self, name: str) -> str:
        """The surface on which that of this name comes to lie."""
        return self.goes.get(name, name)

    @property
    def is_identity(self) -> bool:
        """True for the one that moves nothing."""
        return bool(np.allclose(self.matrix, np.eye(3)))


NO_ISOMETRIES: tuple[Isometry, ...] = (Isometry(np.eye(3), np.zeros(3)),)
"""Isometries of a shape that is not symmetric: the identity alone."""


def box_isometries(size: tuple[float, float, float], *, layered: bool = False) -> tuple[Isometry, ...]:
    """Isometries of a box with a corner at the origin: 8 of a brick, 16 of a square prism, 48 of a cube.

    Those of a `layered` box keep its upright direction.
    """
    isometries = []
    for order in itertools.permutations(range(3)):
        if any(abs(size[i] - size[j]) > EQUAL * size[i] for i, j in enumerate(order)):
            continue
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if not layered or matrix[2, 2] == 1:
                isometries.append(Isometry(matrix, np.array(size) / 2, _box_faces(matrix)))
    return tuple(isometries)


def _box_faces(matrix: np.ndarray) -> dict[str, str]:
    """Names of the faces of a box, and of those onto which they go: a normal ±e_j goes to ±M e_j."""
    goes = {}
    for (axis, sign), name in BOX_FACES.items():
        normal = sign * matrix[:, axis]
        to = int(np.argmax(np.abs(normal)))
        goes[name] = BOX_FACES[to, int(np.sign(normal[to]))]
    return goes


def round_isometries() -> tuple[Isometry, ...]:
    """Isometries of a body of revolution about the z axis: a finite group of turns and mirror images, 16 in all."""
    half = IMAGES // 2
    isometries = []
    for k in range(half):
        c, s = _exact(np.cos(2 * np.pi * k / half)), _exact(np.sin(2 * np.pi * k / half))
        for sign in (1.0, -1.0):
            matrix = np.array([[c, -sign * s, 0.0], [s, sign * c, 0.0], [0.0, 0.0, 1.0]])
            isometries.append(Isometry(matrix, np.zeros(3)))
    return tuple(isometries)


def mirror_isometries(x: float, y: float) -> tuple[Isometry, ...]:
    """Isometries of a body with one mirror plane, which holds the z axis and the point (x, y) in m."""
    angle = 2 * np.arctan2(y, x)
    c, s = _exact(np.cos(angle)), _exact(np.sin(angle))
    reflection = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, 1.0]])
    return (*NO_ISOMETRIES, Isometry(reflection, np.zeros(3)))


def _exact(value: float) -> float:
    """Cosines of right angles without their rounding."""
    nearest = float(round(value))
    return nearest if abs(value - nearest) < 1e-12 else float(value)
