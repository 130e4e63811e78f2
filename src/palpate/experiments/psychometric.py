"""The psychometric function: how often a person answers one way, by the level of the stimulus, and what its data say.

Two forms (Wichmann & Hill 2001, Perception & Psychophysics 63, 1293–1313), with Φ the normal distribution:

    signed    p = λ/2 + (1 − λ) Φ((x − μ + b o)/σ)     "the comparison is stiffer", x the signed difference
    correct   p = γ + (1 − γ − λ) Φ((x − μ)/σ)         the right answer, x the strength of the signal

λ is the lapse rate, γ the guess rate, and b a preference for the second interval in the unit of x; o is +1 where the
comparison came second and −1 where it came first. The point of subjective equality is μ; the just noticeable difference
(JND) of the signed form is Φ⁻¹(¾) σ. Where x is ln(K/K_ref), exp(JND) − 1 is the Weber fraction.

The posterior is computed on a grid, of many people at once. The prior of the lapse rate falls linearly to zero at 0.06,
with the mean 0.02: fixed at zero it would bias the slope. μ, b and ln σ are uniform over what the levels can show.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import ndtr, xlogy

from palpate import checks
from palpate.errors import UsageError

__all__ = ["JND", "Answers", "Estimate", "Goodness", "Psychometric"]

_Axes: TypeAlias = tuple[np.ndarray, ...]

JND = 0.6744897501960817
"""Just-noticeable difference over σ: Φ⁻¹(¾)."""
LAPSES = (0.0, 0.06)  # Wichmann & Hill 2001
_SIDE = 1 / 6  # largest side preference, over the span of the levels
_NARROWEST, _WIDEST = 1 / 25, 2.0  # σ over the span of the levels
_NODES = 4_000_000  # numbers that a chunk of people holds at once
_FINER = 8  # points of a marginal between two nodes of the grid
_SHOWN, _FINE = (0, 1, 2, 4), (0, 1, 4)  # axes with a marginal: μ, ln σ, λ, b; and those made finer
_COARSE = 0.5  # steps of a grid: a posterior narrower than that is not drawn by it
_REFINEMENTS = 6
_COARSE_POINTS = 19  # of a grid on which hundreds of repetitions are fitted
_LEAST = 1e-9  # probability that is never certain


@dataclass(frozen=True, eq=False)
class Answers:
    """Counts of answers of N people to R stimuli.

    Attributes
    ----------
    level : (R,)
        x of each stimulus.
    order : (R,)
        +1 where the comparison came second, −1 where it came first; 0 where that plays no part.
    yes : (N, R)
        Number of answers that p counts.
    total : (N, R)
        Number of all answers.
    """

    level: np.ndarray
    order: np.ndarray
    yes: np.ndarray
    total: np.ndarray

    def __post_init__(self) -> None:
        if not (self.yes.shape == self.total.shape == (len(self.yes), len(self.level))):
            raise UsageError(
                f"Answers of shape {self.yes.shape} are not those to {len(self.level)} stimuli.",
                fix="Pass one row a person and one column a stimulus.",
            )
        if ((self.yes < 0) | (self.yes > self.total)).any():
            raise UsageError("There are more answers of one kind than answers.", fix="Check the counts.")

    @classmethod
    def of_trials(
        cls, levels: np.ndarray, index: np.ndarray, order: np.ndarray, yes: np.ndarray, use: np.ndarray
    ) -> Answers:
        """Return the counts of trials (N, T): index among the levels, order ±1 or 0, answer, whether it counts."""
        n, m = len(index), len(levels)
        stimulus = index + m * (order > 0)
        total = np.zeros((n, 2 * m))
        hits = np.zeros((n, 2 * m))
        rows = np.broadcast_to(np.arange(n)[:, None], index.shape)
        np.add.at(total, (rows[use], stimulus[use]), 1.0)
        np.add.at(hits, (rows[use], stimulus[use]), yes[use].astype(float))
        sides = np.repeat([-1.0, 1.0], m) if (order != 0).any() else np.zeros(2 * m)
        return cls(np.tile(levels, 2), sides, hits, total)


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimates from the answers of N people; intervals have a lower end, a median and an upper end, (N, 3).

    Attributes
    ----------
    location : (N, 3)
        μ, in the unit of the levels.
    spread : (N, 3)
        JND of the signed form and σ of the other, in the unit of the levels.
    lapse : (N, 3)
        Lapse rate λ, from 0 to 1.
    side : (N, 3)
        Preference b for the second interval, in the unit of the levels.
    best : (N, 5)
        The most likely μ, σ, λ, γ and b on the grid.
    edge : (N,)
        Posterior weight at the ends of the grid of ln σ: large where the levels show no slope.
    """

    location: np.ndarray
    spread: np.ndarray
    lapse: np.ndarray
    side: np.ndarray
    best: np.ndarray
    edge: np.ndarray


