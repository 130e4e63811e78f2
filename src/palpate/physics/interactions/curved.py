"""A surface as the finite elements see it: curved elements as many small triangles.

Between their corners the elements of a round body bulge out of its straight triangles, by h²/(8 R) for an edge h on a
radius R: 0.09 mm for 6 mm on 50 mm. Depths are measured to the bulging surface.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from palpate.physics.interactions.patch import Patch

if TYPE_CHECKING:
    from collections.abc import Hashable

    from palpate.physics.shapes.meshing import FineMesh
    from palpate.physics.shapes.shape import Geometry

__all__ = ["surface_of"]

PARTS = 4  # triangles along an edge: what they still miss is a sixteenth
SAME = 1e-9  # of the surface's size: points closer than that are one


def surface_of(geometry: Geometry, surface: str, refinements: tuple[FineMesh, ...] = ()) -> Patch:
    """The named surface of a body at rest, its curved elements parted into small triangles.

    Raises
    ------
    UsageError
        If the body has no such surface.
    """
    straight = Patch.of(geometry.rest(refinements), surface)
    if not getattr(geometry, "curved", False) or straight.is_plane:
        return straight
    return _parted(cast("Hashable", geometry), surface, refinements)


# a sweep asks for the ranges, the design and the chains of a few surfaces
@lru_cache(maxsize=8)
def _parted(geometry: Hashable, surface: str, refinements: tuple[FineMesh, ...]) -> Patch:
    import ngsolve as ngs

    mesh = cast("Any", geometry).mesh(refinements)
    corners, pattern = _pattern(PARTS)
    rule = ngs.IntegrationRule([tuple(corner) for corner in corners.tolist()], [1.0] * len(corners))
    points = mesh.MapToAllElements(rule, mesh.Boundaries(surface))
    places = np.asarray(ngs.CF((ngs.x, ngs.y, ngs.z))(points))
    normals = np.asarray(ngs.specialcf.normal(3)(points)).reshape(-1, len(corners), 3).mean(axis=1)
    nodes, numbers = _joined(places)
    triangles = numbers.reshape(-1, len(corners))[:, pattern]
    return Patch(nodes, _outward(nodes, triangles, normals).reshape(-1, 3))


def _pattern(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) in the reference triangle, and the small triangles between them (parts², 3)."""
    number: dict[tuple[int, int], int] = {}
    for j in range(parts + 1):
        for i in range(parts + 1 - j):
            number[i, j] = len(number)
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in number if i + j < parts]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in number if i + j < parts - 1]
    return np.array(list(number)) / parts, np.array([[number[p] for p in one] for one in up + down])


def _joined(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (M, 3) without those that occur several times, and the numbers (N,) of all among them."""
    size = float(np.ptp(places, axis=0).max())
    _, first, numbers = np.unique(
        np.round(places / (SAME * size)).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    return places[first], np.ravel(numbers)


def _outward(nodes: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Triangles (t, n, 3), turned over where an element's normal (t, 3) says so."""
    a, b, c = np.moveaxis(nodes[triangles[:, 0]], 1, 0)
    turned = np.einsum("ti,ti->t", np.cross(b - a, c - a), normals) < 0
    return np.where(turned[:, None, None], triangles[:, :, ::-1], triangles)
