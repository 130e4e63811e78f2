"""The part of a field that moves with the probe, by linear least squares over all nodes of all solves at once.

**The local mode.** Per solve some hundred nodes of the touched surface lie in reach of the probe, each at another
distance ρ: a few solves decide the whole table of splines in (ρ, s). Where no node has been, a small penalty on second
differences decides (Eilers & Marx 1996), and on the slope at the contact point: what is smooth in the body is even
in ρ.

**Its variation from place to place.** For one solve the regressors are a product: what depends on the node (splines in
ρ times offsets) by what depends on the touch (splines in s times polynomials of the place). So the normal equations
are a sum of Kronecker products, and conjugate gradients (Hestenes & Stiefel 1952) never form them. A priori a
coefficient of total degree n is smaller by b^{−n/2} than a constant, and profiles are smooth in ρ; b is what misses
least of depth series left out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.fields.field_search import FOLDS
from palpate.learning.fields.snapshots import Solves
from palpate.learning.folds import fold_masks
from palpate.surrogates.fields.depth_amplitude import DepthAmplitude
from palpate.surrogates.fields.local_mode import OFFSETS, LocalMode, Variation, design, polynomials, products

__all__ = [
    "VariationRegressors",
    "border_widths",
    "by_conjugate_gradients",
    "degrees",
    "directions",
    "fade_out",
    "fit_local_mode",
    "fit_variation",
]

_REACH = 5.0  # times the radius
_FULL = 0.3  # of the reach: from there on it fades
_CELLS = 14  # to the reach, a third of the radius each: smaller ones show the mesh
_PENALTY = 1e-5  # of the mean diagonal
# of the radius, with and without nodes on the border: the smooth distance rounds that by 2 to 4 % of the radius
WITHIN = (0.06, 0.01)
_EVEN = 1e3  # an even profile is known, not guessed
_LEAST = 1e-6  # keeps the system regular


def border_widths(solves: Solves) -> tuple[float, ...]:
    """Which of `WITHIN` make a difference."""
    distances = [np.abs(solves.surface.at(one.points - solves.shift)[0]) for one in solves.snapshots]
    wide, narrow = ([d < within * solves.radius for d in distances] for within in WITHIN)
    same = all((a == b).all() for a, b in zip(wide, narrow, strict=True))
    return WITHIN[:1] if same else WITHIN


def fade_out(local_mode: LocalMode) -> LocalMode:
    """Return a local mode and its variation times a window that is one in the middle and ends at the reach.

    Fitted so that it ends by itself, it would fall within the last cells from what the field is there to nothing: a
    ring that travels with the probe, which modes can't make up for.
    """
    fade, own = _fading(local_mode.table.shape[1]), local_mode.variation
    if own is not None:
        own = replace(own, table=np.einsum("ij,qmjhc->qmihc", fade, own.table))
    return replace(local_mode, table=fade @ local_mode.table, variation=own)


def _fading(r: int) -> np.ndarray:
    """Coefficients (r, r) of the window times each spline, by least squares, the last three zero."""
    t = (np.arange(40 * (r - 3)) + 0.5) / (40 * (r - 3))
    u = np.clip((t - _FULL) / (1.0 - _FULL), 0.0, 1.0)
    window = 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    B, fade = design(t * (r - 3), r), np.zeros((r, r))
    fade[: r - 3] = np.linalg.lstsq(B[:, : r - 3], window[:, None] * B, rcond=None)[0]
    return fade


def fit_local_mode(solves: Solves, amplitude: DepthAmplitude, within: float = WITHIN[0]) -> LocalMode | None:
    """The local mode of fields where they were solved, not yet faded out; None where no node is in reach.

    Fields of one component are scalars, those of three vectors; others have no local_mode. Nodes on the border of the
    touched surface, which also belong to another one, may move otherwise: by `within`, a share of the radius, they
    can be left to the modes.
    """
    if solves.components not in (1, 3):
        return None
    levels = int(np.clip(len(np.unique(np.round(solves.depth / amplitude.deepest, 6))), 1, 5))
    parts, r, q = 1 if solves.components == 1 else 2, _CELLS + 3, max(4, levels)
    blank = LocalMode(np.zeros((parts, r, q)), _REACH * solves.radius, within * solves.radius)
    G, b = np.zeros((parts * r * q,) * 2), np.zeros(parts * r * q)
    for k, i, rows, A in _regressors(blank, solves, amplitude):
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
    local_mode: LocalMode, solves: Solves, amplitude: DepthAmplitude
) -> Iterator[tuple[int, int, np.ndarray, np.ndarray]]:
    """Yield for each solve snapshots and row, nodes in reach (rows,), regressors (rows · components, table.size)."""
    contact_points, normals = solves.contact_points
    touched = [solves.touched(local_mode, one.points) for one in solves.snapshots]
    for (k, i), contact_point, n, s in zip(solves.rows(), contact_points, normals, solves.depth, strict=True):
        offset = (solves.snapshots[k].points - contact_point) / local_mode.reach
        distance = np.sqrt((offset**2).sum(axis=1))
        rows = np.flatnonzero(touched[k] & (distance < 1.0))
        shares = np.full(len(rows), min(s / amplitude.deepest, 1.0))
        P = float(amplitude.at(np.array(s))) * products(distance[rows], shares, local_mode.table.shape[1:])
        P = P.reshape(len(rows), -1)
        if solves.components == 1:
            yield k, i, rows, P
            continue
        across = offset[rows] - (offset[rows] @ n)[:, None] * n
        A = np.stack([P[:, None] * n[:, None], P[:, None] * across[:, :, None]], axis=2)
        yield k, i, rows, A.reshape(len(rows) * 3, 2 * P.shape[1])


_IN_DEPTH = 4  # one cubic
_MOST_POLYNOMIALS, _HIGHEST_DEGREE = 84, 10  # of the place
_BASES = (4.0, 8.0)  # b, that are compared
_RIDGE = 1e-4  # of the mean diagonal
_ROUGH, _LEAST_OF_PRIOR = 0.1, 0.01  # of second differences in ρ, of the coefficients themselves
_UPRIGHT = 0.2  # cosine: a surface whose normals stay this near to their mean is a graph over a plane
_ITERATIONS, _TOLERANCE = 400, 1e-4  # of conjugate gradients: relative residual
_PARTS = 2  # of six of the solves, each left out once
_GAIN = 0.8  # of the squares in reach that are missed of columns left out: more is not worth the numbers


@dataclass(frozen=True, eq=False)
class VariationRegressors:
    """Regressors of N solves, separate for nodes and touches."""

    nodes: list[np.ndarray]  # N arrays (n_i,), in reach of each probe, of its own snapshots
    near: list[np.ndarray]  # N arrays (n_i, 4 r), products of splines in ρ and offsets at these
    touches: np.ndarray  # (N, q, m), f times products of splines in s and polynomials
    shape: tuple[int, int]  # number of splines in ρ, and of the field's components

    def images(self, table: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return a variation's table (rows, 4 r, components) at the touch of each solve, f included."""
        flat = table.reshape(self.touches[0].size, -1, self.shape[1])
        return np.asarray(np.tensordot(self.touches[rows].reshape(len(rows), -1), flat, 1))


