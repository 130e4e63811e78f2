"""Tetrahedra from cells of other kinds, and nodes that belong together.

split_cells   hexahedra, wedges and pyramids become tetrahedra whose faces fit each other
merge_nodes   nodes at one place become one
duplicate_cells   cells that a file holds several times
"""

from __future__ import annotations

import numpy as np

from palpate.physics.shapes.surface_repair import unite_points

__all__ = ["SIDES", "duplicate_cells", "merge_nodes", "shortest_edge", "split_cells"]

SAME = 1e-6  # of the body's length, below which two nodes are at one place
# the corners of a cell as those of its mirror image are numbered
MIRRORED = {
    "tetra": [0, 2, 1, 3],
    "pyramid": [0, 3, 2, 1, 4],
    "wedge": [3, 4, 5, 0, 1, 2],
    "hexahedron": [4, 5, 6, 7, 0, 1, 2, 3],
}
SHORT = 0.1  # of the shortest edge: nodes further apart are meant to be two
# corners of the faces of each kind, counter-clockwise as seen from outside where the cell is right-handed
SIDES = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


def merge_nodes(points: np.ndarray, shortest: float) -> tuple[np.ndarray, float]:
    """Return for each node the number of the one that stands for its place, and how far apart they are at most, m.

    `points` are (n, 3) in m; nodes that are a tenth of `shortest`, the shortest edge of the mesh in m, apart are
    two.
    """
    length = float(np.ptp(points, axis=0).max())
    node = unite_points(points, min(SAME * length, SHORT * shortest))
    return node, float(np.linalg.norm(points - points[node], axis=1).max(initial=0.0))


