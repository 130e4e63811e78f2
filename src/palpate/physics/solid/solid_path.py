"""Following an equilibrium along a straight line of inputs, in steps that adapt themselves.

Prediction. The factorised tangent gives z + z' h + ½ z'' h², with z'' from the last two derivatives where the path goes
straight on. Where that is not admissible, or worse than staying, less of it is taken.

Error in time. Plastic and viscous flow in a step depend on its length. So the step of a body with a history is taken
once whole and once in two halves; the difference of the two responses is the error that the step is judged by (Hairer,
Nørsett & Wanner 1993, Solving Ordinary Differential Equations I, II.4), and the halves are the result.

Length. Steps grow and shrink with the iterations that they take and, for bodies with a history, with their error in
time.
"""

from __future__ import annotations

import logging
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.physics.stop import Stop, Verdict
from palpate.processes import is_supervised

if TYPE_CHECKING:
    from palpate.physics.solid.solid_model import SolidModel
    from palpate.physics.solid.solid_newton import NewtonResult

__all__ = [
    "LoadStep",
    "PathPoint",
    "PathResult",
    "StepResult",
    "follow",
    "predict",
    "soften_and_follow",
    "take_step",
]

STRAIGHT = 0.999  # cosine from which on two steps are on one line
SMALLEST_STEP = 2.0**-10  # shortest step, as a share of the whole path
# The same where equilibria are found but lie beyond a law's reach: shorter steps find such ones too
SMALLEST_REFUSED = 2.0**-4
# The same where a step errs too much in time: the first moments of a long creep may be short
SMALLEST_IN_TIME = 2.0**-30
# Newton iterations of steps that led nowhere, or of all steps of a body without a history: bounds the time that
# pointless inputs cost
MOST_ITERATIONS = 200
# Tries in a row that led nowhere, and the CPU time in s that they took, from which on a path is given up: so many
# halvings of a step are hardly ever followed by one that succeeds, and small bodies try them all within that time
FUTILE_TRIES, FUTILE_SECONDS = 4, 15.0
TOLD_AFTER, TOLD_EVERY = 5.0, 1.0  # s of a solve from which on its progress is shown, and between two lines
MOST_STEPS = 400  # a body that flows without end, near collapse, is followed in ever shorter steps
EASY, HARD = 3, 6  # factorisations of a search up to which steps grow, beyond which they shrink
GROWTH, SHRINKAGE = 1.6, 0.7
LONGEST, SHORTEST, SAFETY = 4.0, 0.2, 0.8  # factors of the next step that the error in time allows

# share of a very stiff pad's stiffness on the way, factor of a step from there, and the least after halvings
SOFT, STIFFENING, LEAST_STIFFENING = 1 / 16, 4.0, 1.1

logger = logging.getLogger("palpate.physics.solid")  # progress, for those who ask for it


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium on a path."""

    q: np.ndarray  # (n,) inputs
    z: np.ndarray  # (dof,) unknowns
    slope: np.ndarray | None = None  # (n, dof) about ∂z/∂q; None where it is not known yet
    previous: PathPoint | None = None  # equilibrium from which it was reached

    def without_previous(self) -> PathPoint:
        """Return the equilibrium without the one before it, so that chains don't pile up in memory."""
        return replace(self, previous=None)


def predict(model: SolidModel, here: PathPoint, q: np.ndarray) -> np.ndarray:
    """Return the best admissible guess of the equilibrium under inputs q (n,).

    In displacement form that is the guess of the least energy. In mixed form, where an equilibrium is a saddle of the
    energy, it is the guess whose residual is least, measured by the present tangent.
    """
    model.set(q)
    best = model.impose(here.z, q)
    if here.slope is None or (model.histories and _turns_back(here, q)):
        return best
    least = _badness(model, best)
    for guess in _extrapolations(here, q):
        guess = model.impose(guess, q)
        badness = _badness(model, guess)
        if badness < least or not np.isfinite(least):
            best, least = guess, badness
    return best


def _turns_back(here: PathPoint, q: np.ndarray) -> bool:
    """Return whether the way to q (n,) leads back: what has yielded then answers as it did before it yielded."""
    return here.previous is not None and float((here.q - here.previous.q) @ (q - here.q)) < 0


