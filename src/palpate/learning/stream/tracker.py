"""Tracking of a map that may stand still, drift or jump: a bank of linear filters over the same units.

The map is a Gaussian process seen through its values u at h centres, and an affine tail T:

    f(x) = T·[1, x] + k(x)ᵀ K⁻¹ u,   k_j(x) = s² exp(−‖(x − μ_j)/ℓ‖²),   K = k(centres)

so a network of h Gaussian units with weights K⁻¹u. z = [T, u] is normal; its covariance P never exceeds the prior
P₀ = diag(t² I, K), whatever is forgotten (Van Vaerenbergh, Lázaro-Gredilla & Santamaría 2012):

    P ← P + q (P₀ − P)      before each observation, the mean resting

Each filter of the bank believes in another rate q: none, some drifts, and a jump. They interact (Blom & Bar-Shalom
1988): from one observation to the next the map may change from one regime to another, and every filter begins from the
mixture of what all believe. Their probabilities say whether the map rests, drifts or has jumped, and the mixture of
their means is one network.

A measurement is right, with normal noise of variance r(x), or an outlier of any size, with a Cauchy density that is the
same for all filters. The probability that it is right is its weight in the update. So one wild reading changes nothing,
and several in a row that the jump foresees make it likely.

r(x) is what readings near each unit scattered by, shrunk towards what they all do; expected squared noise given the
innovation, so uncertainty of the map is not taken for noise.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import block_diag

from palpate.learning.stream.noise_level import NoiseLevel
from palpate.learning.stream.scales import Scales
from palpate.learning.stream.tracker_kernels import measure, mix
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.regressors import pairs

__all__ = ["Tracker"]

RATES = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 0.0)  # the last is of a map that has jumped
_STAY = 0.995  # that the regime of a drift goes on for another observation
_JUMP = 1e-5  # that a jump comes now
_SUSPECTED = 1e-3  # chance of a jump from which its beginning is looked for
_LIKELY = 0.9  # and from which it is told
_SETTLE = 0.05  # that after a jump the map rests or drifts again
_WRONG = 0.03  # share of outliers to begin with
_WRONG_RANGE = (0.003, 0.2)
_SPREAD = 10.0  # scale of the outliers' density over the noise
_WRONG_RATE = 0.005  # of a reading in the share of outliers
_LEAST = 1e-9  # of a reading's variance, over s²
_BESIDE = 0.3  # lengths from a place to the units beside it
_NOVEL = 0.1  # prior variance that no unit explains, over the noise's, from which a unit is added
_FINEST, _COARSEST = 1e-7, 1e-2  # bounds of that, relative to s²


class Tracker:
    """The bank of filters: `update` with one reading at a time, `predict` with the mixture of the bank.

    The scales are the prior of the map from n inputs to m outputs; the bank has `units_max` units at most, and `count`
    readings went before those it will see.
    """

    def __init__(self, scales: Scales, inputs: int, outputs: int, units_max: int, count: int = 0) -> None:
        self.scales, self.units_max = scales, units_max
        self._novelty = scales.variance * float(
            np.clip(_NOVEL * scales.noise / scales.variance, _FINEST, _COARSEST)
        )
        self._least = _LEAST * scales.variance
        self._regressors = Settings(form="axis-aligned").regressors(inputs)
        n, m, B = inputs, outputs, len(RATES)
        self.tail = 1 + n
        self.centres = np.zeros((0, n))
        self.inverse = np.zeros((0, 0))  # of φ(centres)
        self.prior = scales.tail * np.eye(self.tail)
        self.means = np.zeros((B, self.tail, m))
        self.means[:, 0] = scales.centre
        self.covariances = np.repeat(self.prior[None], B, axis=0)
        self.rates = np.array(RATES)
        self.chances = np.full(B, _JUMP)
        self.chances[:-1] = (1.0 - _JUMP) / (B - 1)
        self.transitions = _transitions(B)
        self.wrong = _WRONG
        self.noise = NoiseLevel(scales.noise, n, m)
        self.weight = 1.0  # probability that the last reading was right
        self.count = count
        self.changed_at = 0  # the reading that began the latest jump, counting from one; 0 for none
        self._quiet = count  # the last reading at which no jump was suspected

    @property
    def units(self) -> int:
        """h."""
        return len(self.centres)

    @property
    def theta(self) -> np.ndarray:
        """The units' numbers (h, 2 n): centres, and logarithms of widths."""
        widths = np.broadcast_to(np.log(self.scales.lengths), self.centres.shape)
        return np.hstack([self.centres, widths])

    @property
    def numbers(self) -> int:
        """Count of the numbers kept."""
        arrays = (self.means, self.covariances, self.prior, self.inverse, self.centres)
        return sum(a.size for a in arrays)

    def activations(self, x: np.ndarray) -> np.ndarray:
        """φ (h,) at x (n,)."""
        return np.asarray(np.exp(-(((self.centres - x) / self.scales.lengths) ** 2).sum(axis=1)))

    def noise_at(self, x: np.ndarray) -> float:
        """r at x (n,)."""
        return self.noise.at(x, self.activations(x))

    def update(self, observation: Observation) -> np.ndarray:
        """Learn a reading, and its slopes and curvatures; the error (m,) of the value that was foreseen."""
        x = observation.x
        phi = self.activations(x)
        lever = self.inverse @ phi
        rest = self.scales.variance * max(1.0 - float(phi @ lever), 0.0)
        if rest > self._novelty and self.units < self.units_max:
            self._add(x, phi, lever, rest)
            if observation.slopes is not None:
                self._add_beside(x)
            phi = self.activations(x)
            lever, rest = self.inverse @ phi, 0.0
        self.chances, self.means, self.covariances = mix(
            self.transitions, self.chances, self.means, self.covariances, self.prior, self.rates
        )
        r = max(self.noise.at(x, phi), self._least)
        weight = observation.weight
        row = np.concatenate([[1.0], x, lever])
        before = self.chances
        errors, S, p = self._measure(row, rest, r / weight, observation.y)
        self.weight = float(self.chances @ p)
        self.wrong = float(
            np.clip(self.wrong + _WRONG_RATE * (1.0 - self.weight - self.wrong), *_WRONG_RANGE)
        )
        self.noise.learn(x, phi, np.sqrt(weight) * errors, weight * S, self.chances, r)
        if not observation.plain:
            self._measure_derivatives(observation, r)
        self._watch()
        return np.asarray(before @ errors)

    def _measure(
        self, row: np.ndarray, rest: float, r: float, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Learn that row·z was read as y (m,), with noise of variance r.

        Returns the errors of the filters (B, m), their variances (B,), and the chances (B,) that the reading is right.
        """
        errors, S, right, self.chances = measure(
            *(row, rest, r, np.ascontiguousarray(y), self.noise.shares, self.wrong, _SPREAD),
            *(self.chances, self.means, self.covariances),
        )
        return errors, S, right

    def _measure_derivatives(self, observation: Observation, r: float) -> None:
        """Learn slopes and curvatures, number by number of the inputs."""
        kernel = self.prior[self.tail :, self.tail :] / self.scales.variance
        for tail, by_x, variance, weight, y in _derivatives(observation, self.theta, self.scales.lengths):
            lever = self.inverse @ by_x
            rest = self.scales.variance * max(variance - float(lever @ kernel @ lever), 0.0)
            self._measure(np.concatenate([tail, lever]), rest, r / (observation.weight * weight), y)

    def _watch(self) -> None:
        """Count the reading, and note a jump once it is likelier than not."""
        self.count += 1
        jump = float(self.chances[-1])
        if jump < _SUSPECTED:
            self._quiet = self.count
        elif jump > _LIKELY and self.changed_at <= self._quiet:
            self.changed_at = self._quiet + 1

    @property
    def drifts(self) -> float:
        """Probability that the map drifts."""
        return float(self.chances[self.rates > 0].sum())

    def _add_beside(self, x: np.ndarray) -> None:
        """Units beside x, for slopes and curvatures there to be seen in values."""
        for step in np.diag(_BESIDE * self.scales.lengths):
            phi = self.activations(x + step)
            lever = self.inverse @ phi
            rest = self.scales.variance * (1.0 - float(phi @ lever))
            if rest > self._novelty and self.units < self.units_max:
                self._add(x + step, phi, lever, rest)

    def _add(self, x: np.ndarray, phi: np.ndarray, lever: np.ndarray, rest: float) -> None:
        """A unit at x: what the others say of the value there, and the prior variance that they leave."""
        s2, t = self.scales.variance, self.tail
        left = max(rest / s2, 1e-12)
        h = self.units
        inverse = np.empty((h + 1, h + 1))
        inverse[:h, :h] = self.inverse + np.outer(lever, lever) / left
        inverse[:h, h] = inverse[h, :h] = -lever / left
        inverse[h, h] = 1.0 / left
        self.inverse = inverse
        self.centres = np.vstack([self.centres, x])
        self.noise.add_unit(phi)
        prior = np.zeros((t + h + 1, t + h + 1))
        prior[:-1, :-1] = self.prior
        prior[t:-1, -1] = prior[-1, t:-1] = s2 * phi
        prior[-1, -1] = s2
        self.prior = prior
        B, p, m = self.means.shape
        means, P = np.empty((B, p + 1, m)), np.empty((B, p + 1, p + 1))
        means[:, :p], P[:, :p, :p] = self.means, self.covariances
        means[:, p] = np.einsum("h,bhm->bm", lever, self.means[:, t:])
        cross = self.covariances[:, :, t:] @ lever
        P[:, :p, p] = P[:, p, :p] = cross
        P[:, p, p] = cross[:, t:] @ lever + rest
        self.means, self.covariances = means, P

    @property
    def mean(self) -> np.ndarray:
        """Coefficients (p, m) of the tail and of the units, the bank's mixture."""
        z = np.tensordot(self.chances, self.means, axes=1)
        return np.vstack([z[: self.tail], self.inverse @ z[self.tail :]])

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (p, p) of each output's coefficients, the bank's mixture."""
        apart = self.means - np.tensordot(self.chances, self.means, axes=1)
        P = np.tensordot(
            self.chances, self.covariances + apart @ apart.transpose(0, 2, 1) / apart.shape[2], 1
        )
        # by its root: the inverse would make rounding of P into variances below zero
        values, directions = np.linalg.eigh(P)
        root = block_diag(np.eye(self.tail), self.inverse) @ (directions * np.sqrt(np.maximum(values, 0.0)))
        return np.asarray(root @ root.T)

    def predict(self, X: np.ndarray) -> np.ndarray:
        """f (N, m) at X (N, n)."""
        phi = self._regressors.phi(X, self.theta)
        return np.asarray(np.hstack([self._regressors.tail_rows(X), phi]) @ self.mean)


def _derivatives(
    observation: Observation, theta: np.ndarray, lengths: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, float, float, np.ndarray]]:
    """Rows of an observation's slopes and curvatures that have a weight.

    Each is the tail's derivatives (1 + n,), the units' (h,), the prior variance over s², the weight, and what was
    read (m,).
    """
    n, x = len(lengths), observation.x[None]
    regressors = Settings(form="axis-aligned").regressors(n)
    if observation.slopes is not None:
        weights = np.broadcast_to(observation.slope_weight, n)
        rows = regressors.slopes(x, theta)[0]
        for k in np.flatnonzero(weights > 0):
            tail = np.eye(1 + n)[1 + k]
            yield tail, rows[k], 2.0 / lengths[k] ** 2, weights[k], observation.slopes[:, k]
    if observation.curvatures is not None:
        i, j = pairs(n)
        weights = np.broadcast_to(observation.curvature_weight, len(i)) * np.where(i == j, 1.0, 2.0)
        variances = np.where(i == j, 12.0, 4.0) / (lengths[i] * lengths[j]) ** 2
        rows = regressors.curvatures(x, theta)[0]
        for k in np.flatnonzero(weights > 0):
            yield np.zeros(1 + n), rows[k], variances[k], weights[k], observation.curvatures[:, k]


def _transitions(B: int) -> np.ndarray:
    """Probabilities (B, B) of the regime j after i."""
    T = np.full((B, B), (1.0 - _STAY) / (B - 2))
    np.fill_diagonal(T, _STAY)
    T[:, -1] = _JUMP
    T[-1] = _SETTLE / (B - 1)
    T[-1, -1] = 1.0 - _SETTLE
    return np.asarray(T / T.sum(axis=1, keepdims=True))
