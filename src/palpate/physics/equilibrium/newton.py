"""Newton's method as an energy minimisation.

Finds a minimum of Π(z) = W(z) - f·z. Near the minimum the Newton decrement λ² = rᵀK⁻¹r is twice the energy
still to be gained, so √(λ²/energy) is the relative error in the energy norm. It is the criterion here because
it weighs each residual by its compliance: the round-off of a stiff direction (stretching a beam) can neither
hide nor feign the convergence of a soft one (bending it), as it could in a norm of the residual.

Slender bodies are stiff in some directions and soft in others, and a step along the soft ones that is right to
first order costs stiff energy in the second: the line search would crawl. So each trial state is first relaxed:
energy is minimised, by one linear solve, over unknowns in which it is quadratic (variable projection; Golub &
Pereyra 1973).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate.physics.equilibrium.stop import Stop

__all__ = ["Equilibrium", "Model", "Tangent", "minimise"]

ARMIJO = 1e-4  # share of the predicted decrease that a step must bring (Nocedal & Wright 2006, eq. 3.4)
ROUND_OFF = 1e-6  # below this relative error energy differences drown in round-off: steps are taken whole
SHIFTS = (0.0, *(1e-4 * 3.0**power for power in range(16)))
SMALLEST_STEP = 2.0**-14


class Tangent(Protocol):
    """Second derivative K of a strain energy at one state."""

    def solve(self, rhs: np.ndarray, shift: float) -> np.ndarray | None:
        """(K + shift·M)⁻¹ rhs with a stiffness M of the body's own kind, or None if K + shift·M is indefinite."""


class Model(Protocol):
    """A strain energy W(z) of unknowns z (dof,) and its derivatives."""

    energy_floor: float
    """Energy in J that counts as nothing."""

    def energy(self, z: np.ndarray) -> float:
        """W in J."""

    def force(self, z: np.ndarray) -> np.ndarray:
        """∂W/∂z, shape (dof,)."""

    def tangent(self, z: np.ndarray) -> Tangent:
        """∂²W/∂z²."""

    def relax(self, z: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Minimise W - load·z over those unknowns in which W is quadratic, the others held; or return z."""


@dataclass(frozen=True)
class Equilibrium:
    """Where the iteration ended: unknowns z (dof,), the reason, its cost and relative error."""

    z: np.ndarray
    stop: Stop
    iterations: int
    residual: float


def minimise(
    model: Model,
    load: np.ndarray,
    start: np.ndarray,
    *,
    tolerance: float = 1e-10,
    limit: int = 30,
) -> Equilibrium:
    """Minimise W(z) - load·z from `start`.

    Parameters
    ----------
    model : Model
    load, start : (dof,) array
    tolerance : float
        Relative error in the energy norm.
    limit : int
        Largest number of iterations.

    Returns
    -------
    Equilibrium
        Never raises for want of convergence: `stop` says how it ended.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # overflow shows as an error that is not finite
        return _iterate(model, load, start, tolerance, limit)


def _iterate(model: Model, load: np.ndarray, start: np.ndarray, tolerance: float, limit: int) -> Equilibrium:
    z, last = model.relax(start, load), math.inf
    for iteration in range(limit):
        step, decrement, stable = _direction(model, load, z)
        error = math.sqrt(decrement / _scale(model, load, z)) if decrement >= 0 else math.nan
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


def _scale(model: Model, load: np.ndarray, z: np.ndarray) -> float:
    return max(model.energy(z), abs(float(load @ z)), model.energy_floor)


def _direction(model: Model, load: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, float, bool]:
    """Newton step, its decrement (NaN if there is none) and whether the tangent is positive definite."""
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
    model: Model, load: np.ndarray, z: np.ndarray, step: np.ndarray, decrement: float
) -> np.ndarray | None:
    """A state along the step that lowers the energy enough (Armijo, halving), or None."""
    here = model.energy(z) - float(load @ z)
    length = 1.0
    while length >= SMALLEST_STEP:
        there = model.relax(z - length * step, load)
        if model.energy(there) - float(load @ there) <= here - ARMIJO * length * decrement:  # False for NaN
            return there
        length /= 2
    return None
