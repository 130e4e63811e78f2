"""Fewer triangles for the same surface, within a tolerance that is measured.

Edges are collapsed by rising quadric error (Garland & Heckbert 1997, Surface simplification using quadric error
metrics, SIGGRAPH, 209-216). Each pass takes many edges that are no neighbours of each other. How far the result is
from the surface is measured afterwards, in both directions; where that is too far, it is made anew with smaller errors.

A library of such collapses (fast-simplification 0.2) is quicker, but leaves slender triangles: Netgen takes them for
features and makes two to three times as many tetrahedra, of a worst quality of 0.04 instead of 0.36.

simplify_surface   the surface with fewer triangles, and a sentence about it
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from palpate.format import millimetres
from palpate.physics.shapes.surface_checks import closest_points
from palpate.physics.shapes.surface_repair import Surface, without_spare_nodes

__all__ = ["MANY", "TOLERANCE", "simplify_surface"]

MANY = 20_000
"""Triangles of a surface up to which nothing is simplified, and at which simplifying ends."""

TOLERANCE = 5e-4
"""Tolerance over the surface's length, where none is given."""

PASSES = 100  # each takes about a twelfth of the triangles
CHEAPEST = 0.25  # share of the edges that a pass looks at
MIX = 1e-3  # of the largest error, below which edges count as equal
LEAST = 2e-3  # edges that a pass must find, over the number of triangles
ROUNDS = 3  # of choosing edges in a pass
SHARES = (0.6, 0.3, 0.15)  # of the tolerance that a collapse may take, one attempt after the other
PULL = 1e-3  # weight of an edge's middle against the planes, which leave the place along them open
TURN = 0.5  # cosine of the angle by which a triangle may turn
SHAPE = 0.05  # twice the area over the square of the longest side, below which a triangle is too slender


class _Edges(NamedTuple):
    ends: np.ndarray  # (m, 2) nodes
    place: np.ndarray  # (m, 3) where the edge would go, m
    cost: np.ndarray  # (m,) mean squared distance from the planes, m²


def simplify_surface(surface: Surface, tolerance: float, most: int = MANY) -> Surface:
    """Return a closed surface with at most `most` triangles, or as few as the tolerance allows.

    Nodes between parts of different labels stay.

    `tolerance` is the largest distance in m between both surfaces; each edge of `surface` belongs to two triangles.
    """
    for share in SHARES:
        points, triangles, label_of, lead = _collapse(surface, share * tolerance, most)
        if len(triangles) == len(surface.triangles):
            break
        simple = replace(surface, points=points, triangles=triangles, label_of=label_of)
        deviation = _deviation(surface, simple, lead, tolerance / 4)
        if deviation <= tolerance:
            return without_spare_nodes(simple).with_note(
                f"{len(surface.triangles):,} triangles were simplified to {len(triangles):,}, at most "
                f"{millimetres(float(f'{deviation:.2g}'))} from the surface of the file."
            )
    return surface


def _collapse(
    surface: Surface, tolerance: float, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Collapse edges that leave the nodes of the surface within the tolerance in m of the triangles around them.

    Returns points, triangles and labels of the new surface on the old numbers of nodes, and for each old node (n,) the
    node that stands for it.
    """
    points, triangles, label_of = surface.points.copy(), surface.triangles, surface.label_of
    lead = np.arange(len(points))
    weight, quadric = _quadrics(points, triangles)
    fixed = _label_borders(len(points), triangles, label_of)
    banned = np.empty(0, dtype=np.int64)
    for _ in range(PASSES):
        excess = len(triangles) - most
        if excess <= 0:
            break
        edges = _edges(points, triangles, weight, quadric, fixed, tolerance**2, banned)
        chosen = _choose(edges, points, triangles)[: (excess + 1) // 2]
        far = _departure(edges, chosen, points, triangles, surface.points, lead) > tolerance
        banned = np.union1d(banned, edges.ends[chosen[far]] @ (len(points), 1))
        chosen = chosen[~far]
        if len(chosen) < LEAST * len(triangles):
            break
        keep, go = edges.ends[chosen].T
        points[keep] = edges.place[chosen]
        weight[keep] += weight[go]
        quadric[keep] += quadric[go]
        step = np.arange(len(points))
        step[go] = keep
        lead = step[lead]
        triangles = step[triangles]
        a, b, c = triangles.T
        whole = (a != b) & (b != c) & (c != a)
        triangles, label_of = triangles[whole], label_of[whole]
    return points, triangles, label_of, lead


def _normals(corners: np.ndarray) -> np.ndarray:
    """Normals (t, 3) of triangles (t, 3, 3), of the length of twice the area."""
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _quadrics(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sum of areas (n,) around each node, and the sums (n, 4, 4) of p pᵀ times area of its planes p · (x, 1) = 0."""
    corners = points[triangles]
    normal = _normals(corners)
    twice = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(twice, 1e-300)[:, None]
    plane = np.column_stack([unit, -np.einsum("ti,ti->t", unit, corners[:, 0])])
    product = twice[:, None, None] * plane[:, :, None] * plane[:, None, :]
    weight, quadric = np.zeros(len(points)), np.zeros((len(points), 4, 4))
    for k in range(3):
        weight += np.bincount(triangles[:, k], twice, minlength=len(points))
        for i in range(4):
            for j in range(4):
                quadric[:, i, j] += np.bincount(triangles[:, k], product[:, i, j], minlength=len(points))
    return weight, quadric


def _label_borders(count: int, triangles: np.ndarray, label_of: np.ndarray) -> np.ndarray:
    """Mask (n,) of the nodes at which triangles of different labels meet."""
    low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, -1)
    for k in range(3):
        np.minimum.at(low, triangles[:, k], label_of)
        np.maximum.at(high, triangles[:, k], label_of)
    return high > low


