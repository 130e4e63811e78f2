"""Newton's method for beams as an energy minimisation, and paths of equilibria from load to load.

`minimise` finds a minimum of Π(z) = W(z) - f·z. Near the minimum the Newton decrement λ² = rᵀK⁻¹r is twice the energy
still to be gained, so √(λ²/energy) is the relative error in the energy norm. It is the criterion here because
it weighs each residual by its compliance: the round-off of a stiff direction (stretching a beam) can neither
hide nor feign the convergence of a soft one (bending it), as it could in a norm of the residual.

Slender bodies are stiff in some directions and soft in others, and a step along the soft ones that is right to
first order costs stiff energy in the second: the line search would crawl. So each trial state is first relaxed:
energy is minimised, by one linear solve, over unknowns in which it is quadratic (variable projection; Golub &
Pereyra 1973).

`follow` leads an equilibrium from one load to another, in steps that adapt themselves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from palpate.physics.stop import Stop

__all__ = ["EnergyModel", "Equilibrium", "LoadPath", "Tangent", "follow", "lower_state", "minimise"]

ARMIJO = 1e-4  # share of the predicted decrease that a step must bring (Nocedal & Wright 2006, eq. 3.4)
ROUND_OFF = 1e-6  # below this relative error energy differences drown in round-off: steps are taken whole
# factors of a tangent's shifter M, tried in turn until the shifted tangent is positive definite
SHIFTS = (0.0, *(1e-4 * 3.0**power for power in range(16)))
SHORTEST_STEP = 2.0**-14  # of a line search, as a share of Newton's step

NEWTON_LIMIT = 60  # a load step that needs more iterations is cheaper in two halves
TOTAL_LIMIT = 600  # iterations over a whole path: bounds the time that a pointless load costs
SMALLEST_STEP = 2.0**-10  # of a path, as a share of its length
GROWTH = 2.0  # factor of the next step of a path after one that succeeded


class Tangent(Protocol):
    """Second derivative K of a strain energy at one state."""

    def solve(self, rhs: np.ndarray, shift: float) -> np.ndarray | None:
        """Return (K + shift·M)⁻¹ rhs with a stiffness M of the body's own kind; None if K + shift·M is indefinite."""


