"""Building the finite elements of a problem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import Attached
from palpate.physics.interactions.rigid import require_held
from palpate.physics.materials.pre_stretched import PreStretched
from palpate.physics.solid.density import material_energies
from palpate.physics.solid.field import SolidField
from palpate.physics.solid.history import History
from palpate.physics.solid.measures import Measures
from palpate.physics.solid.model import Constant, SolidModel
from palpate.physics.solid.path import Followed, Known, follow
from palpate.physics.stop import Stop

if TYPE_CHECKING:
    from palpate.physics.solid.body import Body
    from palpate.physics.solid.problem import SolidProblem

__all__ = ["Opened", "open_problem"]

BALANCED = 1e-6  # of all forces on nodes: rounding
SETTLED = 1e9  # s that constant loads have acted before an interaction comes: all relaxation is over


@dataclass(frozen=True, eq=False)
class Opened:
    """The finite elements of a problem.

    Attributes
    ----------
    model : SolidModel
    settled : Followed or None
        How the base state was found, if the body has constant loads.
    """

    model: SolidModel
    settled: Followed | None


def open_problem(problem: SolidProblem, solver: str, tolerance: float) -> Opened:
    """Mesh, spaces, energies and the base state.

    Raises
    ------
    UsageError
        If nothing holds the body.
    """
    import ngsolve

    body = problem.body
    mesh = body.geometry.mesh(problem.refinements)
    field = SolidField(mesh, problem.mesh, body.order, body.fixed, body.mixed_regions)
    time_step = ngsolve.Parameter(SETTLED)
    histories = {
        region: History(field, region, material, time_step)
        for region, material in body.materials.items()
        if material.states
    }
    energies = material_energies(field, body.materials, histories)
    measures = Measures(field, body.materials, histories)
    constants = _constants(field, body)
    rest = np.zeros(field.size)
    base, settled = rest, None

    def model(constants: list[Constant], varied: list[Attached], base: np.ndarray) -> SolidModel:
        return SolidModel(
            field,
            energies,
            histories,
            constants,
            varied,
            base,
            solver,
            tolerance,
            measures,
            time_step,
            body.strain_limit,
            body.step_error,
        )

    if constants:
        require_held(field, [constant.attached for constant in constants])
        settled = _settle(model(constants=[], varied=[c.attached for c in constants], base=rest), constants)
        base = settled.last.z
        field.settle(base)
    varied = [interaction.attach(field) for interaction in problem.interactions]
    if not constants:
        require_held(field, varied)
    opened = model(constants, varied, base)
    if any(isinstance(material, PreStretched) for material in body.materials.values()):
        _require_balance(opened, base)
    opened.spans = np.array([r.high - r.low for r in problem.ranges])
    return Opened(opened, settled)


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


def _settle(model: SolidModel, constants: list[Constant]) -> Followed:
    """The body under its constant loads, brought up from nothing."""
    target = np.concatenate([constant.values for constant in constants])
    start = model.approach(target)
    start = np.zeros_like(target) if start is None else start
    model.duration = SETTLED
    found = follow(model, Known(start, model.impose(model.base, start)), target)
    if found.verdict.stop is Stop.CONVERGED:
        model.commit(found.last.z)
    return found


def _constants(field: SolidField, body: Body) -> list[Constant]:
    """Gravity and the interactions that always act."""
    constants = [
        Constant(held.interaction.attach(field), np.asarray(held.values, dtype=float)) for held in body.held
    ]
    if any(body.gravity):
        constants.append(Constant(_gravity(field, body), np.ones(1)))
    return constants


def _gravity(field: SolidField, body: Body) -> Attached:
    """The weight as a dead load, whose one input is the share of it that acts."""
    import ngsolve

    weights = {region: material.density for region, material in body.materials.items()}
    force = field.mesh.MaterialCF(weights) * ngsolve.CF(body.gravity)
    load = field.load(lambda v: force * v * ngsolve.dx)
    return Attached((ngsolve.Parameter(0.0),), loads=load[None, :])
