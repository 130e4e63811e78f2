"""Following an equilibrium along a straight line of inputs, in steps that adapt themselves.

Steps grow and shrink with the iterations that they take and, for bodies with a history, with their error in time.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from palpate.physics.solid.model import SolidModel
from palpate.physics.solid.predicting import Known
from palpate.physics.solid.stepping import Tried, take
from palpate.physics.stop import Stop, Verdict

__all__ = ["Followed", "Known", "LoadStep", "follow"]

logger = logging.getLogger("palpate.physics.solid")  # progress, for those who ask for it

SMALLEST_STEP = 2.0**-10  # of the whole path
# Where equilibria are found but lie beyond a law's reach, shorter steps find them too
SMALLEST_REFUSED = 2.0**-4
# Where a step errs too much in time: the first moments of a long creep may be short
SMALLEST_IN_TIME = 2.0**-30
# Of steps that led nowhere, and of all where nothing is remembered: bounds the time that pointless inputs cost
MOST_ITERATIONS = 200
MOST_STEPS = 400  # a body that flows without end, near collapse, is followed in ever shorter steps
EASY, HARD = 3, 6  # factorisations of a search up to which steps grow, beyond which they shrink
GROWTH, SHRINKAGE = 1.6, 0.7
LONGEST, SHORTEST, SAFETY = 4.0, 0.2, 0.8  # factors of the next step that the error in time allows


@dataclass(frozen=True)
class LoadStep:
    """One tried step along a path.

    Attributes
    ----------
    position : float
        Share of the path at its end.
    step : float
        Its length as a share of the path.
    stop : Stop
        How it ended; the step counts only if it converged.
    iterations : int
        Newton iterations: tangents assembled and factorised.
    chords : int
        Cheap steps with a tangent used before.
    residual : float
        √(|rᵀK⁻¹r|/energy) before the last correction.
    cuts : int
        Halvings in the line search.
    error : float
        Error in time over what is tolerated: a step counts only if it is at most 1. 0 without a history.
    """

    position: float
    step: float
    stop: Stop
    iterations: int
    chords: int
    residual: float
    cuts: int
    error: float = 0.0

    def __str__(self) -> str:
        how = "" if self.stop is Stop.CONVERGED else f", cut back: {self.stop}"
        late = ", cut back: it errs too much in time" if not how and self.error > 1 else ""
        return f"load step to {self.position:.1%} of the path, {self.iterations} Newton iterations{how}{late}"


@dataclass(frozen=True)
class Followed:
    """Where following a path ended: the last equilibrium, the verdict and the steps."""

    last: Known
    verdict: Verdict
    log: tuple[LoadStep, ...]

    @property
    def iterations(self) -> int:
        """Over all steps, also those that failed."""
        return sum(step.iterations for step in self.log)

    @property
    def chords(self) -> int:
        """Steps with a tangent used before, over all steps of the path."""
        return sum(step.chords for step in self.log)


def follow(model: SolidModel, start: Known, target: np.ndarray) -> Followed:
    """Follow the equilibrium from `start` along a straight line of inputs to `target` (n,).

    Internal variables are taken over after each step but the last: what belongs to the last one can then still be
    asked of the model.

    Parameters
    ----------
    model : SolidModel
    start : Known
    target : (n,) array

    Returns
    -------
    Followed
        With `Stop.CONVERGED` where it arrived, else with the reason and the last equilibrium before it.
    """
    here, position, log = _sloped(model, start), 0.0, list[LoadStep]()
    length = model.distance(start.q, target)
    step = min(1.0, model.first_step() / length) if length > 0 else 1.0
    while True:
        end = _stretched(position, step)
        q = start.q + end * (target - start.q) if end < 1.0 else target
        remembered = model.remembered()
        tried = take(model, here, q, end - position)
        log.append(_record(end, end - position, tried))
        logger.info("%s", log[-1])
        if len(log) == 1 and here is not start:
            log[0] = replace(log[0], iterations=log[0].iterations + 1)  # the tangent that gave the slope
        if tried.good:
            if end == 1.0:
                return Followed(Known(q, tried.z, None, here.alone()), tried.verdict, tuple(log))
            here = Known(q, tried.z, model.sensitivity(tried.z), here.alone())
            model.commit(tried.z)
            step = (end - position) * _pace(tried)
            position = end
        else:
            model.recall(remembered)
            step = (end - position) * min(_allowed(tried.error), 0.5)
        if step < _smallest(tried) or _spent(model, log) >= MOST_ITERATIONS or len(log) >= MOST_STEPS:
            return Followed(here, _given_up(tried, _spent(model, log), len(log)), tuple(log))


def _sloped(model: SolidModel, start: Known) -> Known:
    """The start with its slope, where the inputs move a part of the body: that part alone would turn elements over."""
    if start.slope is not None or not model.inputs.lifts.any():
        return start
    model.begin(0.0)
    return replace(start, slope=model.slope_at(start.z, start.q))


def _stretched(position: float, step: float) -> float:
    """End of a step, the path's own where little would be left of it."""
    end = position + step
    return 1.0 if end > 1.0 - 0.25 * step else end


def _pace(tried: Tried) -> float:
    """By how much the next step is longer."""
    hardest = max(found.iterations for found in tried.found)
    easy = GROWTH if hardest <= EASY else SHRINKAGE if hardest > HARD else 1.0
    return min(easy, _allowed(tried.error)) if tried.error > 0 else easy


def _allowed(error: float) -> float:
    """The same, for an error in time that goes at least with the square of the step."""
    return float(np.clip(SAFETY / np.sqrt(max(error, 1e-9)), SHORTEST, LONGEST))


def _smallest(tried: Tried) -> float:
    """Shortest step that is worth while after this one."""
    if tried.verdict.stop is Stop.STRAIN_LIMIT:
        return SMALLEST_REFUSED
    return SMALLEST_IN_TIME if tried.verdict.stop is Stop.CONVERGED and tried.error > 0 else SMALLEST_STEP


def _spent(model: SolidModel, log: list[LoadStep]) -> int:
    """Iterations that count against the limit."""
    return sum(e.iterations for e in log if not model.histories or e.stop is not Stop.CONVERGED)


def _given_up(last: Tried, spent: int, steps: int) -> Verdict:
    """The verdict on a path that ends before its target: never that of a good step on the way."""
    if last.verdict.stop is not Stop.CONVERGED:
        return last.verdict
    if spent >= MOST_ITERATIONS:
        return Verdict(Stop.ITERATION_LIMIT, f"{spent} iterations along the path")
    if steps >= MOST_STEPS:
        return Verdict(Stop.ITERATION_LIMIT, f"{steps} steps along the path")
    return Verdict(Stop.STEP_TOO_SMALL)


def _record(end: float, step: float, tried: Tried) -> LoadStep:
    found = tried.found
    return LoadStep(
        position=end,
        step=step,
        stop=tried.verdict.stop,
        iterations=sum(one.iterations for one in found),
        chords=sum(one.chords for one in found),
        residual=found[-1].error,
        cuts=sum(one.cuts for one in found),
        error=tried.error,
    )
