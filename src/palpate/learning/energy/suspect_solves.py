"""Solves that contradict their neighbours: a solver that ended on another branch, a wrong factor, a damaged row.

A Gaussian process on ℓ = ln(U/U₀), conditioned on values and slopes, expects at each solve an energy and a force, and
knows how far it may be off there. A bad solve spoils that process too: it passes for noise. The
solves that are missed most when their series is left out are therefore taken out in turn, and the process is searched
anew without each. The one whose removal makes the rest most likely is suspect where what it says is improbable by the
rest, and differs by more than `LEAST`. It is set aside, and the search begins again. In the end those set aside are
judged by all others: one that only stood beside a bad solve comes back.

Taking out solve i, whose rows have weights w, is compared by the rest's misfit − ½ Σ ln w: its own rows then have a
broad density in units of their noise, as in the mean-shift model of outliers (Cook & Weisberg 1982, §2.2.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaincc

from palpate.format import share
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.gradient_process import GradientProcess, Observations, fit_process, no_symmetry
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import Baseline

__all__ = ["LEAST", "SuspectSolve", "observations", "suspect_solves"]

LEAST = 0.1
"""Relative error of energy and force from which a solve is called suspect: smaller ones may be the mesh's."""

_CHANCE = 0.01  # probability that a dataset without a bad solve shows one, were all errors Gaussian
_FEWEST = 8  # solves, of which fewer can't tell which one is bad
_CANDIDATES = 6  # solves that are taken out in turn, by what is missed of them
_SHARE = 0.2  # of the solves: with more bad ones nobody knows which are the good ones
_LIGHTEST = 0.5  # of an error where the mesh shows through: it counts less, but at least so much
_TOGETHER = 120  # solves that are judged by each other; more are dealt into parts


@dataclass(frozen=True)
class SuspectSolve:
    """A solve that contradicts its neighbours.

    Attributes
    ----------
    solve : int
        Number of the solve in the dataset, from 0.
    energy : float
        Its energy over the one that the other solves lead to expect.
    force : float
        Difference of its force from the expected one, relative to the force of the solve.
    """

    solve: int
    energy: float
    force: float

    def __str__(self) -> str:
        return (
            f"solve {self.solve} contradicts its neighbours: its energy is {self.energy:.2g} times what they say, its "
            f"force is off by {share(self.force)}"
        )


@dataclass(frozen=True, eq=False)
class _Verdict:
    """One solve that was taken out, and what the others say of it."""

    row: int
    score: float  # the less the better do the others go together
    error: np.ndarray  # (1 + n,), of value and slopes
    size: float  # relative error of energy and force, less where the mesh shows through
    chance: float  # probability of such an error

    def is_bad(self, chance: float) -> bool:
        """Return whether such an error is neither small nor to be expected once in 1/`chance` solves."""
        return self.size >= LEAST and self.chance <= chance


def observations(samples: EnergySamples, baseline: Baseline) -> Observations:
    """Return values and slopes of ℓ above a baseline as a Gaussian process takes them."""
    rows = samples.rows(baseline)
    weights = np.hstack([np.ones((len(samples), 1)), rows["slope_weight"]]) * rows["weights"][:, None]
    return Observations(samples.scaled, np.hstack([rows["Y"], rows["slopes"][:, 0]]), weights)


def suspect_solves(
    samples: EnergySamples, baseline: Baseline, images: Images | None
) -> tuple[SuspectSolve, ...]:
    """Return the solves that contradict the others, the worst of each part of the solves first.

    Energies are counted from the likeliest of the baseline's candidates.
    """
    symmetry = images or no_symmetry(len(samples.inputs))
    if len(samples) < _FEWEST:
        return ()
    seen = _likeliest(samples, baseline, symmetry)
    return tuple(
        _describe(samples, int(part[verdict.row]), verdict.error)
        for part in _parts(samples.groups)
        for verdict in _bad_ones(seen.take(part), samples.groups[part], symmetry)
    )


def _likeliest(samples: EnergySamples, baseline: Baseline, images: Images) -> Observations:
    """Return the observations above that candidate of a baseline which makes some of them most likely."""
    some = samples.take(_parts(samples.groups)[0])
    process = fit_process(observations(some, baseline), images)
    candidates = baseline.candidates()
    rivals = [replace(process, seen=observations(some, one)) for one in candidates]
    return observations(samples, candidates[int(np.argmin([one.misfit for one in rivals]))])


