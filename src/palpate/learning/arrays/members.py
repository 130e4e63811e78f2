"""Networks of one kind learnt crosswise: what their mean misses is measured where none of those asked had learnt.

In each round the samples are dealt into five folds, and five networks each learn without one of them. So each sample
is unseen by one network of each round; of two rounds there are ten networks, whose mean is handed over. With f₁ and f₂
unseen at a sample, and M networks in all,

    E₂ = mean (y − ½(f₁ + f₂))²     v = mean ½(f₁ − f₂)²     E = max(E₂ − (½ − 1/M) v, ½ E₂)

is the squared error of the mean: a mean of M misses less than one of two by the spread of the two (Krogh & Vedelsby
1995, eq. 6), where the spread counts at samples that neither has seen (Breiman 1996), not between samples, where
networks that diverge would be rewarded.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.learning.arrays.held_out import RIDGE, HeldOut, carry
from palpate.learning.kernel_layer import KernelLayer, Metric, likely_metric
from palpate.learning.search import Candidate
from palpate.rbf.refinement.projection import project
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.refinement.rows import Rows

__all__ = ["LOOK_SAMPLES", "ROWS", "Crossed", "CrossedLayers", "Fresh", "clearly_less", "refit_weights"]

ROWS = 4000
"""Samples by which a ridge is chosen and a covariance is made; more would say the same and take longer."""

LOOK_SAMPLES = 1000
"""Samples from which a start is refined before it sees all of them."""

_ASTRAY = 3.0  # times what the median network is away from the others: not of their kind
_RIDGES = tuple(10.0**k for k in range(-13, -2))


@dataclass(frozen=True, eq=False)
class Crossed:
    """Networks of one kind, each with weights from the samples that it may know, scaled inputs and latent outputs."""

    networks: tuple[Refined, ...]  # K members of the mean
    unseen: np.ndarray  # (K, N), samples that neither units nor weights of each one have seen
    rounds: np.ndarray  # (K,), in one round a sample is unseen by one network at most
    X: np.ndarray  # (N, n)
    Y: np.ndarray  # (N, k)

    @cached_property
    def _answers(self) -> np.ndarray:
        """Answers (R, N, k) of each round's networks at samples unseen by them; not-a-number where there is none."""
        out = np.full((int(self.rounds.max()) + 1, *self.Y.shape), np.nan)
        for network, unseen, k in zip(self.networks, self.unseen, self.rounds, strict=True):
            out[k, unseen] = network.predict(self.X[unseen])
        return out

    @cached_property
    def tested(self) -> np.ndarray:
        """Mask (N,) of the samples that some network has not seen."""
        return np.asarray(self.unseen.any(axis=0))

    @cached_property
    def missed(self) -> np.ndarray:
        """Error (J, k), at each tested sample, of the mean of the networks that had not seen it."""
        return np.asarray(self.Y[self.tested] - np.nanmean(self._answers[:, self.tested], axis=0))

    @cached_property
    def gain(self) -> float:
        """Error to expect of the mean of all networks, over that of the mean of those that had not seen a sample."""
        both = np.isfinite(self._answers).all(axis=(0, 2))
        if len(self._answers) < 2 or not both.any():
            return 1.0
        pair = self._answers[:, both]
        square = float(((self.Y[both] - pair.mean(axis=0)) ** 2).mean())
        apart = float((0.5 * (pair[0] - pair[1]) ** 2).mean())
        less = square - (0.5 - 1.0 / len(self.networks)) * apart
        return float(np.sqrt(max(less, 0.5 * square) / max(square, 1e-300)))

    @property
    def error(self) -> float:
        """Error to expect of the mean of all, root mean square per latent output."""
        return self.gain * float(np.sqrt((self.missed**2).mean()))

    def clearly_ahead(self, missed: np.ndarray, *, errors: float = 2.0) -> bool:
        """Return True if the mean of all misses clearly less than another network did of each sample, (N, k)."""
        return clearly_less(self.gain * self.missed, missed[self.tested], errors=errors)

    def spread(self, spread_of: Callable[[Refined, np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """Return at the tested samples (J,) the mean spread of the networks that had not seen them.

        `spread_of` takes a network, the mask (N,) of the samples that it had not seen, and inputs (M, n).
        """
        total, count = np.zeros(len(self.X)), np.zeros(len(self.X))
        for network, unseen in zip(self.networks, self.unseen, strict=True):
            total[unseen] += spread_of(network, unseen, self.X[unseen])
            count[unseen] += 1.0
        return np.asarray((total / np.maximum(count, 1.0))[self.tested])

    def without_strays(self) -> Crossed:
        """Return the networks that agree with the others between the samples.

        Left out is one whose distance from the pointwise median is, at one in a hundred places half way from a sample
        to another near it, above three times what it is for the median network: one that was caught elsewhere.
        """
        from scipy.spatial import KDTree

        tree = KDTree(self.X[: 2 * ROWS])
        some = self.X[:ROWS]
        near = np.asarray(tree.query(some, min(4, len(tree.data)))[1])[:, -1]
        between = 0.5 * (some + tree.data[near])
        answers = np.array([network.predict(between) for network in self.networks])
        apart = np.sqrt(((answers - np.median(answers, axis=0)) ** 2).mean(axis=2))
        far = np.quantile(apart, 0.99, axis=1)
        kept = np.flatnonzero(far <= _ASTRAY * np.median(far))
        if len(kept) in (0, len(self.networks)):
            return self
        networks = tuple(self.networks[i] for i in kept)
        return replace(self, networks=networks, unseen=self.unseen[kept], rounds=self.rounds[kept])


def refit_weights(network: Refined, X: np.ndarray, Y: np.ndarray, ridge: float = RIDGE) -> Refined:
    """Return the same units with weights from all samples; the ridge by leave-one-out error, `ridge` at least."""
    some = X, Y
    if len(X) > ROWS:
        rows = np.sort(np.random.default_rng(0).choice(len(X), ROWS, replace=False))
        some = X[rows], Y[rows]

    def fit(penalty: float) -> Refined:
        return refine(*some, network.theta, network.regressors, ridge=penalty, iterations=0)

    best, chosen = fit(ridge), ridge
    for penalty in (r for r in _RIDGES if r > ridge):
        other = fit(penalty)
        if not other.loo < best.loo:  # as many unknowns as samples judge nothing: both are infinite
            break
        best, chosen = other, penalty
    if len(X) <= ROWS:
        return best
    problem = Rows.of(network.regressors, X, Y)
    solution = project(problem, network.theta, chosen * problem.total)
    return replace(best, coefficients=solution.coefficients @ problem.modes)


@dataclass(frozen=True, eq=False)
class CrossedLayers:
    """A kernel layer of all samples, and layers of its metric that had not seen some of them."""

    layer: KernelLayer  # the one that is handed over
    # each with the mask (N,) of what it had not seen; no sample is in two
    folds: tuple[tuple[KernelLayer, np.ndarray], ...]
    X: np.ndarray  # (N, n), scaled inputs
    Y: np.ndarray  # (N, k), latent outputs

    @classmethod
    def of(
        cls, metric: Metric, X: np.ndarray, Y: np.ndarray, masks: Sequence[np.ndarray], *, steps: int = 0
    ) -> CrossedLayers:
        """Return the layers of a metric, one without each mask (N,) of samples.

        With `steps` each layer's metric goes so many steps further in likelihood on the samples that it may know: else
        all have had their part in the metric, and errors look a little too small.
        """
        folds = []
        for unseen in masks:
            own = metric
            if steps:
                known = ~unseen
                own = likely_metric(
                    metric.radial, X[known], Y[known], samples=len(X), iterations=steps, start=metric
                )
            folds.append((KernelLayer.fit(own, X[~unseen], Y[~unseen]), unseen))
        return cls(KernelLayer.fit(metric, X, Y), tuple(folds), X, Y)

    @cached_property
    def missed(self) -> np.ndarray:
        """Error (N, k) at each sample of the layer that had not seen it; not-a-number where there is none."""
        errors = np.full(self.Y.shape, np.nan)
        for layer, unseen in self.folds:
            errors[unseen] = self.Y[unseen] - layer.predict(self.X[unseen])
        return errors

    @property
    def error(self) -> float:
        """Error to expect, root mean square per latent output."""
        return float(np.sqrt(np.nanmean(self.missed**2)))


def clearly_less(missed: np.ndarray, other: np.ndarray, *, errors: float = 1.0) -> bool:
    """Return True if errors (J, k) are less than others at the same samples by more than their difference's own error.

    The mean of the squares' differences is compared with so many times its standard error. What was chosen among many
    by an error with noise in it has a little luck; so a tie goes to the other.
    """
    gain = (other**2).mean(axis=1) - (missed**2).mean(axis=1)
    return bool(gain.mean() > errors * gain.std() / np.sqrt(len(gain)))


@dataclass(frozen=True, eq=False)
class Fresh:
    """The recipe of another network like one that was found, from another start."""

    like: Candidate  # whose kind and number of units are taken
    scales: np.ndarray  # (n,), of first units
    deadline: float  # of `time.monotonic`

    def refined(self, where: tuple[HeldOut, int]) -> Candidate | None:
        """Return the network refined on a split from a start of a seed; nothing where the time does not suffice."""
        split, seed = where
        regressors = self.like.regressors
        fresh = split.enter(regressors.form.name, self.like.theta.size, self.scales, seed)
        for problem, iterations in ((split.first(LOOK_SAMPLES), 15), (split, max(30, self.like.iterations))):
            left = self.deadline - time.monotonic()
            if left <= 0:
                return None
            fresh = problem.evaluate(fresh, iterations, None if np.isinf(left) else left)
            if problem.partial:
                fresh = carry(fresh, regressors.radial)
        return fresh

    def work(self, split: HeldOut) -> float:
        """Return the multiplications that a refinement and the fit of its weights take at most."""
        columns, samples = len(self.like.theta), len(split.X) + len(split.unseen[0])
        first = 15 * split.first(LOOK_SAMPLES).work(self.like)
        return first + max(30, self.like.iterations) * split.work(self.like) + 4.0 * samples * columns**2
