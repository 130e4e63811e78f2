"""A Prony series from the record of a response that fades while a deformation is held: `fit_relaxation`.

    response(t) = A_∞ + Σ Aᵢ aᵢ exp(−t/τᵢ),    A ≥ 0,    γᵢ = Aᵢ/(A_∞ + Σ Aₖ)

with t from the end of the rise and aᵢ = (1 − exp(−T/τᵢ)) τᵢ/T, what a rise at an even rate over T leaves of a branch.
Non-negative least squares (Lawson & Hanson 1974) on a logarithmic grid of times finds the branches; neighbours on the
grid are one branch; amplitudes and logarithms of times are then refined together, and branches merged or dropped one by
one. The fewest are taken whose Schwarz criterion N ln(RSS/N) + (2n + 1) ln N (Schwarz 1978) is within 6 of the least:
more is strong evidence for another branch (Kass & Raftery 1995, J. Am. Stat. Assoc. 90, 773-795).
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate import checks
from palpate.errors import UsageError
from palpate.format import number, with_interval
from palpate.output_files import picture_metadata
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.relaxation_record import held_record
from palpate.physics.materials.specimen_tests import columns_of_numbers

__all__ = ["RelaxationFit", "fit_relaxation"]

PER_DECADE = 6  # times of the grid
BEYOND = 3.0  # the grid's ends under the shortest and over the longest time of the record
EXACT = 1e-9  # of the response: closer than this no record is known
STRONG = 6.0  # difference of Schwarz's criterion that is strong evidence
LEAST = 1e-6  # share of the response below which an amplitude of the grid is rounding


@dataclass(frozen=True, eq=False)
class RelaxationFit:
    """The relaxation that a record tells.

    Attributes
    ----------
    prony : PronySeries
        Shares and times, for `Viscoelastic` and for study files.
    instantaneous, equilibrium : float
        Response at once after an infinitely fast step, and in the end, in the unit of the record.
    shares, times : tuple of (float, float, float)
        Value and interval of each γᵢ, and of each τᵢ in s.
    error : float
        Root mean square of the residuals over the first response.
    notes : tuple of str
        Sentences on what the record does not tell.
    time, response : (N,) arrays
        The hold, from its begin, without the preload.
    ramp : float
        Time in s that the deformation took to rise.
    confidence : float
        Level of the intervals.
    """

    prony: PronySeries
    instantaneous: float
    equilibrium: float
    shares: tuple[tuple[float, float, float], ...]
    times: tuple[tuple[float, float, float], ...]
    error: float
    notes: tuple[str, ...]
    time: np.ndarray
    response: np.ndarray
    ramp: float
    confidence: float

    def model(self, time: ArrayLike) -> np.ndarray:
        """Return the fitted response at times in s after the rise, of any shape."""
        t = np.asarray(time, dtype=float)
        parts = [
            self.instantaneous * g * _left_of_ramp(self.ramp, tau) * np.exp(-t / tau)
            for g, tau in self.prony.terms
        ]
        return np.asarray(self.equilibrium + np.sum(parts, axis=0))

    def __str__(self) -> str:
        """Return the terms, the responses at once and in the end, and notes."""
        lines = [
            f"relaxes in {len(self.shares)} terms ({self.confidence:.0%} intervals); error {self.error:.2%} rms"
        ]
        for share, time in zip(self.shares, self.times, strict=True):
            lines.append(f"  share {with_interval(*share)} in {with_interval(*time)} s")
        lines.append(f"  at once {number(self.instantaneous)}, in the end {number(self.equilibrium)}")
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "prony": [list(term) for term in self.prony.terms],
            "shares": [list(entry) for entry in self.shares],
            "times": [list(entry) for entry in self.times],
            "instantaneous": self.instantaneous,
            "equilibrium": self.equilibrium,
            "confidence": self.confidence,
            "error": self.error,
            "notes": list(self.notes),
        }

    def toml(self) -> str:
        """Return the terms as a line of a material in a study file, whose Young's modulus is then that at once."""
        terms = ", ".join(f"[{share:.5g}, {time:.5g}]" for share, time in self.prony.terms)
        ratio = self.instantaneous / self.equilibrium if self.equilibrium > 0 else math.inf
        return (
            f"# relaxation fitted, {self.error:.2%} rms; the moduli beside it are those at once,\n"
            f"# {ratio:.4g} times those in the end\nprony = [{terms}]\n"
        )

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """Return a Matplotlib figure of the record and the fit over the logarithm of time; saved too, with a path."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 4), layout="constrained")
        axes = figure.subplots()
        shown = self.time > 0
        axes.semilogx(self.time[shown], self.response[shown], "o", markersize=3, label="measured")
        fine = np.geomspace(self.time[shown].min(), self.time.max(), 300)
        axes.semilogx(fine, self.model(fine), "-", label="fitted")
        for _, time in self.prony.terms:
            axes.axvline(time, color="0.7", linewidth=0.8, linestyle="--")
        axes.set_xlabel("time after the rise (s)")
        axes.set_ylabel("response (unit of the record)")
        axes.legend(frameon=False)
        axes.grid(alpha=0.3)
        if path is not None:
            figure.savefig(path, dpi=150, metadata=picture_metadata(path))
        return figure


def fit_relaxation(
    time: ArrayLike,
    response: ArrayLike,
    *,
    begin: float | None = None,
    ramp: float | None = None,
    preload: float | None = None,
    most: int = 6,
    confidence: float = 0.95,
) -> RelaxationFit:
    """Fit a Prony series to a response at a held deformation.

    Parameters
    ----------
    time : (N,) array
        Times in s. They count from the end of the rise, or, where the record has the rise, on any clock.
    response : (N,) array
        Stress or force, in any unit; its sign is that of the first value.
    begin : float, optional
        Time in s, on the record's clock, at which the deformation had risen and the hold began; rows before it are not
        fitted. By default found where the record has the rise, else 0.
    ramp : float, optional
        Time in s that the deformation took to rise at an even rate; 0 for a step too fast to matter. By default found
        where the record has the rise, else 0.
    preload : float, optional
        Response before the rise, in the record's unit, which is subtracted. By default that of the rows before the
        rise, or 0 where there are none.
    most : int
        Largest number of terms.
    confidence : float
        Level of the intervals, which are those of the linearised model; of times, in their logarithm.

    Raises
    ------
    UsageError
        For records that are too short or do not relax, or that begin within the hold on a clock of the machine, where
        only `begin` tells how long the hold has lasted.
    """
    t, y = columns_of_numbers("times", time, "responses", response)
    checks.fits("The time of the rise", 0.0 if ramp is None else ramp, "s", least=0)
    order = np.argsort(t, kind="stable")
    record = held_record(t[order], y[order], begin, ramp, preload)
    t, y, ramp = record.time, record.response, record.ramp
    scale = float(y[: max(1, len(y) // 50)].mean())
    if len(t) < 4 or not t[-1] > 0 or scale == 0 or most < 1:
        raise UsageError(
            f"This record of {len(t)} rows, {t[-1]:g} s from the begin of the hold on, can't be fitted with up to "
            f"{most} terms.",
            why="The response at the begin of the hold is not 0, and one term needs four rows.",
            fix="Check when the hold begins: begin= (--begin).",
        )
    y = y / scale
    if y[-max(1, len(y) // 20) :].mean() >= y[0] - 1e-3 * np.ptp(y):
        raise UsageError(
            "The response does not relax.",
            why=f"It goes from {scale:g} to {scale * y[-1]:g} while the deformation is held.",
            fix="Check the columns, and give the time at which the rise ended: begin= (--begin).",
        )
    branches = _from_grid(t, y, ramp)
    tried: list[tuple[float, np.ndarray, float]] = []
    while len(branches):
        x, rest, rss = _refine(t, y, ramp, branches)
        count = len(branches)
        rss = max(rss, len(t) * EXACT**2)
        score = len(t) * math.log(rss / len(t)) + (2 * count + 1) * math.log(len(t))
        if count <= most and len(t) > 2 * count + 1:
            tried.append((score, x, rest))
        branches = _fewer(x)
    if not tried:
        raise UsageError(
            f"The record has too few rows: {len(t)}.", why="One term needs four.", fix="Give a longer record."
        )
    least = min(score for score, _, _ in tried)
    _, branches, rest = next(entry for entry in reversed(tried) if entry[0] <= least + STRONG)
    result = _result(t, y, scale, ramp, branches, rest, confidence)
    return replace(result, notes=(*record.notes, *result.notes))


def _left_of_ramp(ramp: float, tau: Any) -> Any:
    """Return a, what an even rise over `ramp` seconds leaves of branches of times `tau`."""
    ratio = ramp / np.asarray(tau, dtype=float)
    return np.where(ratio > 1e-12, -np.expm1(-ratio) / np.maximum(ratio, 1e-12), 1.0)


def _columns(t: np.ndarray, ramp: float, times: np.ndarray) -> np.ndarray:
    """Return the response (N, n + 1) of unit amplitudes: of what stays, and of each branch."""
    branches = _left_of_ramp(ramp, times) * np.exp(-t[:, None] / times)
    return np.concatenate([np.ones((len(t), 1)), branches], axis=1)


def _from_grid(t: np.ndarray, y: np.ndarray, ramp: float) -> np.ndarray:
    """Return branches (n, 2), amplitude and time, of the non-negative least squares on a grid of times."""
    from scipy.optimize import nnls

    low, high = t[t > 0].min() / BEYOND, t[-1] * BEYOND
    times = np.geomspace(low, high, max(2, round(PER_DECADE * math.log10(high / low))))
    amplitudes = nnls(_columns(t, ramp, times), y, maxiter=50 * len(times))[0][1:]
    branches: list[tuple[float, float]] = []
    last = -2
    for i in np.flatnonzero(amplitudes > LEAST).tolist():
        amplitude, time = float(amplitudes[i]), float(times[i])
        if i == last + 1:  # neighbours stand for one time between them
            before, then = branches.pop()
            share = amplitude / (amplitude + before)
            amplitude, time = (
                amplitude + before,
                math.exp((1 - share) * math.log(then) + share * math.log(time)),
            )
        branches.append((amplitude, time))
        last = i
    return np.array(branches or [(float(np.ptp(y)), float(np.sqrt(low * high)))])


def _refine(
    t: np.ndarray, y: np.ndarray, ramp: float, branches: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Return branches (n, 2) refined together, in the order of their times, what stays, and the sum of squares."""
    from scipy.optimize import least_squares, nnls

    def solve(logs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        A = _columns(t, ramp, np.exp(logs))
        amplitudes = nnls(A, y)[0]
        return amplitudes, A @ amplitudes - y

    ends = math.log(t[t > 0].min() / BEYOND), math.log(100 * t[-1])
    start = np.clip(np.log(branches[:, 1]), ends[0] + 1e-6, ends[1] - 1e-6)

    def residuals(logs: np.ndarray) -> np.ndarray:
        return solve(logs)[1]

    fitted = least_squares(residuals, start, bounds=ends, xtol=1e-12, ftol=1e-14)
    order = np.argsort(fitted.x)
    amplitudes = solve(fitted.x)[0]
    refined = np.stack([amplitudes[1:][order], np.exp(fitted.x[order])], axis=1)
    return refined, float(amplitudes[0]), 2 * float(fitted.cost)


def _fewer(branches: np.ndarray) -> np.ndarray:
    """Return one branch less: without the one of no amplitude, or with the two nearest in time united."""
    if len(branches) == 1:
        return np.empty((0, 2))
    least = int(np.argmin(branches[:, 0]))
    if branches[least, 0] < LEAST:
        return np.delete(branches, least, axis=0)
    i = int(np.argmin(np.diff(np.log(branches[:, 1]))))
    (a, s), (b, u) = branches[i], branches[i + 1]
    united = [a + b, math.exp((a * math.log(s) + b * math.log(u)) / (a + b))]
    return np.insert(np.delete(branches, [i, i + 1], axis=0), i, united, axis=0)


def _result(
    t: np.ndarray,
    y: np.ndarray,
    scale: float,
    ramp: float,
    branches: np.ndarray,
    rest: float,
    confidence: float,
) -> RelaxationFit:
    from scipy.special import stdtrit

    kept = branches[branches[:, 0] > 0]
    amplitudes, times = np.append(rest, kept[:, 0]), kept[:, 1]
    whole, count = float(amplitudes.sum()), len(times)
    columns = _columns(t, ramp, times)
    # by the logarithms of the times, by differences
    slopes = amplitudes[1:] * (_columns(t, ramp, times * (1 + 1e-6)) - columns)[:, 1:] / 1e-6
    J = np.concatenate([columns, slopes], axis=1)
    residual = columns @ amplitudes - y
    scatter = float(residual @ residual) / max(len(t) - 2 * count - 1, 1)
    covariance = scatter * np.linalg.pinv(J.T @ J, rcond=1e-14)
    shares = amplitudes[1:] / whole
    to_shares = np.zeros((count, 1 + 2 * count))
    to_shares[:, : count + 1] = -shares[:, None] / whole
    to_shares[np.arange(count), 1 + np.arange(count)] += 1 / whole
    quantile = float(stdtrit(max(len(t) - 2 * count - 1, 1), 0.5 + confidence / 2))
    share_spread = quantile * np.sqrt(np.einsum("ij,jk,ik->i", to_shares, covariance, to_shares))
    time_spread = np.exp(np.minimum(quantile * np.sqrt(np.diag(covariance)[1 + count :]), 50.0))
    return RelaxationFit(
        PronySeries(tuple(zip(shares.tolist(), times.tolist(), strict=True))),
        whole * scale,
        float(amplitudes[0]) * scale,
        tuple((float(g), float(g - d), float(g + d)) for g, d in zip(shares, share_spread, strict=True)),
        tuple((float(s), float(s / f), float(s * f)) for s, f in zip(times, time_spread, strict=True)),
        float(np.sqrt(np.mean(residual**2))),
        tuple(_notes(t, ramp, times, time_spread, amplitudes[0] / whole)),
        t,
        y * scale,
        ramp,
        confidence,
    )


def _notes(t: np.ndarray, ramp: float, times: np.ndarray, spread: np.ndarray, rest: float) -> list[str]:
    """Return sentences on what the record does not tell."""
    notes = []
    first = max(ramp, float(t[t > 0].min()))
    if times.min() < first:
        notes.append(
            f"A term of {times.min():.3g} s is shorter than the rise or the first sample, {first:.3g} s: its share is "
            "a guess."
        )
    if times.max() > t[-1] / 2:
        notes.append(
            f"A term of {times.max():.3g} s is not finished within the record of {t[-1]:.4g} s: what stays in the end "
            "is told only roughly."
        )
    if rest < 1e-6:
        notes.append(
            "Nothing stays in the end: as a solid it would flow. A longer record tells the equilibrium."
        )
    notes += [
        f"The time {tau:.3g} s is hardly told (factor {f:.2g})."
        for tau, f in zip(times, spread, strict=True)
        if f > 2
    ]
    notes.append(
        "One record at one strain tells shares and times; whether they depend on the strain (and so are no Prony "
        "series) tells a second one."
    )
    return notes
