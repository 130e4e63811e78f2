"""The travelling part of a field, by linear least squares over all nodes of all solves at once.

Per solve some hundred nodes of the touched surface lie in reach of the probe, each at another distance ρ: a few
solves decide the whole table of splines in (ρ, s). Where no node has been, a small penalty on second differences
decides (Eilers & Marx 1996), and on the slope at the foot: what is smooth in the body is even in ρ.
"""

from __future__ import annotations

import numpy as np

from palpate.surrogates.field.dimple import Dimple, products
from palpate.surrogates.field.rise import Rise
from palpate.surrogates.surface import TouchedSurface

__all__ = ["fitted_dimple", "touched_nodes", "travelling_values"]

_REACH = 3.0  # times the radius
_CELLS = 11  # to the reach: a quarter of the radius each
_PENALTY = 1e-5  # of the mean diagonal
# of the radius: the smooth distance rounds a border by 2 to 4 % of it
_ON, _ON_BORDER = 0.01, 0.06
_EVEN = 1e3  # an even profile is known, not guessed
_LEAST = 1e-6  # keeps the system regular


def touched_nodes(
    surface: TouchedSurface, points: np.ndarray, radius: float, *, border: bool = True
) -> np.ndarray:
    """Which nodes (nodes, 3) lie on the touched surface, bool; with or without those on its border."""
    near = (_ON_BORDER if border else _ON) * radius
    return np.asarray(np.abs(surface.at(np.ascontiguousarray(points))[0]) < near)


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
    border: bool = True,
) -> Dimple | None:
    """The dimple of fields (N, nodes, components) less their rest, of probes at C (N, 3); None where none is in reach.

    Fields of one component are scalars, those of three vectors; others have no dimple. Nodes on the border of the
    touched surface, which also belong to another one, may move otherwise: they can be left to the modes.
    """
    components = values.shape[2]
    touched = touched_nodes(surface, points, radius, border=border)
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
    G += _PENALTY * mean * np.kron(np.eye(parts), _roughness(*shape))
    table = np.zeros((parts, *shape))
    table[:, :-3] = np.linalg.solve(G, b).reshape(parts, shape[0] - 3, shape[1])
    return Dimple(table, reach, touched)


def _roughness(r: int, q: int) -> np.ndarray:
    """Squares of second differences in ρ and s, and of the slope at ρ = 0, of the (r − 3) · q free coefficients."""
    in_rho = np.diff(np.eye(r), n=2, axis=0)[:, : r - 3]
    in_s = np.diff(np.eye(q), n=2, axis=0)
    slope = np.zeros(r - 3)
    slope[[0, 2]] = -1.0, 1.0
    along = in_rho.T @ in_rho + _EVEN * np.outer(slope, slope)
    return np.asarray(
        np.kron(along, np.eye(q)) + np.kron(np.eye(r - 3), in_s.T @ in_s) + _LEAST * np.eye((r - 3) * q)
    )


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
