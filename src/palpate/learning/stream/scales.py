"""Scales of a map, from some of its readings: how far it carries along each input, how large it is, and the noise.

The readings are those of a Gaussian process with an affine tail,

    y ~ N(0, s² (Φ + t² [1, X][1, X]ᵀ + η D)),   Φ = exp(−‖(x − x')/ℓ‖²),   D the readings' relative noise

and ℓ, η have the largest posterior density, s² in closed form. The search is a pattern search (Hooke & Jeeves 1961)
over log ℓ and log η, one density at a time, so that a stream can pay for it in small portions.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

__all__ = ["Scales", "search_scales"]

_TAIL = 10.0  # t², in the search
_TAIL_SHARE = 0.25  # of the outputs' variance: prior variance of the tail's coefficients, in the filters
_LENGTH, _LENGTH_SPREAD = 1.0, 1.0  # prior of ℓ, a lognormal: its median and the deviation of its logarithm
_NOISE, _NOISE_SPREAD = 0.01, 3.0  # and of η
_SHORTEST, _LONGEST = 0.05, 6.0
_NOISES = (1e-8, 10.0)  # bounds of η
_LEAST = 1e-6  # of s²: outputs are scaled to about 1
_FIRST_STEP, _LAST_STEP = 0.8, 0.1  # of the logarithms
_MOST = 200  # densities of one search
_STRANGE = 6.0  # robust deviations of a left-out error from which a reading is left aside
_ASIDE = 0.2  # share of the readings that may be


@dataclass(frozen=True, eq=False)
class Scales:
    """Scales of a map, in scaled inputs and outputs."""

    # (n,) ℓ: distances along each input over which the map's values are alike; widths of the units
    lengths: np.ndarray
    variance: float  # s², prior variance of what the affine tail does not explain
    noise: float  # η s², variance of a reading
    tail: float  # prior variance of the affine tail's coefficients
    centre: np.ndarray  # (m,) prior mean of the map

    @classmethod
    def vague(cls, inputs: int, outputs: int) -> Scales:
        """Return the scales to begin with, for outputs of about 1."""
        return cls(np.ones(inputs), 0.5, 0.01, _TAIL_SHARE, np.zeros(outputs))


def search_scales(
    X: np.ndarray, Y: np.ndarray, noise: np.ndarray, start: Scales
) -> Generator[None, None, tuple[Scales, float]]:
    """Search the likeliest scales, yielding after every density that was computed.

    The readings X (N, n) and Y (N, m) are in scaled quantities; `noise` (N,) is D, their variances over the mean
    variance. Returned are the likeliest, and by how much its log density is above the start's.
    """
    v = np.log(np.append(start.lengths, start.noise / start.variance))
    low = np.log(np.append(np.full(X.shape[1], _SHORTEST), _NOISES[0]))
    high = np.log(np.append(np.full(X.shape[1], _LONGEST), _NOISES[1]))
    v = np.clip(v, low, high)
    right = _plausible(X, Y - np.median(Y, axis=0), noise, v)
    X, Y, noise = X[right], Y[right], noise[right]
    centre = Y.mean(axis=0)
    Y = Y - centre
    yield
    best = first = _log_density(X, Y, noise, v)[0]
    yield
    step, count = _FIRST_STEP, 1
    while step > _LAST_STEP and count < _MOST:
        before = v.copy()
        for i in range(len(v)):
            for sign in (1.0, -1.0):
                tried = v.copy()
                # noise varies by orders of magnitude
                tried[i] += sign * step * (3.0 if i == len(v) - 1 else 1.0)
                tried = np.clip(tried, low, high)
                value = _log_density(X, Y, noise, tried)[0]
                count += 1
                yield
                if value > best:
                    best, v = value, tried
                    break
        if np.array_equal(v, before):
            step /= 2.0
            continue
        tried = np.clip(2.0 * v - before, low, high)
        value = _log_density(X, Y, noise, tried)[0]
        count += 1
        yield
        if value > best:
            best, v = value, tried
    variance = _log_density(X, Y, noise, v)[1]
    tail = max(_TAIL_SHARE * float(Y.var(axis=0).mean()), 0.1 * variance)
    found = Scales(np.exp(v[:-1]), variance, variance * float(np.exp(v[-1])), tail, centre)
    return found, best - first


def _covariance(X: np.ndarray, noise: np.ndarray, v: np.ndarray) -> np.ndarray:
    Z = X / np.exp(v[:-1])
    square = (Z**2).sum(axis=1)
    K = np.exp(-np.maximum(square[:, None] + square - 2.0 * Z @ Z.T, 0.0))
    K += _TAIL * (1.0 + X @ X.T)
    K.ravel()[:: len(K) + 1] += np.exp(v[-1]) * noise + 1e-10
    return np.asarray(K)


def _log_density(X: np.ndarray, Y: np.ndarray, noise: np.ndarray, v: np.ndarray) -> tuple[float, float]:
    """Log posterior density of log ℓ and log η, and the likeliest s²."""
    factor, info = dpotrf(_covariance(X, noise, v), lower=1)
    if info:
        return -np.inf, 1.0
    N, m = Y.shape
    variance = max(float((Y * dpotrs(factor, Y, lower=1)[0]).sum()) / (N * m), _LEAST)
    # outputs are seldom independent: together they count as one reading each time
    likelihood = -0.5 * N * np.log(variance) - float(np.log(np.diag(factor)).sum())
    prior = -0.5 * (((v[:-1] - np.log(_LENGTH)) / _LENGTH_SPREAD) ** 2).sum()
    prior -= 0.5 * ((v[-1] - np.log(_NOISE)) / _NOISE_SPREAD) ** 2
    return likelihood + prior, variance


def _plausible(X: np.ndarray, Y: np.ndarray, noise: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Mask (N,) of the readings that the others foresee, leaving each out in turn."""
    factor, info = dpotrf(_covariance(X, noise, v), lower=1)
    if info or len(X) < 8:
        return np.ones(len(X), bool)
    inverse = np.tril(dpotri(factor, lower=1)[0])
    diagonal = np.diag(inverse)
    error = dpotrs(factor, Y, lower=1)[0] / np.sqrt(diagonal)[:, None]
    size = np.abs(error)
    worst = (size / np.maximum(1.4826 * np.median(size, axis=0), 1e-12)).max(axis=1)
    limit = max(_STRANGE, float(np.quantile(worst, 1.0 - _ASIDE)))
    return np.asarray(worst <= limit)
