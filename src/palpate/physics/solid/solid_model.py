"""The equations of a body under interactions, as functions of the inputs, and how they are built for a problem."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import Attached, Energy
from palpate.physics.interactions.interaction_checks import require_support
from palpate.physics.interactions.rigid_limit import with_rigid_pad
from palpate.physics.materials.pre_stretched import PreStretched
from palpate.physics.solid.solid_energy import History, material_energies
from palpate.physics.solid.solid_field import SolidField
from palpate.physics.solid.solid_measures import Measures
from palpate.physics.solid.solid_newton import NewtonResult, Scale, equilibrate, error_at
from palpate.physics.solid.solid_path import PathPoint, PathResult, follow
from palpate.physics.solid.solid_system import Inputs, System
from palpate.physics.stop import Stop, Verdict

if TYPE_CHECKING:
    from palpate.physics.solid.solid_body import Body
    from palpate.physics.solid.solid_problem import SolidProblem

__all__ = ["BodyElements", "ConstantInteraction", "OpenProblem", "SolidModel", "open_problem"]

FLOOR = 1e-14  # J that count as nothing, over shear modulus times volume
SMALL = 1e-6  # share of the largest energy on the way that still counts
INSTANT = 1e-9  # s; so short that nothing relaxes
BALANCED = 1e-6  # share of all forces on nodes that rounding may leave
SETTLED = 1e9  # s that constant loads have acted before an interaction comes: all relaxation is over
STEP_LIMIT = 12  # factorisations in one load step: more are cheaper in two halves


@dataclass(frozen=True, eq=False)
class ConstantInteraction:
    """An attached interaction with inputs that stay as they are."""

    attached: Attached
    values: np.ndarray


class BodyElements:
    """Finite elements of a body without interactions: its unknowns, energies, histories and measures.

    The problem gives the body, and the places where its mesh is fine; `solver` is NGSolve's name of a sparse solver,
    `tolerance` the relative error in the energy norm at which an iteration ends. `time_step` is the duration of a load
    step in s, `histories` are the internal variables by region, of materials with a history.
    """

    def __init__(self, problem: SolidProblem, solver: str, tolerance: float) -> None:
        import ngsolve

        body = self.body = problem.body
        self.solver, self.tolerance = solver, tolerance
        mesh = body.geometry.mesh(problem.refinements)
        self.field = SolidField(mesh, problem.mesh, body.order, body.fixed, body.mixed_regions)
        self.time_step = ngsolve.Parameter(SETTLED)
        self.histories = {
            region: History(self.field, region, material, self.time_step)
            for region, material in body.materials.items()
            if material.states
        }
        self.energies = material_energies(self.field, body.materials, self.histories)
        self.measures = Measures(self.field, body.materials, self.histories)

    def system(self, energies: Sequence[Energy], free: np.ndarray) -> System:
        """Return the equations of a sum of energies on the free unknowns, a mask (dof,)."""
        return System(self.field, energies, free, self.solver)


class SolidModel:
    """Π(z; q) of a body: its material, constant interactions and those whose inputs q (n,) vary.

    `base` (dof,) are the unknowns under the constant interactions alone; `duration` is that of the whole path that is
    followed, in s.
    """

    def __init__(
        self,
        elements: BodyElements,
        constants: Sequence[ConstantInteraction],
        varied: Sequence[Attached],
        base: np.ndarray,
    ) -> None:
        self._elements, self.base, self._constants = elements, base, tuple(constants)
        self.field, self.histories, self.measures = elements.field, elements.histories, elements.measures
        self.duration, self.step_error = 0.0, elements.body.step_error
        self.inputs = Inputs(self.field, varied)
        fixed = Inputs(self.field, [constant.attached for constant in constants])
        values = np.concatenate([[], *(constant.values for constant in constants)])
        fixed.set(values)
        self._load = values @ fixed.loads
        self._given = ~self.field.free | fixed.constrained | self.inputs.constrained
        parts = {
            "materials": elements.energies,
            "constant": [energy for constant in constants for energy in constant.attached.energies],
            "varied": [energy for part in varied for energy in part.energies],
        }
        self.system = elements.system(list(itertools.chain(*parts.values())), ~self._given)
        self._terms = {
            name: elements.system(energies, ~self._given) for name, energies in parts.items() if energies
        }
        self._base_step = self._base_stored = self._base_constant = 0.0
        self._floor = FLOOR * self.measures.shear_modulus * self.measures.volume
        self.scale = Scale(0.0, self._floor)
        self._tangent = False
        self.spans = np.ones(self.inputs.size)
        self._largest_response = 0.0

    @property
    def has_tangent(self) -> bool:
        """True where a tangent of this body and its present history is factorised."""
        return self._tangent

    def measure_from_base(self) -> None:
        """Measure energies from the base state, in which the varied interactions have none."""
        self.begin(0.0)
        self._base_step, self._base_constant = self._term("materials"), self._term("constant")
        base = self._base_step + self._base_constant - float(self._load @ self.base)
        self.scale = Scale(base, self._floor)
        self.field.show(self.base)
        self._base_stored = self.measures.stored_energy() if self._knows_stored_energy else self._base_step

    def forget(self) -> None:
        """Drop the tangent and the size of the response, which earlier solves left behind."""
        self._tangent, self._largest_response = False, 0.0

    def error(self, z: np.ndarray) -> float:
        """Return the relative error in the energy norm of a state (dof,), with the present tangent."""
        return error_at(self.system, self.scale, z)

    def set(self, q: np.ndarray) -> None:
        """Make q (n,) the inputs."""
        self.inputs.set(q)
        self.system.load = self._load + q @ self.inputs.loads

    def begin(self, share: float) -> None:
        """Get ready for a load step that takes a share of the duration."""
        if self.histories:
            self._elements.time_step.Set(max(share * self.duration, INSTANT))
            for history in self.histories.values():
                history.begin()

    def commit(self, z: np.ndarray) -> None:
        """Take over the internal variables at the end of a step that led to z (dof,)."""
        self.field.show(z)
        for history in self.histories.values():
            history.advance()

    def snapshot(self) -> dict[str, dict[str, np.ndarray]]:
        """Return copies of the internal variables by region."""
        return {region: history.snapshot() for region, history in self.histories.items()}

    def restore(self, snapshot: Mapping[str, dict[str, np.ndarray]]) -> None:
        """Put former internal variables back."""
        for region, values in snapshot.items():
            self.histories[region].restore(values)

    def response(self, z: np.ndarray) -> np.ndarray:
        """Return -∂U/∂q (n,) at an equilibrium z (dof,) under the present inputs."""
        return -self.inputs.gradient(z, self.system.gradient(z))

    def step_mismatch(self, whole: np.ndarray, halves: np.ndarray) -> float:
        """Return the difference of the responses (n,) after a step and after its halves, over the tolerated one.

        They are weighted by the spans of their inputs, so that forces and moments add up as works do.
        """
        size, mismatch = (float(np.linalg.norm(self.spans * r)) for r in (halves, whole - halves))
        self._largest_response = max(self._largest_response, size)
        return mismatch / (self.step_error * max(self._largest_response, self._floor))

    def impose(self, z: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return unknowns z (dof,) with the given ones as the inputs want them."""
        return np.where(self._given, self.base + q @ self.inputs.lifts, z)

    def conclude(self, z: np.ndarray) -> tuple[float, float]:
        """Return strain energy and U in J at the end z (dof,) of a path; the internal variables are taken over.

        In an instant the body's share is the incremental energy that was minimised, whose derivative is the
        response exactly. Over time it is the free energy: what is minimised in a step of time is no stored energy.
        """
        step = self._term("materials", z)
        self.commit(z)
        if self.duration > 0 and self._knows_stored_energy:
            strain = self.measures.stored_energy()
            return strain, strain - self._base_stored + self._work(z)
        return step - self._base_step + self._base_stored, step - self._base_step + self._work(z)

    @property
    def _knows_stored_energy(self) -> bool:
        """True where there are histories, all of laws that know their free energy."""
        available = [history.stored is not None for history in self.histories.values()]
        return bool(available) and all(available)

    def _work(self, z: np.ndarray) -> float:
        """Return the interactions' energy in J less the potential of the loads, both from the base state."""
        constant = self._term("constant", z) - self._base_constant - float(self._load @ (z - self.base))
        return constant + self._term("varied", z) - float((self.system.load - self._load) @ z)

    def _term(self, name: str, z: np.ndarray | None = None) -> float:
        """Return the energy in J of materials, constant or varied interactions, by default in the base state."""
        state = self.base if z is None else z
        return self._terms[name].potential(state) if name in self._terms else 0.0

    def search(self, q: np.ndarray, guess: np.ndarray, *, fresh: bool = False) -> NewtonResult:
        """Search the equilibrium under inputs q near a guess (dof,), with a fresh or the present tangent, if any."""
        self.set(q)
        end = equilibrate(
            self.system,
            guess,
            self.scale,
            self._elements.tolerance,
            STEP_LIMIT,
            fresh=fresh or not self._tangent,
        )
        self._tangent = self._tangent or end.iterations > 0
        if end.stop is Stop.CONVERGED:
            # where the energy passes zero, it is measured by what it was before
            reached = SMALL * abs(self.system.potential(end.z) - self.scale.reference)
            self.scale = Scale(self.scale.reference, max(self.scale.floor, reached))
        return end

    def sensitivity(self, z: np.ndarray) -> np.ndarray | None:
        """Return ∂z/∂q (n, dof) with the present tangent, or None where there is none yet."""
        return self.inputs.sensitivity(self.system, z) if self._tangent else None

    def scales(self) -> tuple[Scale, float]:
        """Return the scales that energies and responses are measured by."""
        return self.scale, self._largest_response

    def restore_scales(self, scales: tuple[Scale, float]) -> None:
        """Measure by former scales, and begin with a fresh tangent."""
        self.scale, self._largest_response = scales
        self._tangent = False

    def fresh_sensitivity(self, z: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return ∂z/∂q (n, dof) with a fresh tangent at a state (dof,) under inputs q (n,)."""
        self.set(q)
        self.system.factorise(z)
        self._tangent = True
        return self.inputs.sensitivity(self.system, z)

    def judge(self, z: np.ndarray, q: np.ndarray) -> Verdict:
        """Return a verdict on a state (dof,), whatever way it was found."""
        self.field.show(z)
        figures: dict[str, float] = {"least_volume_ratio": self.measures.least_volume_ratio()}
        if figures["least_volume_ratio"] <= 0:
            return Verdict(Stop.ELEMENT_INVERTED, f"det F = {figures['least_volume_ratio']:.2g}", figures)
        strain = self.measures.largest_small_strain()
        if strain > self._elements.body.strain_limit:
            return Verdict(
                Stop.STRAIN_LIMIT, f"{strain:.2g} against {self._elements.body.strain_limit:g}", figures
            )
        for part, values in self._acting(q):
            verdict = part.inspect(values)
            for name, figure in verdict.figures.items():
                figures[name] = max(figure, figures.get(name, figure))
            if verdict.stop is not Stop.CONVERGED:
                return Verdict(verdict.stop, verdict.detail, figures)
        return Verdict(figures=figures)

    def _acting(self, q: np.ndarray) -> list[tuple[Attached, np.ndarray]]:
        """Return all interactions with their inputs: those that vary, and those that are constant."""
        varied = zip(self.inputs.attached, (q[rows] for rows in self.inputs.slices), strict=True)
        return [*varied, *((constant.attached, constant.values) for constant in self._constants)]

    def explain(self, end: NewtonResult, q: np.ndarray) -> Verdict:
        """Return the reason for which a search failed: the state that it had to refuse tells more than the refusal."""
        if end.rejected is not None and end.stop in {Stop.STEP_TOO_SMALL, Stop.NOT_FINITE}:
            verdict = self.judge(end.rejected, q)
            if verdict.stop is not Stop.CONVERGED:
                return verdict
        return Verdict(end.stop)

    def approach(self, q: np.ndarray) -> np.ndarray | None:
        """Return inputs (n,) at which the body is left alone, from which a straight line leads to q."""
        parts = [
            a.approach(q[rows]) for a, rows in zip(self.inputs.attached, self.inputs.slices, strict=True)
        ]
        return None if any(part is None for part in parts) else np.concatenate([[], *parts])

    def distance(self, here: np.ndarray, there: np.ndarray) -> float:
        """Return how dear it is to go from one vector of inputs to another, on the scale of a straight approach."""
        total = 0.0
        for part, rows in zip(self.inputs.attached, self.inputs.slices, strict=True):
            if part.distance is not None:
                total += part.distance(here[rows], there[rows]) ** 2
            else:
                total += float(np.linalg.norm(there[rows] - here[rows])) ** 2
        return float(np.sqrt(total))

    @property
    def has_stiff_pads(self) -> bool:
        """True where a path is easier under a softer pad, see `stiffen`."""
        return any(part.stiffen is not None for part in self.inputs.attached)

    def stiffen(self, share: float) -> None:
        """Give very stiff pads a share of their stiffness."""
        for part in self.inputs.attached:
            if part.stiffen is not None:
                part.stiffen(share)

    def first_step(self) -> float:
        """Return the longest first step along a path, as a distance between inputs."""
        return min((part.first_step for part in self.inputs.attached), default=np.inf)


@dataclass(frozen=True, eq=False)
class OpenProblem:
    """The finite elements of a problem."""

    model: SolidModel  # ready for inputs
    settled: PathResult | None  # path to the base state, if the body has constant loads


def open_problem(problem: SolidProblem, solver: str, tolerance: float) -> OpenProblem:
    """Build mesh, spaces, energies and the base state of a problem; no rigid motion of its body may be free."""
    elements = BodyElements(problem, solver, tolerance)
    field, body = elements.field, problem.body
    constants = _constants(field, body)
    base, settled = np.zeros(field.size), None
    if constants:
        require_support(field, [constant.attached for constant in constants])
        alone = SolidModel(elements, [], [constant.attached for constant in constants], base)
        settled = _settle(alone, constants)
        base = settled.last.z
        field.set_base(base)
    varied = [interaction.attach(field) for interaction in problem.acting]
    if not constants:
        require_support(field, varied)
    model = SolidModel(elements, constants, varied, base)
    if any(isinstance(material, PreStretched) for material in body.materials.values()):
        _require_balance(model, base)
    model.spans = np.array([r.high - r.low for r in problem.ranges])
    return OpenProblem(model, settled)


def _require_balance(model: SolidModel, base: np.ndarray) -> None:
    """Refuse a tense body that would move before anything touches it: depths are measured to it as it is drawn."""
    forces = model.system.gradient(base)
    least = BALANCED * model.measures.shear_modulus * model.measures.volume ** (2 / 3)
    left = np.linalg.norm(forces * model.system.free) / max(np.linalg.norm(forces), least)
    if left > BALANCED:
        raise UsageError(
            f"The pre-stretched body is not in balance: {left:.2g} of its forces at rest are held by nothing.",
            why="A stretched part pulls at its sides; one that is free would shrink before it is touched.",
            fix='Fix its sides too, for example fixed=("bottom", "side").',
        )


def _settle(model: SolidModel, constants: list[ConstantInteraction]) -> PathResult:
    """Follow the body under its constant loads, brought up from nothing."""
    target = np.concatenate([constant.values for constant in constants])
    start = model.approach(target)
    start = np.zeros_like(target) if start is None else start
    model.duration = SETTLED
    path = follow(model, PathPoint(start, model.impose(model.base, start)), target)
    if path.verdict.stop is Stop.CONVERGED:
        model.commit(path.last.z)
    return path


def _constants(field: SolidField, body: Body) -> list[ConstantInteraction]:
    """Return gravity and the interactions that always act."""
    constants = [
        ConstantInteraction(
            with_rigid_pad(held.interaction, body.materials).attach(field),
            np.asarray(held.values, dtype=float),
        )
        for held in body.held
    ]
    if any(body.gravity):
        constants.append(ConstantInteraction(_gravity(field, body), np.ones(1)))
    return constants


def _gravity(field: SolidField, body: Body) -> Attached:
    """Return the weight as a dead load, whose one input is the share of it that acts."""
    import ngsolve

    weights = {region: material.density for region, material in body.materials.items()}
    force = field.mesh.MaterialCF(weights) * ngsolve.CF(body.gravity)
    load = field.load(lambda v: force * v * ngsolve.dx)
    return Attached((ngsolve.Parameter(0.0),), loads=load[None, :])
