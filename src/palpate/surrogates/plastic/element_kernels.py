"""The loops behind `elements`: one even step of all of them, and where they are at rest."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

__all__ = ["advance", "follow", "free_step", "pull_after"]

_jit = njit(cache=True, nogil=True, error_model="numpy")
_HALVINGS = 80  # of the search for the free state: to the last bit of any bracket


@_jit
def _after(e, alpha, dh, dt, y, c, tau):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Elongation and slip of one element after an even step."""
    if tau < math.inf:
        x = min(dt / tau, 700.0)
        mean = -math.expm1(-x) / x if x > 0.0 else 1.0
        return e * math.exp(-x) + mean * dh, 0.0
    trial = e + dh
    over = abs(trial) - y - c * alpha
    if over <= 0.0:
        return trial, 0.0
    slip = over / (1.0 + c)
    return (trial - slip if trial > 0.0 else trial + slip), slip


@_jit
def _lost(e, alpha, slip, dh, dt, k, y, c, tau):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Energy that one element turns into heat during an even step, J; never negative."""
    if tau < math.inf:
        x = min(dt / tau, 700.0)
        if x <= 0.0:
            return 0.0
        # e(t) = A exp(−t/τ) + B
        B = dh / x
        A = e - B
        once, twice = -math.expm1(-x), -math.expm1(-2.0 * x)
        return max(k * (0.5 * A * A * twice + 2.0 * A * B * once + B * B * x), 0.0)
    if slip == 0.0:  # a spring's limit is infinite
        return 0.0
    return k * slip * (y + c * (alpha + 0.5 * slip))


@_jit
def pull_after(dh, dt, e, alpha, k, y, c, tau) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Σ k e, N, after an even step that is not taken."""
    pull = 0.0
    for i in range(k.size):
        pull += k[i] * _after(e[i], alpha[i], dh, dt, y[i], c[i], tau[i])[0]
    return float(pull)


@_jit
def advance(dh, dt, e, alpha, ledger, k, y, c, tau) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take an even step; returns Σ k e, N. The ledger has stored, lost, work and lost in this step, J."""
    before, stored, lost, pull = ledger[0], 0.0, 0.0, 0.0
    for i in range(k.size):
        after, slip = _after(e[i], alpha[i], dh, dt, y[i], c[i], tau[i])
        lost += _lost(e[i], alpha[i], slip, dh, dt, k[i], y[i], c[i], tau[i])
        e[i], alpha[i] = after, alpha[i] + slip
        stored += 0.5 * k[i] * after * after
        pull += k[i] * after
    ledger[0] = stored
    ledger[1] += lost
    ledger[2] += stored - before + lost
    ledger[3] = lost
    return float(pull)


@_jit
def free_step(dt, e, alpha, k, y, c, tau) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Change of h, m, after which nothing pulls: the force grows with h, so halving an interval finds it."""
    reach = 0.0
    for i in range(k.size):
        reach = max(reach, abs(e[i]))
    # by then every spring pushes the other way; one that relaxes meanwhile may need more
    low, high = -reach, reach
    for _ in range(_HALVINGS):
        if pull_after(low, dt, e, alpha, k, y, c, tau) <= 0.0:
            break
        low *= 2.0
    for _ in range(_HALVINGS):
        if pull_after(high, dt, e, alpha, k, y, c, tau) >= 0.0:
            break
        high *= 2.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if pull_after(middle, dt, e, alpha, k, y, c, tau) > 0.0:
            high = middle
        else:
            low = middle
    return float(0.5 * (low + high))


@_jit
def follow(stretch, steps, k, y, c, tau) -> np.ndarray:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Elongations (N, n) along a history."""
    e, alpha, out = np.zeros(k.size), np.zeros(k.size), np.zeros((stretch.size, k.size))
    last = 0.0
    for t in range(stretch.size):
        dh = stretch[t] - last
        last = stretch[t]
        for i in range(k.size):
            e[i], slip = _after(e[i], alpha[i], dh, steps[t], y[i], c[i], tau[i])
            alpha[i] += slip
            out[t, i] = e[i]
    return out