def split_cells(
    points: np.ndarray, solids: list[tuple[str, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Split cells into tetrahedra whose faces fit each other.

    The face of four corners is cut at its corner of the least number, the cell at the least of all: six tetrahedra
    from a hexahedron, three from a wedge, two from a pyramid (pulling triangulation; Dompierre et al. 1999, How to
    subdivide pyramids, prisms and hexahedra into tetrahedra, 8th Int. Meshing Roundtable). A cell with a face that
    lies on tetrahedra of the file, which cut it the other way, gets a node in its middle.

    `points` are the nodes (n, 3), `solids` the cells (k, corners) by kind. Returns the nodes (m, 3), with those in
    the middle of cells behind them; tetrahedra (e, 4), right-handed where the cells of their kind are all numbered
    alike; and the index (e,) of the cell of each, counted through the blocks.
    """
    cut = _cut_by_tetrahedra(solids)
    tetrahedra, origins, middles = [], [], []
    start, free = 0, len(points)
    for kind, cells in solids:
        number = np.arange(start, start + len(cells))
        start += len(cells)
        cells = _turn_right_handed(points, kind, cells)
        if kind == "tetra":
            tetrahedra.append(cells)
            origins.append(number)
            continue
        against = np.array([_is_cut_otherwise(cell, kind, cut) for cell in cells.tolist()], dtype=bool)
        plain, plain_origin = _pull(cells[~against], kind)
        tetrahedra.append(plain)
        origins.append(number[~against][plain_origin])
        for cell, own in zip(cells[against].tolist(), number[against].tolist(), strict=True):
            middles.append(points[cell].mean(axis=0))
            faces = [triangle for side in SIDES[kind] for triangle in _cut([cell[k] for k in side], cut)]
            tetrahedra.append(np.array([(a, c, b, free) for a, b, c in faces]))
            origins.append(np.full(len(faces), own))
            free += 1
    more = np.array(middles).reshape(-1, 3)
    every = np.concatenate(tetrahedra) if tetrahedra else np.empty((0, 4), dtype=np.int64)
    origin = np.concatenate(origins) if origins else np.empty(0, dtype=np.int64)
    # a hexahedron with one corner twice stands for a wedge
    whole = (np.diff(np.sort(every, axis=1), axis=1) > 0).all(axis=1)
    return np.concatenate([points, more]), every[whole], origin[whole]


def _cut_by_tetrahedra(solids: list[tuple[str, np.ndarray]]) -> dict[frozenset[int], frozenset[int]]:
    """Diagonals, by the corners of a face, of those faces of four corners on which two faces of tetrahedra lie."""
    mixed = [(kind, cells) for kind, cells in solids if kind != "tetra" and len(cells)]
    four = [cells for kind, cells in solids if kind == "tetra" and len(cells)]
    if not mixed or not four:
        return {}
    faces = np.sort(np.concatenate(four)[:, np.array(SIDES["tetra"])].reshape(-1, 3), axis=1)
    triangles = set(map(tuple, faces.tolist()))
    cut = {}
    for kind, cells in mixed:
        for side in SIDES[kind]:
            if len(side) == 3:
                continue
            for a, b, c, d in cells[:, side].tolist():
                if tuple(sorted((a, b, c))) in triangles and tuple(sorted((a, c, d))) in triangles:
                    cut[frozenset((a, b, c, d))] = frozenset((a, c))
                elif tuple(sorted((a, b, d))) in triangles and tuple(sorted((b, c, d))) in triangles:
                    cut[frozenset((a, b, c, d))] = frozenset((b, d))
    return cut


def _is_cut_otherwise(cell: list[int], kind: str, cut: dict[frozenset[int], frozenset[int]]) -> bool:
    """Tell whether tetrahedra cut a face of a cell along the diagonal that its corner of the least number is not on."""
    if not cut:
        return False
    for side in SIDES[kind]:
        if len(side) == 4:
            corners = [cell[k] for k in side]
            diagonal = cut.get(frozenset(corners))
            if diagonal is not None and min(corners) not in diagonal:
                return True
    return False


def _cut(corners: list[int], cut: dict[frozenset[int], frozenset[int]]) -> list[tuple[int, ...]]:
    """Triangles of a face, cut as tetrahedra of the file do, else at the corner of the least number."""
    if len(corners) == 3:
        return [tuple(corners)]
    diagonal = cut.get(frozenset(corners))
    k = corners.index(min(corners) if diagonal is None else min(diagonal))
    a, b, c, d = corners[k:] + corners[:k]
    return [(a, b, c), (a, c, d)]


def _pull(cells: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Join the corner of the least number with the triangles of the faces that it is not on."""
    least = cells.argmin(axis=1)
    tetrahedra, origins = [], []
    for apex in range(cells.shape[1]):
        mine = np.flatnonzero(least == apex)
        for side in SIDES[kind]:
            if apex in side or not len(mine):
                continue
            corners = cells[mine][:, side]
            # turned so that the least is first; a face of three corners is one triangle
            turn = corners.argmin(axis=1)[:, None] + np.arange(len(side))
            corners = np.take_along_axis(corners, turn % len(side), axis=1)
            for triangle in ((0, 1, 2), (0, 2, 3))[: len(side) - 2]:
                a, b, c = corners[:, triangle].T
                # the side faces outwards: seen from the apex within, its corners run clockwise
                tetrahedra.append(np.column_stack([a, c, b, cells[mine, apex]]))
                origins.append(mine)
    if not tetrahedra:
        return np.empty((0, 4), dtype=np.int64), np.empty(0, dtype=np.int64)
    return np.concatenate(tetrahedra), np.concatenate(origins)


def _turn_right_handed(points: np.ndarray, kind: str, cells: np.ndarray) -> np.ndarray:
    """Turn cells of a kind whose corners run the other way round, as those of VTK's wedges do."""
    centre = points[cells].mean(axis=1)
    volume = np.zeros(len(cells))
    for side in SIDES[kind]:
        for k in range(1, len(side) - 1):
            a, b, c = points[cells[:, side[0]]], points[cells[:, side[k]]], points[cells[:, side[k + 1]]]
            volume += np.einsum("ni,ni->n", np.cross(b - a, c - a), a - centre) / 6
    if len(cells) and (volume < 0).all():
        return cells[:, MIRRORED[kind]]
    return cells


def shortest_edge(points: np.ndarray, solids: list[tuple[str, np.ndarray]]) -> float:
    """Return the length of the shortest edge of cells that is no point, m; infinite without cells."""
    shortest = np.inf
    for kind, cells in solids:
        for side in SIDES[kind]:
            ends = points[cells[:, side]]
            length = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2)
            shortest = min(shortest, float(length.min(where=length > 0, initial=np.inf)))
    return shortest


def duplicate_cells(tetrahedra: np.ndarray) -> np.ndarray:
    """Return for each cell the first one with the same corners."""
    _, first, inverse = np.unique(np.sort(tetrahedra, axis=1), axis=0, return_index=True, return_inverse=True)
    return np.asarray(first[inverse.ravel()])
