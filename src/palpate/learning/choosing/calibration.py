"""How far a chosen network may be off: widths that samples held out while choosing have set.

    σ_j(x)² = s_j² (1 + φ̃(x)ᵀ M φ̃(x)),   M = G Gᵀ,   coefficients = G Y

is what the weights' uncertainty makes of noise in the samples; a kernel layer has its Gaussian process's variance,
s_j² (1 + λ − kᵀ (K + λ)⁻¹ k), instead. Either only says where the network knows less. How much, the samples say that
were held out: of n scores |y − f|/σ of networks whose weights had not seen them the ⌈(n + 1) level⌉-th smallest
(conformal prediction by a split or by folds: Vovk, Gammerman & Shafer 2005; Barber, Candès, Ramdas & Tibshirani
2021). Where n is too small for that level, it is Student's quantile with n degrees of freedom.

The scores are not quite those of the final network. Its form and size were chosen by these samples, which makes
the widths narrower than they should be; its weights then learn from these samples too, which makes it better than
the widths say. Of few samples the first weighs more. There networks of the same kind are learnt again, each without
a fold of which it then has seen nothing, and what those miss on their folds counts where it is more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from scipy.special import stdtrit

from palpate.learning.choosing.kernel_layer import KernelLayer
from palpate.network import Network
from palpate.network.uncertainty import Uncertainty
from palpate.rbf.refinement.refine import Refined

__all__ = [
    "LARGEST",
    "Evidence",
    "calibrated",
    "committee_root",
    "kernel_covariance",
    "kernel_spread",
    "regressor_root",
    "spread_of",
]

LARGEST = 1200
"""Regressors of which a covariance is kept, 12 MB; larger networks have the same width everywhere."""

_RIDGE = 1e-10  # of the samples' number: units that nearly cancel would leave no inverse
_KERNEL_RIDGE = 1e-6  # the least with which a kernel's variance survives rounding
_ROUND_OFF = 1e-24  # mean square of scaled outputs


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a network missed on samples that its weights had not seen.

    Attributes
    ----------
    missed : (N', m)
        In scaled outputs.
    spread : (N',)
        σ² over s² at these samples, of that network.
    """

    missed: np.ndarray
    spread: np.ndarray

    @classmethod
    def together(cls, parts: Sequence[Evidence], gain: float = 1.0) -> Evidence:
        """Of several networks, whose average is expected to miss `gain` times as much."""
        return cls(np.vstack([p.missed for p in parts]) * gain, np.concatenate([p.spread for p in parts]))


def regressor_root(found: Refined, X: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """G (c, N) by which the coefficients follow from outputs at X (N, n), the units as they are.

    With weights (N,) it is of the outputs times their roots, whose noise is then alike.
    """
    rows = _rows(found, X) if weights is None else _rows(found, X) * np.sqrt(weights)[:, None]
    U, s, Vt = np.linalg.svd(rows, full_matrices=False)
    return np.asarray((Vt.T * (s / (s * s + _RIDGE * len(X)))) @ U.T)


def spread_of(found: Refined, root: np.ndarray, X: np.ndarray) -> np.ndarray:
    """1 + φ̃ᵀ G Gᵀ φ̃ (N',) at X (N', n)."""
    return np.asarray(1.0 + ((_rows(found, X) @ root) ** 2).sum(axis=1))


def committee_root(found: Sequence[Refined], X: np.ndarray) -> np.ndarray:
    """The same G of the average of several networks as one: mean of the tails, then all units' weights."""
    roots = [regressor_root(one, X) / len(found) for one in found]
    tails = [one.regressors.tail_size for one in found]
    tail = sum(root[:t] for root, t in zip(roots, tails, strict=True))
    return np.vstack([tail, *(root[t:] for root, t in zip(roots, tails, strict=True))])


def kernel_covariance(layer: KernelLayer) -> np.ndarray:
    """M (1 + n + h square) with which s² (1 + φ̃ᵀ M φ̃) is the Gaussian process's variance over 1 + λ."""
    h, n = layer.centres.shape
    C, ridge = _kernel(layer)
    M = np.zeros((1 + n + h, 1 + n + h))
    inverse = np.linalg.inv(C)
    M[1 + n :, 1 + n :] = -(inverse + inverse.T) / (2.0 * (1.0 + ridge))
    return M


def kernel_spread(layer: KernelLayer, X: np.ndarray) -> np.ndarray:
    """1 + φ̃ᵀ M φ̃ (N',) at X (N', n)."""
    C, ridge = _kernel(layer)
    k = layer.metric.kernel(X, layer.centres)
    return np.asarray(1.0 - (k * np.linalg.solve(C, k.T).T).sum(axis=1) / (1.0 + ridge))


def calibrated(
    network: Network, M: np.ndarray | None, evidence: Sequence[Evidence], level: float
) -> Uncertainty:
    """The network's uncertainty, its widths set so that intervals of `level` hold what the evidence holds.

    Parameters
    ----------
    network : Network
    M : (c, c), optional
        Covariance of tail and weights over s²; none where widths are to be the same everywhere.
    evidence : sequence of Evidence
        Of m outputs; where there are several, the widest counts, output by output.
    level : float
    """
    found = [_noise_and_factor(one, level, constant=M is None) for one in evidence]
    noise, factor = np.array([n for n, _ in found]), np.array([f for _, f in found])
    widest = (noise * factor**2).argmax(axis=0)[None]
    noise, factor = (np.take_along_axis(a, widest, axis=0)[0] for a in (noise, factor))
    M = np.zeros((0, 0)) if M is None else M
    none = np.zeros((2, 0), dtype=np.int64)
    return Uncertainty(network, noise, M, np.zeros((0, 0)), np.zeros((len(M), 0)), none, factor)


def _noise_and_factor(evidence: Evidence, level: float, *, constant: bool) -> tuple[np.ndarray, np.ndarray]:
    """s_j² and what a normal law's width is to be multiplied by, each (m,)."""
    spread = np.ones_like(evidence.spread) if constant else evidence.spread
    squares = evidence.missed**2 / spread[:, None]
    noise = np.maximum(squares.mean(axis=0), _ROUND_OFF)
    normal = NormalDist().inv_cdf((1.0 + level) / 2.0)
    return noise, _quantiles(np.sqrt(squares / noise), level) / normal


def _quantiles(scores: np.ndarray, level: float) -> np.ndarray:
    """What scores (N', m) stay below with probability `level`, (m,)."""
    count = len(scores)
    rank = math.ceil((count + 1) * level - 1e-9)
    if rank <= count:
        return np.asarray(np.maximum(np.sort(scores, axis=0)[rank - 1], 1e-12))
    return np.full(scores.shape[1], float(stdtrit(count, (1.0 + level) / 2.0)))  # quantile of Student's t


def _rows(found: Refined, X: np.ndarray) -> np.ndarray:
    r = found.regressors
    return np.hstack([r.tail_rows(X), r.phi(X, found.theta)])


def _kernel(layer: KernelLayer) -> tuple[np.ndarray, float]:
    """K + λ (h, h) between the centres, and λ."""
    ridge = max(layer.metric.ridge, _KERNEL_RIDGE)
    C = layer.metric.kernel(layer.centres, layer.centres)
    C[np.diag_indices(len(C))] += ridge
    return C, ridge