def _badness(model: SolidModel, guess: np.ndarray) -> float:
    """Return a measure of a guess, the lower the better; infinite where the guess is not admissible."""
    potential = model.system.potential(guess)
    if not np.isfinite(potential):
        return np.inf
    if not model.system.saddle:
        return potential
    return model.error(guess) if model.has_tangent else 0.0


def _extrapolations(here: PathPoint, q: np.ndarray) -> Iterator[np.ndarray]:
    """Yield extrapolations from the boldest to the most timid."""
    ahead = q - here.q
    assert here.slope is not None  # only a state with a slope is extrapolated
    first = ahead @ here.slope
    bend = _bend(here, ahead)
    if bend is not None:
        yield here.z + first + bend
    for share in (1.0, 0.5, 0.25):
        yield here.z + share * first


def _bend(here: PathPoint, ahead: np.ndarray) -> np.ndarray | None:
    """Return ½ z'' h² from the change of slope in the last step, if the path goes straight on."""
    previous = here.previous
    if previous is None or previous.slope is None or here.slope is None:
        return None
    taken = here.q - previous.q
    lengths = float(np.linalg.norm(taken)), float(np.linalg.norm(ahead))
    if min(lengths) == 0 or taken @ ahead < STRAIGHT * lengths[0] * lengths[1]:
        return None
    ratio = min(lengths[1] / lengths[0], 2.0)
    change: np.ndarray = ahead @ (here.slope - previous.slope)
    return ratio / 2 * change


@dataclass(frozen=True, eq=False)
class StepResult:
    """The result of one tried step."""

    z: np.ndarray  # (dof,) unknowns at its end
    verdict: Verdict  # whether its end is admissible, and why not
    searches: tuple[NewtonResult, ...]  # one, or those of the whole step and its halves
    error: float = 0.0  # error in time over the tolerated one

    @property
    def good(self) -> bool:
        """True where the step counts."""
        return self.verdict.stop is Stop.CONVERGED and self.error <= 1.0


def take_step(model: SolidModel, here: PathPoint, q: np.ndarray, share: float) -> StepResult:
    """Take a step from an equilibrium to inputs q (n,) in a share of the path's duration.

    Afterwards the model is in the last half of the step, its internal variables those at the beginning of that half.
    """
    whole = _single(model, here, q, share)
    if not model.histories or whole.verdict.stop is not Stop.CONVERGED or np.isinf(model.step_error):
        return whole
    expected = model.response(whole.z)
    middle = (here.q + q) / 2
    model.begin(share / 2)
    first = model.search(middle, model.impose((here.z + whole.z) / 2, middle))
    if first.stop is not Stop.CONVERGED:
        return StepResult(first.z, model.explain(first, middle), (*whole.searches, first))
    model.commit(first.z)
    model.begin(share / 2)
    second = model.search(q, whole.z)
    searches = (*whole.searches, first, second)
    verdict = _verdict(model, second, q)
    if verdict.stop is not Stop.CONVERGED:
        return StepResult(second.z, verdict, searches)
    return StepResult(second.z, verdict, searches, model.step_mismatch(expected, model.response(second.z)))


def _single(model: SolidModel, here: PathPoint, q: np.ndarray, share: float) -> StepResult:
    """Take the step in one go."""
    model.begin(share)
    back = bool(model.histories) and _turns_back(here, q)
    end = model.search(q, predict(model, here, q), fresh=back)
    return StepResult(end.z, _verdict(model, end, q), (end,))


def _verdict(model: SolidModel, end: NewtonResult, q: np.ndarray) -> Verdict:
    return model.judge(end.z, q) if end.stop is Stop.CONVERGED else model.explain(end, q)


@dataclass(frozen=True)
class LoadStep:
    """One tried step along a path."""

    position: float  # share of the path at its end
    step: float  # its length as a share of the path
    stop: Stop  # why its search ended; the step counts only if it converged
    iterations: int  # tangents assembled and factorised
    chords: int  # cheap steps with a tangent used before
    residual: float  # √(|rᵀK⁻¹r|/energy) before the last correction
    cuts: int  # halvings in the line search
    error: float = 0.0  # error in time over the tolerated one: the step counts up to 1; 0 without a history

    def __str__(self) -> str:
        failed = "" if self.stop is Stop.CONVERGED else f", cut back: {self.stop}"
        late = ", cut back: it errs too much in time" if not failed and self.error > 1 else ""
        return (
            f"load step to {self.position:.1%} of the path, {self.iterations} Newton iterations{failed}{late}"
        )