def _edges(
    points: np.ndarray,
    triangles: np.ndarray,
    weight: np.ndarray,
    quadric: np.ndarray,
    fixed: np.ndarray,
    squared: float,
    banned: np.ndarray,
) -> _Edges:
    """Edges that may be collapsed, by rising cost: those of a mean squared error in m², and not banned by number."""
    from scipy.sparse import coo_array

    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends = ends[ends[:, 0] < ends[:, 1]]  # of a closed surface each edge runs both ways
    graph = coo_array(
        (np.ones(2 * len(ends), dtype=np.int32), (ends.T.ravel(), ends[:, ::-1].T.ravel())),
        shape=(len(points),) * 2,
    ).tocsr()
    valence = np.diff(graph.indptr)
    free = ~fixed[ends].any(axis=1) & ~np.isin(ends @ (len(points), 1), banned)
    ends = ends[free]
    both = quadric[ends[:, 0]] + quadric[ends[:, 1]]
    area = weight[ends].sum(axis=1)
    middle = points[ends].mean(axis=1)
    # the place is found as a shift from the middle, where the numbers are small
    pull = PULL * area[:, None, None] * np.eye(3)
    slope = np.einsum("eij,ej->ei", both[:, :3, :3], middle) + both[:, :3, 3]
    shift = np.linalg.solve(both[:, :3, :3] + pull, -slope[:, :, None])[:, :, 0]
    at_middle = np.einsum("ei,eij,ej->e", middle, both[:, :3, :3], middle) + 2 * np.einsum(
        "ei,ei->e", both[:, :3, 3], middle
    )
    cost = at_middle + both[:, 3, 3] + 2 * np.einsum("ei,ei->e", slope, shift)
    cost = np.maximum(cost + np.einsum("ei,eij,ej->e", shift, both[:, :3, :3], shift), 0.0) / area
    cheap = cost <= squared
    ends, place, cost = ends[cheap], (middle + shift)[cheap], cost[cheap]
    # the ends have two common neighbours, else the surface would pinch
    shared = (graph @ graph).multiply(graph).tocoo()
    number = shared.row.astype(np.int64) * len(points) + shared.col
    sorted_rows = np.argsort(number)
    found = np.searchsorted(number[sorted_rows], ends[:, 0] * len(points) + ends[:, 1])
    common = shared.data[sorted_rows[found]]
    sound = (common == 2) & (valence[ends].sum(axis=1) > 6)
    # where all cost nothing, as on a plane, a random order leaves more edges without a neighbour before them
    mixed = cost[sound] + MIX * squared * np.random.default_rng(0).random(int(sound.sum()))
    order = np.flatnonzero(sound)[np.argsort(mixed, kind="stable")]
    order = order[: max(int(CHEAPEST * len(free)), 50)]
    return _Edges(ends[order], place[order], cost[order])


