"""A Gaussian process of a scalar that is observed with its gradient, symmetric under a group of maps of the inputs.

The covariance of two values is

    k(x, x') = 1/c Σ_g [ (1 + ‖(x − G x' − t)/l‖²)^(−1/2) + a + b (x − p)·(G x' + t − p) ]

the inverse multiquadric of Hardy (1971) with a length l for each input, and a wide prior on an affine part about the
point p that the group leaves where it is. The sum goes over the c maps x' ↦ G x' + t of the group; it makes every
function of the process symmetric (Ginsbourger, Roustant & Durrande 2016). Values and slopes are jointly Gaussian, since
differentiation is linear; the covariances of slopes are derivatives of k (Solak, Murray-Smith, Leithead, Leith &
Rasmussen 2003). An observation of weight w has the noise σ²τ²/w. The process's own scale σ² has its most likely value
in closed form; lengths and τ are searched by the marginal likelihood (Rasmussen & Williams 2006, chapter 5).

References: R. L. Hardy (1971), J. Geophys. Res. 76, 1905–1915. D. Ginsbourger, O. Roustant, N. Durrande (2016), J.
Stat. Plan. Inference 170, 117–128. E. Solak et al. (2003), NIPS 15, 1057–1064. C. E. Rasmussen, C. K. I. Williams
(2006), Gaussian Processes for Machine Learning, MIT Press.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize
from scipy.sparse.csgraph import connected_components

from palpate.rbf.symmetric_units import Images

__all__ = ["GradientProcess", "Observations", "covariance", "fit_process", "no_symmetry", "tied_inputs"]

LEVEL, SLOPE = 25.0, 4.0
"""Prior variances a and b of the affine part, in units of the process's own variance."""

SHORTEST, LONGEST = 0.15, 6.0  # lengths in scaled inputs: half of a range is 1
QUIETEST, NOISIEST = 3e-4, 0.3  # bounds of the noise τ
BEGIN_LENGTH, BEGIN_NOISE = 1.0, 0.01  # length and noise from which a search begins
SEARCHED = 60  # observations from which lengths are searched: more cost time and move them little
# evaluations of the likelihood: for a new process, and from the last lengths
FIRST_STEPS, FURTHER_STEPS = 60, 16
_SPREAD = 0.4  # size of the search's first simplex, in logarithms
_AT_ONCE = 100_000  # numbers of each array that stands for several maps: more leave the cache
_MIXED = 1e-9  # entry of a map that mixes two inputs


@dataclass(frozen=True, eq=False)
class Observations:
    """Values and slopes of the scalar at N places."""

    X: np.ndarray  # (N, n), scaled inputs
    targets: np.ndarray  # (N, 1 + n), value and slopes by the scaled inputs
    weights: np.ndarray  # (N, 1 + n); zero where a target is not known

    def __len__(self) -> int:
        return len(self.X)

    def take(self, rows: np.ndarray) -> Observations:
        """Return some of the places, by indices or a mask."""
        return Observations(self.X[rows], self.targets[rows], self.weights[rows])


def no_symmetry(inputs: int) -> Images:
    """Return the group of the identity alone."""
    return Images(np.eye(inputs)[None], np.zeros((1, inputs)))


