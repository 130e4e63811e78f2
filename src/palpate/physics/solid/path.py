"""Following an equilibrium along a straight line of inputs, in steps that adapt themselves.

The next state is predicted from the last ones and their derivatives in the inputs, which the factorised tangent
gives: z + z' h + ½ z'' h², with z'' from the last two derivatives where the path goes straight on. Where that
prediction is not admissible, or worse than staying, less of it is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.physics.equilibrium.stop import Stop, Verdict
from palpate.physics.solid.model import SolidModel
from palpate.physics.solid.newton import Found

__all__ = ["Followed", "Known", "LoadStep", "follow"]

SMALLEST_STEP = 2.0**-10  # of the whole path
MOST_ITERATIONS = 200  # over a whole path: bounds the time that pointless inputs cost
EASY, HARD = 3, 6  # factorisations up to which steps grow, beyond which they shrink
GROWTH, SHRINKAGE = 1.6, 0.7
STRAIGHT = 0.999  # cosine from which on two steps are on one line


@dataclass(frozen=True)
class Known:
    """An equilibrium.

    Attributes
    ----------
    q : (n,) array
        Its inputs.
    z : (dof,) array
        Its unknowns.
    slope : (n, dof) array or None
        ∂z/∂q, about.
    before : Known or None
        The equilibrium from which it was reached.
    """

    q: np.ndarray
    z: np.ndarray
    slope: np.ndarray | None = None
    before: Known | None = None

    def alone(self) -> Known:
        """The same without the one before it, so that chains don't pile up in memory."""
        return replace(self, before=None)


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
    """

    position: float
    step: float
    stop: Stop
    iterations: int
    chords: int
    residual: float
    cuts: int


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
    here, position, log = start, 0.0, list[LoadStep]()
    length = model.distance(start.q, target)
    step = min(1.0, model.first_step() / length) if length > 0 else 1.0
    while True:
        end = _stretched(position, step)
        q = start.q + end * (target - start.q)
        model.begin(end - position)
        found = model.search(q, predict(model, here, q))
        verdict = model.judge(found.z, q) if found.stop is Stop.CONVERGED else model.why(found, q)
        log.append(_record(end, end - position, verdict.stop, found))
        if verdict.stop is Stop.CONVERGED:
            if end == 1.0:
                return Followed(Known(q, found.z, None, here.alone()), verdict, tuple(log))
            here = Known(q, found.z, model.sensitivity(found.z), here.alone())
            model.commit(found.z)
            step = (end - position) * _pace(found.iterations)
            position = end
        else:
            step = (end - position) / 2
        spent = sum(entry.iterations for entry in log)
        if step < SMALLEST_STEP or spent >= MOST_ITERATIONS:
            return Followed(here, verdict, tuple(log))


def predict(model: SolidModel, here: Known, q: np.ndarray) -> np.ndarray:
    """Guess of the equilibrium under inputs q (n,), the first admissible one of those at hand."""
    model.set(q)
    stay = model.impose(here.z, q)
    if here.slope is None:
        return stay
    best, lowest = stay, model.system.potential(stay)
    for guess in _extrapolated(here, q):
        guess = model.impose(guess, q)
        potential = model.system.potential(guess)
        if not np.isfinite(potential):
            continue
        if model.system.saddle:
            return guess  # an energy that has no minimum doesn't tell the better one
        if not potential >= lowest:
            best, lowest = guess, potential
    return best


def _extrapolated(here: Known, q: np.ndarray) -> Iterator[np.ndarray]:
    """Extrapolations from the boldest to the most timid."""
    ahead = q - here.q
    assert here.slope is not None  # only a state with a slope is extrapolated
    first = ahead @ here.slope
    bend = _bend(here, ahead)
    if bend is not None:
        yield here.z + first + bend
    for share in (1.0, 0.5, 0.25):
        yield here.z + share * first


def _bend(here: Known, ahead: np.ndarray) -> np.ndarray | None:
    """½ z'' h² from the change of slope in the last step, if the path goes straight on."""
    before = here.before
    if before is None or before.slope is None or here.slope is None:
        return None
    taken = here.q - before.q
    lengths = float(np.linalg.norm(taken)), float(np.linalg.norm(ahead))
    if min(lengths) == 0 or taken @ ahead < STRAIGHT * lengths[0] * lengths[1]:
        return None
    ratio = min(lengths[1] / lengths[0], 2.0)
    change: np.ndarray = ahead @ (here.slope - before.slope)
    return ratio / 2 * change


def _stretched(position: float, step: float) -> float:
    """End of a step, the path's own where little would be left of it."""
    end = position + step
    return 1.0 if end > 1.0 - 0.25 * step else end


def _pace(iterations: int) -> float:
    return GROWTH if iterations <= EASY else SHRINKAGE if iterations > HARD else 1.0


def _record(end: float, step: float, stop: Stop, found: Found) -> LoadStep:
    return LoadStep(end, step, stop, found.iterations, found.chords, found.error, found.cuts)
