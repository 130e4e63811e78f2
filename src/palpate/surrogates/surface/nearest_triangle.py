"""The nearest of many small triangles, by a tree of thin discs around them."""

from __future__ import annotations

import numpy as np

from palpate.kernels import part

__all__ = ["DEEP", "disc_tree", "nearest_into"]

LEAF = 2  # triangles in each smallest disc, at most
ROUNDING = 1e-9  # share by which discs are larger than they need be
DEEP = 64  # discs that can wait at a time: two for each level of the tree


def disc_tree(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the order (T,) in which a tree keeps triangles (T, 3, 3), and its discs (2 n, 8).

    Disc i holds discs 2 i and 2 i + 1, the root is 1; the last n discs hold the triangles between
    a share of all and the next share. A disc has a centre (3), a unit normal (3), half a thickness along
    it and a radius across it: on a smooth surface discs are thin, so that few are as near to a point as the nearest
    triangle.
    """
    leaves = 1 << max(-(-len(corners) // LEAF) - 1, 0).bit_length()
    order = _halved(corners.mean(axis=1), leaves)
    points = corners[order]
    areas = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    discs = np.zeros((2 * leaves, 8))
    nodes = leaves
    while nodes:
        discs[nodes : 2 * nodes] = _discs(points, areas, _starts(nodes, len(points)))
        nodes //= 2
    discs[:, 6:] += ROUNDING * (discs[:, 6:] + np.ptp(points.reshape(-1, 3), axis=0).max())
    return order, discs


def _starts(nodes: int, count: int) -> np.ndarray:
    """Return the first triangle (nodes,) of each node of one level, of `count` triangles."""
    return np.arange(nodes) * count // nodes


def _halved(places: np.ndarray, leaves: int) -> np.ndarray:
    """Return an order (T,) of places (T, 3): each node of a level is halved across its longest side."""
    order, nodes = np.arange(len(places)), 1
    while nodes < leaves:
        starts = _starts(nodes, len(places))
        sides = np.maximum.reduceat(places[order], starts) - np.minimum.reduceat(places[order], starts)
        node = np.repeat(np.arange(nodes), np.diff(np.append(starts, len(places))))
        along = places[order, np.argmax(sides, axis=1)[node]]
        order = order[np.lexsort((along, node))]
        nodes *= 2
    return order


def _discs(points: np.ndarray, areas: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Return the discs (n, 8) around runs of triangles (T, 3, 3) with areas (T, 3), which begin at starts (n,)."""
    node = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(points))))
    low = np.minimum.reduceat(points.min(axis=1), starts)
    centres = (low + np.maximum.reduceat(points.max(axis=1), starts)) / 2
    normals = np.add.reduceat(areas, starts)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(lengths > 0, lengths, 1.0)
    offsets = points - centres[node, None]
    heights = np.einsum("tki,ti->tk", offsets, normals[node])
    across = np.linalg.norm(offsets - heights[..., None] * normals[node, None], axis=2)
    sizes = [np.maximum.reduceat(np.abs(size).max(axis=1), starts) for size in (heights, across)]
    return np.column_stack([centres, normals, *sizes])


@part
def _apart(discs: np.ndarray, i: int, x: float, y: float, z: float, best: float) -> float:
    """Return the square of the distance of a point to disc i, or some square that is not below `best`."""
    x, y, z = x - discs[i, 0], y - discs[i, 1], z - discs[i, 2]
    along = x * discs[i, 3] + y * discs[i, 4] + z * discs[i, 5]
    height = max(abs(along) - discs[i, 6], 0.0)
    square = height * height
    if square >= best:
        return float(square)
    across = max(np.sqrt(max(x * x + y * y + z * z - along * along, 0.0)) - discs[i, 7], 0.0)
    return float(square + across * across)


