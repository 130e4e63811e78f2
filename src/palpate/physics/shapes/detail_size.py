"""The smallest elements that details of a CAD part get: fillets and engravings far below the elements of the body.

Netgen follows each curvature with elements of half its radius, whatever the size of the body: fillets of 0.2 mm on
the edges of a block of 40 mm become 70,000 triangles. The edges alone are divided in little time, and tell how many
triangles there would be.

least_element   the size below which no element is made
detail_note     what is told of it
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["detail_note", "least_element"]

SHARES = (1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32)  # of the body's elements, that details are bounded to
ENOUGH = 2_000  # triangles of a surface: some 6,000 elements, seconds of a solve
MORE = 1.3  # times as many triangles, from which on details and not the body's own curvature make them
MOST = 100_000  # triangles of a surface beyond any solver
AREA = 3**0.5 / 4  # of a triangle of edge 1
PADDING = 1e-6  # of the part's length, by which a face's box takes the edges around it in


def least_element(solid: Any, coarse: float, grading: float) -> tuple[float, int]:
    """Return the size in m below which no element is made, and how many triangles there would be with finer ones.

    The solid is a netgen.occ.TopoDS_Shape in m, `coarse` the largest element size in m, `grading` the growth of the
    element size per distance.
    """
    least = SHARES[0] * coarse
    count = _triangles(solid, coarse, least, grading)
    if count > MOST:
        raise UsageError(
            f"The part would have about {float(f'{count:.1g}'):,.0f} triangles on its surface.",
            why=f"It has details far below the elements of {1e3 * coarse:.3g} mm, all over.",
            fix="Remove small fillets, threads and engravings in the CAD program, or choose larger elements.",
        )
    for share in SHARES[1:]:  # from the coarsest on, which are counted fastest
        before, count = count, _triangles(solid, coarse, share * coarse, grading)
        if count > max(ENOUGH, MORE * before):
            break
        least = share * coarse
    return least, count


def detail_note(solid: Any, coarse: float, grading: float) -> str:
    """Return a sentence on details that get larger elements than their curvature asks for; "" where there are none."""
    least, count = least_element(solid, coarse, grading)
    if least <= SHARES[-1] * coarse:
        return ""
    return (
        f"Details far below the elements of {1e3 * coarse:.2g} mm, such as small fillets, would take "
        f"{float(f'{count:.1g}'):,.0f} triangles or more: they get elements of {1e3 * least:.2g} mm or more."
    )


def _triangles(solid: Any, coarse: float, least: float, grading: float) -> int:
    """Return about how many triangles the surface gets: of a face by its area, and by its edges where they are finer.

    Beside an edge of length l with elements h, whose size grows by the grading g, lie l / (g h) squares of an element.
    """
    import ngsolve
    from netgen.meshing import MeshingStep
    from netgen.occ import OCCGeometry

    ngsolve.SetNumThreads(1)
    mesh = OCCGeometry(solid).GenerateMesh(
        maxh=coarse, minh=least, grading=grading, nthreads=1, perfstepsend=MeshingStep.MESHEDGES
    )
    points = np.array([point.p for point in mesh.Points()])
    ends = np.array([[vertex.nr - 1 for vertex in e.vertices[:2]] for e in mesh.Elements1D()]).reshape(-1, 2)
    lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    middles = points[ends].mean(axis=1)
    slack = PADDING * float(np.ptp(points, axis=0).max())
    total = 0.0
    for face in solid.faces:
        low, high = (np.array([corner[i] for i in range(3)]) for corner in face.bounding_box)
        mine = lengths[((middles >= low - slack) & (middles <= high + slack)).all(axis=1)]
        size = float(mine.mean()) if len(mine) else coarse
        beside = face.mass / coarse**2 + float(mine.sum()) / (grading * size)
        total += min(face.mass / size**2, beside) / AREA
    return int(total)
