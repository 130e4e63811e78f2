"""A bounded refinement of the filter's state on retained samples, and what it may cost."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from palpate.errors import UsageError
from palpate.learning.starts import units_at_errors
from palpate.learning.stream.reservoir import Keeping, Reservoir
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.refinement.levenberg import levenberg_step
from palpate.rbf.refinement.posterior import posterior
from palpate.rbf.refinement.projection import Fit, project
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.refinement.rows import Rows

__all__ = ["Progress", "Refining", "refined_state"]

_SETTLED = 0.1  # a step that gains less of the cost than this: what is left needs more units, not other ones
_WIDE = 1.5  # new units' widths relative to their spacing
_WIDTHS = 0.4  # spread of new units' log widths
_SPIKE = 30.0  # times the median error from which a sample may be a spike
_SPIKE_WEIGHT = 1e-8
_NEIGHBOURS = 4  # samples that a spike disagrees with
_ENOUGH = 8  # samples among which spikes are looked for
_WEIGHT = 1.0  # size of weights where samples say nothing, in scaled outputs
_CLEARLY = (
    0.5  # error of weights that may be of any size, over that of moderate ones, below which they are taken
)
_FILLED = 0.5  # unknowns per number in the reservoir up to which units are added


@dataclass(frozen=True)
class Refining:
    """The refinement that goes with a stream: one Levenberg–Marquardt iteration every so many observations.

    Attributes
    ----------
    samples : int
        R, retained samples.
    keeping : {"uniform", "fading", "latest"}
        Which ones: a uniform sample of the whole stream, or of its recent past (see `Reservoir`).
    every : int
        Observations from one iteration to the next; 0 for no refinement.
    tries : int
        Dampings tried in one iteration at most.
    grows : bool
        Whether units are added where the reservoir's error is, or by the filter's own rule.
    share : float
        Units added at a time, relative to those there are; one at least.
    ridge : float
        Least penalty on squared weights, per sample; the error expected of new samples may ask for more.
    judges : int
        One retained sample in so many judges whether moved or added units are better; 0 for none.
    patience : int
        Iterations that units on trial may take to become better.
    """

    samples: int = 500
    keeping: Keeping = "uniform"
    every: int = 10
    tries: int = 3
    grows: bool = True
    share: float = 0.25
    ridge: float = 1e-13
    judges: int = 5
    patience: int = 20

    def __post_init__(self) -> None:
        if self.keeping not in get_args(Keeping):
            raise UsageError(f"keeping is {self.keeping!r}; it is one of {', '.join(get_args(Keeping))}.")
        if (
            self.samples < 1
            or self.every < 0
            or self.tries < 1
            or min(self.share, self.ridge, self.judges) < 0
        ):
            raise UsageError(
                f"{self} makes no sense.",
                fix="Keep one sample at least, try one damping at least, and let nothing be negative.",
            )


@dataclass(frozen=True, eq=False)
class Progress:
    """The state that one iteration leaves to the next."""

    damping: float = 1e-2  # Levenberg–Marquardt damping of the next step
    gain: float = 0.0  # by how much it lowered the cost, relative; 0 before the first
    rms: float = float("nan")  # root mean square error over the reservoir, per scaled output
    expected: float = float("nan")  # the same over the judging samples, before they were fitted too
    # (h', p) units on trial: iterated from, but not better than the state's yet
    scout: np.ndarray | None = None
    since: int = 0  # iterations of the units on trial so far
    failed: int = 0  # trials that failed since the last one that did not


def refined_state(
    state: State, kept: Reservoir, settings: Settings, refining: Refining, last: Progress
) -> tuple[State, Progress]:
    """Return the state after one iteration on the reservoir, with the Gauss–Newton posterior, and what it achieved.

    With a forgetting factor λ a sample of age a weighs λᵃ, as it does in the filter. Spikes hardly weigh. Moved and
    new units replace the state's once they have less error on the judging samples; weights and tail are then fitted
    to all.
    """
    weights = kept.weights * settings.forgetting_factor ** (kept.ages - kept.ages.min())
    weights = np.where(_spikes(state, kept, settings), _SPIKE_WEIGHT * weights, weights)
    judging = _judging(kept, weights, refining)
    rows = _rows(state, kept, settings, np.where(judging, 0.0, weights))

    def error_at(penalty: float) -> float:
        return _error(rows, kept, judging, weights, state.theta, project(rows, state.theta, penalty))

    penalty = max(refining.ridge, 1e-30)
    before = error_at(penalty * rows.total)
    # of the likeliest weights under noise (MacKay 1992, Neural Computation 4, 415-447): units that nearly cancel do not
    # follow noise or drift, unless what was held back shows that they are right
    expected = last.expected if math.isfinite(last.expected) else 0.0
    noise = (expected / _WEIGHT) ** 2 / rows.total
    if noise > penalty and _CLEARLY * (calm := error_at(noise * rows.total)) < before:
        penalty, before = noise, calm
    start, damping, new = _start(state, kept, settings, refining, last)
    step = levenberg_step(rows, start, penalty * rows.total, damping=damping, tries=refining.tries)
    after = _error(rows, kept, judging, weights, step.theta, step.fit)
    better = not after > before
    theta = step.theta if better else state.theta
    everything = _rows(state, kept, settings, weights)
    fit = project(everything, theta, penalty * everything.total)
    squares = float((fit.residual[: len(everything.X)] ** 2).sum())
    rms = float(np.sqrt(squares / (everything.total * state.outputs)))
    progress = Progress(
        damping=step.damping,
        gain=step.gain,
        rms=rms,
        expected=min(before, after) if judging.any() else rms,
        scout=None if better else step.theta,
        since=0 if better else 1 if new else last.since + 1,
        failed=0 if better else last.failed + (new and last.since > 0),
    )
    coefficients = fit.coefficients @ everything.modes
    return _continued(state, kept, weights, settings, theta, coefficients, progress), progress


def _continued(
    state: State,
    kept: Reservoir,
    weights: np.ndarray,
    settings: Settings,
    theta: np.ndarray,
    coefficients: np.ndarray,
    progress: Progress,
) -> State:
    """Return the filter's state with other parameters and their posterior."""
    new = len(theta) - state.units
    refined = replace(_refined(state, settings, theta, coefficients), rms=progress.expected)
    posterior_of_units = posterior(
        *(refined, kept.X, settings),
        modes=state.modes,
        weights=weights,
        slope_weight=kept.slope_weights,
        curvature_weight=kept.curvature_weights,
    )
    state = replace(
        state,
        coefficients=coefficients,
        theta=theta,
        covariance=posterior_of_units.covariance,
        places=posterior_of_units.places,
        silent=np.append(state.silent, np.zeros(new, np.int64)),
        innovation=min(state.innovation, progress.expected**2),
        mode_coefficients=posterior_of_units.mode_coefficients,
    )
    return replace(state, errors=_window_errors(state, settings))


