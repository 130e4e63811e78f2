"""A network whose units sit at the data and share one metric: kernel interpolation, smoothed by a ridge.

    f(x) = T·[1, x] + Σ_k w_k g(‖s ∘ (x − x_k)‖²),   w = (K + λ I)⁻¹ (Y − [1, x] Tᵀ)

Where no small network follows a target this is what is left, and it is never bad. The input scales s and the ridge λ
maximise the Gaussian-process likelihood of a part of the data (Rasmussen & Williams 2006, eq. 5.8), all output
modes sharing kernel and variance, so that the variance drops out: with C = K + λ I and m modes

    L = ½ N m log tr(Yᵀ C⁻¹ Y) + ½ m log det C.

T is fitted beforehand in least squares; or its slopes are uncertain too, of a variance τ² over that of the kernel, and
then C = K + τ² X Xᵀ + λ I (Rasmussen & Williams 2006, section 2.7). A sample that is the mean of several has so much
less noise: λ I becomes λ diag(noise).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lapack

from palpate.network.radial import RadialFunction, radial

__all__ = ["CENTRES_MAX", "SCALES", "KernelLayer", "Metric", "likely_metric", "negative_likelihood"]

SCALES = (np.log(1e-3), np.log(30.0))
"""Logarithms of the least and the largest input scale."""

_RIDGES = (np.log(1e-11), np.log(10.0))
STARTS = (1e-5, 0.1)  # ridges from which the likelihood is climbed
CENTRES_MAX = 2000
"""Samples that become centres; the others are then fitted in least squares."""


@dataclass(frozen=True)
class Metric:
    """Radial function, input scales s (n,) and ridge λ of a kernel; τ² of its slopes, infinite if these are fitted."""

    radial: RadialFunction
    scales: np.ndarray
    ridge: float
    slopes: float = np.inf

    def kernel(self, X: np.ndarray, Z: np.ndarray) -> np.ndarray:
        """Return K (N, M) between X (N, n) and Z (M, n)."""
        return np.asarray(radial(self.radial, _squares(X * self.scales, Z * self.scales))[0])

    def covariance(self, X: np.ndarray, noise: np.ndarray | float = 1.0) -> np.ndarray:
        """Return C (N, N) of samples at X (N, n), each of whose noise is `noise` times the ridge."""
        C = self.kernel(X, X)
        C[np.diag_indices(len(C))] += self.ridge * noise
        return C if np.isinf(self.slopes) else C + self.slopes * (X @ X.T)

    def noise(self, X: np.ndarray, Y: np.ndarray) -> float:
        """Return the standard deviation of the noise, root mean square of the outputs, that the likelihood sees.

        X (N, n) and Y (N, k) are scaled; a plane is taken off, as for the likelihood.
        """
        one = _tail(X)
        Y = Y - one @ np.linalg.lstsq(one, Y, rcond=None)[0]
        return float(np.sqrt(self.ridge * max((Y * _solve_weights(self.covariance(X), Y)).mean(), 0.0)))

    def altered(self, scale: float, ridge: float) -> Metric:
        """Return the metric with all scales and the ridge multiplied by two factors."""
        return replace(self, scales=self.scales * scale, ridge=self.ridge * ridge)


@dataclass(frozen=True, eq=False)
class KernelLayer:
    """A fitted kernel layer in scaled quantities."""

    metric: Metric
    centres: np.ndarray  # (h, n), scaled inputs of the samples that carry a unit
    weights: np.ndarray  # (h, k), for k outputs
    tail: np.ndarray  # (1 + n, k), coefficients of one and of the inputs
    noise: np.ndarray | float = 1.0  # (h,) or one number: noise variance of each sample over the ridge

    @classmethod
    def likely(
        cls, metric: Metric, X: np.ndarray, Y: np.ndarray, noise: np.ndarray | float = 1.0
    ) -> KernelLayer:
        """Return the mean of the Gaussian process whose slopes are uncertain too, given X (N, n) and Y (N, k)."""
        mean = Y.mean(axis=0)
        weights = _solve_weights(metric.covariance(X, noise), Y - mean)
        return cls(metric, X, weights, np.vstack([mean, metric.slopes * (X.T @ weights)]), noise)

    @classmethod
    def fit(
        cls, metric: Metric, X: np.ndarray, Y: np.ndarray, *, seed: int = 0, most: int = CENTRES_MAX
    ) -> KernelLayer:
        """Return the layer of X (N, n) and Y (N, k): `most` samples become centres, the others are fitted too."""
        one = _tail(X)
        tail = np.linalg.lstsq(one, Y, rcond=None)[0]
        residual = Y - one @ tail
        if len(X) <= most:
            C = metric.kernel(X, X)
            C[np.diag_indices(len(C))] += metric.ridge
            return cls(metric, X, _solve_weights(C, residual), tail)
        chosen = np.random.default_rng(seed).choice(len(X), most, replace=False)
        Z = X[np.sort(chosen)]
        cross, own = metric.kernel(X, Z), metric.kernel(Z, Z)
        # the subset-of-regressors equations (Rasmussen & Williams 2006, eq. 8.14)
        return cls(
            metric,
            Z,
            _solve_weights(cross.T @ cross + max(metric.ridge, 1e-9) * own, cross.T @ residual),
            tail,
        )

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return scaled outputs (N, k) at scaled inputs X (N, n)."""
        return np.asarray(_tail(X) @ self.tail + self.metric.kernel(X, self.centres) @ self.weights)

    def units(self) -> tuple[np.ndarray, np.ndarray]:
        """Return factors A (h, n, n) and shifts b (h, n) of the same network, unit by unit."""
        h, n = self.centres.shape
        A = np.zeros((h, n, n))
        A[:, np.arange(n), np.arange(n)] = self.metric.scales
        return A, self.centres * self.metric.scales


