"""The network of the modes' coefficients: from the affine map upwards, chosen by solves left out.

The targets are b = a/f, smooth down to first touch, with the weights f²: an error then counts as what it is in the
field. All coefficients share their units, and since the modes are orthonormal, the errors' squares add up to the
field's mean square.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.network.radial import RadialFunction
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.regressors import Regressors

__all__ = ["Coefficients", "FieldTrial", "parts_of", "searched"]

_RIDGE = 1e-9
_KINDS: tuple[tuple[str, RadialFunction], ...] = (
    ("axis-aligned", "inverse-multiquadric"),
    ("rotated", "inverse-multiquadric"),
    ("axis-aligned", "gaussian"),
)
_SIZES = (1, 2, 3, 4, 6, 8, 11, 15, 20, 27, 36, 48)
_FOLDS = 6
_GIVE_UP = 3  # sizes without a gain
_GAIN = 0.99


@dataclass(frozen=True)
class FieldTrial:
    """One network that was tried.

    Attributes
    ----------
    form, radial : str
        "at solves" for a unit at each.
    units : int
    loo : float
        Error of the field within its modes at solves left out: root mean square, in the field's unit.
    seconds : float
    """

    form: str
    radial: str
    units: int
    loo: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Coefficients:
    """What is to be learnt.

    Attributes
    ----------
    X : (N, n)
        Scaled inputs.
    along : (N, k)
        a, coefficients in the field's unit.
    rise : (N,)
        f > 0.
    groups : (N,) int
        Solves that are left out together.
    """

    X: np.ndarray
    along: np.ndarray
    rise: np.ndarray
    groups: np.ndarray

    @property
    def scale(self) -> float:
        """Of b, in the field's unit."""
        b = self.along / self.rise[:, None]
        return max(float(np.sqrt((self.rise**2 @ b**2).sum() / (self.rise**2).sum())), 1e-300)

    def refined(self, theta: np.ndarray, of: Regressors, seconds: float) -> Refined:
        """The refinement from units θ."""
        return self._refined(theta, of, seconds, np.ones(len(self.X), dtype=bool))

    def _refined(self, theta: np.ndarray, of: Regressors, seconds: float, kept: np.ndarray) -> Refined:
        return refine(
            *(self.X[kept], (self.along / self.rise[:, None] / self.scale)[kept], theta, of),
            weights=self.rise[kept] ** 2,
            groups=self.groups[kept],
            ridge=_RIDGE,
            iterations=100,
            tolerance=1e-5,
            seconds=seconds,
        )

    def left_out(self, theta: np.ndarray, of: Regressors, deadline: float) -> float:
        """Error in the field's unit of each part of the solves, when units θ are refined on the other parts.

        Root mean square over surface and solves; infinite where time is over. Leaving rows out of the linear
        weights alone would be cheaper, but says too little of few solves: there units overfit.
        """
        parts, total = parts_of(self.groups), 0.0
        if len(parts) < 2:
            return float("inf")
        for out in parts:
            left = deadline - time.monotonic()
            if left <= 0:
                return float("inf")
            found = self._refined(theta, of, left, ~out)
            answered = found.predict(self.X[out]) * (self.scale * self.rise[out])[:, None]
            total += float(((answered - self.along[out]) ** 2).sum())
        return float(np.sqrt(total / len(self.X)))


def parts_of(groups: np.ndarray) -> list[np.ndarray]:
    """Masks (N,) of the solves that are left out together: whole groups, at most six parts."""
    _, own = np.unique(groups, return_inverse=True)
    folds = min(_FOLDS, int(own.max()) + 1)
    return [own.ravel() % folds == fold for fold in range(folds)]


def searched(
    problem: Coefficients, *, units_max: int, seconds: float, target: float, seed: int
) -> tuple[Refined, float, tuple[FieldTrial, ...]]:
    """The best network, its left-out error in the field's unit, and all that was tried.

    Of each size the closed form picks the start, and sizes are compared by what is missed of solves left out.
    """
    deadline, rng = time.monotonic() + seconds, np.random.default_rng(seed)
    trials: list[FieldTrial] = []
    best, error, without, last = None, np.inf, 0, None
    for units in (0, *(h for h in _SIZES if h <= units_max)):
        begun = time.monotonic()
        if best is not None and (begun > deadline or error <= target or without >= _GIVE_UP):
            break
        each = [
            (problem.refined(theta, of, max(deadline - time.monotonic(), 0.1)), theta)
            for of, theta in _starts(last, units, problem.X, rng)
        ]
        last, theta = min(each, key=lambda pair: pair[0].loo)
        of = last.regressors
        missed = problem.left_out(theta, of, np.inf if best is None else deadline)
        trials.append(FieldTrial(of.form.name, of.radial, units, missed, time.monotonic() - begun))
        without = 0 if missed < _GAIN * error else without + 1
        if best is None or missed < error:
            best, error = last, missed
    assert best is not None  # the affine map was tried
    return best, error, tuple(trials)


def _starts(
    last: Refined | None, units: int, X: np.ndarray, rng: np.random.Generator
) -> Iterator[tuple[Regressors, np.ndarray]]:
    """The affine map alone, or units of every kind at solves drawn; and the last size's with some more."""
    kinds = _KINDS[:1] if units == 0 else _KINDS
    if last is not None and 0 < len(last.theta) < units:
        of = last.regressors
        yield of, np.vstack([last.theta, _drawn(of, units - len(last.theta), X, rng)])
    for form, radial in kinds:
        of = Regressors(unit_form(form, X.shape[1]), radial, "affine")
        yield of, _drawn(of, units, X, rng)


def _drawn(of: Regressors, count: int, X: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    places = X[rng.integers(len(X), size=count)]
    widths = np.exp(rng.uniform(np.log(0.5), np.log(2.0), count))
    units = [of.form.unit(x, w, seed=int(rng.integers(2**31))) for x, w in zip(places, widths, strict=True)]
    return np.array(units).reshape(count, of.form.size)