def _spikes(state: State, kept: Reservoir, settings: Settings) -> np.ndarray:
    """Mask (N,) of retained samples that are far off the network, where their nearest neighbours are not."""
    if len(kept) < _ENOUGH:
        return np.zeros(len(kept), bool)
    of = settings.regressors(state.inputs)
    f = np.hstack([of.tail_rows(kept.X), of.phi(kept.X, state.theta)]) @ state.coefficients
    size = np.linalg.norm(kept.Y - f, axis=1)
    spikes = size > _SPIKE * max(float(np.median(size)), 1e-12)
    for i in np.flatnonzero(spikes):
        near = np.argsort(((kept.X - kept.X[i]) ** 2).sum(axis=1))[1 : 1 + _NEIGHBOURS]
        spikes[i] = float(np.median(size[near])) < 0.1 * size[i]
    return np.asarray(spikes)


def _judging(kept: Reservoir, weights: np.ndarray, refining: Refining) -> np.ndarray:
    """Return which retained samples (N,) judge: a place says nothing about when its sample came."""
    none = np.zeros(len(kept), bool)
    if not refining.judges or len(kept) < 2 * refining.judges:
        return none
    chosen = np.arange(len(kept)) % refining.judges == refining.judges - 1
    # where old samples fade, all that count may be on one side
    return chosen if weights[chosen].any() and weights[~chosen].any() else none


