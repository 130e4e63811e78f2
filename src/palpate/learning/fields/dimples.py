"""The travelling part of a field, by linear least squares over all nodes of all solves at once.

Per solve some hundred nodes of the touched surface lie in reach of the probe, each at another distance ρ: a few
solves decide the whole table of splines in (ρ, s). Where no node has been, a small penalty on second differences
decides (Eilers & Marx 1996), and on the slope at the foot: what is smooth in the body is even in ρ.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from palpate.learning.fields.solves import Solves
from palpate.surrogates.field.dimple import Dimple, design, products
from palpate.surrogates.field.rise import Rise

__all__ = ["borders", "faded", "fitted_dimple"]

_REACH = 5.0  # times the radius
_FULL = 0.3  # of the reach: from there on it fades
_CELLS = 14  # to the reach, a third of the radius each: smaller ones show the mesh
_PENALTY = 1e-5  # of the mean diagonal
# of the radius, with and without nodes on the border: the smooth distance rounds that by 2 to 4 % of the radius
WITHIN = (0.06, 0.01)
_EVEN = 1e3  # an even profile is known, not guessed
_LEAST = 1e-6  # keeps the system regular


def borders(solves: Solves) -> tuple[float, ...]:
    """Which of `WITHIN` make a difference."""
    distances = [np.abs(solves.surface.at(np.ascontiguousarray(one.points))[0]) for one in solves.snapshots]
    wide, narrow = ([d < within * solves.radius for d in distances] for within in WITHIN)
    same = all((a == b).all() for a, b in zip(wide, narrow, strict=True))
    return WITHIN[:1] if same else WITHIN


def faded(dimple: Dimple) -> Dimple:
    """The same, and its variation, times a window that is one in the middle and ends at the reach.

    Fitted so that it ends by itself, it would fall within the last cells from what the field is there to nothing: a
    ring that travels with the probe, which modes can't make up for.
    """
    fade, own = _fading(dimple.table.shape[1]), dimple.variation
    if own is not None:
        own = replace(own, table=np.einsum("ij,qmjhc->qmihc", fade, own.table))
    return replace(dimple, table=fade @ dimple.table, variation=own)


def _fading(r: int) -> np.ndarray:
    """Coefficients (r, r) of the window times each spline, by least squares, the last three zero."""
    t = (np.arange(40 * (r - 3)) + 0.5) / (40 * (r - 3))
    u = np.clip((t - _FULL) / (1.0 - _FULL), 0.0, 1.0)
    window = 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    B, fade = design(t * (r - 3), r), np.zeros((r, r))
    fade[: r - 3] = np.linalg.lstsq(B[:, : r - 3], window[:, None] * B, rcond=None)[0]
    return fade


def fitted_dimple(solves: Solves, rise: Rise, within: float = WITHIN[0]) -> Dimple | None:
    """The dimple of fields where they were solved, not yet faded; None where no node is in reach.

    Fields of one component are scalars, those of three vectors; others have no dimple. Nodes on the border of the
    touched surface, which also belong to another one, may move otherwise: by `within`, a share of the radius, they
    can be left to the modes.
    """
    if solves.components not in (1, 3):
        return None
    levels = int(np.clip(len(np.unique(np.round(solves.depth / rise.deepest, 6))), 1, 5))
    parts, r, q = 1 if solves.components == 1 else 2, _CELLS + 3, max(4, levels)
    blank = Dimple(np.zeros((parts, r, q)), _REACH * solves.radius, within * solves.radius)
    G, b = np.zeros((parts * r * q,) * 2), np.zeros(parts * r * q)
    for k, i, rows, A in _regressors(blank, solves, rise):
        w = np.repeat(solves.snapshots[k].mass[rows], solves.components)
        G += A.T @ (A * w[:, None])
        b += A.T @ (w * solves.snapshots[k].values[i, rows].ravel())
    mean = float(np.trace(G)) / len(G)
    if not mean > 0:
        return None
    G += _PENALTY * mean * np.kron(np.eye(parts), _roughness(r, q))
    return replace(blank, table=np.linalg.solve(G, b).reshape(parts, r, q))


def _roughness(r: int, q: int) -> np.ndarray:
    """Squares of second differences in ρ and s, and of the slope at ρ = 0, of the r · q coefficients."""
    in_rho = np.diff(np.eye(r), n=2, axis=0)
    in_s = np.diff(np.eye(q), n=2, axis=0)
    slope = np.zeros(r)
    slope[[0, 2]] = -1.0, 1.0
    along = in_rho.T @ in_rho + _EVEN * np.outer(slope, slope)
    return np.asarray(np.kron(along, np.eye(q)) + np.kron(np.eye(r), in_s.T @ in_s) + _LEAST * np.eye(r * q))


def _regressors(
    dimple: Dimple, solves: Solves, rise: Rise
) -> Iterator[tuple[int, int, np.ndarray, np.ndarray]]:
    """Of every solve: snapshots and row, nodes in reach (rows,), regressors (rows · components, table.size)."""
    feet, normals = solves.feet
    touched = [dimple.touches(solves.surface, one.points) for one in solves.snapshots]
    for (k, i), foot, n, s in zip(solves.rows(), feet, normals, solves.depth, strict=True):
        offset = (solves.snapshots[k].points - foot) / dimple.reach
        distance = np.sqrt((offset**2).sum(axis=1))
        rows = np.flatnonzero(touched[k] & (distance < 1.0))
        shares = np.full(len(rows), min(s / rise.deepest, 1.0))
        P = float(rise.at(np.array(s))) * products(distance[rows], shares, dimple.table.shape[1:])
        P = P.reshape(len(rows), -1)
        if solves.components == 1:
            yield k, i, rows, P
            continue
        across = offset[rows] - (offset[rows] @ n)[:, None] * n
        A = np.stack([P[:, None] * n[:, None], P[:, None] * across[:, :, None]], axis=2)
        yield k, i, rows, A.reshape(len(rows) * 3, 2 * P.shape[1])