def likely_metric(
    name: RadialFunction,
    X: np.ndarray,
    Y: np.ndarray,
    *,
    samples: int = 500,
    iterations: int = 40,
    start: Metric | None = None,
) -> Metric:
    """Return scales and ridge of the largest likelihood on the first `samples` of X (N, n) and Y (N, k).

    The likelihood is climbed from a metric near the optimum, `start`, or else from two ridges.
    """
    from scipy.optimize import minimize

    X, Y = X[:samples], Y[:samples]
    one = _tail(X)
    Y = Y - one @ np.linalg.lstsq(one, Y, rcond=None)[0]
    n = X.shape[1]
    scales = np.full(n, -0.5 * np.log(n)) if start is None else np.log(start.scales)
    if not np.any(Y) or len(X) < n + 3:
        return Metric(name, np.exp(scales), 1e-8)
    # noise has two explanations, and from one start only the interpolating one is found (Rasmussen & Williams 2006,
    # section 5.4.1)
    optima = [
        minimize(
            negative_likelihood,
            np.r_[scales, np.log(ridge)],
            args=(name, X, Y),
            jac=True,
            method="L-BFGS-B",
            bounds=[SCALES] * n + [_RIDGES],
            options={"maxiter": iterations},
        )
        for ridge in (STARTS if start is None else (start.ridge,))
    ]
    best = min(optima, key=lambda one: float(one.fun))
    return Metric(name, np.exp(best.x[:n]), float(np.exp(best.x[n])))


def negative_likelihood(
    logs: np.ndarray, name: RadialFunction, X: np.ndarray, Y: np.ndarray, noise: np.ndarray | float = 1.0
) -> tuple[float, np.ndarray]:
    """Return L per number observed and its gradient by log s, log λ and, where `logs` has it, log τ²."""
    (N, n), m = X.shape, Y.shape[1]
    Z, ridge = X * np.exp(logs[:n]), float(np.exp(logs[n]))
    C, slope, _ = radial(name, _squares(Z, Z))
    C[np.diag_indices(N)] += ridge * noise
    if len(logs) > n + 1:
        C += np.exp(logs[n + 1]) * (X @ X.T)
    L, failed = lapack.dpotrf(C, lower=1)
    if failed:
        return 1e10, np.zeros_like(logs)
    alpha = lapack.dpotrs(L, Y, lower=1)[0]
    fit = float((Y * alpha).sum())
    inverse = lapack.dpotri(L, lower=1)[0]
    inverse = np.tril(inverse) + np.tril(inverse, -1).T
    by_C = 0.5 * m * inverse - 0.5 * N * m * (alpha @ alpha.T) / max(fit, 1e-300)
    value = 0.5 * N * m * np.log(max(fit, 1e-300)) + m * float(np.log(np.diagonal(L)).sum())
    by_q = by_C * slope
    # Σ_ij M_ij 2 (z_i − z_j)² for symmetric M
    spread = 4.0 * (by_q.sum(axis=1) @ (Z * Z) - np.einsum("ni,ni->i", Z, by_q @ Z))
    by_slopes = [np.exp(t) * float(((by_C @ X) * X).sum()) for t in logs[n + 1 :]]
    by_ridge = ridge * float((noise * np.diagonal(by_C)).sum())
    return value / (N * m), np.r_[spread, by_ridge, by_slopes] / (N * m)


def _squares(X: np.ndarray, Z: np.ndarray) -> np.ndarray:
    return np.asarray(np.maximum((X * X).sum(1)[:, None] + (Z * Z).sum(1) - 2.0 * X @ Z.T, 0.0))


def _tail(X: np.ndarray) -> np.ndarray:
    return np.hstack([np.ones((len(X), 1)), X])


def _solve_weights(C: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Return C⁻¹ Y of a symmetric positive definite C, helped by jitter where rounding spoilt it."""
    jitter, size = 0.0, float(np.trace(C)) / len(C)
    while True:
        trial = C.copy(order="F")
        trial[np.diag_indices(len(C))] += jitter
        _, weights, failed = lapack.dposv(trial, Y, lower=1, overwrite_a=1)
        if not failed:
            return np.asarray(weights)
        jitter = max(10.0 * jitter, 1e-14 * size)
