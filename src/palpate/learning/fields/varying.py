"""How a dimple varies from place to place, by regularised least squares over all nodes of all solves.

For one solve the regressors are a product: what depends on the node (splines in ρ times offsets) by what depends on
the touch (splines in s times polynomials of the place). So the normal equations are a sum of Kronecker products, and
conjugate gradients (Hestenes & Stiefel 1952) never form them. A priori a coefficient of total degree n is smaller by
b^{−n/2} than a constant, and profiles are smooth in ρ; b is what misses least of columns left out.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from palpate.learning.fields.search import parts_of
from palpate.learning.fields.solves import Solves
from palpate.surrogates.field.dimple import Dimple, design
from palpate.surrogates.field.rise import Rise
from palpate.surrogates.field.variation import OFFSETS, Variation, polynomials

__all__ = ["VaryingDimples", "by_conjugate_gradients", "degrees", "directions", "fitted_variation"]

_IN_DEPTH = 4  # one cubic
_MOST = 84  # polynomials
_DEGREE = 10
_BASES = (4.0, 8.0)
_RIDGE = 1e-4  # of the mean diagonal
_ROUGH, _LEAST = 0.1, 0.01  # of second differences in ρ, of the coefficients themselves
_UPRIGHT = 0.2  # cosine: a surface whose normals stay this near to their mean is a graph over a plane
_ITERATIONS, _TOLERANCE = 400, 1e-4  # of conjugate gradients: relative residual
_PARTS = 2  # of six of the solves, each left out once
_GAIN = 0.8  # of the squares in reach that are missed of columns left out: more is not worth the numbers


@dataclass(frozen=True, eq=False)
class VaryingDimples:
    """Regressors of N solves, parted into nodes' and touches'.

    Attributes
    ----------
    nodes : list of N (n_i,) int arrays
        In reach of each probe, of its own snapshots.
    near : list of N (n_i, 4 r) arrays
        Products of splines in ρ and offsets at these.
    touches : (N, q, m)
        f times products of splines in s and polynomials.
    shape : (r, components)
    """

    nodes: list[np.ndarray]
    near: list[np.ndarray]
    touches: np.ndarray
    shape: tuple[int, int]

    def images(self, table: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """What a variation's table is (rows, 4 r, components) at the touch of each solve, f included."""
        flat = table.reshape(self.touches[0].size, -1, self.shape[1])
        return np.asarray(np.tensordot(self.touches[rows].reshape(len(rows), -1), flat, 1))


def fitted_variation(
    solves: Solves, remainder: list[np.ndarray], dimple: Dimple, rise: Rise
) -> Variation | None:
    """How the dimple of fields varies, not yet faded.

    None where it is of no use: with one group alone, or where it gains little of columns left out.

    Parameters
    ----------
    solves : Solves
    remainder : list of (N, P, components) arrays
        Fields of the snapshots, less what the dimple gives.
    dimple : Dimple
    rise : Rise
    """
    parts = parts_of(solves.groups)
    if len(parts) < 2:
        return None
    feet, normals = solves.feet
    axes = directions(normals)
    told = np.hstack([feet @ axes.T, solves.X[:, 3:]])
    low, high = told.min(axis=0), told.max(axis=0)
    scales = np.array([(low + high) / 2, np.maximum((high - low) / 2, 1e-9)])
    powers = degrees(told.shape[1])
    empty = np.zeros((_IN_DEPTH, len(powers), dimple.table.shape[1], OFFSETS, solves.components))
    regressors = _regressors(Variation(empty, powers, axes, scales), dimple, rise, solves)
    fit = _Fit(regressors, solves, remainder, powers.sum(axis=1))
    base, missed = _best_base(fit, parts)
    if missed > _GAIN:
        return None
    return Variation(fit.table(base, np.arange(len(told))), powers, axes, scales)


def directions(normals: np.ndarray) -> np.ndarray:
    """Two directions across the mean normal where the surface is a graph over their plane, all three elsewhere."""
    mean = normals.mean(axis=0)
    size = float(np.linalg.norm(mean))
    if size == 0 or (normals @ mean).min() < _UPRIGHT * size:
        return np.eye(3)
    mean /= size
    first = np.cross(mean, np.eye(3)[np.argmin(np.abs(mean))])
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(mean, first)])


def degrees(v: int) -> np.ndarray:
    """Degrees (m, v) up to the largest total degree, ten at most, that has no more than `_MOST` of them."""
    degree = max(d for d in range(_DEGREE + 1) if d == 0 or math.comb(d + v, v) <= _MOST)
    every = [p for p in itertools.product(range(degree + 1), repeat=v) if sum(p) <= degree]
    return np.array(sorted(every, key=lambda p: (sum(p), p)))


