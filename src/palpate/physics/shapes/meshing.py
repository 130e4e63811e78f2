"""Tetrahedra for solids of the CAD kernel, fine where they are asked to be.

FineMesh        a part of a surface that shall have small elements
require_budget  refuses meshes that no direct solver could take
points_on       points on a refined part, at which the element size is restricted
mesh_solid      the mesh
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.shapes.mesh import BodyMesh, body_mesh
from palpate.physics.shapes.naming import AND, GROUPS, members

__all__ = [
    "GRADING",
    "INSIDE",
    "MOST_ELEMENTS",
    "THREADS",
    "FineMesh",
    "boxes_meet",
    "mesh_solid",
    "points_on",
    "require_budget",
    "split_triangles",
]

GRADING = 0.4  # growth of the element size per distance from a fine surface
THREADS = 1  # of Netgen; its own four gain nothing, and spin: ten times slower where another process works
INSIDE = "inside"
"""Name that a refinement gives in place of a surface, to make a box inside the body fine."""
MOST_ELEMENTS = 400_000  # about half a million nodes of second order: beyond any direct solver on one machine
Point = tuple[float, float, float]
FLAT = 1e-5  # thickness over length below which a face counts as upright and plane
PADDING = 1e-7  # m by which the CAD kernel's boxes are larger than the faces within
SHORTEST = 1e-5  # shortest edge over the body's length that is meshed as such; Netgen's own default is in mm


@dataclass(frozen=True)
class FineMesh:
    """A part of a surface, or of the body's inside, that shall have small elements.

    Attributes
    ----------
    surface : str
        Name of a surface of the body, or ``"inside"`` for a box in its volume.
    element : float
        Length of an element's edge in m.
    lower, upper : tuple of three floats, optional
        Corners in m of an upright box; the part of the surface, or of the body, within it becomes fine. Without a box,
        all of a surface.

    Raises
    ------
    UsageError
        If the size is not positive, or the box is empty, has only one corner, or is not given for the inside.
    """

    surface: str
    element: float
    lower: Point | None = None
    upper: Point | None = None

    def __post_init__(self) -> None:
        checks.positive("The element size of a refinement", self.element, "m")
        if (self.lower is None) != (self.upper is None):
            raise UsageError(
                f"The refinement of {self.surface!r} has one corner only.",
                why="A box needs its lower and its upper corner.",
                fix="Give both, or neither for the whole surface.",
            )
        if self.lower is None or self.upper is None:
            if self.surface == INSIDE:
                raise UsageError(
                    "The refinement of the inside of a body has no box.",
                    why="For all of it the shape's own `element` is there.",
                    fix="Give lower and upper, two corners in m.",
                )
            return
        lower = checks.triple("The lower corner of a refinement", self.lower, "m")
        upper = checks.triple("The upper corner of a refinement", self.upper, "m")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)
        if any(a > b for a, b in zip(lower, upper, strict=True)):
            raise UsageError(
                f"The box of the refinement of {self.surface!r} is empty: {lower} … {upper} m.",
                why="Each coordinate of the lower corner must be at most that of the upper one.",
                fix="Swap the coordinates that are in the wrong order.",
            )

    def is_on(self, name: str | None) -> bool:
        """Return True for the refined surface, and for those that its name stands for."""
        return any(name == part or name in GROUPS.get(part, ()) for part in self.surface.split(AND))


def require_budget(volumes: Iterable[tuple[float, float]], fine: Iterable[tuple[float, float]]) -> None:
    """Refuse a mesh of more than `MOST_ELEMENTS` elements before it is made.

    A size h grows with the distance d from a fine surface as h + grading · d, and a tetrahedron of edge h fills
    h³/6√2. Integrated over d, an area A takes 6√2 A / (2 grading h²) elements.

    `volumes` has the volume in m³ and element size in m of each region, `fine` the area in m² and element size in m
    of each refined part.
    """
    per_volume = 6 * 2**0.5
    count = sum(per_volume * volume / h**3 for volume, h in volumes)
    count += sum(per_volume * area / (2 * GRADING * h**2) for area, h in fine)
    if count > MOST_ELEMENTS:
        raise UsageError(
            f"The mesh would have about {count:.2g} elements, more than {MOST_ELEMENTS}.",
            why="Halving the size takes 8 times the elements in a volume, 4 times at a surface.",
            fix="Choose larger elements, or refine a smaller part of the surface.",
        )


def points_on(mesh: BodyMesh, refinement: FineMesh) -> tuple[np.ndarray, float]:
    """Points of the refined part of a surface, at most half an element size apart.

    The triangles are halved across their longest edges until they are small enough. Where the box holds no point,
    the refinement asks for nothing.

    Any mesh of the body will do, a coarse one for example. Returns the points (n, 3) in m, and the area in m² that
    they stand for.
    """
    if refinement.surface == INSIDE:
        return _points_inside(mesh, refinement)
    if not members(refinement.surface, mesh.surfaces):
        return np.empty((0, 3)), 0.0
    corners = mesh.points[mesh.triangles_of(refinement.surface)]
    small = []
    while len(corners):
        corners = corners[boxes_meet(corners.min(axis=1), corners.max(axis=1), refinement)]
        require_budget([], [(_areas(corners).sum(), refinement.element)])
        fits = _longest(corners)[1] <= refinement.element / 2
        small.append(corners[fits])
        corners = _halve(corners[~fits])
    triangles = np.concatenate(small) if small else np.empty((0, 3, 3))
    centres = triangles.mean(axis=1)
    inside = boxes_meet(centres, centres, refinement)
    return centres[inside], float(_areas(triangles[inside]).sum())


def _points_inside(mesh: BodyMesh, refinement: FineMesh) -> tuple[np.ndarray, float]:
    """Points of a lattice in a box, and the area that would take as many elements as its volume (`require_budget`)."""
    low, high = mesh.corners
    assert refinement.lower is not None  # or it were refused
    assert refinement.upper is not None
    lower, upper = np.maximum(np.array(refinement.lower), low), np.minimum(np.array(refinement.upper), high)
    spans = np.maximum(upper - lower, 0.0)
    require_budget([(float(np.prod(spans)), refinement.element)], [])
    counts = np.maximum(np.ceil(spans / refinement.element).astype(int), 1)
    # middles of cells: none lies on the body's surface, where a lattice would fight with the size of its elements
    axes = [a + (np.arange(n) + 0.5) / n * (b - a) for a, b, n in zip(lower, upper, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, 2.0 * GRADING * float(np.prod(spans)) / refinement.element


def split_triangles(corners: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t, 3, 3) halved until no edge is longer than `size` m; and the index of the triangle of each."""
    origin = np.arange(len(corners))
    small, origins = [], []
    while len(corners):
        fits = _longest(corners)[1] <= size
        small.append(corners[fits])
        origins.append(origin[fits])
        corners, origin = _halve(corners[~fits]), np.tile(origin[~fits], 2)
    return np.concatenate(small), np.concatenate(origins)