def fit_variation(
    solves: Solves, remainder: list[np.ndarray], local_mode: LocalMode, amplitude: DepthAmplitude
) -> Variation | None:
    """Return the variation of the local mode of fields, not yet faded out.

    None where it is of no use: with one group alone, or where it gains little of columns left out. The remainder is (N,
    P, components) for each snapshots: its fields, less what the local mode gives.
    """
    parts = fold_masks(solves.groups, FOLDS)
    if len(parts) < 2:
        return None
    contact_points, normals = solves.contact_points
    axes = directions(normals)
    variables = np.hstack([contact_points @ axes.T, solves.X[:, 3:]])
    low, high = variables.min(axis=0), variables.max(axis=0)
    scales = np.array([(low + high) / 2, np.maximum((high - low) / 2, 1e-9)])
    powers = degrees(variables.shape[1])
    empty = np.zeros((_IN_DEPTH, len(powers), local_mode.table.shape[1], OFFSETS, solves.components))
    regressors = _variation_regressors(Variation(empty, powers, axes, scales), local_mode, amplitude, solves)
    fit = _Fit(regressors, solves, remainder, powers.sum(axis=1))
    base, missed = _best_base(fit, parts)
    if missed > _GAIN:
        return None
    return Variation(fit.table(base, np.arange(len(variables))), powers, axes, scales)


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
    """Degrees (m, v) up to the largest total degree, ten at most, that has no more than `_MOST_POLYNOMIALS` of them."""
    degree = max(d for d in range(_HIGHEST_DEGREE + 1) if d == 0 or math.comb(d + v, v) <= _MOST_POLYNOMIALS)
    every = [p for p in itertools.product(range(degree + 1), repeat=v) if sum(p) <= degree]
    return np.array(sorted(every, key=lambda p: (sum(p), p)))


