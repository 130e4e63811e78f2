"""Places all over a surface, so far from each other that any first few of them are spread.

Places in a grid seen along one axis thin out on slopes and miss overhangs. These are chosen on the triangles
themselves, each as far as possible from those before it (Gonzalez 1985), of many points that are even by area.
"""

from __future__ import annotations

import numpy as np

from palpate.physics.interactions.surface_patch import Patch

__all__ = ["border_distance", "depth_sequence", "spread_places"]

CANDIDATES = 4096  # points even by area among which places are chosen, at least
EACH = 8  # the same for each place, at least
# A place as far from the border as from another place would count the border as a place. Beyond the last place towards
# the rim nothing is known, so places are let nearer to it, by this factor.
RIM = 4.0
STEP = 0.25  # distance of the points that stand for the border, over the mean distance of the candidates
GOLDEN = 0.6180339887498949  # of the sequence of depths: any first few are spread (Steinhaus 1957)


def spread_places(patch: Patch, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places (count, 3) in m on a surface, and the outward unit normals (count, 3) there.

    The first of them are the same whatever the count.
    """
    from scipy.stats import qmc

    dense = 1 << int(np.ceil(np.log2(max(CANDIDATES, EACH * count))))
    unit = qmc.Sobol(2, scramble=True, rng=np.random.default_rng(seed)).random(dense)
    points, normals = patch.spread_with_normals(unit)
    gap = RIM * border_distance(patch, points)
    # the first where there is most room; on a closed surface anywhere
    chosen = np.empty(count, dtype=np.int64)
    for k in range(count):
        chosen[k] = np.argmax(gap)
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[k]], axis=1))
    return points[chosen], normals[chosen]


def depth_sequence(depth: tuple[float, float], count: int, seed: int) -> np.ndarray:
    """Return depths (count,) in m, one for each place in turn: shares of the range in a golden sequence."""
    start = np.random.default_rng(seed).random()
    low, high = depth
    return np.asarray(low + (high - low) * ((start + GOLDEN * np.arange(count)) % 1.0))


def border_distance(patch: Patch, points: np.ndarray) -> np.ndarray:
    """Return the distance (N,) in m of points (N, 3) from the border of a surface; infinite where it has none."""
    from scipy.spatial import cKDTree

    edges = np.sort(patch.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, times = np.unique(edges, axis=0, return_counts=True)
    ends = patch.points[unique[times == 1]]
    if not len(ends):
        return np.full(len(points), np.inf)
    area = np.linalg.norm(patch.area_vectors, axis=1).sum()
    step = STEP * np.sqrt(area / len(points))
    parts = np.maximum(np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / step), 1).astype(int)
    row = np.repeat(np.arange(len(ends)), parts)
    share = (np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[row]
    border = ends[row, 0] + share[:, None] * (ends[row, 1] - ends[row, 0])
    return np.asarray(cKDTree(border).query(points)[0])