def _areas(corners: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def boxes_meet(low: np.ndarray, high: np.ndarray, refinement: FineMesh) -> np.ndarray:
    """Return a mask (...) of the boxes between corners (..., 3) in m that touch that of the refinement."""
    if refinement.lower is None or refinement.upper is None:
        return np.ones(low.shape[:-1], dtype=bool)
    return np.asarray(((low <= refinement.upper) & (high >= refinement.lower)).all(axis=-1))


def _longest(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the corner opposite to the longest edge, and that edge's length in m; each (t,)."""
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)
    return lengths.argmax(axis=1), lengths.max(axis=1)


def _halve(corners: np.ndarray) -> np.ndarray:
    """Each triangle cut in two across its longest edge, shape (2t, 3, 3)."""
    apex, _ = _longest(corners)
    rows = np.arange(len(corners))
    a, b, c = (corners[rows, (apex + k) % 3] for k in range(3))
    middle = (b + c) / 2
    return np.concatenate([np.stack([a, b, middle], axis=1), np.stack([a, middle, c], axis=1)])


def mesh_solid(
    solid: Any,
    coarse: float,
    refinements: tuple[FineMesh, ...],
    rename: Callable[[Any], None] | None = None,
    least: float = 0.0,
) -> Any:
    """Mesh a solid whose faces and solids carry names.

    The fine part of an upright plane rectangle is cut out of it as a face of its own, so that the size of its
    elements is even; on other faces the element size is restricted at points.

    The solid is a netgen.occ.TopoDS_Shape in m, the result a netgen.meshing.Mesh. `coarse` is the largest element
    size in m; below `least`, in m, curvature makes no elements, refinements still do. `rename` gives the mesh's
    faces names where those of the solid are not the ones that refinements speak of.
    """
    from netgen.meshing import Pnt
    from netgen.occ import OCCGeometry

    flat = [] if rename else [r for r in refinements if _is_on_rectangles(r, solid)]
    solid = _imprint(solid, flat)
    fine = _restricted_faces(solid, flat)
    points = []
    for refinement in refinements:
        if refinement not in flat:
            rough = _generate(OCCGeometry(solid), solid, coarse, minh=least)
            if rename is not None:
                rename(rough)
            places, area = points_on(body_mesh(rough), refinement)
            points.append((places, refinement.element))
            fine.append((area, refinement.element))
    require_budget([(s.mass, min(coarse, s.maxh)) for s in solid.solids], fine)
    geometry = OCCGeometry(solid)
    for places, element in points:
        for place in places.tolist():
            geometry.RestrictH(Pnt(*place), element)
    mesh = _generate(geometry, solid, coarse, minh=min([least, *(r.element for r in refinements)]))
    if rename is not None:
        rename(mesh)
    return mesh


def _is_on_rectangles(refinement: FineMesh, solid: Any) -> bool:
    """Return True where all refined faces of a solid are upright plane rectangles."""
    return refinement.surface != INSIDE and all(
        _is_rectangle(face) for face in solid.faces if refinement.is_on(face.name)
    )


def _generate(geometry: Any, solid: Any, coarse: float, **options: Any) -> Any:
    import ngsolve
    from netgen.meshing import NgException

    ngsolve.SetNumThreads(1)
    low, high = solid.bounding_box
    longest = max(high[i] - low[i] for i in range(3))
    try:
        return geometry.GenerateMesh(
            maxh=coarse, grading=GRADING, minedgelen=SHORTEST * longest, nthreads=THREADS, **options
        )
    except NgException as error:
        raise UsageError(
            f"Netgen could not mesh the body: {str(error).strip()}.",
            why="Its faces may intersect or leave gaps, or a detail is far smaller than the elements.",
            fix=f"Check the shape, or choose elements smaller than {coarse:.3g} m.",
        ) from error


def _is_rectangle(face: Any) -> bool:
    """Return True for an upright plane rectangle.

    In others a cut may run close to an edge, where only flat elements would fit.
    """
    if _upright_axis(face) is None:
        return False
    low, high = face.bounding_box
    extent = sorted(high[i] - low[i] for i in range(3))
    return bool(abs(face.mass - extent[1] * extent[2]) < 10 * FLAT * face.mass)


def _upright_axis(face: Any) -> int | None:
    """Axis that a plane face is normal to, None for others."""
    low, high = face.bounding_box
    extent = np.array([high[i] - low[i] for i in range(3)])
    axis = int(extent.argmin())
    return axis if extent[axis] < FLAT * extent.max() + 2 * PADDING else None


def _imprint(solid: Any, refinements: list[FineMesh]) -> Any:
    """The solid whose plane faces are cut along the boxes of the refinements."""
    from netgen.occ import Glue

    for refinement in refinements:
        if refinement.lower is None or refinement.upper is None:
            continue
        patches = [
            patch
            for face in solid.faces
            if refinement.is_on(face.name)
            for patch in _patch(face, np.array(refinement.lower), np.array(refinement.upper))
        ]
        if patches:
            solid = Glue([solid, *patches])
    return solid


def _patch(face: Any, lower: np.ndarray, upper: np.ndarray) -> list[Any]:
    """The part of an upright plane face inside a box; nothing where that is all of it or none."""
    from netgen.occ import Face, Pnt, Segment, Wire

    axis = _upright_axis(face)
    low, high = (np.array([p[i] for i in range(3)]) for p in face.bounding_box)
    slack = FLAT * (high - low).max() + 2 * PADDING
    level = (low[axis] + high[axis]) / 2
    if axis is None or not lower[axis] - slack <= level <= upper[axis] + slack:
        return []
    a, b = np.maximum(low, lower), np.minimum(high, upper)
    across = [i for i in range(3) if i != axis]
    if any(b[i] - a[i] <= slack for i in across):
        return []
    if all(lower[i] <= low[i] + slack and upper[i] >= high[i] - slack for i in across):
        return []
    corners = []
    for first, second in ((a, a), (b, a), (b, b), (a, b)):
        corner = np.empty(3)
        corner[axis], corner[across[0]], corner[across[1]] = level, first[across[0]], second[across[1]]
        corners.append(Pnt(*corner.tolist()))
    rectangle = Face(Wire([Segment(p, q) for p, q in pairwise([*corners, corners[0]])]))
    patch = rectangle * face
    # a face that was cut before need not reach the rectangle, though its box does
    return [patch] if list(patch.faces) else []


def _restricted_faces(solid: Any, refinements: list[FineMesh]) -> list[tuple[float, float]]:
    """Set the element size of the faces inside the boxes; area and size of each."""
    fine = {}
    for number, face in enumerate(solid.faces):
        for refinement in refinements:
            if refinement.is_on(face.name) and _inside(face, refinement):
                face.maxh = min(face.maxh, refinement.element)
                fine[number] = (face.mass, face.maxh)
    return list(fine.values())


def _inside(face: Any, refinement: FineMesh) -> bool:
    if refinement.lower is None or refinement.upper is None:
        return True
    low, high = face.bounding_box
    slack = FLAT * max(high[i] - low[i] for i in range(3)) + 2 * PADDING
    return all(
        refinement.lower[i] - slack <= low[i] and high[i] <= refinement.upper[i] + slack for i in range(3)
    )