@part
def _edge(dx: float, dy: float, dz: float, ux: float, uy: float, uz: float) -> tuple[float, float]:
    """Share of the edge u, from 0 to 1, that is nearest to a point at d from its start; square of the distance."""
    t = min(max((dx * ux + dy * uy + dz * uz) / (ux * ux + uy * uy + uz * uz), 0.0), 1.0)
    dx, dy, dz = dx - t * ux, dy - t * uy, dz - t * uz
    return t, dx * dx + dy * dy + dz * dz


@part
def _nearest_point_into(
    corners: np.ndarray, i: int, x: float, y: float, z: float, weights: np.ndarray
) -> tuple[float, int]:
    """Fill the weights (3,) of the nearest point of triangle i; square of the distance, and where on it.

    Where: 0 inside, 1 to 3 on the edge from corner 0 to 2, 4 to 6 on that corner.
    """
    ax, ay, az = corners[i, 0, 0], corners[i, 0, 1], corners[i, 0, 2]
    bx, by, bz = corners[i, 1, 0], corners[i, 1, 1], corners[i, 1, 2]
    cx, cy, cz = corners[i, 2, 0], corners[i, 2, 1], corners[i, 2, 2]
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    px, py, pz = x - ax, y - ay, z - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    second = ((py * vz - pz * vy) * nx + (pz * vx - px * vz) * ny + (px * vy - py * vx) * nz) / square
    third = ((uy * pz - uz * py) * nx + (uz * px - ux * pz) * ny + (ux * py - uy * px) * nz) / square
    if second > 0 and third > 0 and second + third < 1:
        height = px * nx + py * ny + pz * nz
        weights[0], weights[1], weights[2] = 1.0 - second - third, second, third
        return height * height / square, 0
    k = 0
    t, best = _edge(px, py, pz, ux, uy, uz)
    s, d = _edge(x - bx, y - by, z - bz, cx - bx, cy - by, cz - bz)
    if d < best:
        k, t, best = 1, s, d
    s, d = _edge(x - cx, y - cy, z - cz, -vx, -vy, -vz)
    if d < best:
        k, t, best = 2, s, d
    after = k + 1 if k < 2 else 0
    weights[0] = weights[1] = weights[2] = 0.0
    weights[k], weights[after] = 1.0 - t, t
    if t == 0.0:
        return best, 4 + k
    return best, 4 + after if t == 1.0 else 1 + k


@part
def nearest_into(
    x: float,
    y: float,
    z: float,
    guess: int,
    discs: np.ndarray,
    corners: np.ndarray,
    waiting: np.ndarray,
    weights: np.ndarray,
    trial: np.ndarray,
) -> tuple[float, int, int]:
    """Return the nearest triangle to a point: square of the distance, its number, and the place on it.

    The place is that of `_nearest_point_into`, and `weights` (3,) receives those of the nearest point. `guess` is a
    triangle that may be near; `waiting` (DEEP,) int and `trial` (3,) are scratch.
    """
    leaves = discs.shape[0] // 2
    best, place = _nearest_point_into(corners, guess, x, y, z, weights)
    which, top = guess, 1
    waiting[0] = 1
    while top > 0:
        top -= 1
        disc = waiting[top]
        if _apart(discs, disc, x, y, z, best) >= best:
            continue
        if disc < leaves:
            left, right = _apart(discs, 2 * disc, x, y, z, best), _apart(discs, 2 * disc + 1, x, y, z, best)
            near = 0 if left <= right else 1  # looked at first, so stacked last
            if max(left, right) < best:
                waiting[top] = 2 * disc + 1 - near
                top += 1
            if min(left, right) < best:
                waiting[top] = 2 * disc + near
                top += 1
            continue
        own = disc - leaves
        for t in range(own * corners.shape[0] // leaves, (own + 1) * corners.shape[0] // leaves):
            d, where = _nearest_point_into(corners, t, x, y, z, trial)
            if d < best:
                best, which, place = d, t, where
                weights[0], weights[1], weights[2] = trial[0], trial[1], trial[2]
    return best, which, place
