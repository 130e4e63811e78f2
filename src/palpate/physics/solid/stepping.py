"""One step along a path, and for a body with a history its error in time.

What plastic and viscous flow do in a step depends on how long the step is. So the step of a body with a history is
taken once whole and once in two halves; the difference of the two responses is the error that the step is judged by
(Hairer, Nørsett & Wanner 1993, Solving Ordinary Differential Equations I, II.4), and the halves are what is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.physics.solid.predicting import Known, predict, turns_back
from palpate.physics.stop import Stop, Verdict

if TYPE_CHECKING:
    from palpate.physics.solid.model import SolidModel
    from palpate.physics.solid.newton import Found

__all__ = ["Tried", "take"]


@dataclass(frozen=True, eq=False)
class Tried:
    """What a step led to.

    Attributes
    ----------
    z : (dof,) array
        Unknowns at its end.
    verdict : Verdict
    found : tuple of Found
        The searches that it took: one, or those of the whole step and its halves.
    error : float
        Error in time over what is tolerated.
    """

    z: np.ndarray
    verdict: Verdict
    found: tuple[Found, ...]
    error: float = 0.0

    @property
    def good(self) -> bool:
        """Whether it counts."""
        return self.verdict.stop is Stop.CONVERGED and self.error <= 1.0


def take(model: SolidModel, here: Known, q: np.ndarray, share: float) -> Tried:
    """Go from an equilibrium to inputs q (n,) in a share of the path's duration.

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
        return Tried(first.z, model.why(first, middle), (*whole.found, first))
    model.commit(first.z)
    model.begin(share / 2)
    second = model.search(q, whole.z)
    found = (*whole.found, first, second)
    verdict = _judged(model, second, q)
    if verdict.stop is not Stop.CONVERGED:
        return Tried(second.z, verdict, found)
    return Tried(second.z, verdict, found, model.step_mismatch(expected, model.response(second.z)))


def _single(model: SolidModel, here: Known, q: np.ndarray, share: float) -> Tried:
    """The step in one go."""
    model.begin(share)
    back = bool(model.histories) and turns_back(here, q)
    found = model.search(q, predict(model, here, q), fresh=back)
    return Tried(found.z, _judged(model, found, q), (found,))


def _judged(model: SolidModel, found: Found, q: np.ndarray) -> Verdict:
    return model.judge(found.z, q) if found.stop is Stop.CONVERGED else model.why(found, q)