@dataclass(frozen=True)
class Goodness:
    """Goodness of fit of one person.

    Attributes
    ----------
    deviance : float
        Twice the logarithm of the likelihood of perfect proportions over that of the fitted ones.
    p : float
        Share of repetitions, simulated from the fitted function, whose deviance is larger.
    """

    deviance: float
    p: float


@dataclass(frozen=True)
class Psychometric:
    """A form of the psychometric function, with what a task fixes and what is left free.

    Attributes
    ----------
    form : str
        ``"signed"`` or ``"correct"``.
    guess : float or (low, high)
        γ of the form ``correct``: 1/2 for two intervals, 1/3 for the odd one out; a range where it is free, as for
        "was there a lump?".
    lapse : float or (low, high)
        λ, or the range in which it is free.
    side : bool
        Whether a side preference is free; of the signed form alone.
    points : int
        Nodes of the grid along μ and along ln σ.
    """

    form: Literal["signed", "correct"] = "signed"
    guess: float | tuple[float, float] = 0.5
    lapse: float | tuple[float, float] = LAPSES
    side: bool = True
    points: int = 41
    _signed: bool = field(init=False, default=True, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "_signed", checks.one_of("The form", self.form, ("signed", "correct")) == "signed"
        )
        for what, value in (("The guess rate", self.guess), ("The lapse rate", self.lapse)):
            for end in np.atleast_1d(value):
                checks.fits(what, float(end), least=0.0, below=1.0)
        checks.fits("The number of nodes", self.points, least=5, whole=True)

    def probability(
        self,
        x: np.ndarray,
        mu: np.ndarray,
        sigma: np.ndarray,
        lapse: np.ndarray,
        guess: np.ndarray | float = 0.5,
        shift: np.ndarray | float = 0.0,
    ) -> np.ndarray:
        """Return p at levels x; `shift` is b o. All shapes are broadcast together."""
        core = ndtr((x - mu + shift) / sigma)
        if self._signed:
            return np.asarray(lapse / 2.0 + (1.0 - lapse) * core)
        return np.asarray(guess + (1.0 - guess - lapse) * core)

    def axes(self, levels: np.ndarray) -> _Axes:
        """Return the nodes of μ, ln σ, λ, γ and b for the span of these levels.

        Raises
        ------
        UsageError
            If all levels are the same.
        """
        low, high = float(levels.min()), float(levels.max())
        span = high - low
        if not span > 0.0:
            raise UsageError(
                "All stimuli have the same level.",
                why="A slope can't be seen at one level.",
                fix="Give at least two levels.",
            )
        mu = np.linspace(low, high, self.points)
        spread = np.linspace(np.log(_NARROWEST * span), np.log(_WIDEST * span), self.points)
        side = np.linspace(-_SIDE, _SIDE, 15) * span if self._signed and self.side else np.zeros(1)
        guess = np.array([0.0]) if self._signed else _nodes(self.guess, 7)
        return mu, spread, _nodes(self.lapse, 5), guess, side

    def _log_probabilities(self, answers: Answers, axes: _Axes) -> tuple[np.ndarray, np.ndarray]:
        """Return ln p and ln(1 − p) (R, G) of each stimulus at each node of a grid."""
        mu, spread, lapse, guess, side = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
        p = self.probability(
            answers.level[:, None], mu, np.exp(spread), lapse, guess, side * answers.order[:, None]
        )
        p = np.clip(p, _LEAST, 1.0 - _LEAST)
        return np.log(p), np.log1p(-p)

    def _log_prior(self, lapse: np.ndarray) -> np.ndarray:
        """Return the logarithm of the prior of the lapse rate at its nodes, for a grid of all five."""
        if np.ndim(self.lapse) == 0:
            return np.zeros(1)
        return np.asarray(np.log(np.max(self.lapse) - lapse)[:, None, None])

    def estimate(self, answers: Answers, share: float = 0.95) -> Estimate:
        """Return medians and intervals of that posterior share, and the most likely values, of all people.

        Who has answered so often that the grid is too coarse for them gets a finer one of their own.
        """
        axes = self.axes(answers.level)
        tails = np.array([(1.0 - share) / 2.0, 0.5, (1.0 + share) / 2.0])
        marginals, best = self._marginals(answers, axes)
        edge = marginals[1][:, [0, -1]].sum(axis=1) / marginals[1].sum(axis=1)
        quantiles = [_quantiles(axes[k], m, tails) for k, m in marginals.items()]
        for person in np.flatnonzero(_steps(marginals) < _COARSE):
            own = Answers(answers.level, answers.order, answers.yes[[person]], answers.total[[person]])
            finer, values, best[person] = self._refine(
                own, axes, {k: m[[person]] for k, m in marginals.items()}
            )
            for place, k in enumerate(marginals):
                quantiles[place][person] = _quantiles(finer[k], values[k], tails)[0]
        mu, spread, lapse, side = quantiles
        return Estimate(mu, (JND if self._signed else 1.0) * np.exp(spread), lapse, side, best, edge)

    def _marginals(self, answers: Answers, axes: _Axes) -> tuple[dict[int, np.ndarray], np.ndarray]:
        """Return the posterior (N, nodes) of μ, ln σ, λ and b by axis, and the most likely values (N, 5)."""
        on, off = self._log_probabilities(answers, axes)
        sizes, prior = tuple(len(a) for a in axes), self._log_prior(axes[2])
        parts, tops = list[list[np.ndarray]](), list[np.ndarray]()
        for rows in _chunks(len(answers.yes), on.shape[1]):
            yes, total = answers.yes[rows], answers.total[rows]
            log = (yes @ on + (total - yes) @ off).reshape(-1, *sizes) + prior
            flat = log.reshape(len(log), -1)
            top = flat.argmax(axis=1)
            weights = np.exp(flat - flat[np.arange(len(flat)), top][:, None]).reshape(-1, *sizes)
            parts.append([weights.sum(axis=tuple(j + 1 for j in range(5) if j != k)) for k in _SHOWN])
            tops.append(top)
        index = np.unravel_index(np.concatenate(tops), sizes)
        best = np.stack([a[i] for a, i in zip(axes, index, strict=True)], axis=1)
        best[:, 1] = np.exp(best[:, 1])
        joined = (np.concatenate(column) for column in zip(*parts, strict=True))
        return dict(zip(_SHOWN, joined, strict=True)), best

    def _refine(
        self, own: Answers, axes: _Axes, marginals: dict[int, np.ndarray]
    ) -> tuple[_Axes, dict[int, np.ndarray], np.ndarray]:
        """Return a grid about one person's posterior, that posterior, and the most likely values (5,)."""
        best = np.zeros((1, 5))
        for _ in range(_REFINEMENTS):
            if _steps(marginals)[0] >= _COARSE:
                break
            finer = list(axes)
            for k in _FINE:
                if len(axes[k]) > 1:
                    step, w = axes[k][1] - axes[k][0], marginals[k][0] / marginals[k][0].sum()
                    middle = float(w @ axes[k])
                    half = 5.0 * max(float(np.sqrt(w @ (axes[k] - middle) ** 2)), 0.3 * step)
                    low, high = max(axes[k][0], middle - half), min(axes[k][-1], middle + half)
                    finer[k] = np.linspace(low, high, len(axes[k]))
            axes = tuple(finer)
            marginals, best = self._marginals(own, axes)
        return axes, marginals, best[0]

    def goodness(self, answers: Answers, seed: int = 0, repeats: int = 200) -> Goodness:
        """Return the deviance of the first person's answers, and its p-value by so many simulated repetitions.

        Each repetition has the same stimuli, answers of the most likely function, and is fitted anew. Of adaptively
        placed stimuli the p-value is approximate: their placement isn't repeated.
        """
        asked = answers.total[0] > 0
        level, order, total = answers.level[asked], answers.order[asked], answers.total[:1, asked]
        own = Answers(level, order, answers.yes[:1, asked], total)
        if len(np.unique(level)) < 2:
            return Goodness(0.0, 1.0)
        coarse = replace(self, points=_COARSE_POINTS)  # the same for the answers and their repetitions
        on, off = coarse._log_probabilities(own, coarse.axes(own.level))
        best = int((own.yes @ on + (total - own.yes) @ off)[0].argmax())
        rng = np.random.default_rng(seed)
        drawn = rng.binomial(total[0].astype(int), np.exp(on[:, best]), (repeats, len(level))).astype(float)
        yes = np.vstack([own.yes, drawn])
        fitted = np.concatenate(
            [(yes[r] @ on + (total - yes[r]) @ off).max(axis=1) for r in _chunks(len(yes), on.shape[1])]
        )
        share = yes / total
        perfect = (xlogy(yes, share) + xlogy(total - yes, 1.0 - share)).sum(axis=1)
        deviance = 2.0 * (perfect - fitted)
        return Goodness(float(deviance[0]), float((1 + (deviance[1:] >= deviance[0]).sum()) / (1 + repeats)))


