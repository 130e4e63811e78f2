"""Shares and relaxation times from a held force.

    F(t) = A_∞ + Σ A_i exp(−t/τ_i),    A ≥ 0,    γ_i = A_i/(A_∞ + Σ A_k)

For one to three branches: non-negative least squares on all choices of times from a logarithmic grid, then the best one
polished with the amplitudes eliminated, "variable projection" (Golub & Pereyra 1973) with the shortened derivative of
Kaufman 1975. Their number is the one of least N ln(RSS/N) + (2n + 1) ln N (Schwarz 1978).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import share
from palpate.learning.relaxation.force_record import Record
from palpate.surrogates.memories import Relaxation

__all__ = ["Identified", "identify", "identify_behind_pad"]

MOST = 3  # branches that a single record tells apart at best
PER_DECADE = 4  # of the grid: neighbouring exponentials a factor of 1.8 apart can hardly be told from one
BEYOND = 3.0  # the grid's ends over the longest and under the shortest time of the record
EXACT = 1e-9  # of the force: closer than this no record is known
_ACCURATE: dict[str, Any] = {
    "method": "lm",
    "xtol": 1e-13,
    "ftol": 1e-15,
    "gtol": 1e-15,
}  # as far as rounding lets it
_FARTHEST = 60.0  # logarithm of a time on the way of a search
UNSURE = 0.2  # relative standard error from which on a time counts as not told


@dataclass(frozen=True, eq=False)
class Identified:
    """The relaxation that a record tells, and how surely."""

    relaxation: Relaxation  # the branches that were found
    shares_error: np.ndarray  # (n,), standard errors of γ_i
    times_error: np.ndarray  # (n,), standard errors of τ_i, s
    noise: float  # standard deviation of the samples about the fit, over the force at the start
    scores: Mapping[int, float]  # Schwarz's score of each number of branches tried; the least was chosen

    def __str__(self) -> str:
        rows = zip(self.relaxation.terms, self.shares_error, self.times_error, strict=True)
        terms = ", ".join(f"{g:.3g} ± {dg:.1g} in {t:.3g} ± {dt:.1g} s" for (g, t), dg, dt in rows)
        return f"relaxes by {terms}; scatter {share(self.noise)}"


def identify(record: Record, *, most: int = MOST) -> Identified:
    """Find the branches of one record, as the probe feels them through its pad.

    Parameters
    ----------
    record : Record
        Force against time after the press.
    most : int
        Largest number of branches, 1 to 3.

    Raises
    ------
    UsageError
        If the record is too short, too coarse or too noisy to tell one of the times that it shows.
    """
    if not 1 <= most <= MOST:
        raise UsageError(f"{most} branches can't be told from one record.", fix="Ask for 1 to 3.")
    fits = {n: _fit(record, n) for n in range(1, most + 1) if len(record.times) > 2 * n + 1}
    scores = {n: _score(record, log_times) for n, log_times in fits.items() if log_times is not None}
    if not scores:
        raise UsageError(
            f"No relaxation time can be told from this record of {record.span:.3g} s.",
            why="The force falls along a straight line, as if by a time much longer than the record.",
            fix="Record longer.",
        )
    best = min(scores, key=lambda n: scores[n])
    log_times = fits[best]
    assert log_times is not None
    return _estimate(record, np.sort(log_times), scores)


def identify_behind_pad(records: Sequence[Record], *, most: int = MOST) -> Identified:
    """Find the branches of the body and the pad's energy U_a, from records at two depths or more.

    Parameters
    ----------
    records : sequence of Record
        Each with its `energy`; pressed suddenly.
    most : int
        Largest number of branches, 1 to 3.

    Raises
    ------
    UsageError
        If there are less than two different energies, a press took time, or the deepest record is not told.
    """
    energies = [record.energy for record in records]
    if len(set(energies)) < 2 or min(energies) <= 0 or any(record.rise for record in records):
        raise UsageError(
            "A pad shows only where records at different depths differ.",
            why=f"The energies are {energies} J.",
            fix="Give two records or more of sudden presses, each with its elastic energy U > 0.",
        )
    deepest = identify(records[int(np.argmax(energies))], most=most)
    n = len(deepest.relaxation.terms)

    def residual(x: np.ndarray) -> np.ndarray:
        relaxation = _relaxation_of(x, n)
        return np.concatenate([_miss(record, relaxation) for record in records])

    starts = [_unknowns(deepest.relaxation, np.log(scale * max(energies))) for scale in (1e-4, 1e-2, 1.0)]
    from scipy.optimize import least_squares

    fits = [least_squares(residual, start, jac="3-point", **_ACCURATE) for start in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    x, rest, J = best.x, best.fun, np.asarray(best.jac)
    noise = float(np.sqrt(rest @ rest / max(1, len(rest) - len(x))))
    error = noise * np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))
    relaxation = _relaxation_of(x, n)
    order = np.argsort(relaxation.times)
    shares, times = np.array(relaxation.shares)[order], np.array(relaxation.times)[order]
    behind_pad = Relaxation(tuple(zip(shares.tolist(), times.tolist(), strict=True)), relaxation.pad)
    return Identified(
        behind_pad, (shares * error[:n])[order], times * error[n : 2 * n][order], noise, deepest.scores
    )


def _unknowns(relaxation: Relaxation, log_pad: float) -> np.ndarray:
    shares = np.log(np.array(relaxation.shares) / relaxation.equilibrium)
    return np.concatenate([shares, np.log(relaxation.times), [log_pad]])


def _relaxation_of(x: np.ndarray, n: int) -> Relaxation:
    """Unknowns are ln γ_i/γ_∞, ln τ_i and ln U_a: whatever they are, the branches are sound."""
    parts = np.exp(np.minimum(x[:n], 30.0))
    terms = zip((parts / (1 + parts.sum())).tolist(), np.exp(x[n : 2 * n]).tolist(), strict=True)
    return Relaxation(tuple(terms), float(np.exp(np.clip(x[-1], -80.0, 80.0))))


def _miss(record: Record, branches: Relaxation) -> np.ndarray:
    """Deviation (N,) of a record over its force at the start, which is fitted."""
    left = branches.relaxation(record.times, record.energy)
    return np.asarray(record.forces / ((left @ record.forces) / (left @ left)) - left)


def _basis(record: Record, log_times: np.ndarray) -> np.ndarray:
    """Columns (N, 1 + n): what stays, and each branch's force for an amplitude of 1 N."""
    times = np.exp(np.clip(log_times, -_FARTHEST, _FARTHEST))
    decay = np.exp(-np.divide.outer(record.times, times)) * record.gain(times)
    return np.concatenate([np.ones((len(decay), 1)), decay], axis=1)


