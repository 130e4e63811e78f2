"""Refinement: all centres and widths by Levenberg–Marquardt, weights and tail by least squares inside.

Variable projection (Golub & Pereyra 1973): for given centres and log widths θ the best weights and tail are a
linear least-squares solution, so only θ is searched. With the regressors Φ (N, c), Φ = Q R, and the projector
P = I − Q Qᵀ, the Gauss–Newton matrix in Kaufman's approximation (1975) is

    (Dᵀ P D) ∘ (W Wᵀ)

D holding ∂φ_k/∂θ_k and W the weights; the right-hand side is Dᵀ (residual Wᵀ). Neither grows with the number
of outputs. The sequential filter says how many units are needed and where; this buys the last digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, qr

from palpate.learning.gaussian import tail_row
from palpate.learning.settings import Tail

__all__ = ["Refined", "refine"]

_LONGEST = 1.0  # largest change of a log width, or of a centre in units of its width, in one iteration
_DAMPING = (1e-12, 1e12)
_MOST_LEVERAGE = 0.98  # a sample that decides its own fit says little; its residual counts fifty times


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined network in scaled quantities.

    Attributes
    ----------
    centres, widths : (h, n)
    weights : (h, m)
    tail : (p, m)
    rms : float
        Training error per scaled output.
    loo : float
        Leave-one-out error per scaled output: in closed form for weights and tail (Allen 1974), with the
        centres' and widths' degrees of freedom spread evenly over the samples.
    condition : float
        2-norm condition number of the regressors; large values mean that units nearly cancel.
    iterations : int
    converged : bool
        Whether the last steps brought no more gain; False means the iteration limit came first.
    """

    centres: np.ndarray
    widths: np.ndarray
    weights: np.ndarray
    tail: np.ndarray
    rms: float
    loo: float
    condition: float
    iterations: int
    converged: bool


@dataclass(frozen=True, eq=False)
class _Fit:
    """Least-squares solution for one θ: coefficients (c, m), basis Q (N, c), residual (N, m), cost."""

    coefficients: np.ndarray
    Q: np.ndarray
    residual: np.ndarray
    cost: float


def refine(
    X: np.ndarray,
    Y: np.ndarray,
    centres: np.ndarray,
    widths: np.ndarray,
    *,
    tail: Tail = "affine",
    ridge: float = 1e-13,
    iterations: int = 200,
) -> Refined:
    """Refine a network from a start.

    Parameters
    ----------
    X : (N, n)
        Scaled inputs.
    Y : (N, m)
        Scaled outputs.
    centres, widths : (h, n)
        Start, scaled; h = 0 fits the tail alone.
    tail : {"affine", "constant", "none"}
    ridge : float
        Penalty on squared weights, relative to N: it holds near-cancelling units together.
    iterations : int
        Limit on Levenberg–Marquardt iterations.

    Returns
    -------
    Refined
    """
    h = len(centres)
    T = tail_row(X, {"affine": 1 + X.shape[1], "constant": 1, "none": 0}[tail])
    theta = np.stack([centres, np.log(widths)])
    penalty = ridge * len(X)
    fit = _project(X, Y, T, theta, penalty)
    damping, done, count = 1e-2, h == 0, 0
    while not done and count < iterations:
        count += 1
        new, new_fit, damping = _improve(X, Y, T, theta, fit, penalty, damping)
        if new is None:
            done = True
        else:
            done = fit.cost - new_fit.cost < 1e-9 * fit.cost
            theta, fit = new, new_fit
    return _result(X, T, theta, fit, count, done)


def _activations(X: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """φ (N, h) and ∂φ_k/∂(μ_k, log σ_k) (N, h, 2n)."""
    centres, sigma = theta[0], np.exp(theta[1])
    t = (X[:, None, :] - centres) / sigma
    phi = np.exp(-(t * t).sum(axis=2))
    return phi, np.concatenate([t / sigma, t * t], axis=2) * (2.0 * phi)[:, :, None]


def _project(X: np.ndarray, Y: np.ndarray, T: np.ndarray, theta: np.ndarray, penalty: float) -> _Fit:
    h, p = theta.shape[1], T.shape[1]
    phi = _activations(X, theta)[0]
    # the tail carries a penalty of round-off size only, so that duplicate samples can't make R singular
    shrink = np.sqrt(np.r_[np.full(h, penalty), np.full(p, 1e-24)])
    Q, R = qr(np.vstack([np.hstack([phi, T]), np.diag(shrink)]), mode="economic", check_finite=False)
    Q = Q[: len(X)]
    C = np.linalg.solve(R, Q.T @ Y)
    residual = Y - np.hstack([phi, T]) @ C
    cost = float((residual**2).sum() + penalty * (C[:h] ** 2).sum())
    return _Fit(C, Q, residual, cost)


def _improve(
    X: np.ndarray, Y: np.ndarray, T: np.ndarray, theta: np.ndarray, fit: _Fit, penalty: float, damping: float
) -> tuple[np.ndarray | None, _Fit, float]:
    """One accepted Levenberg–Marquardt step, or None where no damping helps."""
    h, n = theta.shape[1:]
    D = _activations(X, theta)[1]
    W = fit.coefficients[:h]
    gradient = np.einsum("nk,nkp->kp", fit.residual @ W.T, D).ravel()
    flat = D.reshape(len(X), -1)
    projected = flat - fit.Q @ (fit.Q.T @ flat)
    G = (projected.T @ projected) * np.kron(W @ W.T, np.ones((2 * n, 2 * n)))
    scale = np.diag(G) + 1e-9 * max(float(np.diag(G).max()), 1e-300)
    while damping < _DAMPING[1]:
        try:
            step = cho_solve(cho_factor(G + np.diag(damping * scale)), gradient)
        except LinAlgError:
            damping *= 10.0
            continue
        new = theta + _bounded(step.reshape(h, 2, n).swapaxes(0, 1), theta)
        new_fit = _project(X, Y, T, new, penalty)
        if new_fit.cost < fit.cost:
            return new, new_fit, max(damping / 5.0, _DAMPING[0])
        damping *= 4.0
    return None, fit, damping


def _bounded(step: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """A step (2, h, n), shortened so that no width or centre leaps."""
    longest = max(float(np.abs(step[0] / np.exp(theta[1])).max()), float(np.abs(step[1]).max()))
    return step * min(1.0, _LONGEST / max(longest, 1e-300))


def _result(X: np.ndarray, T: np.ndarray, theta: np.ndarray, fit: _Fit, count: int, done: bool) -> Refined:
    h = theta.shape[1]
    # centres and widths were fitted too: their 2 h n numbers count as leverage, shared by all samples and outputs
    shared = 2.0 * theta[0].size / fit.residual.size
    leverage = np.minimum((fit.Q**2).sum(axis=1) + shared, _MOST_LEVERAGE)
    left_out = fit.residual / (1.0 - leverage)[:, None]
    regressors = np.hstack([_activations(X, theta)[0], T])
    return Refined(
        theta[0],
        np.exp(theta[1]),
        fit.coefficients[:h],
        fit.coefficients[h:],
        float(np.sqrt((fit.residual**2).mean())),
        float(np.sqrt((left_out**2).mean())),
        float(np.linalg.cond(regressors)) if regressors.size else 1.0,
        count,
        done,
    )
