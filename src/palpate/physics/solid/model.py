"""The equations of a body under interactions, as functions of the inputs."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.interactions.interaction import Attached, Energy
from palpate.physics.solid.field import SolidField
from palpate.physics.solid.measures import Measures
from palpate.physics.solid.newton import Found, Scale, equilibrate, error_at
from palpate.physics.solid.response import Inputs
from palpate.physics.solid.system import System
from palpate.physics.stop import Stop, Verdict

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
    strain_limit : float
        Largest principal strain at which a law of small strain is still asked.
    step_error : float
        Error in time of the response that one step of a body with a history may make, over the largest response.

    Attributes
    ----------
    duration : float
        Of the whole path that is followed, in s.
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
        strain_limit: float,
        step_error: float,
    ) -> None:
        self.duration, self._time_step = 0.0, time_step
        self.field, self.base, self.histories, self.measures = field, base, histories, measures
        self.inputs = Inputs(field, varied)
        self._tolerance = tolerance
        self._constants, self._strain_limit, self.step_error = tuple(constants), strain_limit, step_error
        fixed = Inputs(field, [constant.attached for constant in constants])
        values = np.concatenate([[], *(constant.values for constant in constants)])
        fixed.set(values)
        self._load = values @ fixed.loads
        self._given = ~field.free | fixed.held | self.inputs.held
        parts = {
            "materials": list(materials),
            "constant": [energy for constant in constants for energy in constant.attached.energies],
            "varied": [energy for part in varied for energy in part.energies],
        }
        self.system = System(field, list(itertools.chain(*parts.values())), ~self._given, solver)
        self._terms = {
            name: System(field, energies, ~self._given, solver)
            for name, energies in parts.items()
            if energies
        }
        self._base_step = self._base_stored = self._base_constant = 0.0
        self._floor = FLOOR * measures.shear_modulus * measures.volume
        self.scale = Scale(0.0, self._floor)
        self._tangent = False
        self.spans = np.ones(self.inputs.size)
        self._most = 0.0

    @property
    def has_tangent(self) -> bool:
        """Whether a tangent of this body and its present history is factorised."""
        return self._tangent

    def measure_from_base(self) -> None:
        """Measure energies from the base state, in which the varied interactions have none."""
        self.begin(0.0)
        self._base_step, self._base_constant = self._term("materials"), self._term("constant")
        base = self._base_step + self._base_constant - float(self._load @ self.base)
        self.scale = Scale(base, self._floor)
        self.field.show(self.base)
        self._base_stored = self.measures.stored_energy() if self._tells_stored else self._base_step

    def forget(self) -> None:
        """Drop what earlier solves left behind and later ones would begin with: tangent and size of the response."""
        self._tangent, self._most = False, 0.0

    def error(self, z: np.ndarray) -> float:
        """Relative error in the energy norm of a state (dof,), with the present tangent."""
        return error_at(self.system, self.scale, z)

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

    def remembered(self) -> dict[str, dict[str, np.ndarray]]:
        """Internal variables by region."""
        return {region: history.snapshot() for region, history in self.histories.items()}

    def recall(self, remembered: Mapping[str, dict[str, np.ndarray]]) -> None:
        """Put former internal variables back."""
        for region, snapshot in remembered.items():
            self.histories[region].restore(snapshot)

    def response(self, z: np.ndarray) -> np.ndarray:
        """-∂U/∂q (n,) at an equilibrium z (dof,) under the present inputs."""
        return -self.inputs.gradient(z, self.system.gradient(z))

    def step_mismatch(self, whole: np.ndarray, halves: np.ndarray) -> float:
        """Difference of the responses (n,) after a step and after its halves, over what is tolerated.

        They are weighted by the spans of their inputs, so that forces and moments add up as works do.
        """
        size, mismatch = (float(np.linalg.norm(self.spans * r)) for r in (halves, whole - halves))
        self._most = max(self._most, size)
        return mismatch / (self.step_error * max(self._most, self._floor))

    def impose(self, z: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Unknowns z (dof,) with the given ones as the inputs want them."""
        return np.where(self._given, self.base + q @ self.inputs.lifts, z)

    def conclude(self, z: np.ndarray) -> tuple[float, float]:
        """Strain energy and U in J at the end z (dof,) of a path; the internal variables are taken over.

        In an instant the body's share is the incremental energy that was minimised, whose derivative is the
        response exactly. Over time it is the free energy: what is minimised in a step of time is no stored energy.
        """
        step = self._term("materials", z)
        self.commit(z)
        if self.duration > 0 and self._tells_stored:
            strain = self.measures.stored_energy()
            return strain, strain - self._base_stored + self._work(z)
        return step - self._base_step + self._base_stored, step - self._base_step + self._work(z)

    @property
    def _tells_stored(self) -> bool:
        """Whether there are histories, all of laws that know their free energy."""
        known = [history.stored is not None for history in self.histories.values()]
        return bool(known) and all(known)

    def _work(self, z: np.ndarray) -> float:
        """Energy in J of all but the body itself: of interactions, less the potential of the loads, from the base."""
        constant = self._term("constant", z) - self._base_constant - float(self._load @ (z - self.base))
        return constant + self._term("varied", z) - float((self.system.load - self._load) @ z)

    def _term(self, name: str, z: np.ndarray | None = None) -> float:
        """Energy in J of the materials, the constant or the varied interactions, by default in the base state."""
        state = self.base if z is None else z
        return self._terms[name].potential(state) if name in self._terms else 0.0

    def search(self, q: np.ndarray, guess: np.ndarray, *, fresh: bool = False) -> Found:
        """Equilibrium under inputs q near a guess (dof,), from a fresh tangent or from the present one, if any."""
        self.set(q)
        found = equilibrate(
            self.system, guess, self.scale, self._tolerance, STEP_LIMIT, fresh=fresh or not self._tangent
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

    def standing(self) -> tuple[Scale, float]:
        """What energies and responses are measured by."""
        return self.scale, self._most

    def stand(self, standing: tuple[Scale, float]) -> None:
        """Measure by what was measured by before, and begin with a fresh tangent."""
        self.scale, self._most = standing
        self._tangent = False

    def slope_at(self, z: np.ndarray, q: np.ndarray) -> np.ndarray:
        """∂z/∂q (n, dof) with a fresh tangent at a state (dof,) under inputs q (n,)."""
        self.set(q)
        self.system.factorise(z)
        self._tangent = True
        return self.inputs.sensitivity(self.system, z)

    def judge(self, z: np.ndarray, q: np.ndarray) -> Verdict:
        """Whether a state (dof,) is admissible, whatever way it was found."""
        self.field.show(z)
        figures: dict[str, float] = {"least_volume_ratio": self.measures.least_volume_ratio()}
        if figures["least_volume_ratio"] <= 0:
            return Verdict(Stop.ELEMENT_INVERTED, f"det F = {figures['least_volume_ratio']:.2g}", figures)
        strain = self.measures.largest_small_strain()
        if strain > self._strain_limit:
            return Verdict(Stop.STRAIN_LIMIT, f"{strain:.2g} against {self._strain_limit:g}", figures)
        for part, values in self._acting(q):
            verdict = part.inspect(values)
            for name, figure in verdict.figures.items():
                figures[name] = max(figure, figures.get(name, figure))
            if verdict.stop is not Stop.CONVERGED:
                return Verdict(verdict.stop, verdict.detail, figures)
        return Verdict(figures=figures)

    def _acting(self, q: np.ndarray) -> list[tuple[Attached, np.ndarray]]:
        """All interactions with their inputs: those that vary, and those that are held."""
        varied = zip(self.inputs.attached, (q[rows] for rows in self.inputs.slices), strict=True)
        return [*varied, *((constant.attached, constant.values) for constant in self._constants)]

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
