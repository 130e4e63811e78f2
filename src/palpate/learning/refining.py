"""A bounded refinement of the filter's state on retained samples, and what it may cost."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import UsageError
from palpate.learning.nudge import nudged
from palpate.learning.posterior import posterior
from palpate.learning.refine import Refined
from palpate.learning.reservoir import Keeping, Reservoir
from palpate.learning.rows import Rows
from palpate.learning.settings import Settings
from palpate.learning.state import State
from palpate.learning.structure import placed

__all__ = ["Progress", "Refining", "refined_state"]

_SETTLED = 0.1  # a step that gains less of the cost than this: what is left needs more units, not other ones
_FILLED = 0.5  # unknowns per number in the reservoir up to which units are added


@dataclass(frozen=True)
class Refining:
    """How much refinement goes with a stream: one Levenberg–Marquardt iteration every so many observations.

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
        Penalty on squared weights, per sample.
    """

    samples: int = 500
    keeping: Keeping = "uniform"
    every: int = 10
    tries: int = 3
    grows: bool = True
    share: float = 0.25
    ridge: float = 1e-13

    def __post_init__(self) -> None:
        if self.samples < 1 or self.every < 0 or self.tries < 1 or self.share < 0 or self.ridge < 0:
            raise UsageError(
                f"{self} makes no sense.",
                fix="Keep one sample at least, try one damping at least, and let nothing be negative.",
            )


@dataclass(frozen=True)
class Progress:
    """What the last iteration leaves to the next one.

    Attributes
    ----------
    damping : float
    gain : float
        By how much it lowered the cost, relative; 0 before the first.
    rms : float
        Root mean square error over the reservoir, per scaled output.
    """

    damping: float = 1e-2
    gain: float = 0.0
    rms: float = float("nan")


def refined_state(
    state: State, kept: Reservoir, settings: Settings, refining: Refining, last: Progress
) -> tuple[State, Progress]:
    """The state after one iteration on the reservoir, with the Gauss–Newton posterior, and what it achieved.

    With a forgetting factor λ a sample of age a weighs λᵃ, as it does in the filter.
    """
    of = settings.regressors(state.inputs)
    weights = kept.weights * settings.forgetting_factor**kept.ages
    rows = Rows.of(of, kept.X, kept.Y, weights=weights, slopes=kept.slopes, slope_weight=kept.slope_weights)
    theta = _with_new_units(state, kept, settings, refining, last)
    new = len(theta) - state.units
    damping = 1e-2 if new else last.damping
    found = nudged(
        rows, theta, max(refining.ridge, 1e-30) * rows.total, damping=damping, tries=refining.tries
    )
    squares = float((found.fit.residual[: len(rows.X)] ** 2).sum())
    refined = _refined(state, settings, found.theta, found.fit.coefficients @ rows.modes)
    refined = replace(refined, rms=float(np.sqrt(squares / (rows.total * state.outputs))))
    covariance = posterior(refined, kept.X, settings, modes=state.modes, weights=weights).covariance
    state = replace(
        state,
        coefficients=refined.coefficients,
        theta=refined.theta,
        covariance=covariance,
        places=np.vstack([state.places, of.form.centres(theta[state.units :])]) if new else state.places,
        silent=np.append(state.silent, np.zeros(new, np.int64)),
        innovation=min(state.innovation, refined.rms**2),
        in_modes=None if state.modes is None else refined.coefficients @ state.modes,
    )
    state = replace(state, errors=_window_errors(state, settings))
    return state, Progress(found.damping, found.gain, refined.rms)


def _window_errors(state: State, settings: Settings) -> np.ndarray:
    """Squared errors (≤ M,) over the window: growth must not be asked for by errors that are gone."""
    X, Y = state.seen[:, : state.inputs], state.seen[:, state.inputs :]
    of = settings.regressors(state.inputs)
    error = np.hstack([of.tail_rows(X), of.phi(X, state.theta)]) @ state.led - Y
    return np.asarray((error**2).sum(axis=1))


def _with_new_units(
    state: State, kept: Reservoir, settings: Settings, refining: Refining, last: Progress
) -> np.ndarray:
    """The units, and some more where growth is due: they have settled, and the error is still too large."""
    h, N = state.units, len(kept)
    new = min(max(1, round(refining.share * h)), settings.units_max - h)
    if not refining.grows or new < 1 or last.gain > _SETTLED:
        return state.theta
    if np.isfinite(last.rms) and last.rms * np.sqrt(state.outputs) <= settings.error_rms_min:
        return state.theta
    unknowns = (h + new) * (1.0 + state.theta.shape[1] / state.outputs) + len(state.tail.T)
    if unknowns > _FILLED * N:
        return state.theta
    now = _refined(state, settings, state.theta, state.coefficients)
    return np.vstack([state.theta, placed(kept.X, kept.Y, now, new, seed=state.count)])


def _refined(state: State, settings: Settings, theta: np.ndarray, coefficients: np.ndarray) -> Refined:
    nan = float("nan")
    of = settings.regressors(state.inputs)
    return Refined(of, theta, coefficients, nan, nan, nan, 1, False, np.zeros(0))
