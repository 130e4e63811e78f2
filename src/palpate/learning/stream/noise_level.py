"""Noise of a stream's readings, by place.

    log r(x) = a·[1, x] + log c(x)

a is a regression of squared noise with a logarithmic link, taken reading by reading (a Fisher-scoring step for each);
c, near 1, is what readings near each unit scatter by over that. Both forget slowly. A reading counts as much as the
innovation is made of noise rather than of what is not known of the map, and as two deviations at most.
"""

from __future__ import annotations

import numpy as np

from palpate.kernels import kernel

__all__ = ["NoiseLevel"]

_LOCAL = 10.0  # readings near a unit that count as much as the regression
_SHARPER = 4.0  # power of the units' activations: noise is looked for within half their widths
_FORGET = 0.997
_FIRST = 10.0  # readings that the first guess of the level is worth
_LEVEL = 1.0  # prior variance of the logarithm's slope over half a range
_BOUND = 4.0  # squared deviations that a reading counts as in the noise at most
_BOUNDED = 0.9205  # mean of a normal number's square, so bounded
_LONGEST = 1.0  # step of the logarithm at one reading
_SHARE = 0.01  # of a reading in the outputs' shares


class NoiseLevel:
    """Variance of a reading's noise by place, which begins with one for all, and shares of the m outputs in it."""

    def __init__(self, noise: float, inputs: int, outputs: int) -> None:
        self._log = np.zeros(1 + inputs)
        self._log[0] = np.log(noise)
        self._prior = np.diag(0.5 * np.append(_FIRST, np.full(inputs, 2.0 / _LEVEL)))
        self._information = np.zeros((1 + inputs, 1 + inputs))
        self._near = np.zeros(
            (0, 2)
        )  # readings near each unit, and the sum of their squares over the regression's
        self.shares = np.ones(outputs)  # mean one
        self.mean = noise

    def at(self, x: np.ndarray, phi: np.ndarray) -> float:
        """r at x (n,), where the units' activations are φ (h,)."""
        return float(_level(self._log, x) * _correction(self._near, phi))

    def add_unit(self, phi: np.ndarray) -> None:
        """One more unit, at a place where the others' activations are φ (h,)."""
        near = phi**_SHARPER
        self._near = np.vstack([self._near, near @ self._near / max(float(near.sum()), 1e-12)])

    def learn(
        self, x: np.ndarray, phi: np.ndarray, errors: np.ndarray, S: np.ndarray, chances: np.ndarray, r: float
    ) -> None:
        """Learn from innovations (B, m) of variances S (B,) by filters of these chances (B,), r being the noise."""
        parts = (self._log, self._information, self._prior, self._near, self.shares)
        share, square = _learn(*parts, x, phi, errors, S, chances, r)
        self.mean += 0.01 * share * (square - self.mean)


@kernel
def _level(log: np.ndarray, x: np.ndarray) -> float:
    """r by the regression at x (n,)."""
    value = log[0]
    for i in range(x.size):
        value += log[1 + i] * x[i]
    return float(np.exp(min(max(value, -60.0), 60.0)))


@kernel
def _correction(near: np.ndarray, phi: np.ndarray) -> float:
    """c, by what was read near the units."""
    total, seen, squares = 0.0, 0.0, 0.0
    for k in range(phi.size):
        weight = phi[k] ** _SHARPER
        total += weight
        seen += weight * near[k, 0]
        squares += weight * near[k, 1]
    if total < 1e-12:
        return 1.0
    return (squares / total + _LOCAL) / (seen / total + _LOCAL)


@kernel(allocates=True)
def _learn(
    log: np.ndarray,
    information: np.ndarray,
    prior: np.ndarray,
    near: np.ndarray,
    shares: np.ndarray,
    x: np.ndarray,
    phi: np.ndarray,
    errors: np.ndarray,
    S: np.ndarray,
    chances: np.ndarray,
    r: float,
) -> tuple[float, float]:
    """Change the regression, the sums near the units and the outputs' shares in place.

    Returns how much of the innovation is noise, and the expected squared noise.
    """
    B, m = errors.shape
    share, squares = 0.0, np.zeros(m)
    for i in range(B):
        own = min(r / S[i], 1.0)
        share += chances[i] * own * own
        for j in range(m):
            z2 = min(errors[i, j] ** 2 / S[i], _BOUND) / _BOUNDED
            squares[j] += chances[i] * (own * z2 + 1.0 - own)
    square = squares.mean()
    row = np.ones(1 + x.size)
    row[1:] = x
    information *= _FORGET
    information += 0.5 * share * np.outer(row, row)
    score = 0.5 * share * (r * square / _level(log, x) - 1.0)
    step = np.linalg.solve(information + prior, score * row)
    for i in range(log.size):
        log[i] += min(max(step[i], -_LONGEST), _LONGEST)
    ratio = r * square / _level(log, x)
    for k in range(phi.size):
        weight = phi[k] ** _SHARPER
        keep = 1.0 - (1.0 - _FORGET) * weight
        near[k, 0] = keep * near[k, 0] + share * weight
        near[k, 1] = keep * near[k, 1] + share * weight * ratio
    if m > 1 and square > 0:
        for j in range(m):
            shares[j] = max(shares[j] + _SHARE * (squares[j] / square - shares[j]), 1e-6)
        shares /= shares.mean()
    return share, r * square