def _grid(record: Record) -> np.ndarray:
    shortest = np.diff(record.times, prepend=0.0)
    low, high = np.log(shortest[shortest > 0].min() / BEYOND), np.log(record.span * BEYOND)
    return np.linspace(low, high, 2 + int(PER_DECADE * (high - low) / np.log(10)))


def _start(record: Record, n: int) -> np.ndarray | None:
    """Best times (n,) of the grid whose amplitudes are not negative, as logarithms; None if there are none."""
    grid = _grid(record)
    # the data enter only through their projections on the columns of the grid
    R = np.linalg.qr(np.column_stack([_basis(record, grid), record.forces])).R
    best, least = None, np.inf
    for choice in itertools.combinations(range(1, len(grid) + 1), n):
        A, *_ = np.linalg.lstsq(R[:, (0, *choice)], R[:, -1], rcond=None)
        rest = R[:, -1] - R[:, (0, *choice)] @ A
        if A.min() >= 0 and rest @ rest < least:
            best, least = grid[np.array(choice) - 1], float(rest @ rest)
    return best


def _fit(record: Record, n: int) -> np.ndarray | None:
    """Logarithms (n,) of the best times; None if some amplitude turns negative or a time leaves the grid."""
    start = _start(record, n)
    if start is None:
        return None
    from scipy.optimize import least_squares

    size = float(np.linalg.norm(record.forces))  # so that tolerances are relative to the force

    def residual(x: np.ndarray) -> np.ndarray:
        return _rest(record, x) / size

    def jacobian(x: np.ndarray) -> np.ndarray:
        return _rest_slopes(record, x) / size

    x = np.asarray(least_squares(residual, start, jacobian, **_ACCURATE).x)
    low, high = _grid(record)[[0, -1]]
    inside = x.min() > low - np.log(BEYOND) and x.max() < high + np.log(10 * BEYOND)
    return x if inside and _amplitudes(record, x).min() > 0 else None


