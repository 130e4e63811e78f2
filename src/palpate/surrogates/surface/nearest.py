"""The nearest of many triangles, by a tree of boxes around them."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["LEAF", "boxes_of", "nearest_into", "ordered"]

LEAF = 4  # triangles in each smallest box
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
def _apart(box: np.ndarray, x: float, y: float, z: float) -> float:
    """Square of the distance of a point to a box."""
    u = max(max(box[0] - x, x - box[3]), 0.0)
    v = max(max(box[1] - y, y - box[4]), 0.0)
    w = max(max(box[2] - z, z - box[5]), 0.0)
    return u * u + v * v + w * w


@_jit
def _share(p: np.ndarray, q: np.ndarray, x: float, y: float, z: float) -> float:
    """Where between p and q, from 0 to 1, the point of their line is that is nearest to a point."""
    u, v, w = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    along = (x - p[0]) * u + (y - p[1]) * v + (z - p[2]) * w
    return min(max(along / (u * u + v * v + w * w), 0.0), 1.0)


@_jit
def _foot_into(tri: np.ndarray, x: float, y: float, z: float, foot: np.ndarray) -> tuple[float, int]:
    """Fill the weights (3,) of the nearest point of a triangle; square of the distance, and where on it.

    Where: 0 inside, 1 to 3 on the edge from corner 0 to 2, 4 to 6 on that corner.
    """
    a, b, c = tri[0], tri[1], tri[2]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = x - a[0], y - a[1], z - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    second = ((py * vz - pz * vy) * nx + (pz * vx - px * vz) * ny + (px * vy - py * vx) * nz) / square
    third = ((uy * pz - uz * py) * nx + (uz * px - ux * pz) * ny + (ux * py - uy * px) * nz) / square
    if second > 0 and third > 0 and second + third < 1:
        height = px * nx + py * ny + pz * nz
        foot[0], foot[1], foot[2] = 1.0 - second - third, second, third
        return height * height / square, 0
    best, where = np.inf, 0
    for k in range(3):
        p, q = tri[k], tri[(k + 1) % 3]
        t = _share(p, q, x, y, z)
        dx = x - p[0] - t * (q[0] - p[0])
        dy = y - p[1] - t * (q[1] - p[1])
        dz = z - p[2] - t * (q[2] - p[2])
        d = dx * dx + dy * dy + dz * dz
        if d < best:
            best = d
            foot[k], foot[(k + 1) % 3], foot[(k + 2) % 3] = 1.0 - t, t, 0.0
            where = 1 + k
            if t == 0.0:
                where = 4 + k
            elif t == 1.0:
                where = 4 + (k + 1) % 3
    return best, where


@_jit
def nearest_into(
    x: float,
    y: float,
    z: float,
    bound: float,
    boxes: np.ndarray,
    corners: np.ndarray,
    waiting: np.ndarray,
    foot: np.ndarray,
    trial: np.ndarray,
) -> tuple[float, int, int]:
    """Nearest triangle to a point: square of the distance, its number, and where on it (as `_foot_into`).

    Parameters
    ----------
    bound : float
        Square of a distance within which a triangle is known to be; infinity if none is.
    waiting : (DEEP,) int array
        Scratch.
    foot, trial : (3,) arrays
        The nearest point's weights; scratch.
    """
    leaves = boxes.shape[0] // 2
    best, which, place, top = bound, -1, 0, 1
    waiting[0] = 1
    while top > 0:
        top -= 1
        box = waiting[top]
        if _apart(boxes[box], x, y, z) >= best:
            continue
        if box < leaves:
            left, right = _apart(boxes[2 * box], x, y, z), _apart(boxes[2 * box + 1], x, y, z)
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
            d, where = _foot_into(corners[t], x, y, z, trial)
            if d < best:
                best, which, place = d, t, where
                foot[0], foot[1], foot[2] = trial[0], trial[1], trial[2]
    return best, which, place
