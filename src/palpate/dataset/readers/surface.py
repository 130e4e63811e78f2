"""The outer surface of a body's cells: the faces that belong to one cell only."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

__all__ = ["cells_of_triangles", "outer_surface"]

# faces of each kind of cell by its corner nodes, counter-clockwise seen from outside, in VTK's order of nodes
_FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2, 3),),
}
CORNERS = {"tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5, "triangle": 3, "quad": 4}
"""Number of corner nodes of each kind of cell; the others lie between them."""

_SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid")


def outer_surface(cells: Iterable[tuple[str, np.ndarray]], points: np.ndarray) -> np.ndarray | None:
    """Return the outer triangles (t, 3) of cells; of quadrilaterals both halves. None where there are none.

    Where solid cells exist, surface cells among them are passed over: they lie on faces of the solids.

    Each cell has a kind and its nodes (e, k), of which those beyond the corners are ignored; kinds that have no faces,
    such as lines, are too. By the coordinates (n, 2) or (n, 3) solids numbered the other way round are turned.
    """
    blocks = [(kind, nodes) for kind, nodes in cells if kind in _FACES and len(nodes)]
    solid = any(kind in _SOLIDS for kind, _ in blocks)
    blocks = [(kind, nodes) for kind, nodes in blocks if (kind in _SOLIDS) == solid]
    faces: dict[int, list[np.ndarray]] = {3: [], 4: []}
    for kind, nodes in blocks:
        corners = np.asarray(nodes)[:, : CORNERS[kind]]
        if solid and points.shape[1] == 3:
            inverted = _signed_volumes(kind, corners, points) < 0
        else:
            inverted = np.zeros(len(corners), dtype=bool)
        for face in _FACES[kind]:
            quads = corners[:, face]
            faces[len(face)].append(np.where(inverted[:, None], quads[:, ::-1], quads))
    triangles = [_single(np.concatenate(faces[3])) if solid else np.concatenate(faces[3])] if faces[3] else []
    if faces[4]:
        quads = _single(np.concatenate(faces[4])) if solid else np.concatenate(faces[4])
        triangles += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    joined = np.concatenate(triangles) if triangles else np.empty((0, 3), dtype=np.int64)
    return joined.astype(np.int64) if len(joined) else None


def cells_of_triangles(
    cells: Iterable[tuple[str, np.ndarray, np.ndarray]], triangles: np.ndarray
) -> np.ndarray | None:
    """Return the cell (t,) that each triangle (t, 3) of the surface belongs to; None where one belongs to none.

    Each entry of `cells` has a kind, its nodes (e, k) and the numbers (e,) of its cells.
    """
    parts, owners = [np.sort(triangles, axis=1)], []
    for kind, nodes, numbers in cells:
        for face in _FACES.get(kind, ()):
            corners = np.asarray(nodes)[:, face]
            for three in ((0, 1, 2),) if len(face) == 3 else ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3)):
                parts.append(np.sort(corners[:, three], axis=1))
                owners.append(numbers)
    _, number = np.unique(np.concatenate(parts), axis=0, return_inverse=True)
    number, own = number.ravel()[: len(triangles)], number.ravel()[len(triangles) :]
    cell_of = np.full(int(number.max(initial=-1)) + 1 + len(own), -1)
    cell_of[own] = np.concatenate(owners) if owners else own
    found = cell_of[number]
    return None if (found < 0).any() else np.asarray(found)


def _single(faces: np.ndarray) -> np.ndarray:
    """Return the faces that occur once, whatever the order of their nodes."""
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[counts == 1])])


def _signed_volumes(kind: str, corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return six times the volume between a cell's first corner and its neighbours, negative where inverted."""
    neighbours = (1, 2, 3) if kind in {"tetra", "wedge"} else (1, 3, 4)
    origin = points[corners[:, 0]]
    first, second, third = (points[corners[:, i]] - origin for i in neighbours)
    volumes: np.ndarray = np.einsum("ij,ij->i", np.cross(first, second), third)
    return volumes