def _amplitudes(record: Record, log_times: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.lstsq(_basis(record, log_times), record.forces, rcond=None)[0])


def _rest(record: Record, log_times: np.ndarray) -> np.ndarray:
    """Return the residual force (N,) of the best amplitudes, N."""
    return np.asarray(record.forces - _basis(record, log_times) @ _amplitudes(record, log_times))


def _columns_slopes(record: Record, log_times: np.ndarray) -> np.ndarray:
    """Derivative (N, n) of each branch's column by the logarithm of its own time."""
    step = 1e-5
    change = _basis(record, log_times + step) - _basis(record, log_times - step)
    return np.asarray(change[:, 1:] / (2 * step))


def _rest_slopes(record: Record, log_times: np.ndarray) -> np.ndarray:
    """Derivative of what is left, (N, n), after Kaufman: the part of the columns' change that the basis misses."""
    Q = np.linalg.qr(_basis(record, log_times)).Q
    change = _columns_slopes(record, log_times) * _amplitudes(record, log_times)[1:]
    return np.asarray(-(change - Q @ (Q.T @ change)))


def _score(record: Record, log_times: np.ndarray) -> float:
    rest, count = _rest(record, log_times), len(record.times)
    square = max(float(rest @ rest) / count, (EXACT * np.abs(record.forces).max()) ** 2)
    return count * float(np.log(square)) + (2 * len(log_times) + 1) * float(np.log(count))


def _estimate(record: Record, log_times: np.ndarray, scores: Mapping[int, float]) -> Identified:
    """Return the relaxation with standard errors by the linearised model; raise where a time is unsure."""
    A, rest, n = _amplitudes(record, log_times), _rest(record, log_times), len(log_times)
    whole = A.sum()
    noise = float(np.sqrt(rest @ rest / (len(rest) - 2 * n - 1)))
    J = np.concatenate([_basis(record, log_times), _columns_slopes(record, log_times) * A[1:]], axis=1)
    covariance = noise**2 * np.linalg.pinv(J.T @ J)
    shares = A[1:] / whole
    by_amplitude = (np.eye(n + 1)[1:] - shares[:, None]) / whole
    shares_error = np.sqrt(np.diag(by_amplitude @ covariance[: n + 1, : n + 1] @ by_amplitude.T))
    relative = np.sqrt(np.diag(covariance)[n + 1 :])
    times = np.exp(log_times)
    _require_known_times(record, times, relative)
    relaxation = Relaxation(tuple(zip(shares.tolist(), times.tolist(), strict=True)))
    return Identified(relaxation, shares_error, times * relative, noise / whole, scores)


def _require_known_times(record: Record, times: np.ndarray, relative: np.ndarray) -> None:
    unsure = np.flatnonzero(relative > UNSURE)
    if len(unsure):
        worst = unsure[-1]
        side = "longer" if times[worst] > record.span / 3 else "finer and quieter"
        span, closest = record.span, np.diff(record.times).min()
        raise UsageError(
            f"A relaxation time of about {times[worst]:.2g} s can't be told from this record.",
            why=f"It is known to a factor of {np.exp(min(relative[worst], 20.0)):.2g}, from {len(record.times)}"
            f" samples over {span:.3g} s, the closest {closest:.2g} s apart.",
            fix=f"Record {side}, or ask for fewer branches by most={len(times) - 1 or 1}.",
        )
