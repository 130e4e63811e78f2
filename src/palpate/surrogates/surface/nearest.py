"""The nearest of many triangles, by a tree of boxes around them."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["boxes_of", "nearest_into", "ordered"]

LEAF = 2  # triangles in each smallest box
DEEP = 64  # boxes that can wait at a time: two for each level of the tree

_jit = njit(cache=True, nogil=True, error_model="numpy")


def ordered(corners: np.ndarray) -> np.ndarray:
    """Numbers (T,) of triangles (T, 3, 3) along a curve through space on which neighbours are near (Morton 1966)."""
    centres = corners.mean(axis=1)
    size = max(float(np.ptp(centres, axis=0).max()), np.finfo(float).tiny)
    cell = np.minimum((centres - centres.min(axis=0)) / size * 1024, 1023).astype(np.int64)
    code = np.zeros(len(cell), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def boxes_of(corners: np.ndarray) -> np.ndarray:
    """Lower and upper corners (2 n, 6) of a tree of boxes: box i holds 2 i and 2 i + 1, the root is 1.

    The last n boxes hold `LEAF` triangles each, in their order; boxes without a triangle are infinitely far.
    """
    count = -(-len(corners) // LEAF)
    leaves = 1 << max(count - 1, 0).bit_length()
    padded = np.full((leaves * LEAF, 6), np.inf)
    padded[: len(corners), :3] = corners.min(axis=1)
    padded[: len(corners), 3:] = -corners.max(axis=1)  # so that a minimum makes both halves
    boxes = np.full((2 * leaves, 6), np.inf)
    boxes[leaves:] = padded.reshape(leaves, LEAF, 6).min(axis=1)
    while leaves > 1:
        boxes[leaves // 2 : leaves] = boxes[leaves : 2 * leaves].reshape(-1, 2, 6).min(axis=1)
        leaves //= 2
    boxes[:, 3:] *= -1
    return boxes


@_jit
def _apart(boxes: np.ndarray, i: int, x: float, y: float, z: float) -> float:
    """Square of the distance of a point to box i."""
    u = max(boxes[i, 0] - x, x - boxes[i, 3], 0.0)
    v = max(boxes[i, 1] - y, y - boxes[i, 4], 0.0)
    w = max(boxes[i, 2] - z, z - boxes[i, 5], 0.0)
    return float(u * u + v * v + w * w)


@_jit
def _edge(dx: float, dy: float, dz: float, ux: float, uy: float, uz: float) -> tuple[float, float]:
    """Share of the edge u, from 0 to 1, that is nearest to a point at d from its start; square of the distance."""
    t = min(max((dx * ux + dy * uy + dz * uz) / (ux * ux + uy * uy + uz * uz), 0.0), 1.0)
    dx, dy, dz = dx - t * ux, dy - t * uy, dz - t * uz
    return t, dx * dx + dy * dy + dz * dz


@_jit
def _foot_into(
    corners: np.ndarray, i: int, x: float, y: float, z: float, foot: np.ndarray
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
        foot[0], foot[1], foot[2] = 1.0 - second - third, second, third
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
    foot[0] = foot[1] = foot[2] = 0.0
    foot[k], foot[after] = 1.0 - t, t
    if t == 0.0:
        return best, 4 + k
    return best, 4 + after if t == 1.0 else 1 + k


@_jit
def nearest_into(
    x: float,
    y: float,
    z: float,
    guess: int,
    boxes: np.ndarray,
    corners: np.ndarray,
    waiting: np.ndarray,
    foot: np.ndarray,
    trial: np.ndarray,
) -> tuple[float, int, int]:
    """Nearest triangle to a point: square of the distance, its number, and where on it (as `_foot_into`).

    Parameters
    ----------
    guess : int
        A triangle that may be near.
    waiting : (DEEP,) int array
        Scratch.
    foot, trial : (3,) arrays
        The nearest point's weights; scratch.
    """
    leaves = boxes.shape[0] // 2
    best, place = _foot_into(corners, guess, x, y, z, foot)
    which, top = guess, 1
    waiting[0] = 1
    while top > 0:
        top -= 1
        box = waiting[top]
        if _apart(boxes, box, x, y, z) >= best:
            continue
        if box < leaves:
            left, right = _apart(boxes, 2 * box, x, y, z), _apart(boxes, 2 * box + 1, x, y, z)
            near = 0 if left <= right else 1  # looked at first, so stacked last
            if max(left, right) < best:
                waiting[top] = 2 * box + 1 - near
                top += 1
            if min(left, right) < best:
                waiting[top] = 2 * box + near
                top += 1
            continue
        first = (box - leaves) * LEAF
        for t in range(first, min(first + LEAF, corners.shape[0])):
            d, where = _foot_into(corners, t, x, y, z, trial)
            if d < best:
                best, which, place = d, t, where
                foot[0], foot[1], foot[2] = trial[0], trial[1], trial[2]
    return best, which, place
