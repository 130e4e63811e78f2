"""Ratings of statements from 1 to 7: quartiles, and an ordinal model with people and kinds of expertise apart.

    logit P(rating ≤ k) = θₖ − (αₑ + βₑ꜀ + u),   u ~ N(0, τ²) of each person

αₑ is the intercept of an expertise e, βₑ꜀ what a body c adds to the reference among people of that expertise: exp(β) is
the ratio of the odds of a higher rating. u is integrated by Gauss–Hermite quadrature, and the likelihood maximized.
Two weak penalties keep it finite: ln τ keeps τ off zero (Chung et al. 2013), and α and β are normal with σ = 5, where
all ratings are apart. Intervals of 95 % are Wald's: of α, which is between people, with Student's t of as many degrees
of freedom as there are people beyond groups; of β, which is within people, normal.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logsumexp, ndtri
from scipy.stats import t as student

__all__ = ["RatingResult", "cumulative_logit", "rate"]

LARGEST = 7
REFERENCE = "reference"
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(15)
_WIDE = 5.0  # standard deviation of the prior of an effect, logits
_STEP = 1e-3  # of second differences
_LEAST = 1e-300  # probability

Interval = tuple[float, float, float]


@dataclass(frozen=True)
class RatingResult:
    """Ratings of a statement about a body by people of one expertise: quartiles of their own medians, and the model's.

    `odds` are ratios of the odds of a higher rating, with their 95 % interval, `against` the reference by the same
    people; of the reference, against the first expertise. None where there is nothing to compare, or one person.
    """

    statement: str
    condition: str
    expertise: str
    people: int
    quartiles: Interval
    odds: Interval | None
    against: str

    def __str__(self) -> str:
        low, middle, high = self.quartiles
        line = (
            f"  {self.condition:12} {self.statement:14} {self.expertise:10} median {middle:g}, "
            f"quartiles {low:g} … {high:g}, {self.people} people"
        )
        if self.odds is None:
            return line
        below, ratio, above = self.odds
        return f"{line}; odds of a higher rating × {ratio:.2g} ({below:.2g} … {above:.2g}) against {self.against}"


def cumulative_logit(counts: np.ndarray, design: np.ndarray, groups: int = 1) -> tuple[np.ndarray, float]:
    """Return effects (k, 3) in logits, each with its 95 % interval, and τ, of counts (people, conditions, ratings).

    `design` (people, conditions, k) says which effects act on an answer; people are of so many `groups`.
    """
    counts = counts[:, :, counts.sum(axis=(0, 1)) > 0]  # nobody's rating has no threshold
    cuts, k = counts.shape[2] - 1, design.shape[2]
    unknown = np.tile([-np.inf, 0.0, np.inf], (k, 1)), 0.0
    if not cuts:
        return unknown

    def loss(z: np.ndarray) -> float:
        cut = np.cumsum(np.concatenate([z[:1], np.exp(z[1:cuts])]))
        effects, tau = z[cuts : cuts + k], np.exp(z[-1])
        leaning = (design @ effects)[:, None, :, None] + tau * _NODES[None, :, None, None]
        below = expit(cut - leaning)
        edge = np.zeros((*below.shape[:3], 1))
        share = np.diff(np.concatenate([edge, below, edge + 1.0], axis=3), axis=3)
        log = (counts[:, None] * np.log(np.maximum(share, _LEAST))).sum(axis=(2, 3))
        value = logsumexp(log, axis=1, b=_WEIGHTS / _WEIGHTS.sum()).sum()
        return -float(value + z[-1] - 0.5 * (effects / _WIDE) @ (effects / _WIDE) - tau**2 / (2.0 * _WIDE**2))

    shares = np.cumsum(counts.sum(axis=(0, 1)))[:-1] / counts.sum()
    start = np.log(shares / (1.0 - shares))
    z = np.concatenate([start[:1], np.log(np.diff(start)), np.zeros(k + 1)])
    z = minimize(loss, z, method="BFGS").x
    curvature = _second_differences(loss, z)
    if np.linalg.eigvalsh(curvature)[0] <= 0.0:  # the search ended beside the maximum
        return unknown
    rows = slice(cuts, cuts + k)
    deviation = np.sqrt(np.diag(np.linalg.inv(curvature))[rows])
    between = np.ptp(design, axis=1).max(axis=0) == 0.0
    quantile = np.where(between, student.ppf(0.975, max(len(counts) - groups, 1)), ndtri(0.975))
    half = quantile * deviation
    return np.stack([z[rows] - half, z[rows], z[rows] + half], axis=1), float(np.exp(z[-1]))


def _second_differences(loss: Callable[[np.ndarray], float], z: np.ndarray) -> np.ndarray:
    steps = _STEP * np.eye(len(z))
    curved = np.empty((len(z), len(z)))
    for i, a in enumerate(steps):
        for j, b in enumerate(steps[: i + 1]):
            mixed = loss(z + a + b) - loss(z + a - b) - loss(z - a + b) + loss(z - a - b)
            curved[i, j] = curved[j, i] = mixed / (4.0 * _STEP**2)
    return curved


def rate(
    answers: Mapping[tuple[str, str], Sequence[int]], statement: str, expertise: Mapping[str, str]
) -> list[RatingResult]:
    """Return the results of a statement from its ratings by person and condition, and each person's expertise."""
    people = sorted({person for person, _ in answers})
    conditions = sorted({c for _, c in answers}, key=lambda c: (c != REFERENCE, c))
    kinds = sorted({expertise[p] for p in people})
    counts = np.zeros((len(people), len(conditions), LARGEST))
    for (person, condition), values in answers.items():
        np.add.at(counts[people.index(person), conditions.index(condition)], np.asarray(values) - 1, 1.0)
    own = np.array([kinds.index(expertise[p]) for p in people])
    others = len(conditions) - 1
    design = np.zeros((*counts.shape[:2], len(kinds) - 1 + len(kinds) * others))
    for row, kind in enumerate(own):
        if kind:
            design[row, :, kind - 1] = 1.0
        for c in range(others):
            design[row, 1 + c, len(kinds) - 1 + kind * others + c] = 1.0
    compared = conditions[0] == REFERENCE and len(people) > len(kinds) and design.shape[2] > 0
    effects = np.exp(cumulative_logit(counts, design, len(kinds))[0]) if compared else None
    results, medians = [], defaultdict[tuple[int, int], list[float]](list)
    for (person, condition), values in answers.items():
        medians[own[people.index(person)], conditions.index(condition)].append(float(np.median(values)))
    for (kind, c), middles in sorted(medians.items()):
        place = kind - 1 if c == 0 else len(kinds) - 1 + kind * others + c - 1
        odds = None if effects is None or place < 0 else effects[place]
        low, middle, high = np.quantile(middles, [0.25, 0.5, 0.75]).tolist()
        against = "the reference" if c else kinds[0]
        span = None if odds is None or not np.isfinite(odds).all() else (odds[0], odds[1], odds[2])
        results.append(
            RatingResult(
                statement, conditions[c], kinds[kind], len(middles), (low, middle, high), span, against
            )
        )
    return results
