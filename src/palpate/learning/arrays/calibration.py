"""The error to expect of a chosen network: widths that samples held out while choosing have set.

    σ_j(x)² = s_j² (1 + φ̃(x)ᵀ M φ̃(x)),   M = G Gᵀ,   coefficients = G Y

is what the weights' uncertainty makes of noise in the samples; a kernel layer has its Gaussian process's variance,
s_j² (1 + λ − kᵀ (K + λ)⁻¹ k), instead. Either only says where the network knows less. How much, the samples say that
were held out: of n scores |y − f|/σ of networks whose weights had not seen them the ⌈(n + 1) level⌉-th smallest
(conformal prediction by a split or by folds: Vovk, Gammerman & Shafer 2005; Barber, Candès, Ramdas & Tibshirani
2021). Where n is too small for that level, it is Student's quantile with n degrees of freedom.

What is handed over is the mean of networks each of which was learnt without a fold, and the scores are of those that
had not seen a sample, reckoned down to the mean of all (`members`). Where the work suffices for one network only, its
weights learn from the held-out samples after those have set the widths: its form and size were chosen by them too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import stdtrit

from palpate.learning.arrays.array_samples import ArrayProblem, Samples
from palpate.learning.arrays.compared_rows import ComparedRows
from palpate.learning.arrays.fit_notes import notes_on
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.arrays.held_out import HeldOut
from palpate.learning.arrays.members import ROWS, Crossed, CrossedLayers
from palpate.learning.ensemble import Ensemble
from palpate.learning.kernel_layer import KernelLayer, Metric
from palpate.learning.search import Trial
from palpate.network import Network, TrainedRegion
from palpate.network.influence import Influence
from palpate.network.radial import RadialFunction
from palpate.network.uncertainty import Uncertainty
from palpate.rbf.refinement.refine import Refined

if TYPE_CHECKING:
    from palpate.learning.arrays.few_rows import LeftOut

__all__ = [
    "LARGEST",
    "Evidence",
    "Finish",
    "calibrated",
    "covariance_rows",
    "kernel_covariance",
    "kernel_spread",
    "mean_root",
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
    """The errors of a network on samples that its weights had not seen."""

    missed: np.ndarray  # (N', m), in scaled outputs
    spread: np.ndarray  # (N',), σ² over s² at these samples, of that network

    @classmethod
    def together(cls, parts: Sequence[Evidence], gain: float = 1.0) -> Evidence:
        """Join the errors of several networks, whose mean is expected to miss `gain` times as much."""
        return cls(np.vstack([p.missed for p in parts]) * gain, np.concatenate([p.spread for p in parts]))


def regressor_root(network: Refined, X: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return G (c, N) by which the coefficients follow from outputs at X (N, n), the units as they are.

    With weights (N,) it is of the outputs times their roots, whose noise is then alike. Of more than 4,000 samples it
    is (c, 4000), made of some of them, and G Gᵀ about the same.
    """
    some, share = _some(len(X))
    rows = _rows(network, X[some])
    if weights is not None:
        rows *= np.sqrt(weights[some])[:, None]
    U, s, Vt = np.linalg.svd(rows, full_matrices=False)
    return np.asarray((Vt.T * (math.sqrt(share) * s / (s * s + _RIDGE * len(rows)))) @ U.T)


def _some(count: int) -> tuple[np.ndarray, float]:
    """Return which of so many samples a covariance is made of, and their share."""
    if count <= ROWS:
        return np.arange(count), 1.0
    return np.sort(np.random.default_rng(0).choice(count, ROWS, replace=False)), ROWS / count