@dataclass(frozen=True)
class PathResult:
    """The end of a path: the last equilibrium, the verdict and the steps."""

    last: PathPoint
    verdict: Verdict
    log: tuple[LoadStep, ...]

    @property
    def iterations(self) -> int:
        """Newton iterations over all steps, also those that failed."""
        return sum(step.iterations for step in self.log)

    @property
    def chords(self) -> int:
        """Steps with a tangent used before, over all steps of the path."""
        return sum(step.chords for step in self.log)


def follow(model: SolidModel, start: PathPoint, target: np.ndarray) -> PathResult:
    """Follow the equilibrium from `start` along a straight line of inputs to `target` (n,).

    Internal variables are taken over after each step but the last: what belongs to the last one can then still be asked
    of the model, whose equations are at the end of the path. The result has `Stop.CONVERGED` where the path arrived,
    else the reason and the last equilibrium before it.
    """
    here, position, log = _with_slope(model, start), 0.0, list[LoadStep]()
    watch = _Watch()
    length = model.distance(start.q, target)
    step = min(1.0, model.first_step() / length) if length > 0 else 1.0
    while True:
        end = _step_end(position, step)
        q = start.q + end * (target - start.q) if end < 1.0 else target
        before = model.snapshot()
        tried = take_step(model, here, q, end - position)
        log.append(_record(end, end - position, tried))
        logger.info("%s", log[-1])
        watch.see(tried, position, sum(entry.iterations for entry in log))
        if len(log) == 1 and here is not start:
            log[0] = replace(log[0], iterations=log[0].iterations + 1)  # the tangent that gave the slope
        if tried.good:
            if end == 1.0:
                watch.end()
                return PathResult(
                    PathPoint(q, tried.z, None, here.without_previous()), tried.verdict, tuple(log)
                )
            here = PathPoint(q, tried.z, model.sensitivity(tried.z), here.without_previous())
            model.commit(tried.z)
            step = (end - position) * _pace(tried)
            position = end
        else:
            model.restore(before)
            step = (end - position) * min(_growth_in_time(tried.error), 0.5)
        spent = _spent(model, log)
        if step < _smallest(tried) or spent >= MOST_ITERATIONS or len(log) >= MOST_STEPS or watch.futile:
            watch.end()
            return PathResult(here, _given_up(tried, spent, len(log), watch.reason), tuple(log))


def soften_and_follow(model: SolidModel, start: PathPoint, q: np.ndarray) -> PathResult:
    """Follow the way from outside under softened pads, where they are very stiff, and stiffen them at its end.

    The steps are in ln k, each from the equilibrium before; one that fails is halved. Where none succeeds the way is
    followed under the stiff pads themselves.
    """
    if not model.has_stiff_pads or model.histories:
        return follow(model, start, q)
    try:
        model.stiffen(SOFT)
        path = follow(model, start, q)
        share, factor, log, z = SOFT, STIFFENING, path.log, path.last.z
        if path.verdict.stop is not Stop.CONVERGED:
            factor = 1.0
        while share < 1.0 and factor > LEAST_STIFFENING:
            model.stiffen(min(share * factor, 1.0))
            end = model.search(q, z, fresh=True)
            tried = StepResult(end.z, _verdict(model, end, q), (end,))
            log = (*log, _record(1.0, 0.0, tried))
            if tried.good:
                share, z = min(share * factor, 1.0), tried.z
            else:
                factor = math.sqrt(factor)
    finally:
        model.stiffen(1.0)
    if share < 1.0:
        again = follow(model, start, q)
        return replace(again, log=log + again.log)
    return PathResult(PathPoint(q, z), model.judge(z, q), log)


