"""Following an equilibrium from one load to another in steps that adapt themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from palpate.physics.equilibrium.newton import Equilibrium, Model, minimise
from palpate.physics.equilibrium.stop import Stop

__all__ = ["LoadPath", "follow"]

NEWTON_LIMIT = 60  # a step that needs more iterations is cheaper in two halves
TOTAL_LIMIT = 600  # iterations over a whole path: bounds the time that a pointless load costs
SMALLEST_STEP = 2.0**-10
GROWTH = 2.0


@dataclass(frozen=True)
class LoadPath:
    """A straight path of load vectors (dof,), and the equilibrium at its beginning."""

    start: np.ndarray
    end: np.ndarray
    state: np.ndarray

    def at(self, position: float) -> np.ndarray:
        """Load at a position between 0 and 1."""
        load: np.ndarray = self.start + position * (self.end - self.start)
        return load


def follow(
    model: Model,
    path: LoadPath,
    predictor: np.ndarray,
    admit: Callable[[np.ndarray], Stop],
    near: Callable[[np.ndarray, np.ndarray], bool],
) -> Equilibrium:
    """Follow the equilibrium along a path of loads.

    The whole path is tried in one step first. A step that fails is halved, one that succeeds is doubled. So is a
    step halved that leads far away: under a large load a body may have several stable equilibria, and a long
    step may fall into another one than that which the load leads to. What is still far after the smallest step
    is where the body snaps to.

    Parameters
    ----------
    model : Model
    path : LoadPath
    predictor : (dof,) array
        Guess of the state at the path's end; where it lowers the energy it replaces the start.
    admit : callable
        Says of an equilibrium's unknowns `Stop.CONVERGED`, or why the model has no say there, which ends the
        path.
    near : callable
        Whether an equilibrium's unknowns (second) are near enough to those before the step (first) to be of the
        same branch of equilibria.

    Returns
    -------
    Equilibrium
        With the iterations of all steps.
    """
    state, position, step, spent, trusted = path.state, 0.0, 1.0, 0, True
    while True:
        target = min(1.0, position + step)
        load = path.at(target)
        guess = _lower(model, load, state, predictor) if target == 1.0 and trusted else state
        found = minimise(model, load, guess, limit=min(NEWTON_LIMIT, TOTAL_LIMIT - spent))
        spent += found.iterations
        half = (target - position) / 2
        if found.stop is Stop.CONVERGED and (near(state, found.z) or half < SMALLEST_STEP):
            verdict = admit(found.z)
            if target == 1.0 or verdict is not Stop.CONVERGED:
                return replace(found, stop=verdict, iterations=spent)
            state, position, step = found.z, target, step * GROWTH
        else:
            trusted = trusted and found.stop is not Stop.CONVERGED  # else it led astray
            step = half
        if spent >= TOTAL_LIMIT or step < SMALLEST_STEP:
            return replace(found, z=state, stop=_reason(found.stop), iterations=spent)


def _lower(model: Model, load: np.ndarray, state: np.ndarray, predictor: np.ndarray) -> np.ndarray:
    """Whichever of two states has the lower potential energy."""
    gain = (model.energy(predictor) - load @ predictor) - (model.energy(state) - load @ state)
    return predictor if gain < 0 else state  # NaN keeps the state


def _reason(stop: Stop) -> Stop:
    """What a step was cut back for, its iteration limit or leading far, is not the reason for the end."""
    return Stop.STEP_TOO_SMALL if stop in {Stop.ITERATION_LIMIT, Stop.CONVERGED} else stop
