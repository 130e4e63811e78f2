"""A closed surface wrapped around one that bounds no body: cutting itself, with holes, or with triangles inside out.

Whatever the triangles say of inside and outside, the outside is what can be reached from far away. On a lattice of
spacing h, half of what the surface may move:

1. All nodes nearer to the surface than √3/2 h close it, so that nothing slips through holes narrower than that; larger
   holes are closed by triangles before. A flood from the lattice's border finds the outside.
2. Nodes near the surface are outside where they lie on the same side of it as the nearest node of the outside does.
   Their distances are those to the triangles, so that the zero surface lies between nodes, and deep inside nothing is.
3. Marching tetrahedra (Doi & Koide 1991, IEICE Trans. E74, 214–224) on six tetrahedra of each cube give a closed
   surface whose every edge has two triangles. Taubin's two steps (1995, SIGGRAPH, 351–358) smooth it without shrinking.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from palpate.errors import UsageError
from palpate.format import bound, millimetres
from palpate.physics.shapes.meshing import split_triangles
from palpate.physics.shapes.surface_repair import SAME, Surface, unite_points

__all__ = ["COARSEST", "Moved", "wrap_surface"]

COARSEST = 8.0
"""Least extent of a surface over the size of a wrap: a cube loses 7 % of its volume there, 16 % at half of it."""
MOST_NODES = 8_000_000  # of the lattice: a gigabyte
_BORDER = 3  # nodes of the lattice outside the surface's box
_NEAR = 2.5  # spacings from the surface within which distances are measured
_SAMPLED = 0.5  # of a spacing: how far apart the surface's points are whose distance is measured
_CORNER = 0.15  # of an edge: nearer to a node no vertex lies, so that no triangle is a sliver
_ROUNDS, _SHRINK, _GROW = 15, 0.5, -0.53  # of Taubin's smoothing

# a cube's corners by the bits x, y, z of their number; its six tetrahedra share the diagonal 0–7
_TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


@dataclass(frozen=True)
class Moved:
    """Distances of a surface's points from those of the one that it was wrapped around, m."""

    most: float
    p95: float  # 95th percentile over the area

    def __str__(self) -> str:
        return f"the surface moved by {millimetres(self.p95)} (95 % of it), {millimetres(self.most)} at most"


def wrap_surface(surface: Surface, size: float) -> tuple[Surface, Moved]:
    """Return a closed surface around another, about `size` m from it at most, and how far it lies from it.

    Names of parts are lost. What is thinner than about `size`, and gaps narrower than that, may vanish.
    """
    thinnest = float(np.ptp(surface.points, axis=0).min())
    if size * COARSEST > 1.000001 * thinnest > 0:
        raise UsageError(
            f"A wrap of {millimetres(size)} is too coarse for a surface {millimetres(thinnest)} thin.",
            why="Edges are rounded by about a third of the wrap: a cube loses 7 % of its volume at that limit.",
            fix=f"Wrap by {millimetres(bound(thinnest / COARSEST))} or less.",
        )
    h = size / 2
    node = unite_points(surface.points, SAME * surface.length)  # some formats have no shared corners
    closed = _close_holes(surface.points, node[surface.triangles])
    low = closed.min(axis=(0, 1)) - _BORDER * h
    shape = np.ceil((closed.max(axis=(0, 1)) + _BORDER * h - low) / h).astype(int) + 1
    if shape.prod() > MOST_NODES:
        least = size * (float(shape.prod()) / MOST_NODES) ** (1 / 3)
        raise UsageError(
            f"A wrap of {millimetres(size)} is too fine for a surface {millimetres(surface.length)} long.",
            why=f"It would take a lattice of {shape.prod():,} nodes; at most {MOST_NODES:,} are used.",
            fix=f"Wrap by {millimetres(1.1 * least)} or more.",
        )
    samples = _sample(closed, _SAMPLED * h)
    inside = _inside(samples, low, shape, h)
    if not (inside > 0).any():
        raise UsageError(
            "The surface encloses nothing that a wrap could be laid around.",
            why=f"From outside, everything can be reached through openings wider than {millimetres(size)}.",
            fix="Close the openings, or give a sheet a thickness, in the program that made the file.",
        )
    points, triangles = _march(inside, low, h)
    points = _smooth(points, triangles)
    _require_whole(points, closed, size)
    moved = _shift(points, triangles, samples, h)
    note = f"It was wrapped, {millimetres(size)} fine: {moved}."
    wrapped = Surface(points, triangles, np.zeros(len(triangles), dtype=np.int64), notes=surface.notes)
    return replace(wrapped, notes=(*surface.notes, note)), moved