def _parts(groups: np.ndarray) -> list[np.ndarray]:
    """Return the indices of solves that are judged by each other: all, or whole series dealt at random."""
    count = math.ceil(len(groups) / _TOGETHER)
    number = np.random.default_rng(0).permutation(int(groups.max()) + 1) % count
    parts = [np.flatnonzero(number[groups] == k) for k in range(count)]
    return [part for part in parts if len(part) >= _FEWEST]


def _bad_ones(seen: Observations, groups: np.ndarray, images: Images) -> list[_Verdict]:
    """Return the bad solves, one after another judged without those before it, and in the end by all that are good."""
    good, bad = np.arange(len(seen)), []
    chance = _CHANCE / len(seen)
    for _ in range(max(int(_SHARE * len(seen)), 1)):
        verdict = _worst(seen.take(good), groups[good], images)
        if not verdict.is_bad(chance):
            break
        bad.append(int(good[verdict.row]))
        good = np.delete(good, verdict.row)
    verdicts = [replace(_judge(seen.take(np.r_[good, row]), images, len(good)), row=row) for row in bad]
    return [verdict for verdict in verdicts if verdict.is_bad(chance)]


def _worst(seen: Observations, groups: np.ndarray, images: Images) -> _Verdict:
    """Return the solve whose removal makes the others most likely."""
    process = fit_process(seen, images)
    order = np.argsort(-_surprise(process, groups), kind="stable")
    verdicts = [_judge(seen, images, int(row)) for row in order[:_CANDIDATES]]
    return min(verdicts, key=lambda one: one.score)


def _surprise(process: GradientProcess, groups: np.ndarray) -> np.ndarray:
    """Return the mean squared error (N,) of each solve, in deviations, when its series is left out.

    With the covariance K of all that is known, leaving out the rows B leads to the errors (K⁻¹)_BB⁻¹ (K⁻¹ y)_B of the
    covariance (K⁻¹)_BB⁻¹ (Sundararajan & Keerthi 2001, Neural Comput. 13, 1103–1118).
    """
    inverse, weighted = process.inverse, process.solution
    solve_of = process.rows // process.seen.targets.shape[1]
    surprise = np.zeros(len(groups))
    for group in np.unique(groups):
        block = np.flatnonzero(groups[solve_of] == group)
        spread = np.linalg.inv(inverse[np.ix_(block, block)])
        error, spread = spread @ weighted[block], process.variance * spread
        for i in np.unique(solve_of[block]):
            own = solve_of[block] == i
            surprise[i] = error[own] @ np.linalg.solve(spread[np.ix_(own, own)], error[own]) / own.sum()
    return surprise


def _judge(seen: Observations, images: Images, row: int) -> _Verdict:
    """Return what the other solves say of one, by the process that is likeliest without it."""
    others = np.arange(len(seen)) != row
    process = fit_process(seen.take(others), images)
    known = np.flatnonzero(seen.weights[row] > 0)
    score = process.misfit - 0.5 * float(np.log(seen.weights[row, known]).sum())
    place = seen.X[row : row + 1]
    error = seen.targets[row] - process.predict(place)[0]
    spread = process.posterior(place)[np.ix_(known, known)]
    spread += np.diag(process.noise_variance(seen.weights[row, known]))
    square = float(error[known] @ np.linalg.solve(spread, error[known]))
    weights = seen.weights[row, known]
    natural = np.sqrt(weights / weights[0]) * max(
        math.sqrt(weights[0]), _LIGHTEST
    )  # of slopes: errors of the force
    size, chance = float(np.linalg.norm(error[known] * natural)), float(gammaincc(len(known) / 2, square / 2))
    return _Verdict(row, score, error, size, chance)


def _describe(samples: EnergySamples, row: int, error: np.ndarray) -> SuspectSolve:
    """Return a suspect solve in terms of energy and force, from its errors (1 + n,) of ℓ and its slopes."""
    k, ratio = samples.felt, float(np.exp(error[0]))
    if not samples.moved[row]:
        return SuspectSolve(int(samples.numbers[row]), ratio, 0.0)
    force = samples.force[row, :k]
    # F = −E ∇ ln E: the expected force has the expected energy and the expected slope
    expected = (force + samples.energy[row] * error[1 : 1 + k] / samples.half[:k]) / ratio
    off = float(np.linalg.norm(force - expected)) / max(float(np.linalg.norm(force)), 1e-300)
    return SuspectSolve(int(samples.numbers[row]), ratio, off)
