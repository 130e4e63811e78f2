"""The equations of a body under interactions, as functions of the inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.equilibrium.stop import Stop, Verdict
from palpate.physics.interactions.interaction import Attached, Energy
from palpate.physics.solid.field import SolidField
from palpate.physics.solid.measures import Measures
from palpate.physics.solid.newton import Found, Scale, equilibrate
from palpate.physics.solid.response import Inputs
from palpate.physics.solid.system import System

if TYPE_CHECKING:
    from palpate.physics.solid.history import History

__all__ = ["Constant", "SolidModel"]

FLOOR = 1e-14  # J that count as nothing, over shear modulus times volume
SMALL = 1e-6  # share of the largest energy on the way that still counts
INSTANT = 1e-9  # s; so short that nothing relaxes
STEP_LIMIT = 12  # factorisations in one load step: more are cheaper in two halves


@dataclass(frozen=True, eq=False)
class Constant:
    """An interaction with inputs that stay as they are."""

    attached: Attached
    values: np.ndarray


class SolidModel:
    """Π(z; q) of a body: its material, constant interactions and those whose inputs q (n,) vary.

    Parameters
    ----------
    field : SolidField
    materials : sequence of Energy
    histories : mapping of str to History
    constants : sequence of Constant
    varied : sequence of Attached
    base : (dof,) array
        Unknowns under the constant interactions alone.
    solver : str
        NGSolve's name of a sparse solver.
    tolerance : float
        Relative error in the energy norm.
    measures : Measures
    time_step : ngsolve.Parameter
        Duration of a load step in s.

    Attributes
    ----------
    duration : float
        Of the whole path that is followed, in s.
    base_energy : float
        What `energies` gives of the base state, in J.
    """

    def __init__(
        self,
        field: SolidField,
        materials: Sequence[Energy],
        histories: Mapping[str, History],
        constants: Sequence[Constant],
        varied: Sequence[Attached],
        base: np.ndarray,
        solver: str,
        tolerance: float,
        measures: Measures,
        time_step: Any,
    ) -> None:
        self.duration, self._time_step = 0.0, time_step
        self.field, self.base, self.histories, self.measures = field, base, histories, measures
        self.inputs = Inputs(field, varied)
        self._tolerance = tolerance
        fixed = Inputs(field, [constant.attached for constant in constants])
        values = np.concatenate([[], *(constant.values for constant in constants)])
        fixed.set(values)
        self._load = values @ fixed.loads
        self._given = ~field.free | fixed.held | self.inputs.held
        parts = [c.attached for c in constants] + list(varied)
        self._materials = System(field, materials, ~self._given, solver)
        energies = [*materials, *(energy for part in parts for energy in part.energies)]
        self.system = System(field, energies, ~self._given, solver)
        self.base_energy = 0.0
        self._floor = FLOOR * measures.shear_modulus * measures.volume
        self.scale = Scale(0.0, self._floor)
        self._tangent = False

    def measure_from_base(self) -> None:
        """Measure energies from the base state; the inputs must leave the body alone."""
        self.begin(0.0)
        self.scale = Scale(self.system.potential(self.base), self._floor)
        self.base_energy = self.energies(self.base)[1]

    def set(self, q: np.ndarray) -> None:
        """Make q (n,) the inputs."""
        self.inputs.set(q)
        self.system.load = self._load + q @ self.inputs.loads

    def begin(self, share: float) -> None:
        """Get ready for a load step that takes a share of the duration."""
        if self.histories:
            self._time_step.Set(max(share * self.duration, INSTANT))
            for history in self.histories.values():
                history.begin()

    def commit(self, z: np.ndarray) -> None:
        """Take over the internal variables at the end of a step that led to z (dof,)."""
        self.field.show(z)
        for history in self.histories.values():
            history.advance()

    def impose(self, z: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Unknowns z (dof,) with the given ones as the inputs want them."""
        return np.where(self._given, self.base + q @ self.inputs.lifts, z)

    def energies(self, z: np.ndarray) -> tuple[float, float]:
        """Strain energy ∫ W dV in J, and that plus the interactions' energies less the loads' potential.

        For a material with a history W is the free energy, with the internal variables as they are now: the
        density that is minimised in a step is no stored energy.
        """
        self.field.show(z)
        least, strain = self.system.potential(z), self._materials.potential(z)
        if not any(history.stored is not None for history in self.histories.values()):
            return strain, least
        stored = self.measures.stored_energy()
        return stored, least - strain + stored

    def search(self, q: np.ndarray, guess: np.ndarray) -> Found:
        """Equilibrium under inputs q near a guess (dof,)."""
        self.set(q)
        found = equilibrate(
            self.system, guess, self.scale, self._tolerance, STEP_LIMIT, fresh=not self._tangent
        )
        self._tangent = self._tangent or found.iterations > 0
        if found.stop is Stop.CONVERGED:
            # where the energy passes zero, it is measured by what it was before
            reached = SMALL * abs(self.system.potential(found.z) - self.scale.reference)
            self.scale = Scale(self.scale.reference, max(self.scale.floor, reached))
        return found

    def sensitivity(self, z: np.ndarray) -> np.ndarray | None:
        """∂z/∂q (n, dof) with the present tangent, or None where there is none yet."""
        return self.inputs.sensitivity(self.system, z) if self._tangent else None

    def judge(self, z: np.ndarray, q: np.ndarray) -> Verdict:
        """Whether a state (dof,) is admissible, whatever way it was found."""
        self.field.show(z)
        figures: dict[str, float] = {"least_volume_ratio": self.measures.least_volume_ratio()}
        if figures["least_volume_ratio"] <= 0:
            return Verdict(Stop.ELEMENT_INVERTED, f"det F = {figures['least_volume_ratio']:.2g}", figures)
        for part, rows in zip(self.inputs.attached, self.inputs.slices, strict=True):
            verdict = part.inspect(q[rows])
            figures |= verdict.figures
            if verdict.stop is not Stop.CONVERGED:
                return Verdict(verdict.stop, verdict.detail, figures)
        return Verdict(figures=figures)

    def why(self, found: Found, q: np.ndarray) -> Verdict:
        """Why a search failed: the state that it had to refuse tells more than the refusal."""
        if found.rejected is not None and found.stop in {Stop.STEP_TOO_SMALL, Stop.NOT_FINITE}:
            verdict = self.judge(found.rejected, q)
            if verdict.stop is not Stop.CONVERGED:
                return verdict
        return Verdict(found.stop)

    def approach(self, q: np.ndarray) -> np.ndarray | None:
        """Inputs (n,) at which the body is left alone, from which a straight line leads to q."""
        parts = [
            a.approach(q[rows]) for a, rows in zip(self.inputs.attached, self.inputs.slices, strict=True)
        ]
        return None if any(part is None for part in parts) else np.concatenate([[], *parts])

    def distance(self, here: np.ndarray, there: np.ndarray) -> float:
        """How dear it is to go from one vector of inputs to another."""
        total = 0.0
        for part, rows in zip(self.inputs.attached, self.inputs.slices, strict=True):
            length: Callable[[Any, Any], float] = part.distance or _length
            total += length(here[rows], there[rows]) ** 2
        return float(np.sqrt(total))

    def first_step(self) -> float:
        """Longest first step along a path, as a distance between inputs."""
        return min((part.first_step for part in self.inputs.attached), default=np.inf)


def _length(here: np.ndarray, there: np.ndarray) -> float:
    return float(np.linalg.norm(there - here))
