"""The common data sets on which surrogates are compared.

``data1``: a cantilever-like map, 3 inputs -> 60 outputs, with saturation and a mild kink (500 train, 2,000 test).
``data2``: a smooth global map of rank 25, 6 inputs -> 3,000 outputs (2,000 train, 2,000 test).
``control(kind)``: 6 inputs -> 25 outputs that are not ridges: "quadratics" (tanh of quadratic forms), "gaussians"
(40 rotated Gaussians), "bumps" (40 rotated rational bumps); 2,000 train, 2,000 test.

Inputs lie in [-1, 1]. Centre the outputs by the training mean and scale them by one number (the training RMS);
relative RMSE = ||error|| / ||Y_test|| on those. Shape: X (N, n), Y (N, m), dimensionless.
"""

from __future__ import annotations

import numpy as np

__all__ = ["Samples", "control", "data1", "data2"]

Samples = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # X, Y to train on, X, Y to test on


def data1(seed: int = 20260701) -> Samples:
    """A beam under two tip forces with varying modulus: saturating deflections with a soft stop."""
    rng = np.random.default_rng(seed)

    def response(X: np.ndarray) -> np.ndarray:
        fx, fy, modulus = X[:, 0], 3.0 * X[:, 1], 1.25 + 0.75 * X[:, 2]
        s = np.linspace(0, 1, 301)
        curvature = (fy / modulus)[:, None] * (s - 0.5 * s**2) * np.exp(-0.4 * fx / modulus)[:, None]
        rotation = 0.5 * np.pi * np.tanh(2 / np.pi * curvature)  # saturates
        ds = s[1] - s[0]
        ux = np.cumsum(np.cos(rotation), 1)[:, 10::10] * ds - s[10::10]
        uy = np.cumsum(np.sin(rotation), 1)[:, 10::10] * ds
        uy = uy - 0.35 * np.maximum(0, uy - 0.45)  # soft stop: a mild kink
        return np.hstack([ux, uy])

    train, test = rng.uniform(-1, 1, (500, 3)), rng.uniform(-1, 1, (2000, 3))
    return train, response(train), test, response(test)


def data2(seed: int = 20260702, rank: int = 25) -> Samples:
    """A smooth field of few modes whose amplitudes are sums of ridges."""
    rng = np.random.default_rng(seed)
    w1, b1 = rng.normal(0, 0.9, (6, 40)), rng.normal(0, 0.5, 40)
    w2 = rng.normal(0, 1 / np.sqrt(40), (40, rank))
    z, c, w = np.linspace(0, 1, 3000), rng.uniform(0, 1, rank), rng.uniform(0.02, 0.15, rank)
    modes = np.exp(-(((z[None] - c[:, None]) / w[:, None]) ** 2)) * (0.85 ** np.arange(rank))[:, None]

    def response(X: np.ndarray) -> np.ndarray:
        return np.tanh(X @ w1 + b1) @ w2 @ modes

    train, test = rng.uniform(-1, 1, (2000, 6)), rng.uniform(-1, 1, (2000, 6))
    return train, response(train), test, response(test)


def control(kind: str, seed: int = 5, terms: int = 40) -> Samples:
    """Sums of terms that are not ridges: "quadratics", "gaussians" or "bumps"."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (4000, 6))
    latent = []
    for _ in range(terms):
        if kind == "quadratics":
            B = rng.normal(0, 0.45, (6, 6))
            form = np.einsum("ni,ij,nj->n", X, (B + B.T) / 2, X)
            latent.append(np.tanh(form + X @ rng.normal(0, 0.6, 6) + rng.normal(0, 0.5)))
        else:
            M = rng.normal(0, 0.55, (6, 6))
            q = (((X - rng.uniform(-1, 1, 6)) @ M.T) ** 2).sum(1)
            latent.append(np.exp(-q / 2) if kind == "gaussians" else 1 / (1 + q))
    Y = np.array(latent).T @ rng.normal(0, 1 / np.sqrt(terms), (terms, 25)) * 0.85 ** np.arange(25)
    return X[:2000], Y[:2000], X[2000:], Y[2000:]
