"""Newton's method for an opened body, with tangents used as long as they serve.

A tangent costs some thirty times a residual and a back-substitution. So after each full Newton step the same
tangent goes on giving cheap chord steps while these shrink the error fast enough; only then is it renewed.

Each step is safeguarded. In displacement form the energy must fall (Armijo 1966; Nocedal & Wright 2006, eq.
3.4). In mixed form an equilibrium is a saddle of the energy, so the natural monotonicity test takes its place:
the correction that the same tangent gives at the trial state must be shorter (Deuflhard 2004, Newton Methods for
Nonlinear Problems, sec. 3.3); it too doesn't depend on how unknowns and equations are scaled.

The error is √(|rᵀK⁻¹r|/energy), about the relative error in the energy norm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.physics.solid.solid_system import System
from palpate.physics.stop import Stop

__all__ = ["NewtonResult", "Scale", "equilibrate", "error_at"]

ARMIJO = 1e-4  # share of the predicted decrease that a step must bring
SMALLEST = 2.0**-6  # shortest step of a line search, as a share of Newton's step
ROUND_OFF = 1e-6  # below this relative error energy differences drown in round-off
CHORD = 0.4  # a chord step that leaves more of the error than this is worth less than a new tangent
CHORDS = 12  # chord steps with one tangent


@dataclass(frozen=True)
class Scale:
    """The scale of energies: J from `reference`, at least `floor`."""

    reference: float
    floor: float

    def error(self, decrement: float, potential: float) -> float:
        """Return the relative error in the energy norm of a state with this decrement rᵀK⁻¹r in J."""
        return math.sqrt(decrement / max(abs(potential - self.reference), self.floor))


def error_at(system: System, scale: Scale, z: np.ndarray) -> float:
    """Return the relative error in the energy norm of a state (dof,), with the present tangent."""
    residual = system.residual(z)
    return _error(system, scale, residual, system.solve(residual), system.potential(z))


def _error(
    system: System, scale: Scale, residual: np.ndarray, correction: np.ndarray, potential: float
) -> float:
    moving, products = system.field.moving, residual * correction
    # in mixed form the two parts have opposite signs and must not cancel
    decrement = abs(float(products[moving].sum())) + abs(float(products[~moving].sum()))
    return scale.error(decrement, potential) if math.isfinite(decrement) else math.inf


@dataclass(frozen=True)
class NewtonResult:
    """The end of an iteration."""

    z: np.ndarray  # (dof,) the last accepted state
    stop: Stop
    iterations: int  # tangents assembled and factorised
    error: float  # relative error in the energy norm before the last correction
    chords: int = 0  # steps with a tangent used before
    cuts: int = 0  # halvings of steps
    rejected: np.ndarray | None = None  # (dof,) the last state that the line search refused, to tell why


@dataclass
class _Point:
    """A state, its potential, its residual and the correction of the present tangent."""

    z: np.ndarray
    potential: float
    residual: np.ndarray
    correction: np.ndarray
    error: float


def equilibrate(
    system: System, start: np.ndarray, scale: Scale, tolerance: float, limit: int, *, fresh: bool = True
) -> NewtonResult:
    """Find the equilibrium near `start` (dof,), whose given unknowns stay as they are.

    `tolerance` is the relative error in the energy norm; the correction then at hand is still made. `limit` is the
    largest number of factorisations. The iteration begins with a new tangent if `fresh`, else it tries the present one
    first. It never raises for want of convergence: `NewtonResult.stop` says how it ended.
    """
    return _Iteration(system, scale, tolerance).run(start, limit, fresh=fresh)


class _Iteration:
    """The running iteration and its counts."""

    def __init__(self, system: System, scale: Scale, tolerance: float) -> None:
        self._system, self._scale, self._tolerance = system, scale, tolerance
        self._chords = self._cuts = self._iterations = 0
        self._rejected: np.ndarray | None = None

    def run(self, start: np.ndarray, limit: int, *, fresh: bool) -> NewtonResult:
        potential = self._system.potential(start)
        if not math.isfinite(potential):
            self._rejected = start
            return self._end(start, Stop.NOT_FINITE, math.inf)
        residual = self._system.residual(start)
        if not residual.any():
            return self._end(start, Stop.CONVERGED, 0.0)
        point = _Point(start, potential, residual, np.zeros(0), math.inf)
        if not fresh:
            point = self._chord_steps(self._with_correction(point))
        last = math.inf
        while point.error > self._tolerance and not 0.25 * last < point.error < ROUND_OFF:
            if self._iterations == limit:
                return self._end(point.z, Stop.ITERATION_LIMIT, point.error)
            last = point.error
            advanced = self._newton_step(point)
            if isinstance(advanced, Stop):
                return self._end(point.z, advanced, point.error)
            point = self._chord_steps(advanced)
        return self._end(point.z - point.correction, Stop.CONVERGED, point.error)

    def _newton_step(self, point: _Point) -> _Point | Stop:
        """Take one step with a new tangent, or why there is none."""
        self._system.factorise(point.z)
        self._iterations += 1
        point = self._with_correction(point)
        if not math.isfinite(point.error):
            return Stop.SINGULAR
        if not self._system.saddle and point.residual @ point.correction <= 0:
            return Stop.UNSTABLE  # the energy has a negative curvature: no minimum is near
        if point.error <= self._tolerance:
            return point
        length = 1.0
        while length >= SMALLEST:
            trial = self._trial(point, length)
            if trial is not None:
                return trial
            length /= 2
            self._cuts += 1
        return Stop.STEP_TOO_SMALL

    def _trial(self, point: _Point, length: float) -> _Point | None:
        """Return the state after a step of this length, if it is good enough."""
        z = point.z - length * point.correction
        potential = self._system.potential(z)
        if not self._falls(point, potential, length):
            self._rejected = z
            return None
        trial = self._with_correction(_Point(z, potential, self._system.residual(z), point.correction, 0.0))
        if self._system.saddle and not self._shortens(point, trial, length):
            self._rejected = None  # admissible: no earlier, longer step tells why the search fails
            return None
        return trial

    def _falls(self, point: _Point, potential: float, length: float) -> bool:
        """Return whether a trial state is admissible and, in displacement form, its energy low enough."""
        if not math.isfinite(potential):
            return False
        if self._system.saddle or point.error < ROUND_OFF:
            return True
        slope = float(point.residual @ point.correction)
        return potential <= point.potential - ARMIJO * length * slope

    def _shortens(self, point: _Point, trial: _Point, length: float) -> bool:
        """Apply the natural monotonicity test, in the displacements."""
        moving = self._system.field.moving
        before, after = (float(np.linalg.norm(p.correction[moving])) for p in (point, trial))
        return after <= (1 - length / 4) * before or trial.error < ROUND_OFF

    def _chord_steps(self, point: _Point) -> _Point:
        """Go on with the present tangent while it shrinks the error fast enough."""
        for _ in range(CHORDS):
            if not self._tolerance < point.error < 0.3:  # farther off, only a safeguarded step will do
                break
            z = point.z - point.correction
            potential = self._system.potential(z)
            if not math.isfinite(potential):
                break
            self._chords += 1
            trial = self._with_correction(
                _Point(z, potential, self._system.residual(z), point.correction, 0.0)
            )
            if not trial.error < point.error:
                break
            slow = trial.error > CHORD * point.error
            point = trial
            if slow:
                break
        return point

    def _with_correction(self, point: _Point) -> _Point:
        """Return the state with the present tangent's correction and the error."""
        correction = self._system.solve(point.residual)
        error = _error(self._system, self._scale, point.residual, correction, point.potential)
        return _Point(point.z, point.potential, point.residual, correction, error)

    def _end(self, z: np.ndarray, stop: Stop, error: float) -> NewtonResult:
        return NewtonResult(z, stop, self._iterations, error, self._chords, self._cuts, self._rejected)
