"""Guessing the next equilibrium on a path from the last ones and their derivatives in the inputs.

The factorised tangent gives z + z' h + ½ z'' h², with z'' from the last two derivatives where the path goes straight
on. Where that is not admissible, or worse than staying, less of it is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from palpate.physics.solid.model import SolidModel

__all__ = ["Known", "predict", "turns_back"]

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


def predict(model: SolidModel, here: Known, q: np.ndarray) -> np.ndarray:
    """Guess of the equilibrium under inputs q (n,): of those at hand the admissible one that is best.

    In displacement form that is the one of the least energy. In mixed form, where an equilibrium is a saddle of the
    energy, it is the one whose residual is least, measured by the present tangent.
    """
    model.set(q)
    best = model.impose(here.z, q)
    if here.slope is None or (model.histories and turns_back(here, q)):
        return best
    least = _badness(model, best)
    for guess in _extrapolated(here, q):
        guess = model.impose(guess, q)
        badness = _badness(model, guess)
        if badness < least or not np.isfinite(least):
            best, least = guess, badness
    return best


def turns_back(here: Known, q: np.ndarray) -> bool:
    """Whether the way to q (n,) leads back: what has yielded then answers as it did before it yielded."""
    return here.before is not None and float((here.q - here.before.q) @ (q - here.q)) < 0


def _badness(model: SolidModel, guess: np.ndarray) -> float:
    """The lower, the better; infinite where the guess is not admissible."""
    potential = model.system.potential(guess)
    if not np.isfinite(potential):
        return np.inf
    if not model.system.saddle:
        return potential
    return model.error(guess) if model.has_tangent else 0.0


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
