"""What the six published experiments share: a run of the filter over given samples, judged on others.

The papers' settings are in the papers' units, so inputs and outputs go into `step` as they are. Our own forms run
beside them as anybody would use them: scaled, shuffled, their settings untouched.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.table import Claim, Column
from palpate.learning import Learner, Refining, Settings, State, default, initial, learn, refine, step
from palpate.learning.structure import grow
from palpate.network import Scaling
from palpate.rbf.filter.prediction import value
from palpate.rbf.forms import unit_form
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

__all__ = [
    "COLUMNS",
    "Problem",
    "Score",
    "claim",
    "filtered",
    "linear",
    "ours",
    "published",
    "refined",
    "rms",
    "row",
    "run",
    "scores",
    "streamed",
    "within",
]

COLUMNS = (
    Column("method", "method"),
    Column("units", "units"),
    Column("error", "error"),
    Column("published", "published: error / units"),
    Column("rerun", "re-run elsewhere"),
    Column("seconds", "CPU s a run", ".2f"),
)


@dataclass(frozen=True, eq=False)
class Problem:
    """One draw of an experiment.

    Attributes
    ----------
    X, Y : (N, n), (N, 1)
        Training samples in the papers' units.
    X_test, Y_test : (M, n), (M, 1)
    order : (T,) int
        Which training sample is presented at each instant.
    seed : int
    scale : float
        By which errors are divided: 1, or the standard deviation of the test outputs for a normalised RMSE.
    """

    X: np.ndarray
    Y: np.ndarray
    X_test: np.ndarray
    Y_test: np.ndarray
    order: np.ndarray
    seed: int = 0
    scale: float = 1.0

    def error(self, predicted: np.ndarray) -> float:
        """RMSE of predictions (M, 1) on the test samples."""
        return rms(predicted - self.Y_test) / self.scale

    @property
    def box(self) -> tuple[Range, ...]:
        """The training inputs' ranges."""
        return tuple(
            Range(f"x{i}", float(low), float(high), "1")
            for i, (low, high) in enumerate(zip(self.X.min(axis=0), self.X.max(axis=0), strict=True))
        )


@dataclass(frozen=True)
class Score:
    """Outcome of one run: units, test error, and its CPU time in seconds."""

    units: int
    error: float
    seconds: float


def rms(error: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt((error**2).mean()))


def run(problem: Problem, settings: Settings) -> State:
    """Fold `step` over the samples as they are presented, in the papers' units."""
    state = initial(problem.X.shape[1], problem.Y.shape[1], settings)
    for i in problem.order:
        state, _ = step(state, problem.X[i], problem.Y[i], settings, donate=True)
    return state


def filtered(problem: Problem, settings: Settings) -> Score:
    """Run the filter with a paper's settings."""
    began = time.process_time()
    state = run(problem, settings)
    seconds = time.process_time() - began
    return Score(state.units, problem.error(value(state, problem.X_test, settings)), seconds)


def ours(problem: Problem, passes: int) -> Score:
    """Learn with the default settings, through the public entry: scaled, shuffled anew for each pass.

    Up to three inputs units are rotated; for more that would take too many numbers per unit.
    """
    few = 1 < problem.X.shape[1] <= 3
    began = time.process_time()
    found = learn(
        problem.X,
        problem.Y,
        problem.box,
        [Quantity("y", "1")],
        settings=replace(default(), form="rotated") if few else default(),
        passes=passes,
        seed=problem.seed,
    )
    seconds = time.process_time() - began
    return Score(found.network.units, problem.error(found.network.predict(problem.X_test)), seconds)


def streamed(problem: Problem, every: int) -> Score:
    """Show the samples once to a learner with one iteration of bounded refinement in every so many observations."""
    began = time.process_time()
    settings = replace(default(), form="rotated")
    learner = Learner(
        problem.box,
        [Quantity("y", "1")],
        settings=settings,
        refining=Refining(every=every),
        seed=problem.seed,
    )
    for x, y in zip(problem.X, problem.Y, strict=True):
        learner.observe(x, y)
    network, seconds = learner.network, time.process_time() - began
    return Score(network.units, problem.error(network.predict(problem.X_test)), seconds)


def refined(
    problem: Problem,
    units: int,
    *,
    kind: str = "rotated",
    target: float = 0.0,
    ridge: float = 1e-13,
    iterations: int = 60,
) -> Score:
    """Grow and refine by variable projection up to so many units, or to a leave-one-out error.

    Noisy data want a ridge far above that of rounding errors.
    """
    began = time.process_time()
    scaling = Scaling.of(problem.box, problem.Y)
    xs, ys = scaling.scale_inputs(problem.X), scaling.scale_outputs(problem.Y)
    regressors = Regressors(unit_form(kind, xs.shape[1]))
    fit = partial(refine, ridge=ridge, iterations=iterations)
    found, _ = grow(xs, ys, regressors, target=target, units_max=units, fit=fit)
    seconds = time.process_time() - began
    predicted = found.predict(scaling.scale_inputs(problem.X_test))
    error = problem.error(predicted * scaling.output_scale + scaling.output_centre)
    return Score(len(found.theta), error, seconds)


def linear(problem: Problem) -> Score:
    """Affine least squares: what any network has to beat."""
    began = time.process_time()
    tailed = np.hstack([np.ones((len(problem.X), 1)), problem.X])
    found = np.linalg.lstsq(tailed, problem.Y, rcond=None)[0]
    predicted = np.hstack([np.ones((len(problem.X_test), 1)), problem.X_test]) @ found
    return Score(0, problem.error(predicted), time.process_time() - began)


def scores(problems: Iterable[Problem], how: Callable[[Problem], Score]) -> tuple[Score, ...]:
    """One score per draw."""
    return tuple(how(p) for p in problems)


def row(method: str, found: Sequence[Score], published: str = "–", rerun: str = "–") -> dict[str, Any]:
    """A row of the table: medians, and the range over the draws."""
    units, errors = [s.units for s in found], [s.error for s in found]
    several = len(found) > 1
    middle = statistics.median(units)
    return {
        "method": method,
        "units": f"{middle:g} [{min(units)}–{max(units)}]" if several and any(units) else f"{middle:g}",
        "error": f"{statistics.median(errors):.3g}"
        + (f" [{min(errors):.2g}–{max(errors):.2g}]" if several else ""),
        "published": published,
        "rerun": rerun,
        "seconds": statistics.median(s.seconds for s in found),
        "units_all": units,
        "error_all": errors,
    }


def published(method: str, figure: str = "–", rerun: str = "–") -> dict[str, Any]:
    """A row for a method that is not run here."""
    return {"method": method, "published": figure, "rerun": rerun}


def claim(what: str, found: Sequence[Score], *, error: float, units: float) -> list[Claim]:
    """Two claims: medians of error and units at most these."""
    return [
        Claim(f"{what}, median error", (statistics.median(s.error for s in found),), error, ".3g"),
        Claim(f"{what}, median units", (statistics.median(s.units for s in found),), units, "g"),
    ]


def within(what: str, found: Sequence[Score], low: float, high: float) -> Claim:
    """The median of the units lies in a window: its distance from the middle is at most half its width."""
    middle = statistics.median(s.units for s in found)
    title = f"{what}, median units {middle:g} in [{low:g}, {high:g}], distance from the middle"
    return Claim(title, (abs(middle - 0.5 * (low + high)),), 0.5 * (high - low), "g")