def _require_whole(points: np.ndarray, corners: np.ndarray, size: float) -> None:
    """Refuse a wrap whose box is not that of the surface: the flood came in, and a part is gone."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    gap = float(max(np.abs(points.min(axis=0) - low).max(), np.abs(points.max(axis=0) - high).max()))
    if gap > 2 * size:
        raise UsageError(
            f"The wrap misses a part of the surface, {millimetres(gap)} at an end.",
            why=f"It is open wider than {millimetres(size)} there, thinner than that, or a piece of its own.",
            fix="Wrap by another size, or close the opening in the program that made the file.",
        )


def _close_holes(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the triangles' corners (t, 3, 3) with a fan of further ones in each hole."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners, edges = points[triangles], _border(triangles)
    if not len(edges):
        return np.asarray(corners)
    graph = coo_array((np.ones(len(edges)), edges.T), shape=(len(points), len(points)))
    loop = connected_components(graph, directed=False)[1][edges[:, 0]]
    _, loop = np.unique(loop, return_inverse=True)
    ends = points[edges]
    sums = np.stack([np.bincount(loop, ends[:, :, i].mean(axis=1)) for i in range(3)], axis=1)
    middle = sums / np.bincount(loop)[:, None]
    return np.concatenate([corners, np.concatenate([ends, middle[loop][:, None]], axis=1)])


def _border(triangles: np.ndarray) -> np.ndarray:
    """Return the edges (e, 2) that belong to one triangle only, whichever way that runs along them."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    return np.asarray(edges[count == 1])


def _sample(corners: np.ndarray, spacing: float) -> np.ndarray:
    """Return points (s, 3) all over triangles (t, 3, 3), no farther apart than a spacing."""
    fine, _ = split_triangles(corners, spacing)
    return np.concatenate([fine.mean(axis=1), corners.reshape(-1, 3)])


def _inside(samples: np.ndarray, low: np.ndarray, shape: np.ndarray, h: float) -> np.ndarray:
    """Return the signed distance (a, b, c) in m of each node of a lattice, positive inside the body."""
    touched = np.zeros(shape, dtype=bool)
    touched[tuple(np.rint((samples - low) / h).astype(int).T)] = True
    near = np.argwhere(ndimage.distance_transform_edt(~touched) < _NEAR + 1)
    places = low + near * h
    tree = cKDTree(samples)
    distance = np.asarray(tree.query(places)[0])
    wall = np.zeros(shape, dtype=bool)
    wall[tuple(near[distance < np.sqrt(0.75) * h].T)] = True
    label, _ = ndimage.label(~wall)
    outside = label == label[0, 0, 0]
    field = np.where(outside, -_NEAR * h, _NEAR * h)
    # of each node near the surface the nearest one outside, which knows the side
    _, index = ndimage.distance_transform_edt(~outside, return_indices=True)
    lead = index[:, near[:, 0], near[:, 1], near[:, 2]].T
    start = low + lead * h
    foot = samples[tree.query(start)[1]]
    same = np.einsum("ni,ni->n", places - foot, start - foot) > 0
    reached = np.linalg.norm((lead - near) * h, axis=1) < _NEAR * h
    sign = np.where(outside[tuple(near.T)] | (same & reached), -1.0, 1.0)
    field[tuple(near.T)] = sign * np.minimum(distance, _NEAR * h)
    return _one_piece(field)


def _one_piece(field: np.ndarray) -> np.ndarray:
    """Return a signed distance without bubbles inside, and without crumbs beside the largest piece."""
    bodies, count = ndimage.label(field > 0)
    if count > 1:
        sizes = np.bincount(bodies.ravel())
        sizes[0] = 0
        field = np.where((bodies > 0) & (sizes[bodies] < 0.01 * sizes.max()), -np.abs(field), field)
    voids, count = ndimage.label(field <= 0)
    if count > 1:
        field = np.where((voids > 0) & (voids != voids[0, 0, 0]), np.abs(field) + 1e-12, field)
    return np.asarray(field)