class EnergyModel(Protocol):
    """A strain energy W(z) of unknowns z (dof,) and its derivatives."""

    energy_floor: float
    """Energy in J that counts as nothing."""

    def energy(self, z: np.ndarray) -> float:
        """Return W in J."""

    def force(self, z: np.ndarray) -> np.ndarray:
        """Return ∂W/∂z, shape (dof,)."""

    def tangent(self, z: np.ndarray) -> Tangent:
        """Return ∂²W/∂z²."""

    def relax(self, z: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Minimise W - load·z over those unknowns in which W is quadratic, the others fixed; or return z."""


@dataclass(frozen=True)
class Equilibrium:
    """The end of an iteration: unknowns z (dof,), the reason, its cost and relative error."""

    z: np.ndarray
    stop: Stop
    iterations: int
    residual: float


def minimise(
    model: EnergyModel,
    load: np.ndarray,
    start: np.ndarray,
    *,
    tolerance: float = 1e-10,
    limit: int = 30,
) -> Equilibrium:
    """Minimise W(z) - load·z from `start` (dof,), to a relative error `tolerance` in the energy norm.

    It never raises for want of convergence: `Equilibrium.stop` says how the iteration ended.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # overflow shows as an error that is not finite
        return _iterate(model, load, start, tolerance, limit)


def _iterate(
    model: EnergyModel, load: np.ndarray, start: np.ndarray, tolerance: float, limit: int
) -> Equilibrium:
    z, last = model.relax(start, load), math.inf
    for iteration in range(limit):
        step, decrement, stable = _direction(model, load, z)
        scale = max(model.energy(z), abs(float(load @ z)), model.energy_floor)
        error = math.sqrt(decrement / scale) if decrement >= 0 else math.nan
        if not math.isfinite(error):
            return Equilibrium(z, Stop.NOT_FINITE, iteration, math.inf)
        stagnant = error < ROUND_OFF and error > 0.25 * last
        if error <= tolerance or stagnant:
            return Equilibrium(z - step, Stop.CONVERGED if stable else Stop.UNSTABLE, iteration + 1, error)
        better = z - step if error < ROUND_OFF else _line_search(model, load, z, step, decrement)
        if better is None:
            return Equilibrium(z, Stop.STEP_TOO_SMALL, iteration + 1, error)
        z, last = better, error
    return Equilibrium(z, Stop.ITERATION_LIMIT, limit, last)


def _direction(model: EnergyModel, load: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, float, bool]:
    """Return Newton's step, its decrement (NaN if there is none) and whether the tangent is positive definite."""
    residual = model.force(z) - load
    if not np.isfinite(residual).all():
        return residual, math.nan, False
    tangent = model.tangent(z)
    # an indefinite tangent is shifted until it is positive definite, so that the step goes downhill
    for shift in SHIFTS:
        step = tangent.solve(residual, shift)
        if step is not None:
            return step, float(residual @ step), shift == 0.0
    return residual, math.nan, False


def _line_search(
    model: EnergyModel, load: np.ndarray, z: np.ndarray, step: np.ndarray, decrement: float
) -> np.ndarray | None:
    """Return a state along the step that lowers the energy enough (Armijo, halving), or None."""
    here = model.energy(z) - float(load @ z)
    length = 1.0
    while length >= SHORTEST_STEP:
        there = model.relax(z - length * step, load)
        if model.energy(there) - float(load @ there) <= here - ARMIJO * length * decrement:  # False for NaN
            return there
        length /= 2
    return None


@dataclass(frozen=True)
class LoadPath:
    """A straight path of load vectors (dof,), and the equilibrium at its beginning."""

    start: np.ndarray
    end: np.ndarray
    state: np.ndarray

    def at(self, position: float) -> np.ndarray:
        """Return the load at a position between 0 and 1."""
        load: np.ndarray = self.start + position * (self.end - self.start)
        return load


def follow(
    model: EnergyModel,
    path: LoadPath,
    predictor: np.ndarray,
    admit: Callable[[np.ndarray], Stop],
    near: Callable[[np.ndarray, np.ndarray], bool],
) -> Equilibrium:
    """Follow the equilibrium along a path of loads; the result has the iterations of all steps.

    The whole path is tried in one step first. A step that fails is halved, one that succeeds is doubled. So is a step
    halved that leads far away: under a large load a body may have several stable equilibria, and a long step may fall
    into another one than that which the load leads to. What is still far after the smallest step is where the body
    snaps to.

    `predictor` (dof,) is a guess of the state at the path's end; where it lowers the energy it replaces the start.
    `admit` returns for an equilibrium's unknowns `Stop.CONVERGED`, or why the model does not hold there, which ends the
    path. `near` tells whether an equilibrium's unknowns (second) are near enough to those before the step (first) to be
    of the same branch of equilibria.
    """
    state, position, step, spent, trusted = path.state, 0.0, 1.0, 0, True
    while True:
        target = min(1.0, position + step)
        load = path.at(target)
        guess = lower_state(model, load, state, predictor) if target == 1.0 and trusted else state
        end = minimise(model, load, guess, limit=min(NEWTON_LIMIT, TOTAL_LIMIT - spent))
        spent += end.iterations
        half = (target - position) / 2
        if end.stop is Stop.CONVERGED and (near(state, end.z) or half < SMALLEST_STEP):
            verdict = admit(end.z)
            if target == 1.0 or verdict is not Stop.CONVERGED:
                return replace(end, stop=verdict, iterations=spent)
            state, position, step = end.z, target, step * GROWTH
        else:
            trusted = trusted and end.stop is not Stop.CONVERGED  # else it led astray
            step = half
        if spent >= TOTAL_LIMIT or step < SMALLEST_STEP:
            return replace(end, z=state, stop=_reason(end.stop), iterations=spent)


def lower_state(model: EnergyModel, load: np.ndarray, state: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Return whichever of two states has the lower potential energy."""
    gain = (model.energy(guess) - load @ guess) - (model.energy(state) - load @ state)
    return guess if gain < 0 else state  # NaN keeps the state


def _reason(stop: Stop) -> Stop:
    """Return the reason for the end of a path: not that for which a step was cut back, its limit or leading far."""
    return Stop.STEP_TOO_SMALL if stop in {Stop.ITERATION_LIMIT, Stop.CONVERGED} else stop