def _steps(marginals: dict[int, np.ndarray]) -> np.ndarray:
    """Return the least standard deviation (N,) of the posteriors of μ, ln σ and b, in steps of their grids."""
    least = np.full(len(marginals[0]), np.inf)
    for k in _FINE:
        nodes = np.arange(marginals[k].shape[1])
        if len(nodes) > 1:
            weights = marginals[k] / marginals[k].sum(axis=1, keepdims=True)
            mean = weights @ nodes
            least = np.minimum(least, np.sqrt(np.maximum(weights @ nodes**2 - mean**2, 0.0)))
    return least


def _nodes(value: float | tuple[float, float], count: int) -> np.ndarray:
    """Return the nodes of a rate: the middles of equal parts of its range, so that none is at an end."""
    if np.ndim(value) == 0:
        return np.atleast_1d(np.asarray(value, float))
    low, high = np.asarray(value, float)
    return np.asarray(low + (high - low) * (np.arange(count) + 0.5) / count)


def _chunks(rows: int, nodes: int) -> Iterator[slice]:
    """Yield parts of the rows whose grids fit into memory together."""
    step = max(1, _NODES // nodes)
    return (
        slice(a, min(a + step, rows))
        for a in itertools.takewhile(lambda a: a < rows, itertools.count(0, step))
    )


def _quantiles(nodes: np.ndarray, density: np.ndarray, tails: np.ndarray) -> np.ndarray:
    """Return quantiles (N, q) of densities (N, m) at nodes, by a spline of the density."""
    if len(nodes) == 1:
        return np.broadcast_to(nodes, (len(density), len(tails))).copy()
    fine = np.linspace(nodes[0], nodes[-1], _FINER * (len(nodes) - 1) + 1)
    values = np.maximum(CubicSpline(nodes, density, axis=1)(fine), 0.0)
    total = np.cumsum((values[:, 1:] + values[:, :-1]) / 2.0, axis=1)
    total = np.hstack([np.zeros((len(total), 1)), total])
    total /= total[:, -1:]
    return np.stack([np.interp(tails, row, fine) for row in total])
