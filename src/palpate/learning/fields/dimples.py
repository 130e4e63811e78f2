"""The travelling part of a field, by linear least squares over all nodes of all solves at once.

Per solve some hundred nodes of the touched surface lie in reach of the probe, each at another distance ρ: a few
solves decide the whole table of splines in (ρ, s). A small penalty decides what no node has seen.
"""

from __future__ import annotations

import numpy as np

from palpate.surrogates.field.dimple import Dimple, products
from palpate.surrogates.field.rise import Rise
from palpate.surrogates.surface import TouchedSurface

__all__ = ["fitted_dimple", "travelling_values"]

_REACH = 3.0  # times the radius
_CELLS = 17  # to the reach: a sixth of the radius each
_PENALTY = 1e-6  # of the mean diagonal


def touched_nodes(surface: TouchedSurface, points: np.ndarray, radius: float) -> np.ndarray:
    """Which nodes (nodes, 3) lie on the touched surface, bool."""
    return np.abs(surface.at(np.ascontiguousarray(points))[0]) < 0.02 * radius


def fitted_dimple(
    values: np.ndarray,
    C: np.ndarray,
    depth: np.ndarray,
    *,
    rise: Rise,
    surface: TouchedSurface,
    points: np.ndarray,
    mass: np.ndarray,
    radius: float,
) -> Dimple | None:
    """The dimple of fields (N, nodes, components) less their rest, of probes at C (N, 3); None where none is in reach.

    Fields of one component are scalars, those of three vectors; others have no dimple.
    """
    components = values.shape[2]
    touched = touched_nodes(surface, points, radius)
    if components not in (1, 3) or not touched.any():
        return None
    levels = int(np.clip(len(np.unique(np.round(depth / rise.deepest, 6))), 1, 5))
    shape, parts = (_CELLS + 3, max(4, levels)), 1 if components == 1 else 2
    size = (shape[0] - 3) * shape[1]
    G, b, reach = np.zeros((parts * size, parts * size)), np.zeros(parts * size), _REACH * radius
    for i in range(len(values)):
        A, rows = _rows(C[i], depth[i], shape, rise, surface, points, touched, reach, components)
        w = np.repeat(mass[rows], components)
        G += A.T @ (A * w[:, None])
        b += A.T @ (w * values[i, rows].ravel())
    mean = float(np.trace(G)) / len(G)
    if not mean > 0:
        return None
    G[np.diag_indices_from(G)] += _PENALTY * mean
    table = np.zeros((parts, *shape))
    table[:, :-3] = np.linalg.solve(G, b).reshape(parts, shape[0] - 3, shape[1])
    return Dimple(table, reach, touched)


def travelling_values(
    dimple: Dimple, C: np.ndarray, depth: np.ndarray, rise: Rise, surface: TouchedSurface, points: np.ndarray
) -> np.ndarray:
    """What the dimple gives (N, nodes, components), f included."""
    parts, r, q = dimple.table.shape
    components = 1 if parts == 1 else 3
    known = dimple.table[:, :-3].ravel()
    out = np.zeros((len(C), len(points), components))
    for i in range(len(C)):
        A, rows = _rows(
            C[i], depth[i], (r, q), rise, surface, points, dimple.touched, dimple.reach, components
        )
        out[i, rows] = (A @ known).reshape(len(rows), components)
    return out


def _rows(
    c: np.ndarray,
    depth: float,
    shape: tuple[int, int],
    rise: Rise,
    surface: TouchedSurface,
    points: np.ndarray,
    touched: np.ndarray,
    reach: float,
    components: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (rows · components, parts · (r − 3) · q), f included, of the nodes (rows,) in reach of one probe."""
    d, gradient, _ = surface.at(c[None])
    offset = points - (c - d[0] * gradient[0])
    distance = np.sqrt((offset**2).sum(axis=1))
    rows = np.flatnonzero(touched & (distance < reach)) if depth > 0 else np.zeros(0, int)
    offset, n = offset[rows], gradient[0]
    depths = np.full(len(rows), min(depth / rise.deepest, 1.0))
    P = float(rise.at(np.array(depth))) * products(distance[rows] / reach, depths, shape)
    P = P.reshape(len(rows), (shape[0] - 3) * shape[1])
    if components == 1:
        return P, rows
    across = (offset - (offset @ n)[:, None] * n) / reach
    A = np.stack([P[:, None] * n[:, None], P[:, None] * across[:, :, None]], axis=2)
    return A.reshape(len(rows) * 3, 2 * P.shape[1]), rows
