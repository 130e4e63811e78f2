"""Functions of several inputs as sums of Gaussians of one shape with an affine tail, fitted to values and slopes.

With the centres and the widths along the inputs given, this is linear least squares with a ridge. The widths are found
by coordinate search: each is made wider and narrower in turn, and kept where rows of left-out groups are missed less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.surrogates.lumps.gaussian_sum import GaussianSum

__all__ = ["Samples", "Surface", "as_sum", "fit_surface", "fit_widths", "spread_rows"]

RIDGE = 1e-8  # on squared weights, over the mean square of a column
PART = 4000  # rows whose regressors are held at once
STEP = 1.5  # factor between the widths that are tried
ROUNDS = 2  # through all inputs, in the search of widths
NARROWEST, WIDEST = 0.15, 12.0  # bounds of widths, over half a range
SEARCHED = 260, 1500  # units and rows, at most, in the search of widths


@dataclass(frozen=True, eq=False)
class Samples:
    """Values and slopes of one function, scaled."""

    Z: np.ndarray  # (N, n) inputs, scaled to [−1, 1] over their ranges
    value: np.ndarray  # (N,) of the function
    weight: np.ndarray  # (N,) of each row in the fit
    slopes: np.ndarray | None = None  # (N, q) derivatives along q directions, scaled as the inputs
    directions: np.ndarray | None = None  # (n, q)
    # (N,) weight of a row's slopes beside its value: the scaled length over which a difference of slope makes a
    # difference of value that counts as much
    reach: np.ndarray | None = None

    def take(self, rows: np.ndarray) -> Samples:
        """Return some of the rows."""
        own = None if self.slopes is None or self.reach is None else (self.slopes[rows], self.reach[rows])
        return Samples(
            self.Z[rows], self.value[rows], self.weight[rows], own and own[0], self.directions, own and own[1]
        )


@dataclass(frozen=True, eq=False)
class Surface:
    """A fitted sum of Gaussians in scaled inputs."""

    centres: np.ndarray  # (h, n)
    widths: np.ndarray  # (n,)
    weights: np.ndarray  # (1 + n + h,): constant, slopes, units

    def blocks(self, rows: Samples) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Return regressors (N, 1 + n + h), targets (N,) and weights (N,) of values, then of each slope's squares."""
        far = rows.Z / self.widths, self.centres / self.widths
        q = (far[0] ** 2).sum(axis=1)[:, None] + (far[1] ** 2).sum(axis=1) - 2.0 * far[0] @ far[1].T
        phi = np.exp(-np.maximum(q, 0.0))
        one = np.ones((len(rows.Z), 1))
        parts = [(np.hstack([one, rows.Z, phi]), rows.value, rows.weight)]
        if rows.slopes is None or rows.directions is None or rows.reach is None:
            return parts
        for i, along in enumerate(rows.directions.T):
            step = along / self.widths
            slope = -2.0 * phi * ((far[0] @ step)[:, None] - far[1] @ step)
            tail = np.hstack([0.0 * one, np.broadcast_to(along, rows.Z.shape), slope])
            parts.append((tail, rows.slopes[:, i], rows.weight * rows.reach**2))
        return parts

    def missed(self, rows: Samples) -> float:
        """Return the weighted mean square of what is missed of values and slopes."""
        total = sum(float((w * (B @ self.weights - y) ** 2).sum()) for B, y, w in self.blocks(rows))
        return total / float(rows.weight.sum())

    def fit(self, rows: Samples) -> Surface:
        """Return the surface whose weights fit rows best."""
        size = 1 + self.centres.shape[1] + len(self.centres)
        normal, right = np.zeros((size, size)), np.zeros(size)
        for first in range(0, len(rows.Z), PART):
            part = rows.take(np.arange(first, min(first + PART, len(rows.Z))))
            for B, y, w in self.blocks(part):
                weighted = B * w[:, None]
                normal += weighted.T @ B
                right += weighted.T @ y
        normal[np.diag_indices(size)] += RIDGE * np.trace(normal) / size
        return Surface(self.centres, self.widths, np.linalg.solve(normal, right))


def fit_widths(rows: Samples, groups: np.ndarray, widths: np.ndarray, seed: int = 0) -> np.ndarray:
    """Return widths (n,) with which rows of left-out groups (N,) are missed least; the search begins at `widths`."""
    rng = np.random.default_rng(seed)
    some = np.sort(rng.permutation(len(rows.Z))[: 2 * SEARCHED[1]])
    names = rng.permutation(np.unique(groups))
    out = np.isin(groups[some], names[: max(1, len(names) // 3)])
    learnt, judged = rows.take(some[~out]), rows.take(some[out])
    if not len(learnt.Z) or not len(judged.Z):
        return widths

    def error(trial: np.ndarray) -> float:
        return (
            Surface(spread_rows(learnt.Z / trial, SEARCHED[0]) * trial, trial, np.zeros(0))
            .fit(learnt)
            .missed(judged)
        )

    best, least = widths, error(widths)
    for _ in range(ROUNDS):
        for i in range(len(widths)):
            for factor in (STEP, 1.0 / STEP):
                trial = best.copy()
                trial[i] = float(np.clip(trial[i] * factor, NARROWEST, WIDEST))
                if trial[i] != best[i] and (value := error(trial)) < least:
                    best, least = trial, value
                    break
    return best


def fit_surface(rows: Samples, widths: np.ndarray, units: int) -> Surface:
    """Return the surface of so many units at most, whose centres are rows far from each other."""
    centres = spread_rows(rows.Z / widths, units) * widths
    return Surface(centres, widths, np.zeros(0)).fit(rows)


def as_sum(surface: Surface, middle: np.ndarray, half: np.ndarray) -> GaussianSum:
    """Return the surface as a function of physical inputs, whose ranges have these middles and halves (n,)."""
    n = surface.centres.shape[1]
    return GaussianSum(
        middle, half, surface.centres, surface.widths, surface.weights[1 + n :], surface.weights[: 1 + n]
    )


def spread_rows(Z: np.ndarray, count: int) -> np.ndarray:
    """Return so many rows of Z (N, n) at most, each the farthest from those before it (Gonzalez 1985)."""
    if len(Z) <= count:
        return Z
    some = Z[np.linspace(0, len(Z) - 1, min(len(Z), 8 * count)).astype(int)]
    chosen, nearest = [0], ((some - some[0]) ** 2).sum(axis=1)
    while len(chosen) < count:
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, ((some - some[chosen[-1]]) ** 2).sum(axis=1))
    return np.asarray(some[chosen])