def _variation_regressors(
    blank: Variation, local_mode: LocalMode, amplitude: DepthAmplitude, solves: Solves
) -> VariationRegressors:
    r, components = blank.table.shape[2], blank.table.shape[4]
    touched = [np.flatnonzero(solves.touched(local_mode, one.points)) for one in solves.snapshots]
    contact_points, nodes, near = solves.contact_points[0], [], []
    for (k, _), contact_point in zip(solves.rows(), contact_points, strict=True):
        offset = (solves.snapshots[k].points[touched[k]] - contact_point) / local_mode.reach
        distance = np.linalg.norm(offset, axis=1)
        some = np.flatnonzero(distance < 1.0)
        B = design(distance[some] * (r - 3), r)
        around = np.column_stack([np.ones(len(some)), offset[some]])
        nodes.append(touched[k][some])
        near.append((B[:, :, None] * around[:, None, :]).reshape(len(some), -1))
    in_depth = design(np.minimum(solves.depth / amplitude.deepest, 1.0) * (_IN_DEPTH - 3), _IN_DEPTH)
    in_place = polynomials(blank.variables(contact_points, solves.X[:, 3:]), blank.powers)
    touches = amplitude.at(solves.depth)[:, None, None] * in_depth[:, :, None] * in_place[:, None, :]
    return VariationRegressors(nodes, near, touches, (r, components))


class _Fit:
    """Normal equations of all solves, each as a product."""

    def __init__(
        self, regressors: VariationRegressors, solves: Solves, fields: list[np.ndarray], total: np.ndarray
    ) -> None:
        self._regressors, self._total = regressors, total
        rows = list(zip(solves.rows(), regressors.nodes, strict=True))
        self._values = [fields[k][i, nodes] for (k, i), nodes in rows]
        self._mass = [solves.snapshots[k].mass[nodes] for (k, _), nodes in rows]
        r = regressors.shape[0]
        rough = np.diff(np.eye(r), n=2, axis=0)
        smooth = np.linalg.cholesky(np.linalg.inv(_ROUGH * rough.T @ rough + _LEAST_OF_PRIOR * np.eye(r)))
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
        """Return the sum of squares that is missed of solves where `out` (N,), by what the others say."""
        return self.missed(np.flatnonzero(out), self.table(base, np.flatnonzero(~out)))

    def table(self, base: float, rows: np.ndarray) -> np.ndarray:
        """Coefficients (q, m, r, 4, components) from solves (rows,)."""
        size = base ** (-self._total / 2.0)
        touches = (self._regressors.touches[rows] * size).reshape(len(rows), -1)
        solution = by_conjugate_gradients(self._grams[rows], touches, self._sides[rows])
        (r, components), (q, m) = self._regressors.shape, self._regressors.touches.shape[1:]
        free = np.einsum("kl,flc->fkc", self._prior, solution).reshape(q, m, r, OFFSETS, components)
        return np.asarray(free * size[None, :, None, None, None])


def _best_base(fit: _Fit, parts: list[np.ndarray]) -> tuple[float, float]:
    """b, and the share of the squares that is missed of solves left out."""
    parts = parts[:_PARTS]
    squares = {b: sum(fit.missed_left_out(b, out) for out in parts) for b in _BASES}
    base = min(_BASES, key=lambda b: squares[b])
    whole = sum(fit.missed(np.flatnonzero(out)) for out in parts)
    return base, squares[base] / max(whole, 1e-300)


def by_conjugate_gradients(grams: np.ndarray, touches: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return W (k, R, c) with Σ_i t_i ⊗ (G_i (t_i · W)) + μ W = Σ_i t_i ⊗ s_i, for all c components.

    G are `grams` (N, R, R), symmetric and non-negative, t `touches` (N, k), s `sides` (N, R, c).
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
