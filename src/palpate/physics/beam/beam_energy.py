"""The energy of a plane beam on finite elements, elastic or with memory.

Geometrically exact (Reissner 1972, J. Appl. Math. Phys. 23, 795-804; Simo 1985, Comput. Methods Appl. Mech.
Eng. 49, 55-70): with the centre line's displacement (u, v) and the section's rotation t over the arc length x
of the undeformed beam,

    axial strain  ε = (1 + u') cos t + v' sin t - 1
    shear strain  γ = v' cos t - (1 + u') sin t
    curvature     κ = t'
    W = ∫ w(ε, γ, κ) dx

where the section law gives w, for an elastic beam ½ (EA ε² + kGA γ² + EI κ²). The small-displacement beam
(Timoshenko 1921) has ε = u', γ = v' - t and κ = t' instead.

Over one step, from given internal variables and for a given time, W is the incremental energy, condensed over the
internal variables; its minimum is the equilibrium at the end of the step. Nothing is remembered until the step's
outcome is asked for. A beam without memory has the same energy in all steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from palpate.physics.beam.beam_element import LineElements, Strains
from palpate.physics.beam.section_laws import SectionAnswer, SectionLaw

__all__ = ["BandedTangent", "BeamEnergy", "BeamStep"]

# linear solves that put axial and shear forces in balance; two or three do where few fibres yield
RELAXATIONS = 12
BALANCED = 1e-14  # share of the energy below which what is left to be gained counts as nothing


class BeamEnergy:
    """Finite elements of a clamped plane beam over a section law, geometrically exact if `large`.

    The first of the ascending `vertices` (node,), in m, is clamped; the elements are of polynomial order 2 or more.
    """

    def __init__(self, vertices: np.ndarray, order: int, law: SectionLaw, *, large: bool) -> None:
        self.elements = LineElements(vertices, order)
        self.law, self.large = law, large
        self.energy_floor = 1e-24 * float(law.elastic[2]) / float(vertices[-1] - vertices[0])
        self.is_translation = self.elements.translations()
        rows, columns = self.elements.band_columns()
        # entries between displacements; above the matrix' first row the band holds nothing
        self.between_translations = self.is_translation[rows] & self.is_translation[columns] & (rows >= 0)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.elements.size

    @property
    def vertex_dofs(self) -> np.ndarray:
        """Indices of the unknowns of the vertices but the first, shape (node - 1, 3)."""
        return self.elements.vertex_values

    def rest(self) -> Any:
        """Return the internal variables of the virgin beam."""
        return self.law.rest(self.elements.weights.shape)

    def step(self, internal: Any, dt: float | None) -> BeamStep:
        """Open a step of dt seconds from the given internal variables; None is an instant."""
        return BeamStep(self, internal, dt)

    def strains(self, z: np.ndarray) -> np.ndarray:
        """Return axial strain, shear strain and curvature at the Gauss points, shape (element, point, 3)."""
        return Strains(self.elements.at_points(z), large=self.large).values

    def strains_end_to_end(self, z: np.ndarray) -> np.ndarray:
        """Return the strains at five points from end to end of each element, shape (element, 5, 3)."""
        return Strains(self.elements.end_to_end(z), large=self.large).values

    def stored_energy(self, z: np.ndarray, internal: Any) -> float:
        """Return the energy in J that can be had back."""
        return self._integral(self.law.stored_energy(self.strains(z), internal))

    def dissipated_energy(self, before: Any, after: Any, dt: float | None) -> float:
        """Return the energy in J that a step took for good."""
        return self._integral(self.law.dissipated_energy(before, after, dt))

    def _integral(self, density: np.ndarray) -> float:
        return float((density * self.elements.weights).sum())


@dataclass(frozen=True)
class _State:
    """A state z (dof,) with the strains and the answers of the sections there."""

    z: np.ndarray
    strains: Strains
    answer: SectionAnswer


class BeamStep:
    """One step of a beam (an `EnergyModel`), from the internal variables at its beginning.

    Its length `dt` is in s; None is an instant.
    """

    def __init__(self, beam: BeamEnergy, internal: Any, dt: float | None) -> None:
        self._beam, self._internal, self._dt = beam, internal, dt
        self.energy_floor = beam.energy_floor
        self._state: _State | None = None

    def energy(self, z: np.ndarray) -> float:
        """Return the incremental energy in J."""
        return float((self._at(z).answer.energy * self._beam.elements.weights).sum())

    def force(self, z: np.ndarray) -> np.ndarray:
        """Return the derivative of the energy, shape (dof,)."""
        return self._forces(z)[0]

    def clamp_force(self, z: np.ndarray) -> np.ndarray:
        """Return the derivative of the energy by (u, v, t) at the clamp, shape (3,)."""
        return self._forces(z)[1]

    def tangent(self, z: np.ndarray) -> BandedTangent:
        """Return the second derivative of the energy."""
        return BandedTangent(self._banded_tangent(z), lambda: self._shifter(z))

    def relax(self, z: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Minimise energy - load·z over the displacements, the rotations fixed.

        Given the rotations the strains are linear in the displacements and the energy is convex in the strains, so
        Newton's method needs no safeguard but that each step gains. Where the energy is quadratic, one step does.
        """
        potential = self.energy(z) - float(load @ z)
        for _ in range(1 if self._beam.law.quadratic else RELAXATIONS):
            better, gain = self._relaxation(z, load)
            there = self.energy(better) - float(load @ better)
            if not there <= potential:  # True for NaN, too
                break
            z, potential = better, there
            if gain <= BALANCED * max(self.energy(z), self.energy_floor):
                break
        return z

    def outcome(self, z: np.ndarray) -> Any:
        """Return the internal variables at the end of the step."""
        return self._at(z).answer.internal

    def dissipated_energy(self, z: np.ndarray) -> float:
        """Return the energy in J that the step took for good."""
        return self._beam.dissipated_energy(self._internal, self.outcome(z), self._dt)

    def resultants(self, z: np.ndarray) -> np.ndarray:
        """Return N, Q in N and M in N·m at the Gauss points, shape (element, point, 3)."""
        return self._at(z).answer.force

    def _relaxation(self, z: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, float]:
        """Return z after a Newton step in the displacements alone, and its decrement."""
        banded = np.where(self._beam.between_translations, self._banded_tangent(z), 0.0)
        banded[-1] += ~self._beam.is_translation
        residual = (self.force(z) - load) * self._beam.is_translation
        step = BandedTangent(banded).solve(residual)
        return (z, 0.0) if step is None else (z - step, float(residual @ step))

    def _at(self, z: np.ndarray) -> _State:
        # the search asks for energy, force and tangent of one state one after the other
        if self._state is None or not np.array_equal(self._state.z, z):
            strains = Strains(self._beam.elements.at_points(z), large=self._beam.large)
            answer = self._beam.law.answer(strains.values, self._internal, self._dt)
            self._state = _State(z.copy(), strains, answer)
        return self._state

    def _forces(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        state = self._at(z)
        return self._beam.elements.forces(state.strains.forces(state.answer.force))

    def _shifter(self, z: np.ndarray) -> np.ndarray:
        """Return the stiffness that an indefinite tangent is shifted by, without what the turning of forces adds."""
        stiffness = np.diag(self._beam.law.shift)
        return self._beam.elements.banded_matrix(self._at(z).strains.stiffness(np.zeros(3), stiffness))

    def _banded_tangent(self, z: np.ndarray) -> np.ndarray:
        state = self._at(z)
        return self._beam.elements.banded_matrix(
            state.strains.stiffness(state.answer.force, state.answer.tangent)
        )


class BandedTangent:
    """A symmetric matrix K in upper banded storage (band + 1, dof), and M to shift it by (a `Tangent`).

    The diagonal is the last row. `shifter` returns M in the same storage; it is asked once, where K is indefinite.
    """

    def __init__(self, banded: np.ndarray, shifter: Callable[[], np.ndarray] | None = None) -> None:
        self._banded, self._make = banded, shifter
        self._shifter: np.ndarray | None = None

    def solve(self, rhs: np.ndarray, shift: float = 0.0) -> np.ndarray | None:
        """Return (K + shift·M)⁻¹ rhs by Cholesky's method, or None if K + shift·M is not positive definite."""
        banded = self._banded
        if shift and self._make is not None:
            self._shifter = self._make() if self._shifter is None else self._shifter
            banded = banded + shift * self._shifter
        try:
            factor = cholesky_banded(banded, check_finite=False)
        except LinAlgError:
            return None
        solution: np.ndarray = cho_solve_banded((factor, False), rhs, check_finite=False)
        return solution