def _regressors(blank: Variation, dimple: Dimple, rise: Rise, solves: Solves) -> VaryingDimples:
    r, components = blank.table.shape[2], blank.table.shape[4]
    touched = [np.flatnonzero(dimple.touches(solves.surface, one.points)) for one in solves.snapshots]
    feet, nodes, near = solves.feet[0], [], []
    for (k, _), foot in zip(solves.rows(), feet, strict=True):
        offset = (solves.snapshots[k].points[touched[k]] - foot) / dimple.reach
        distance = np.linalg.norm(offset, axis=1)
        some = np.flatnonzero(distance < 1.0)
        B = design(distance[some] * (r - 3), r)
        around = np.column_stack([np.ones(len(some)), offset[some]])
        nodes.append(touched[k][some])
        near.append((B[:, :, None] * around[:, None, :]).reshape(len(some), -1))
    in_depth = design(np.minimum(solves.depth / rise.deepest, 1.0) * (_IN_DEPTH - 3), _IN_DEPTH)
    in_place = polynomials(blank.variables(feet, solves.X[:, 3:]), blank.powers)
    touches = rise.at(solves.depth)[:, None, None] * in_depth[:, :, None] * in_place[:, None, :]
    return VaryingDimples(nodes, near, touches, (r, components))


class _Fit:
    """Normal equations of all solves, each as a product."""

    def __init__(
        self, regressors: VaryingDimples, solves: Solves, fields: list[np.ndarray], total: np.ndarray
    ) -> None:
        self._regressors, self._total = regressors, total
        rows = list(zip(solves.rows(), regressors.nodes, strict=True))
        self._values = [fields[k][i, nodes] for (k, i), nodes in rows]
        self._mass = [solves.snapshots[k].mass[nodes] for (k, _), nodes in rows]
        r = regressors.shape[0]
        rough = np.diff(np.eye(r), n=2, axis=0)
        smooth = np.linalg.cholesky(np.linalg.inv(_ROUGH * rough.T @ rough + _LEAST * np.eye(r)))
        self._prior = np.kron(smooth, np.eye(OFFSETS))
        weighted = [A * mass[:, None] for A, mass in zip(regressors.near, self._mass, strict=True)]
        G = [A.T @ W for A, W in zip(regressors.near, weighted, strict=True)]
        self._grams = self._prior.T @ np.array(G) @ self._prior
        sides = [W.T @ u for W, u in zip(weighted, self._values, strict=True)]
        self._sides = self._prior.T @ np.array(sides)

    def missed(self, rows: np.ndarray, table: np.ndarray | None = None) -> float:
        """Sum over nodes in reach of squares that a table, or none, leaves of solves (rows,)."""
        total = 0.0
        images = None if table is None else self._regressors.images(table, rows)
        for i, row in enumerate(rows):
            left = self._values[row]
            left = left if images is None else left - self._regressors.near[row] @ images[i]
            total += float((left**2).sum(axis=1) @ self._mass[row])
        return total

    def missed_left_out(self, base: float, out: np.ndarray) -> float:
        """The same of solves where `out` (N,), by what the others say."""
        return self.missed(np.flatnonzero(out), self.table(base, np.flatnonzero(~out)))

    def table(self, base: float, rows: np.ndarray) -> np.ndarray:
        """Coefficients (q, m, r, 4, components) from solves (rows,)."""
        size = base ** (-self._total / 2.0)
        touches = (self._regressors.touches[rows] * size).reshape(len(rows), -1)
        found = by_conjugate_gradients(self._grams[rows], touches, self._sides[rows])
        (r, components), (q, m) = self._regressors.shape, self._regressors.touches.shape[1:]
        free = np.einsum("kl,flc->fkc", self._prior, found).reshape(q, m, r, OFFSETS, components)
        return np.asarray(free * size[None, :, None, None, None])


def _best_base(fit: _Fit, parts: list[np.ndarray]) -> tuple[float, float]:
    """b, and the share of the squares that is missed of solves left out."""
    parts = parts[:_PARTS]
    squares = {b: sum(fit.missed_left_out(b, out) for out in parts) for b in _BASES}
    base = min(_BASES, key=lambda b: squares[b])
    whole = sum(fit.missed(np.flatnonzero(out)) for out in parts)
    return base, squares[base] / max(whole, 1e-300)


def by_conjugate_gradients(grams: np.ndarray, touches: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """W (k, R, c) with Σ_i t_i ⊗ (G_i (t_i · W)) + μ W = Σ_i t_i ⊗ s_i, for all c components.

    Parameters
    ----------
    grams : (N, R, R)
        G, symmetric and non-negative.
    touches : (N, k)
        t.
    sides : (N, R, c)
        s.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    (N, k), (R, c) = touches.shape, sides.shape[1:]
    diagonal = (touches**2).T @ np.einsum("ill->il", grams)
    mu = max(_RIDGE * float(diagonal.mean()), 1e-300)

    def times(w: np.ndarray) -> np.ndarray:
        # all components at once, since reading the matrices is what takes the time
        W = w.reshape(k, R * c)
        images = grams @ (touches @ W).reshape(N, R, c)
        return np.asarray(touches.T @ images.reshape(N, R * c) + mu * W).ravel()

    scales = np.repeat(diagonal + mu, c)
    size = (scales.size, scales.size)
    whole = LinearOperator(size, matvec=times, dtype=np.float64)
    scaled = LinearOperator(size, matvec=lambda w: w / scales, dtype=np.float64)
    # a fit that has not wholly settled is a little smoother: no fault, and what is left out judges it
    w, _ = cg(
        whole,
        (touches.T @ sides.reshape(N, R * c)).ravel(),
        rtol=_TOLERANCE,
        maxiter=_ITERATIONS,
        M=scaled,
    )
    return np.asarray(w).reshape(k, R, c)
