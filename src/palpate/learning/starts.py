"""Units to begin a search with: drawn at samples, spread over them, or placed where a network still misses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from palpate.rbf.forms import Form
from palpate.rbf.refinement.refine import Refined

__all__ = ["random_units", "spread", "units_at_errors", "units_at_residuals"]


def random_units(
    form: Form,
    X: np.ndarray,
    count: int,
    rng: np.random.Generator,
    *,
    widths: tuple[float, float] = (0.2, 1.0),
    scatter: float = 0.0,
) -> np.ndarray:
    """Return units (count, p) at samples drawn from scaled inputs X (N, n), scattered about them by that deviation.

    The logarithm of a width is uniform between those of the least and the largest, in scaled inputs.
    """
    places = X[rng.integers(len(X), size=count)] + rng.normal(0.0, 1.0, (count, X.shape[1])) * scatter
    sigma = np.exp(rng.uniform(math.log(widths[0]), math.log(widths[1]), count))
    units = [form.unit(x, s, seed=int(rng.integers(2**31))) for x, s in zip(places, sigma, strict=True)]
    return np.array(units).reshape(count, form.size)


def units_at_residuals(
    X: np.ndarray, Y: np.ndarray, network: Refined, count: int, seed: int = 0
) -> np.ndarray:
    """Return units (count, p) where a network's error is large and other units are far, as wide as their spacing."""
    form, h = network.regressors.form, len(network.theta) + count
    error = ((Y - network.predict(X)) ** 2).sum(axis=1)
    width = 2.0 / h ** (1.0 / form.inputs)
    seeds = [1000 * seed + h + k for k in range(count)]
    return units_at_errors(form, X, error, np.full(count, width), spacing=width, seeds=seeds)


def units_at_errors(
    form: Form,
    X: np.ndarray,
    error: np.ndarray,
    widths: np.ndarray,
    *,
    spacing: float,
    seeds: Sequence[int] | None = None,
    rng: np.random.Generator | None = None,
) -> np.ndarray:
    """Return units (k, p) of given widths (k,), one after another at the sample of the largest error, far from others.

    The squared error (N,) at each scaled input X (N, n) counts times the squared distance to the nearest new unit, up
    to `spacing`, beyond which there is no gain. With `rng` samples are drawn in proportion to that, in place of the
    largest. `seeds` decide directions where the form has them.
    """
    distance = np.full(len(X), spacing**2)
    units = []
    for k, width in enumerate(widths):
        chance = 1.0 if rng is None else rng.exponential(size=len(X))
        i = int(np.argmax(error * distance * chance))
        seed = seeds[k] if seeds is not None else int(rng.integers(2**31)) if rng is not None else k
        units.append(form.unit(X[i], width, seed=seed))
        distance = np.minimum(distance, ((X - X[i]) ** 2).sum(axis=1))
    return np.array(units)


def spread(points: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of `count` points far from each other, by farthest-point selection (Gonzalez 1985)."""
    chosen = [int(np.argmin(points.sum(axis=1)))]
    distance = np.full(len(points), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.array(chosen)