def spread_of(network: Refined, root: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Return 1 + φ̃ᵀ G Gᵀ φ̃ (N',) at X (N', n)."""
    if root.shape[1] > len(root):  # G Gᵀ is the same of a square one
        root = np.asarray(np.linalg.qr(root.T, mode="r")).T
    return np.asarray(1.0 + ((_rows(network, X) @ root) ** 2).sum(axis=1))


def mean_root(networks: Sequence[Refined], X: np.ndarray) -> np.ndarray:
    """Return the same G of the mean of several networks as one: mean of the tails, then all units' weights."""
    roots = [regressor_root(network, X) / len(networks) for network in networks]
    tails = [network.regressors.tail_size for network in networks]
    tail = sum(root[:t] for root, t in zip(roots, tails, strict=True))
    return np.vstack([tail, *(root[t:] for root, t in zip(roots, tails, strict=True))])


def kernel_covariance(layer: KernelLayer) -> np.ndarray:
    """Return M (1 + n + h square) with which s² (1 + φ̃ᵀ M φ̃) is the Gaussian process's variance over 1 + λ."""
    C, metric = _kernel(layer)
    seen = covariance_rows(layer)
    M = -seen @ np.linalg.solve(C, seen.T)
    if not np.isinf(metric.slopes):
        slopes = np.arange(1, 1 + layer.centres.shape[1])
        M[slopes, slopes] += metric.slopes
    return np.asarray((M + M.T) / (2.0 * (1.0 + metric.ridge)))


def covariance_rows(layer: KernelLayer) -> np.ndarray:
    """Return S (1 + n + h, h): what is asked at x covaries with the samples by φ̃ᵀ S."""
    h = len(layer.centres)
    slopes = 0.0 if np.isinf(layer.metric.slopes) else layer.metric.slopes
    return np.vstack([np.zeros((1, h)), slopes * layer.centres.T, np.eye(h)])


def kernel_spread(layer: KernelLayer, X: np.ndarray) -> np.ndarray:
    """Return 1 + φ̃ᵀ M φ̃ (N',) at X (N', n)."""
    C, metric = _kernel(layer)
    k, alone = metric.kernel(X, layer.centres), 0.0
    if not np.isinf(metric.slopes):
        k = k + metric.slopes * (X @ layer.centres.T)
        alone = metric.slopes * (X * X).sum(axis=1)
    return np.asarray(1.0 + (alone - (k * np.linalg.solve(C, k.T).T).sum(axis=1)) / (1.0 + metric.ridge))


def calibrated(
    network: Network, M: np.ndarray | None, evidence: Sequence[Evidence], level: float
) -> Uncertainty:
    """Return the network's uncertainty, its widths set so that intervals of `level` hold what the evidence holds.

    M (c, c) is the covariance of tail and weights over s², None where widths are to be the same everywhere. Of several
    pieces of evidence of the m outputs the widest counts, output by output.
    """
    pairs = [_noise_and_factor(one, level, constant=M is None) for one in evidence]
    noise, factor = np.array([n for n, _ in pairs]), np.array([f for _, f in pairs])
    widest = (noise * factor**2).argmax(axis=0)[None]
    noise, factor = (np.take_along_axis(a, widest, axis=0)[0] for a in (noise, factor))
    M = np.zeros((0, 0)) if M is None else M
    none = np.zeros((2, 0), dtype=np.int64)
    return Uncertainty(network, noise, M, np.zeros((0, 0)), np.zeros((len(M), 0)), none, factor)


def _noise_and_factor(evidence: Evidence, level: float, *, constant: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return s_j² and what a normal law's width is to be multiplied by, each (m,)."""
    spread = np.ones_like(evidence.spread) if constant else evidence.spread
    squares = evidence.missed**2 / spread[:, None]
    noise = np.maximum(squares.mean(axis=0), _ROUND_OFF)
    normal = NormalDist().inv_cdf((1.0 + level) / 2.0)
    return noise, _quantiles(np.sqrt(squares / noise), level) / normal


def _quantiles(scores: np.ndarray, level: float) -> np.ndarray:
    """Return what scores (N', m) stay below with probability `level`, (m,)."""
    count = len(scores)
    rank = math.ceil((count + 1) * level - 1e-9)
    if rank <= count:
        return np.asarray(np.maximum(np.sort(scores, axis=0)[rank - 1], 1e-12))
    return np.full(scores.shape[1], float(stdtrit(count, (1.0 + level) / 2.0)))  # quantile of Student's t


def _rows(network: Refined, X: np.ndarray) -> np.ndarray:
    r = network.regressors
    return np.hstack([r.tail_rows(X), r.phi(X, network.theta)])


def _kernel(layer: KernelLayer) -> tuple[np.ndarray, Metric]:
    """Return the covariance (h, h) of the samples at the centres, and its metric."""
    metric = replace(layer.metric, ridge=max(layer.metric.ridge, _KERNEL_RIDGE))
    return metric.covariance(layer.centres, layer.noise), metric


@dataclass(frozen=True, eq=False)
class Finish:
    """The last stage of a fit: what a result holds beside its network."""

    samples: Samples
    problem: ArrayProblem
    trials: Sequence[Trial]
    began: float
    level: float
    places: np.ndarray
    scales: np.ndarray

    def network(
        self,
        network: Refined,
        split: HeldOut,
        error: float,
        *,
        before: Refined,
        form: str | None = None,
        root: np.ndarray | None = None,
    ) -> Fitted:
        """Return the result for one network; what it missed, before its weights saw it, sets the intervals.

        G Gᵀ, of `root` G (c, c), is the covariance of the coefficients over s²; by default it is made of the samples.
        """
        held, spread = split.unseen[0], np.ones(len(split.unseen[0]))
        if len(before.coefficients) <= LARGEST:
            G = regressor_root(before, split.X) if root is None else root
            spread = spread_of(before, G, held)
        evidence = Evidence(self._errors(before.predict(held), split.held), spread)
        return self._of(Ensemble((network,)), error, evidence, split.held, form, root)

    def mean_network(self, crossed: Crossed) -> Fitted:
        """Return the result for the mean of networks learnt crosswise, each judged by what it had not seen."""

        def spread(network: Refined, unseen: np.ndarray, X: np.ndarray) -> np.ndarray:
            if len(network.coefficients) > LARGEST:
                return np.ones(len(X))
            return spread_of(network, regressor_root(network, self.problem.X[~unseen]), X)

        tested = crossed.tested
        missed = self._errors(crossed.Y[tested] - crossed.missed, tested)
        evidence = Evidence(missed * crossed.gain, crossed.spread(spread))
        return self._of(Ensemble(crossed.networks), crossed.error, evidence, tested, None)

    def _of(
        self,
        mean: Ensemble,
        error: float,
        evidence: Evidence,
        tested: np.ndarray,
        form: str | None,
        root: np.ndarray | None = None,
    ) -> Fitted:
        M = None
        if sum(len(network.coefficients) for network in mean.members) <= LARGEST:
            G = mean_root(mean.members, self.problem.X) if root is None else root
            M = G @ G.T
        arrays = (*mean.regressors.form.factors(mean.theta), *mean.weights_and_tail)
        name, radial = form or mean.regressors.form.name, mean.regressors.radial
        members = [
            (*member.regressors.form.factors(member.theta), member.weights, member.tail)
            for member in mean.members
        ]
        rows = np.flatnonzero(tested)
        return self._fitted(
            arrays, radial, name, error, M, evidence, rows, members if len(members) > 1 else ()
        )

    def kernel_network(self, crossed: CrossedLayers, error: float | None = None) -> Fitted:
        """Return the result for a kernel layer; `error` per latent output is by default what its folds missed."""
        layer, M = crossed.layer, None
        small = len(layer.centres) <= LARGEST
        if small:
            M = kernel_covariance(layer)
        parts = []
        for other, unseen in crossed.folds:
            held = self.problem.X[unseen]
            spread = kernel_spread(other, held) if small else np.ones(len(held))
            parts.append(Evidence(self._errors(other.predict(held), unseen), spread))
        arrays = (*layer.units(), layer.weights, layer.tail)
        evidence = Evidence.together(parts)
        rows = np.concatenate([np.flatnonzero(unseen) for _, unseen in crossed.folds])
        error = crossed.error if error is None else error
        return self._fitted(arrays, layer.metric.radial, "kernel layer", error, M, evidence, rows)

    def few_network(self, candidate: LeftOut) -> Fitted:
        """Return the result for the network that was best of few rows; every row was left out once."""
        layer = candidate.layer
        everything = np.ones(len(candidate.missed), dtype=bool)
        wanted = self.problem.Y - candidate.missed
        evidence = Evidence(self._errors(wanted, everything), candidate.spread)
        arrays = (*layer.units(), layer.weights, layer.tail)
        rows = np.arange(len(candidate.missed))
        fitted = self._fitted(
            arrays, layer.metric.radial, candidate.form, candidate.error, candidate.covariance, evidence, rows
        )
        return replace(fitted, influence=Influence(candidate.influence, candidate.means @ evidence.missed))

    def _errors(self, latent: np.ndarray, held: np.ndarray) -> np.ndarray:
        """Return errors (N', m) in scaled outputs of latent ones (N', k) at samples of a mask (N,)."""
        wanted = self.problem.scaling.scale_outputs(self.samples.Y[held])
        return np.asarray(wanted - latent @ self.problem.basis)

    def _fitted(
        self,
        arrays: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
        radial: RadialFunction,
        form: str,
        error: float,
        M: np.ndarray | None,
        evidence: Evidence,
        rows: np.ndarray,
        members: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = (),
    ) -> Fitted:
        heldout = float(error / self.problem.unit)
        network = self.problem.network(*arrays, radial, heldout=heldout)
        fitted = Fitted(
            network,
            form,
            radial,
            network.units,
            heldout,
            tuple(self.trials),
            time.monotonic() - self.began,
            calibrated(network, M, [evidence], self.level),
            TrainedRegion.of(self.problem.X, groups=self.places),
            self.level,
            self.samples.one_output,
            tuple(self.problem.network(*one, radial, heldout=heldout) for one in members),
        )
        notes = notes_on(self.samples, self.problem, fitted, evidence.missed, rows, self.scales)
        wanted = self.samples.Y[rows]
        scale, sure = self.problem.scaling.output_scale, fitted.uncertainty
        spread = np.ones(len(rows)) if M is None else evidence.spread
        deviation = np.sqrt(spread[:, None] * sure.noise) * sure.factor * scale
        comparison = ComparedRows(wanted, wanted - evidence.missed * scale, deviation=deviation)
        return replace(fitted, notes=notes, comparison=comparison)