def covariance(A: np.ndarray, B: np.ndarray, lengths: np.ndarray, images: Images) -> np.ndarray:
    """Return the prior covariance (N, 1 + n, P, 1 + n) of values and slopes at A (N, n) with those at B (P, n).

    All inputs are scaled, also for the group of images. Inputs that the group mixes need one length l of the (n,), else
    the function is not symmetric.
    """
    n, inverse = A.shape[1], 1.0 / lengths**2
    out = np.zeros((len(A), 1 + n, len(B), 1 + n))
    fixed = images.shifts.mean(axis=0)  # the middle of the origin's images
    centred, placed = A - fixed, images.of(B)
    step = max(1, _AT_ONCE // max(len(A) * len(B) * n, 1))
    for i in range(0, len(placed), step):
        G, image = images.turns[i : i + step], placed[i : i + step]
        D = A[:, None] - image[:, None]
        E = D * inverse
        turned = E @ G[:, None]
        inner = 1.0 / (1.0 + (D * E).sum(axis=3))
        k = np.sqrt(inner)
        first = k * inner  # −2 dk/dq, by q = ‖x − G x' − t‖²/l²
        around = image - fixed
        out[:, 0, :, 0] += (k + LEVEL + SLOPE * centred @ around.transpose(0, 2, 1)).sum(axis=0)
        out[:, 0, :, 1:] += np.einsum("gxp,gxpb->xpb", first, turned)
        out[:, 0, :, 1:] += SLOPE * (centred @ G.sum(axis=0))[:, None]
        out[:, 1:, :, 0] += SLOPE * around.sum(axis=0).T - np.einsum("gxp,gxpa->xap", first, E)
        out[:, 1:, :, 1:] += np.einsum("gxpa,gxpb->xapb", (-3.0 * first * inner)[..., None] * E, turned)
        out[:, 1:, :, 1:] += np.einsum("gxp,gab->xapb", first, inverse[:, None] * G)
        out[:, 1:, :, 1:] += SLOPE * G.sum(axis=0)[:, None]
    return out / len(images.turns)


@dataclass(frozen=True, eq=False)
class GradientProcess:
    """The process, given observations.

    Where rounding makes the covariance indefinite, the properties raise `numpy.linalg.LinAlgError`: the noise is too
    small then.
    """

    seen: Observations  # what it is conditioned on
    images: Images  # the group
    lengths: np.ndarray  # (n,), l, in scaled inputs
    noise: float  # τ

    @cached_property
    def rows(self) -> np.ndarray:
        """Indices of the targets that are known, in all of them one after another."""
        return np.flatnonzero(self.seen.weights.ravel() > 0)

    @cached_property
    def _factor(self) -> np.ndarray:
        X, size = self.seen.X, self.seen.targets.size
        K = covariance(X, X, self.lengths, self.images).reshape(size, size)[np.ix_(self.rows, self.rows)]
        K[np.diag_indices(len(K))] += self.noise**2 / self.seen.weights.ravel()[self.rows]
        return np.asarray(cholesky(K, lower=True, check_finite=False))

    @cached_property
    def solution(self) -> np.ndarray:
        """The known targets times the inverse of their covariance, in units of σ²."""
        return np.asarray(cho_solve((self._factor, True), self.seen.targets.ravel()[self.rows]))

    @property
    def inverse(self) -> np.ndarray:
        """Inverse of the covariance of the known targets, in units of σ²."""
        return np.asarray(cho_solve((self._factor, True), np.eye(len(self._factor))))

    @cached_property
    def variance(self) -> float:
        """σ²: the scale of the covariance that makes the observations most likely."""
        return float(self.seen.targets.ravel()[self.rows] @ self.solution) / len(self.rows)

    @cached_property
    def misfit(self) -> float:
        """Negative logarithm of the marginal likelihood at that scale, less a constant."""
        return float(0.5 * len(self.rows) * np.log(self.variance) + np.log(np.diagonal(self._factor)).sum())

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return the expected value and slopes (P, 1 + n) at scaled inputs X (P, n)."""
        shape = (len(X), 1 + X.shape[1])
        prior = covariance(X, self.seen.X, self.lengths, self.images).reshape(X.size + len(X), -1)
        return np.asarray(prior[:, self.rows] @ self.solution).reshape(shape)

    def posterior(self, X: np.ndarray) -> np.ndarray:
        """Return the covariance (P(1 + n), P(1 + n)) of value and slopes at X (P, n), place by place."""
        size = X.size + len(X)
        prior = covariance(X, X, self.lengths, self.images).reshape(size, size)
        with_seen = covariance(self.seen.X, X, self.lengths, self.images).reshape(-1, size)[self.rows]
        half = np.linalg.solve(self._factor, with_seen)
        return np.asarray(self.variance * (prior - half.T @ half))

    def noise_variance(self, weights: np.ndarray) -> np.ndarray:
        """Return the noise σ²τ²/w of observations of these weights; infinite where the weight is zero."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.variance * self.noise**2 / weights)


def tied_inputs(images: Images) -> np.ndarray:
    """Return the number (n,) of the length of each input: inputs that the group mixes share one."""
    mixed = (np.abs(images.turns) > _MIXED).any(axis=0)
    return np.asarray(connected_components(mixed | mixed.T, directed=False)[1])


def fit_process(
    seen: Observations, images: Images, begin: GradientProcess | None = None, *, seed: int = 0
) -> GradientProcess:
    """Return the process whose lengths and noise make the observations most likely, by a coarse search.

    The search goes on from a process of fewer observations, if there is one, and looks at a part of many observations,
    which the seed decides. At least one place has a weight.
    """
    tied = tied_inputs(images)
    count = int(tied.max()) + 1
    some = seen
    if len(seen) > SEARCHED:
        rng = np.random.default_rng([seed, len(seen)])
        some = seen.take(np.sort(rng.choice(len(seen), SEARCHED, replace=False)))
    low = np.log([*[SHORTEST] * count, QUIETEST])
    high = np.log([*[LONGEST] * count, NOISIEST])
    start = np.log([*[BEGIN_LENGTH] * count, BEGIN_NOISE])
    if begin is not None:
        first = [int(np.flatnonzero(tied == i)[0]) for i in range(count)]
        start = np.log([*begin.lengths[first], begin.noise])

    def process(p: np.ndarray, of: Observations) -> GradientProcess:
        values = np.exp(np.clip(p, low, high))
        return GradientProcess(of, images, values[:-1][tied], float(values[-1]))

    def misfit(p: np.ndarray) -> float:
        outside = 10.0 * float(np.square(p - np.clip(p, low, high)).sum())
        try:
            return process(p, some).misfit + outside
        except np.linalg.LinAlgError:
            return 1e10

    steps = FIRST_STEPS if begin is None else FURTHER_STEPS
    simplex = np.vstack([start, start + _SPREAD * np.eye(len(start))])
    result = minimize(
        misfit, start, method="Nelder-Mead", options={"maxfev": steps, "initial_simplex": simplex}
    )
    return _definite(process(result.x, seen))


def _definite(process: GradientProcess) -> GradientProcess:
    """Return the process with as much more noise as makes its covariance definite in floating point."""
    while True:
        try:
            _ = process.variance
        except np.linalg.LinAlgError:
            process = replace(process, noise=3.0 * process.noise)
            continue
        return process