def _march(field: np.ndarray, low: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points (p, 3) and triangles (t, 3) of the zero surface of a field on a lattice, facing where it falls."""
    strides = np.array([field.shape[1] * field.shape[2], field.shape[2], 1])
    flat = field.ravel()
    steps = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) @ strides
    signs, shape = field > 0, np.array(field.shape) - 1
    some, every = np.zeros(shape, dtype=bool), np.ones(shape, dtype=bool)
    for bits in np.ndindex(2, 2, 2):
        part = signs[tuple(slice(bit, bit + n) for bit, n in zip(bits, shape, strict=True))]
        some |= part
        every &= part
    cubes = np.argwhere(some & ~every) @ strides
    tetrahedra = (cubes[:, None, None] + steps[_TETRAHEDRA]).reshape(-1, 4)
    pairs = _crossings(tetrahedra, flat > 0)
    pairs = np.sort(pairs.reshape(-1, 2), axis=1).astype(np.int64)
    edges, index = np.unique(pairs[:, 0] * flat.size + pairs[:, 1], return_inverse=True)
    ends = np.stack(np.divmod(edges, flat.size), axis=1)
    a, b = flat[ends[:, 0]], flat[ends[:, 1]]
    t = np.clip(a / (a - b), _CORNER, 1 - _CORNER)[:, None]
    first, second = (np.stack(np.unravel_index(ends[:, i], field.shape), axis=1) for i in (0, 1))
    points = low + h * (first + t * (second - first))
    return points, index.reshape(-1, 3)


def _crossings(tetrahedra: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return triangles (t, 3, 2) whose corners lie on edges of tetrahedra (n, 4), each edge by its two nodes.

    Tetrahedra have a positive volume; triangles run counter-clockwise as seen from where `inside` is False.
    """
    signs = inside[tetrahedra]
    count = signs.sum(axis=1)
    found = []
    for number, lone in ((1, True), (3, False)):
        rows = count == number
        nodes, at = tetrahedra[rows], (signs[rows] == lone).argmax(axis=1)
        order = _EVEN[at]
        p, q, r, s = (nodes[np.arange(len(nodes)), order[:, i]] for i in range(4))
        corners = (q, r, s) if lone else (q, s, r)
        found.append(np.stack([np.stack([p, c], axis=1) for c in corners], axis=1))
    rows = count == 2
    nodes, mask = tetrahedra[rows], signs[rows] @ (1 << np.arange(4))
    order = _PAIRS[mask]
    p, q, r, s = (nodes[np.arange(len(nodes)), order[:, i]] for i in range(4))
    # p and q inside, r and s outside: the quadrilateral pr, ps, qs, qr faces away from p and q
    quad = [np.stack(pair, axis=1) for pair in ((p, r), (p, s), (q, s), (q, r))]
    found += [np.stack([quad[0], quad[1], quad[2]], axis=1), np.stack([quad[0], quad[2], quad[3]], axis=1)]
    return np.concatenate(found)


# even permutations of four nodes that bring node i to the front
_EVEN = np.array([[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]])


def _pair_orders() -> np.ndarray:
    """Return for each mask of two nodes inside the even permutation with these two in front."""
    from itertools import permutations

    orders = np.zeros((16, 4), dtype=int)
    for order in permutations(range(4)):
        odd = sum(order[i] > order[j] for i in range(4) for j in range(i + 1, 4)) % 2
        if not odd:
            orders[(1 << order[0]) | (1 << order[1])] = order
    return orders


_PAIRS = _pair_orders()


def _smooth(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return points moved to the means of their neighbours and back, so that the volume stays."""
    from scipy.sparse import coo_array

    i, j = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    ones = np.ones(len(i))
    A = coo_array((ones, (i, j)), shape=(len(points), len(points))).tocsr()
    A = A + A.T
    degree = A.sum(axis=1)[:, None]
    for _ in range(_ROUNDS):
        for step in (_SHRINK, _GROW):
            points = points + step * (A @ points / degree - points)
    return points


def _shift(points: np.ndarray, triangles: np.ndarray, samples: np.ndarray, h: float) -> Moved:
    """Return how far a wrapped surface lies from the samples of the one it was wrapped around."""
    fine, _ = split_triangles(points[triangles], h)
    distance = np.asarray(cKDTree(samples).query(fine.mean(axis=1))[0])
    area = np.linalg.norm(np.cross(fine[:, 1] - fine[:, 0], fine[:, 2] - fine[:, 0]), axis=1)
    order = np.argsort(distance)
    share = np.cumsum(area[order]) / area.sum()
    return Moved(float(distance.max()), float(distance[order][np.searchsorted(share, 0.95)]))
