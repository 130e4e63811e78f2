"""The noise of data from the differences of neighbouring samples: no model is fitted.

A sample is compared with the value at its place of a plane through its nearest neighbours, Σ_j a_j y_j with
Σ_j a_j = 1 and Σ_j a_j x_j = x. The noise adds σ² (1 + Σ_j a_j²) to the mean square of the difference; the map's
curvature adds about the fourth power of the neighbours' distance. Differences of more and more neighbours
therefore lie on a line over that power, and the line begins at σ². Differences that cancel a plane are Spokoiny's
(2002, J. Multivariate Anal. 82, 111–133); the way back to no distance is that of the Gamma test (Stefánsson,
Končar & Jones 1997, Neural Comput. Appl. 5, 131–133).
"""

from __future__ import annotations

import numpy as np

__all__ = ["noise_variance", "spacing"]

_ASKED = 400  # samples that are compared with their neighbours: the estimate is then good to about a tenth
_SURE = 2.0  # standard errors by which the line must begin above zero to count as noise
_MOST = 0.7  # of the differences of the nearest that must be noise: curvature bends the line where it rules


def noise_variance(X: np.ndarray, Y: np.ndarray, seed: int = 0) -> float:
    """Return the variance σ² of the noise in Y (N, m) over X (N, n), mean of the outputs; 0 where none shows.

    Too few samples tell nothing, nor do samples so far apart that curvature hides the noise: then it is 0. A map
    that is no longer the same from one sample to the next can't be told from noise, and counts as noise.
    """
    N, n = X.shape
    sizes = [k for k in ((n + 2) * f // 2 for f in (3, 4, 5, 6, 8)) if k < N // 2]
    if len(sizes) < 3 or not np.ptp(Y):
        return 0.0
    rows = np.random.default_rng(seed).permutation(N)[:_ASKED]
    distance, near = _nearest(X, X[rows], max(sizes) + 1)
    differences, reach = np.empty((len(sizes), len(rows))), np.empty(len(sizes))
    for i, k in enumerate(sizes):
        differences[i] = _differences(X, Y, rows, near[:, 1 : k + 1])
        reach[i] = (distance[:, k] ** 4).mean()
    return _begin(reach, differences)


def _differences(X: np.ndarray, Y: np.ndarray, rows: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return squared differences (S,), each worth σ² where there is no curvature, mean of the outputs."""
    squared = np.empty(len(rows))
    for s, (i, j) in enumerate(zip(rows, near, strict=True)):
        basis = np.hstack([np.ones((len(j), 1)), X[j] - X[i]])
        a = np.linalg.pinv(basis)[0]
        squared[s] = ((Y[i] - a @ Y[j]) ** 2).mean() / (1.0 + a @ a)
    return squared


def _begin(reach: np.ndarray, differences: np.ndarray) -> float:
    """Return where the line through mean differences begins, if surely above zero; never above the least of them."""
    line = np.vstack([np.ones_like(reach), reach / reach.max()]).T if reach.max() > 0 else None
    means = differences.mean(axis=1)
    if line is None:  # all neighbours are duplicates: their difference is noise alone
        return float(means.min())
    weights = np.linalg.pinv(line)[0]
    begin = float(weights @ means)
    # the same samples are asked at each size, so their own beginnings scatter as the mean's does
    error = float((weights @ differences).std() / np.sqrt(differences.shape[1]))
    least = float(means.min())
    return min(begin, least) if begin > max(_SURE * error, _MOST * least) else 0.0


def spacing(X: np.ndarray) -> float:
    """Return the median distance of a sample to the nearest other one, 0 for one sample; duplicates don't count."""
    X = np.unique(X, axis=0)
    if len(X) < 2:
        return 0.0
    return float(np.median(_nearest(X, X, 2)[0][:, 1]))


def _nearest(X: np.ndarray, places: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    from scipy.spatial import cKDTree

    distance, near = cKDTree(X).query(places, count)
    return np.asarray(distance), np.asarray(near)