class _Watch:
    """The clock of a path: how long nothing has succeeded, and a line of progress on a terminal."""

    def __init__(self) -> None:
        self._began = self._shown = time.monotonic()
        self._since, self._tries = time.process_time(), 0
        self._line = sys.stderr is not None and sys.stderr.isatty() and not is_supervised()
        self._open = False

    @property
    def futile(self) -> bool:
        """True where several tries in a row led nowhere and took long."""
        return self._tries >= FUTILE_TRIES and time.process_time() - self._since > FUTILE_SECONDS

    @property
    def reason(self) -> str:
        """The tries in words, where they are futile; else empty."""
        if not self.futile:
            return ""
        return f"given up after {self._tries} tries in a row, {time.process_time() - self._since:.0f} s of CPU time"

    def see(self, tried: StepResult, position: float, iterations: int) -> None:
        """Take note of a try from a position (a share of the path), and show how far the solve is."""
        found = tried.verdict.stop is Stop.CONVERGED  # one that errs too much in time is no failure
        self._tries = 0 if found else self._tries + 1
        if found:
            self._since = time.process_time()
        now = time.monotonic()
        if self._line and now - self._began > TOLD_AFTER and now - self._shown > TOLD_EVERY:
            self._shown, self._open = now, True
            failed = f", {self._tries} tries without a step" if self._tries else ""
            text = f"solving: {position:.0%} of the path, {iterations} iterations, {now - self._began:.0f} s{failed}"
            sys.stderr.write(f"\r{text:<78}")
            sys.stderr.flush()

    def end(self) -> None:
        """Wipe the line of progress."""
        if self._open:
            sys.stderr.write("\r" + " " * 78 + "\r")
            sys.stderr.flush()


def _with_slope(model: SolidModel, start: PathPoint) -> PathPoint:
    """Return the start with its slope where inputs move a part of the body, which alone would turn elements over."""
    if start.slope is not None or not model.inputs.lifts.any():
        return start
    model.begin(0.0)
    return replace(start, slope=model.fresh_sensitivity(start.z, start.q))


def _step_end(position: float, step: float) -> float:
    """Return the end of a step, the path's own where little would be left of it."""
    end = position + step
    return 1.0 if end > 1.0 - 0.25 * step else end


def _pace(tried: StepResult) -> float:
    """Return the factor by which the next step is longer."""
    hardest = max(search.iterations for search in tried.searches)
    easy = GROWTH if hardest <= EASY else SHRINKAGE if hardest > HARD else 1.0
    return min(easy, _growth_in_time(tried.error)) if tried.error > 0 else easy


def _growth_in_time(error: float) -> float:
    """Return the factor that an error in time allows, which goes at least with the square of the step."""
    return float(np.clip(SAFETY / np.sqrt(max(error, 1e-9)), SHORTEST, LONGEST))


def _smallest(tried: StepResult) -> float:
    """Return the shortest step that is worth while after this one."""
    if tried.verdict.stop is Stop.STRAIN_LIMIT:
        return SMALLEST_REFUSED
    return SMALLEST_IN_TIME if tried.verdict.stop is Stop.CONVERGED and tried.error > 0 else SMALLEST_STEP


def _spent(model: SolidModel, log: list[LoadStep]) -> int:
    """Return the iterations that count against the limit."""
    counted = (entry for entry in log if not model.histories or entry.stop is not Stop.CONVERGED)
    return sum(entry.iterations for entry in counted)


def _given_up(last: StepResult, spent: int, steps: int, futile: str) -> Verdict:
    """Return the verdict on a path that ends before its target: never that of a good step on the way."""
    if last.verdict.stop is not Stop.CONVERGED:
        detail = "; ".join(part for part in (last.verdict.detail, futile) if part)
        return replace(last.verdict, detail=detail)
    if spent >= MOST_ITERATIONS:
        return Verdict(Stop.ITERATION_LIMIT, f"{spent} iterations along the path")
    if steps >= MOST_STEPS:
        return Verdict(Stop.ITERATION_LIMIT, f"{steps} steps along the path")
    return Verdict(Stop.STEP_TOO_SMALL)


def _record(end: float, step: float, tried: StepResult) -> LoadStep:
    searches = tried.searches
    return LoadStep(
        position=end,
        step=step,
        stop=tried.verdict.stop,
        iterations=sum(search.iterations for search in searches),
        chords=sum(search.chords for search in searches),
        residual=searches[-1].error,
        cuts=sum(search.cuts for search in searches),
        error=tried.error,
    )
