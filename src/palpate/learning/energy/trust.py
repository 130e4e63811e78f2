"""The posterior of the linear weights of ℓ, and the factor that makes it cover the errors of solves left out.

Given the units, the weights of a network have the covariance M = (ΦᵀΦ + λ)⁻¹ times a variance. A mean of networks has
the shape of its best one's: they learnt from the same solves, and miss where there are none. Leaving a fold i of
solves out, its rows have the covariance H_ii (I − H_ii)⁻¹ (Cook & Weisberg 1982), and the force of each solve the
relative error of a mean that was refined again without that fold. The variance is chosen such that nine tenths of
those errors are below 1.645 deviations, and as many more as so few groups ask for: of n exchangeable ones the share
0.9 (n + 1)/n has to lie below what the next one exceeds once in ten times (Vovk, Gammerman & Shafer 2005, §2.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.energy.energy_search import EnergyEnsemble
from palpate.rbf.refinement.rows import Rows

__all__ = ["Trust", "trust_of"]

_NINE_TENTHS = 1.645  # standard deviations that hold 90 % of a Gaussian's errors
_LARGEST_LEVERAGE = 0.98  # of a direction of a fold's rows: beyond it nothing is left to judge by


@dataclass(frozen=True, eq=False)
class Trust:
    """The errors that leaving solves out has shown, and the posterior that covers them."""

    # (c, z), of the coefficients' covariance, tail first, calibrated; zero for units beside the best network's
    root: np.ndarray
    errors: np.ndarray  # (N,), relative force error of each solve whose force is known, when it is left out


def trust_of(ensemble: EnergyEnsemble, samples: EnergySamples) -> Trust:
    """Return what a mean of networks misses of the solves that it was refined on, when they are left out."""
    rows, fit, fold = ensemble.left_out.rows, ensemble.left_out.fit, ensemble.left_out.together
    missed, Q = ensemble.left_out.errors @ rows.modes, fit.Q
    to_force, solves = _to_force(rows, samples), _slope_rows(rows)
    errors, sizes = np.empty(len(solves)), np.empty(len(solves))
    fold_of_row = fold[rows.samples]
    for left in np.unique(fold[[i for i, _ in solves]]):
        members = np.flatnonzero(fold_of_row == left)
        values, V = np.linalg.eigh(Q[members] @ Q[members].T)
        values = np.clip(values, 0.0, _LARGEST_LEVERAGE)
        spread = V * np.sqrt(values / (1.0 - values))
        for row, (i, first) in enumerate(solves):
            if fold[i] == left:
                block = np.r_[i, first + np.arange(samples.forceful)]
                errors[row] = np.linalg.norm(to_force[row] @ missed[block, 0])
                sizes[row] = np.linalg.norm(to_force[row] @ spread[np.searchsorted(members, block)])
    groups = int(rows.groups.max()) + 1
    share = min(0.9 * (groups + 1) / groups, 1.0)
    ratio = float(np.quantile(errors / np.maximum(sizes, 1e-300), share)) / _NINE_TENTHS
    triangle = np.linalg.cholesky(fit.inverse + 1e-14 * np.trace(fit.inverse) * np.eye(len(fit.tau)))
    others = np.zeros((len(ensemble.coefficients) - len(triangle), triangle.shape[1]))
    return Trust(ratio * np.vstack([triangle, others]), errors)


def _slope_rows(rows: Rows) -> list[tuple[int, int]]:
    """Return the samples whose force is known, and the first row of each one's slopes: the first are the force's."""
    counts = (rows.slope_scale > 0).sum(axis=1)
    starts = len(rows.X) + np.cumsum(counts) - counts
    return [(int(i), int(start)) for i, start in zip(rows.sloped, starts, strict=True)]


def _to_force(rows: Rows, samples: EnergySamples) -> np.ndarray:
    """Return (S, k, 1 + k): what errors of a solve's weighted rows make of its force, relative to it."""
    rows_with_force, k = rows.sloped, samples.forceful
    force = samples.force[rows_with_force, :k]
    size = np.linalg.norm(force, axis=1)
    to_force = np.zeros((len(rows_with_force), k, 1 + k))
    to_force[:, :, 0] = force / (size * rows.scale[rows_with_force])[:, None]
    half = samples.half[:k]
    for i in range(k):
        to_force[:, i, 1 + i] = -samples.energy[rows_with_force] / (size * rows.slope_scale[:, i] * half[i])
    return to_force