def _rows(state: State, kept: Reservoir, settings: Settings, weights: np.ndarray) -> Rows:
    of = settings.regressors(state.inputs)
    derivatives: dict[str, Any] = {}
    if kept.slopes is not None:
        derivatives |= {"slopes": kept.slopes, "slope_weight": kept.slope_weights}
    if kept.curvatures is not None:
        derivatives |= {"curvatures": kept.curvatures, "curvature_weight": kept.curvature_weights}
    return Rows.of(of, kept.X, kept.Y, weights=weights, **derivatives)


def _error(
    rows: Rows, kept: Reservoir, judging: np.ndarray, weights: np.ndarray, theta: np.ndarray, fit: Fit
) -> float:
    """Return the weighted RMS error per scaled output on the judging samples; 0 where there are none."""
    if not judging.any():
        return 0.0
    X, w = kept.X[judging], weights[judging]
    phi = np.hstack([rows.regressors.tail_rows(X), rows.regressors.phi(X, theta)])
    error = phi @ (fit.coefficients @ rows.modes) - kept.Y[judging]
    return float(np.sqrt(((error**2).mean(axis=1) * w).sum() / w.sum()))


def _window_errors(state: State, settings: Settings) -> np.ndarray:
    """Return squared errors (≤ M,) over the window: growth must not be asked for by errors that are gone."""
    seen = state.memory[-settings.window :]
    X, Y = seen[:, : state.inputs], seen[:, state.inputs :]
    of = settings.regressors(state.inputs)
    error = np.hstack([of.tail_rows(X), of.phi(X, state.theta)]) @ state.latent_coefficients - Y
    return np.asarray((error**2).sum(axis=1))


def _start(
    state: State, kept: Reservoir, settings: Settings, refining: Refining, last: Progress
) -> tuple[np.ndarray, float, bool]:
    """Return units to iterate from, a damping, and whether they are new on trial.

    They are those on trial; or, where growth is due, the state's and some more; or, after a trial that failed, all
    drawn anew in turns with the state's; or the state's.
    """
    if last.scout is not None and last.since < refining.patience:
        return last.scout, last.damping, False
    fresh, settled = Progress().damping, last.since > 0 or last.gain <= _SETTLED
    rng = np.random.default_rng((state.count, state.units))
    if settled and (new := _growth(state, len(kept), settings, refining, last)):
        return np.vstack([state.theta, _drawn(state, kept, settings, new, rng)]), fresh, True
    if last.since and last.failed % 2 == 0 and refining.grows and state.units:
        none = replace(state, theta=state.theta[:0], coefficients=state.coefficients[: -state.units or None])
        return _drawn(none, kept, settings, state.units, rng), fresh, True
    return state.theta, fresh if last.since else last.damping, True


def _growth(state: State, samples: int, settings: Settings, refining: Refining, last: Progress) -> int:
    """Return how many units to add: none while the error is small enough, or where samples would not decide on them."""
    h = state.units
    new = min(max(1, round(refining.share * h)), settings.units_max - h)
    if not refining.grows or new < 1:
        return 0
    if last.expected * np.sqrt(state.outputs) <= settings.error_rms_min:
        return 0
    unknowns = (h + new) * (1.0 + state.theta.shape[1] / state.outputs) + len(state.tail.T)
    return new if unknowns <= _FILLED * samples else 0


def _drawn(
    state: State, kept: Reservoir, settings: Settings, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Return units (count, p) at samples drawn by squared error and distance from others, about their spacing wide."""
    of, X, n = settings.regressors(state.inputs), kept.X, state.inputs
    f = np.hstack([of.tail_rows(X), of.phi(X, state.theta)]) @ state.coefficients
    error = ((kept.Y - f) ** 2).sum(axis=1)
    width = _WIDE * 2.0 / (state.units + count) ** (1.0 / n)
    widths = width * np.exp(rng.normal(0.0, _WIDTHS, count))
    return units_at_errors(of.form, X, error, widths, spacing=width, rng=rng)


def _refined(state: State, settings: Settings, theta: np.ndarray, coefficients: np.ndarray) -> Refined:
    nan = float("nan")
    of = settings.regressors(state.inputs)
    return Refined(of, theta, coefficients, nan, nan, nan, 1, False, np.zeros(0))
