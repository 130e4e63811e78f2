"""Kernels of the tracker: the mixture that its filters begin from, and what a reading teaches them."""

from __future__ import annotations

import numpy as np

from palpate.kernels import kernel

__all__ = ["measure", "mix"]


@kernel(allocates=True)
def mix(
    transitions: np.ndarray,
    chances: np.ndarray,
    means: np.ndarray,
    covariances: np.ndarray,
    prior: np.ndarray,
    rates: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Chances (B,), means (B, p, m) and covariances (B, p, p) from which the filters begin the next reading.

    Filter j begins from the mixture of all filters that may turn into it, by transitions (B, B), and then forgets at
    its rate. Who turns into the last one is as unsure as the prior (p, p).
    """
    B, p, m = means.shape
    last = B - 1
    ahead = chances @ transitions
    centre = means[np.argmax(chances)].copy()
    spread = np.empty((B, p, p))
    mixed, P = np.zeros((B, p, m)), np.zeros((B, p, p))
    for i in range(B):
        apart = np.ascontiguousarray(means[i] - centre)
        spread[i] = apart @ apart.T / m
    for j in range(B):
        for i in range(B):
            share = transitions[i, j] * chances[i] / ahead[j]
            if share < 1e-15:
                continue
            mixed[j] += share * (means[i] - centre)
            source = prior if j == last and i != last else covariances[i]
            for r in range(p):
                for c in range(r + 1):
                    P[j, r, c] += share * (source[r, c] + spread[i, r, c])
        own = mixed[j] @ mixed[j].T / m
        q = rates[j]
        for r in range(p):
            for c in range(r + 1):
                P[j, r, c] = (1.0 - q) * (P[j, r, c] - own[r, c]) + q * prior[r, c]
                P[j, c, r] = P[j, r, c]
        mixed[j] += centre
    return ahead, mixed, P


@kernel(allocates=True)
def measure(
    row: np.ndarray,
    rest: float,
    r: float,
    y: np.ndarray,
    shares: np.ndarray,
    wrong: float,
    spread: float,
    chances: np.ndarray,
    means: np.ndarray,
    covariances: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Teach every filter that row·z (p,) was read as y (m,); means and covariances change in place.

    The reading has noise of variance r, in shares (m,) of the outputs, and is an outlier with probability `wrong`, then
    `spread` deviations of the noise away as a Cauchy number is. `rest` is variance of the map that no unit explains.

    Returns errors (B, m), their variances S (B,), the chances (B,) that the reading is right, and new chances (B,).
    """
    B, p, m = means.shape
    errors, S = np.empty((B, m)), np.empty(B)
    right_chances, likelihoods = np.empty(B), np.empty(B)
    b2 = spread * spread * r
    for i in range(B):
        gain = covariances[i] @ row
        own = max(gain @ row, 0.0)
        S[i] = own + r + rest
        total, worst = 0.0, 0.0
        for j in range(m):
            foreseen = 0.0
            for k in range(p):
                foreseen += row[k] * means[i, k, j]
            errors[i, j] = y[j] - foreseen
            z2 = errors[i, j] ** 2 / (own + rest + r * shares[j])
            total += z2
            worst = max(worst, z2)
        # the outputs go together, so they count as one number; but one of them may be wrong alone
        z2 = max(total / m, worst / 9.0) if m > 1 else total
        right = (1.0 - wrong) * np.exp(-0.5 * min(z2, 1400.0)) / np.sqrt(2.0 * np.pi * S[i])
        other = wrong / (np.pi * np.sqrt(b2) * (1.0 + z2 * S[i] / b2))
        right_chances[i], likelihoods[i] = right / (right + other), right + other
        scale = 1.0 / (own + (r + rest) / max(right_chances[i], 1e-12))
        for k in range(p):
            K = scale * gain[k]
            for j in range(m):
                means[i, k, j] += K * errors[i, j]
            for c in range(p):
                covariances[i, k, c] -= K * gain[c]
    new = chances * likelihoods
    return errors, S, right_chances, new / new.sum()
