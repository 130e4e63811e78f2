"""Tetrahedra for solids of the CAD kernel, fine where it is asked for."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.geometry.mesh import body_mesh
from palpate.physics.geometry.refinement import GRADING, THREADS, FineMesh, require_budget
from palpate.physics.geometry.sampling import points_on

__all__ = ["mesh_solid"]

FLAT = 1e-5  # thickness over length below which a face counts as upright and plane
PADDING = 1e-7  # m by which the CAD kernel's boxes are larger than the faces within
SHORTEST = 1e-5  # shortest edge over the body's length that is meshed as such; Netgen's own default is in mm


def mesh_solid(solid: Any, coarse: float, refinements: tuple[FineMesh, ...]) -> Any:
    """Mesh a solid whose faces and solids carry names.

    The fine part of an upright plane rectangle is cut out of it as a face of its own, so that the size of its
    elements is even; on other faces the element size is restricted at points.

    Parameters
    ----------
    solid : netgen.occ.TopoDS_Shape
        In m.
    coarse : float
        Largest element size in m.
    refinements : tuple of FineMesh

    Returns
    -------
    netgen.meshing.Mesh

    Raises
    ------
    UsageError
        If there would be too many elements, or Netgen can't mesh the solid.
    """
    from netgen.occ import OCCGeometry

    flat = [r for r in refinements if all(_is_rectangle(f) for f in solid.faces if r.is_on(f.name))]
    solid = _imprinted(solid, flat)
    fine = _restricted_faces(solid, flat)
    points = []
    for refinement in refinements:
        if refinement not in flat:
            at, area = points_on(body_mesh(_generate(OCCGeometry(solid), solid, coarse)), refinement)
            points.append((at, refinement.element))
            fine.append((area, refinement.element))
    require_budget([(s.mass, min(coarse, s.maxh)) for s in solid.solids], fine)
    geometry = OCCGeometry(solid)
    for at, element in points:
        _restrict(geometry, at, element)
    return _generate(geometry, solid, coarse)


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
    """Whether a face is an upright plane rectangle.

    In others a cut may run close to an edge, where only flat elements would fit.
    """
    if _upright(face) is None:
        return False
    low, high = face.bounding_box
    extent = sorted(high[i] - low[i] for i in range(3))
    return bool(abs(face.mass - extent[1] * extent[2]) < 10 * FLAT * face.mass)


def _upright(face: Any) -> int | None:
    """Axis that a plane face is normal to, None for others."""
    low, high = face.bounding_box
    extent = np.array([high[i] - low[i] for i in range(3)])
    axis = int(extent.argmin())
    return axis if extent[axis] < FLAT * extent.max() + 2 * PADDING else None


def _imprinted(solid: Any, refinements: list[FineMesh]) -> Any:
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

    axis = _upright(face)
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
    return [rectangle * face]


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


def _restrict(geometry: Any, at: np.ndarray, element: float) -> None:
    from netgen.meshing import Pnt

    for point in at.tolist():
        geometry.RestrictH(Pnt(*point), element)
