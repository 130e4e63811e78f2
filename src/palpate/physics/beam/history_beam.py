"""The incremental energy of a beam whose sections remember.

Over one step, from given internal variables and for a given time, the beam is a `newton.Model` like the elastic one:
its energy is that of the sections, condensed over their internal variables, and its minimum the equilibrium at the
end of the step. Nothing is remembered until the step's outcome is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.physics.beam.line_elements import LineElements
from palpate.physics.beam.reissner import BandedTangent
from palpate.physics.beam.resultants import SectionAnswer, SectionLaw
from palpate.physics.beam.strains import Strains

__all__ = ["HistoryBeam", "Step"]

RELAXATIONS = (
    12  # linear solves that put axial and shear forces in balance; two or three do where few fibres yield
)
BALANCED = 1e-14  # share of the energy below which what is left to be gained counts as nothing


class HistoryBeam:
    """Finite elements of a clamped plane beam over a section law.

    Parameters
    ----------
    vertices : (node,) array
        Positions of the mesh's vertices in m, ascending; the first one is clamped.
    order : int
        Polynomial order of the elements.
    law : SectionLaw
    large : bool
        Geometrically exact, or small displacements.
    """

    def __init__(self, vertices: np.ndarray, order: int, law: SectionLaw, *, large: bool) -> None:
        self.elements = LineElements(vertices, order)
        self.law, self.large = law, large
        self.energy_floor = 1e-24 * law.elastic[2] / float(vertices[-1] - vertices[0])
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
        """Which unknowns are those of the vertices but the first, shape (node - 1, 3)."""
        return self.elements.vertex_values

    def rest(self) -> Any:
        """Internal variables of the virgin beam."""
        return self.law.rest(self.elements.weights.shape)

    def step(self, internal: Any, dt: float | None) -> Step:
        """Open a step of dt seconds from the given internal variables; None is an instant."""
        return Step(self, internal, dt)

    def strains(self, z: np.ndarray) -> np.ndarray:
        """Axial strain, shear strain and curvature at the Gauss points, shape (element, point, 3)."""
        return Strains(self.elements.at_points(z), large=self.large).values

    def stored(self, z: np.ndarray, internal: Any) -> float:
        """Energy in J that can be had back."""
        return self._integral(self.law.stored(self.strains(z), internal))

    def dissipated(self, before: Any, after: Any, dt: float | None) -> float:
        """Energy in J that a step took for good."""
        return self._integral(self.law.dissipated(before, after, dt))

    def distributed(self, force: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Load vector of a constant force per length (x, y) in N/m: (dof,) and the clamped three."""
        return self.elements.uniform(force)

    def _integral(self, density: np.ndarray) -> float:
        return float((density * self.elements.weights).sum())


@dataclass(frozen=True)
class _State:
    """A state z (dof,) with the strains and the answers of the sections there."""

    z: np.ndarray
    strains: Strains
    answer: SectionAnswer


class Step:
    """One step of a beam that remembers (a `newton.Model`).

    Parameters
    ----------
    beam : HistoryBeam
    internal : value
        Internal variables at the beginning of the step.
    dt : float or None
        Its length in s; None is an instant.
    """

    def __init__(self, beam: HistoryBeam, internal: Any, dt: float | None) -> None:
        self._beam, self._internal, self._dt = beam, internal, dt
        self.energy_floor = beam.energy_floor
        self._state: _State | None = None

    def energy(self, z: np.ndarray) -> float:
        """Incremental energy in J."""
        return float((self._at(z).answer.energy * self._beam.elements.weights).sum())

    def force(self, z: np.ndarray) -> np.ndarray:
        """Its derivative, shape (dof,)."""
        return self._forces(z)[0]

    def clamp_force(self, z: np.ndarray) -> np.ndarray:
        """Its derivative by (u, v, t) at the clamp, shape (3,)."""
        return self._forces(z)[1]

    def tangent(self, z: np.ndarray) -> _ShiftedTangent:
        """Its second derivative."""
        return _ShiftedTangent(self._banded(z), lambda: self._elastic(z))

    def relax(self, z: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Minimise energy - load·z over the displacements, the rotations held.

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
        """Internal variables at the end of the step."""
        return self._at(z).answer.internal

    def dissipated(self, z: np.ndarray) -> float:
        """Energy in J that the step took for good."""
        return self._beam.dissipated(self._internal, self.outcome(z), self._dt)

    def resultants(self, z: np.ndarray) -> np.ndarray:
        """N, Q in N and M in N·m at the Gauss points, shape (element, point, 3)."""
        return self._at(z).answer.force

    def _relaxation(self, z: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, float]:
        """A Newton step in the displacements alone, and its decrement."""
        banded = np.where(self._beam.between_translations, self._banded(z), 0.0)
        banded[-1] += ~self._beam.is_translation
        residual = (self.force(z) - load) * self._beam.is_translation
        step = BandedTangent(banded, banded).solve(residual, 0.0)
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

    def _elastic(self, z: np.ndarray) -> np.ndarray:
        """The stiffness that the sections had if they did not yield, without what the turning of forces adds."""
        stiffness = np.diag(self._beam.law.elastic)
        return self._beam.elements.banded(self._at(z).strains.stiffness(np.zeros(3), stiffness))

    def _banded(self, z: np.ndarray) -> np.ndarray:
        state = self._at(z)
        return self._beam.elements.banded(state.strains.stiffness(state.answer.force, state.answer.tangent))


class _ShiftedTangent:
    """A tangent in banded storage (a `newton.Tangent`).

    An indefinite one is shifted by the elastic stiffness: what has buckled is short of bending stiffness, what has
    yielded of that and of axial stiffness.
    """

    def __init__(self, banded: np.ndarray, shifter: Callable[[], np.ndarray]) -> None:
        self._banded, self._make = banded, shifter
        self._shifter: np.ndarray | None = None

    def solve(self, rhs: np.ndarray, shift: float) -> np.ndarray | None:
        """(K + shift·M)⁻¹ rhs, or None if K + shift·M is not positive definite."""
        if shift and self._shifter is None:
            self._shifter = self._make()  # seldom asked for
        other = self._banded if self._shifter is None else self._shifter
        return BandedTangent(self._banded, other).solve(rhs, shift)