def _choose(edges: _Edges, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Indices of edges no two of which share a neighbour, and whose collapse turns or flattens no triangle."""
    alive = _turn_little(edges, points, triangles)
    rank = np.where(alive, np.arange(len(edges.cost)), len(edges.cost))
    busy = np.zeros(len(points), dtype=bool)
    chosen = []
    for _ in range(ROUNDS):
        open_rank = np.where(busy[edges.ends].any(axis=1), len(rank), rank)
        best = np.full(len(points), len(rank))
        for k in range(2):
            np.minimum.at(best, edges.ends[:, k], open_rank)
        ring = best.copy()
        for k in range(3):
            np.minimum.at(ring, triangles[:, k], best[triangles].min(axis=1))
        mine = np.flatnonzero((open_rank < len(rank)) & (open_rank == ring[edges.ends].min(axis=1)))
        if not len(mine):
            break
        chosen.append(mine)
        taken = np.zeros(len(points), dtype=bool)
        taken[edges.ends[mine]] = True
        for _ in range(2):
            taken[triangles[taken[triangles].any(axis=1)]] = True
        busy |= taken
    return np.sort(np.concatenate(chosen)) if chosen else np.empty(0, dtype=np.int64)


def _turn_little(edges: _Edges, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mask of the edges whose collapse leaves the triangles around them facing as before, and none too slender."""
    order, start, count = _members(triangles.ravel(), len(points))
    sound = np.ones(len(edges.cost), dtype=bool)
    for k in range(2):
        node, other = edges.ends[:, k], edges.ends[:, 1 - k]
        edge, position = _gather(start[node], count[node])
        row, corner = np.divmod(order[position], 3)
        stays = ~(triangles[row] == other[edge][:, None]).any(axis=1)
        edge, row, corner = edge[stays], row[stays], corner[stays]
        corners = points[triangles[row]]
        before = _normals(corners)
        corners[np.arange(len(row)), corner] = edges.place[edge]
        after = _normals(corners)
        length = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        sides = np.square(corners - np.roll(corners, 1, axis=1)).sum(axis=2).max(axis=1)
        bad = (np.einsum("ti,ti->t", before, after) < TURN * length) | (
            np.linalg.norm(after, axis=1) < SHAPE * sides
        )
        sound[edge[bad]] = False
    return sound


def _members(keys: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Order that sorts keys below `count`, and where in it those of each key start and how many they are."""
    size = np.bincount(keys, minlength=count)
    return np.argsort(keys, kind="stable"), np.cumsum(size) - size, size


def _gather(start: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Row of each element of blocks of `size` that begin at `start`, and its position."""
    row = np.repeat(np.arange(len(size)), size)
    return row, start[row] + np.arange(len(row)) - np.repeat(np.cumsum(size) - size, size)


def _departure(
    edges: _Edges,
    chosen: np.ndarray,
    points: np.ndarray,
    triangles: np.ndarray,
    original: np.ndarray,
    lead: np.ndarray,
) -> np.ndarray:
    """Largest distance in m of the original nodes around each chosen edge from the triangles after its collapse."""
    if not len(chosen):
        return np.empty(0)
    ends, place = edges.ends[chosen], edges.place[chosen]
    # triangles around each edge, without the two that go
    order, start, size = _members(triangles.ravel(), len(points))
    parts = [_gather(start[ends[:, k]], size[ends[:, k]]) for k in (0, 1)]
    owner = np.concatenate([row for row, _ in parts])
    face, corner = np.divmod(order[np.concatenate([position for _, position in parts])], 3)
    other = np.concatenate([ends[row, 1 - k] for k, (row, _) in enumerate(parts)])
    stays = ~(triangles[face] == other[:, None]).any(axis=1)
    owner, face, corner = owner[stays], face[stays], corner[stays]
    corners = points[triangles[face]]
    corners[np.arange(len(face)), corner] = place[owner]
    by_edge, first, ring = _members(owner, len(chosen))
    # original nodes that both ends stand for
    order, start, size = _members(lead, len(points))
    parts = [_gather(start[ends[:, k]], size[ends[:, k]]) for k in (0, 1)]
    row = np.concatenate([row for row, _ in parts])
    node = order[np.concatenate([position for _, position in parts])]
    pair, position = _gather(first[row], ring[row])
    distance = np.linalg.norm(
        closest_points(corners[by_edge[position]], original[node[pair]]) - original[node[pair]], axis=1
    )
    least = np.full(len(node), np.inf)
    np.minimum.at(least, pair, distance)
    most = np.zeros(len(chosen))
    np.maximum.at(most, row, least)
    return most


def _deviation(surface: Surface, simple: Surface, lead: np.ndarray, near: float) -> float:
    """Largest distance in m of the nodes of each of two surfaces, and the middles of its triangles, from the other."""
    there = _distance(surface, simple, lead, near)
    # a node of the simple surface stands among nodes that it leads
    return max(there, _distance(simple, surface, np.arange(len(lead)), near))


def _distance(surface: Surface, other: Surface, node: np.ndarray, near: float) -> float:
    """Largest distance in m of nodes and middles of triangles from another surface: never less than it is.

    It is measured to the triangles around the node of the other surface that stands for the point. Where that is more
    than `near` in m, the search goes on around the nearest triangle, as long as it comes nearer.
    """
    used = np.unique(surface.triangles)
    points = np.concatenate([surface.points[used], surface.points[surface.triangles].mean(axis=1)])
    corners = other.points[other.triangles]
    order, start, count = _members(other.triangles.ravel(), len(other.points))
    least, nearest = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
    rows = np.arange(len(points))
    around = np.concatenate([node[used], node[surface.triangles[:, 0]]])[:, None]
    while len(rows):
        pair, position = _gather(start[around.ravel()], count[around.ravel()])
        row, triangle = rows[pair // around.shape[1]], order[position] // 3
        distance = np.linalg.norm(closest_points(corners[triangle], points[row]) - points[row], axis=1)
        before = least[rows]
        np.minimum.at(least, row, distance)
        best = distance <= least[row]
        nearest[row[best]] = triangle[best]
        rows = rows[(least[rows] > near) & (least[rows] < before)]
        around = other.triangles[nearest[rows]]
    return float(least.max())
