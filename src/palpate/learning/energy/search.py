"""Networks of ℓ from several starts, grown unit by unit, and chosen by the leave-one-solve-out error.

A search judges by the mean over solves of what each one misses when it is left out, not by the root of the mean
square: a solve that alone decides a unit misses anything, and one such would outweigh all others.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.network.radial import RadialFunction
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import default
from palpate.rbf.filter.state import initial
from palpate.rbf.filter.step import observe
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.leave_one_out import leave_one_out_row_errors
from palpate.rbf.refinement.projection import Fit, project, span_of_units
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors
from palpate.rbf.symmetric_units import Images, SymmetricRegressors

__all__ = ["EnergyTrial", "Found", "LeftOut", "Problem", "Search"]

_WIDTHS = (0.2, 1.0)  # of first units, in scaled inputs: from an edge's reach to the whole range
_TOLERANCE = 1e-5
_RIDGE = 3e-6  # with 1e-10 some networks bend wildly between solves, with 1e-4 all miss more
_MOST = 0.98  # leverage; what a solve decides alone is judged by fifty times its residual
_ALL_OVER = 8.0  # times the finest: a unit that is nowhere wider stands on one solve
_PASSES = 3
_COMBED = (30, 0)  # iterations after needles are taken out, once and again; with none there can't be new ones
_STEP = 1.4  # growth of the number of units from one size to the next


@dataclass(frozen=True)
class EnergyTrial:
    """One network that was tried.

    Attributes
    ----------
    law, form, radial, start : str
    units : int
        Of it; with a symmetry, orbits.
    loo : float
        Leave-one-solve-out error: mean over solves of the weighted relative error of energy, force and stiffness.
    seconds : float
    """

    law: str
    form: str
    radial: str
    start: str
    units: int
    loo: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Problem:
    """What networks of ℓ are learnt from.

    Attributes
    ----------
    X : (N, n)
        Scaled inputs ξ.
    rows : dict
        What `refine` takes besides them.
    images : Images or None
        Of every solve.
    law : str
    ridge : float
        A penalty on weights.
    finest : (n,), optional
        Of scaled inputs, the shortest way over which a unit may change, 0 where that is any; None where all are.
    """

    X: np.ndarray
    rows: dict[str, np.ndarray]
    images: Images | None
    law: str
    ridge: float = _RIDGE
    finest: np.ndarray | None = None

    def regressors(self, form: str, radial: RadialFunction) -> Regressors:
        """Units of a form, with their images where there is a symmetry."""
        of = unit_form(form, self.X.shape[1])
        return (
            Regressors(of, radial)
            if self.images is None
            else SymmetricRegressors(of, radial, "affine", self.images)
        )

    def refined(
        self, theta: np.ndarray, regressors: Regressors, *, iterations: int, seconds: float | None = None
    ) -> Refined:
        """The refinement from units θ."""
        known: dict[str, Any] = dict(self.rows)
        return refine(
            *(self.X, known.pop("Y"), theta, regressors),
            **known,
            ridge=self.ridge,
            iterations=iterations,
            seconds=seconds,
            tolerance=_TOLERANCE,
        )

    def needles(self, refined: Refined) -> np.ndarray:
        """Units (h,) that are narrower than anything that a probe could feel: far so in one direction, or in all."""
        if self.finest is None or not len(refined.theta):
            return np.zeros(len(refined.theta), dtype=bool)
        felt = self.finest > 0
        factors = refined.regressors.form.factors(refined.theta)[0][:, :, felt] * self.finest[felt]
        sharpness = np.linalg.svd(factors, compute_uv=False)
        all_over = sharpness.shape[1] == felt.sum()
        return np.asarray((sharpness[:, 0] > 1.0) | (all_over & (sharpness[:, -1] > 1.0 / _ALL_OVER)))

    def fitted(self, refined: Refined) -> tuple[Rows, Fit]:
        """The least-squares problem of a refinement's units, and its solution."""
        known: dict[str, Any] = dict(self.rows)
        rows = Rows.of(refined.regressors, self.X, known.pop("Y"), **known)
        return rows, project(rows, refined.theta, self.ridge * rows.total)

    def missed(self, refined: Refined) -> LeftOut:
        """What a network misses of each solve that is left out; anything where its unknowns could fit all."""
        rows, fit = self.fitted(refined)
        if refined.theta.size + len(fit.tau) >= len(rows.targets):
            return LeftOut(rows, fit, np.full(rows.targets.shape, np.inf), rows.groups)
        span = span_of_units(rows, refined.theta, fit) if len(refined.theta) else None
        return LeftOut(rows, fit, leave_one_out_row_errors(rows, fit, basis=span, most=_MOST), rows.groups)

    def of(self, kept: np.ndarray) -> Problem:
        """The problem of some samples, (N,) true, alone."""
        count = len(self.X)
        some = {k: v[kept] if np.shape(v)[:1] == (count,) else v for k, v in self.rows.items()}
        return replace(self, X=self.X[kept], rows=some)

    def room(self, regressors: Regressors) -> int:
        """How many units so many solves can decide on: half as many unknowns as numbers known."""
        q = [
            1.0,
            (self.rows["slope_weight"] > 0).sum(1).mean(),
            (self.rows["curvature_weight"] > 0).sum(1).mean(),
        ]
        return int(sum(q) * len(self.X) / 2 / (1 + regressors.form.size))


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What is missed of solves that are left out.

    Attributes
    ----------
    rows : Rows
    fit : Fit
        Of all of them.
    errors : (R, 1)
        Of every weighted row, when its solve is left out.
    together : (N,) int
        Samples of one number were left out together.
    """

    rows: Rows
    fit: Fit
    errors: np.ndarray
    together: np.ndarray

    @property
    def mean(self) -> float:
        """Over solves, of the error of all that is known of one."""
        if not np.isfinite(self.errors).all():
            return float("inf")
        squares = np.bincount(self.rows.samples, (self.errors**2).sum(axis=1))
        return float(np.sqrt(squares / self.rows.scale**2) @ self.rows.scale**2 / self.rows.total)


@dataclass(frozen=True, eq=False)
class Found:
    """A network that was tried, and what it misses of solves that are left out.

    Attributes
    ----------
    network : Refined
    errors : (R, 1)
        As in `LeftOut`, without the fit that takes a hundred times the memory.
    error : float
        Their mean over solves.
    """

    network: Refined
    errors: np.ndarray
    error: float


@dataclass(eq=False)
class Search:
    """A search that keeps what it tried (`found`), and stops when its time is over.

    Attributes
    ----------
    problem : Problem
    deadline : float
        Of `time.monotonic`.
    seed : int
    """

    problem: Problem
    deadline: float
    seed: int = 0

    def __post_init__(self) -> None:
        self.trials: list[EnergyTrial] = []
        self.found: list[Found] = []
        self.best: Refined | None = None
        self.error = np.inf
        self._rng = np.random.default_rng(self.seed)

    @property
    def left(self) -> float:
        """Seconds left."""
        return self.deadline - time.monotonic()

    def tried(
        self, theta: np.ndarray, regressors: Regressors, start: str, iterations: int = 150
    ) -> tuple[Refined, float]:
        """A refinement from a start, recorded, and its error."""
        begun = time.monotonic()
        found = self._refined(theta, regressors, iterations)
        left_out = self.problem.missed(found)
        error = left_out.mean
        self.found.append(Found(found, left_out.errors, error))
        took = time.monotonic() - begun
        form, radial = regressors.form.name, regressors.radial
        self.trials.append(EnergyTrial(self.problem.law, form, radial, start, len(found.theta), error, took))
        if self.best is None or error < self.error:
            self.best, self.error = found, error
        return found, error

    def _refined(self, theta: np.ndarray, regressors: Regressors, iterations: int) -> Refined:
        """A refinement without needles: what has some is refined once more without them.

        A unit that stands on one solve alone and misses all others costs nothing where solves are left out, and makes
        the force ripple between them.
        """
        found = self.problem.refined(theta, regressors, iterations=iterations, seconds=max(self.left, 0.1))
        for more in _COMBED:
            if not (narrow := self.problem.needles(found)).any():
                break
            kept = found.theta[~narrow]
            found = self.problem.refined(kept, regressors, iterations=more, seconds=max(self.left, 0.1))
        return found

    def random(self, regressors: Regressors, count: int) -> np.ndarray:
        """Units (count, p) at samples drawn, of widths drawn."""
        X, rng = self.problem.X, self._rng
        places = X[rng.integers(len(X), size=count)] + rng.normal(0.0, 0.05, (count, X.shape[1]))
        widths = np.exp(rng.uniform(np.log(_WIDTHS[0]), np.log(_WIDTHS[1]), count))
        units = [
            regressors.form.unit(x, w, seed=int(rng.integers(2**31)))
            for x, w in zip(places, widths, strict=True)
        ]
        return np.array(units).reshape(count, regressors.form.size)

    def filtered(self, regressors: Regressors, count: int) -> np.ndarray:
        """Units (≤ count, p) that the sequential filter allocates and tunes on the solves as they come."""
        p, n = self.problem, self.problem.X.shape[1]
        plain = default()
        settings = replace(
            plain, form=regressors.form.name, radial=regressors.radial, tail="affine", units_max=count, error_min=0.01,
            error_rms_min=0.005, distance_max=0.6, distance_min=0.15, update="full",
        )  # fmt: skip
        state = initial(n, 1, settings)
        for _ in range(_PASSES):
            for i in self._rng.permutation(len(p.X)):
                one = {k: p.rows[k][i] for k in ("slopes", "slope_weight", "curvatures", "curvature_weight")}
                seen = Observation(p.X[i], p.rows["Y"][i], float(p.rows["weights"][i]), **one)
                state, _event = observe(state, seen, settings)
        return state.theta

    def grow(self, begin: Refined, error: float, units_max: int, target: float) -> None:
        """Sizes upwards from a network of a left-out `error`, each from the last one and more units, and random ones.

        The first size begins with the filter's units too.
        """
        best, regressors = begin, begin.regressors
        sizes = _sizes(len(begin.theta), min(units_max, self.problem.room(regressors)))
        for h in sizes:
            for start, theta in self._starts(best, regressors, h, filtered=h == sizes[0]):
                if self.left <= 0 or error <= target:
                    return
                found, missed = self.tried(theta, regressors, start)
                if missed < error:
                    best, error = found, missed

    def _starts(
        self, best: Refined, regressors: Regressors, h: int, *, filtered: bool
    ) -> Iterator[tuple[str, np.ndarray]]:
        more = h - len(best.theta)
        if more > 0:
            yield "grown", np.vstack([best.theta, self.random(regressors, more)])
        # a start of the filter is as good as a random one, and of many solves takes as long as several of these
        if filtered and h >= 4 and (units := self.filtered(regressors, h)).size:
            yield "filter", units
        yield "random", self.random(regressors, h)


def _sizes(least: int, most: int) -> list[int]:
    sizes, h = [], max(least, 2)
    while h <= most:
        sizes.append(h)
        h = max(h + 1, round(_STEP * h))
    return sizes
