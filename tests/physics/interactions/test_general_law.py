"""One law for all interactions: response = -∂U/∂q, its gradient symmetric, forces in balance."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.physics.interactions import (
    BodyForce,
    GluedPad,
    PointForce,
    PrescribedDisplacement,
    Pressure,
    SurfaceTraction,
)
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.physics.solid.solid_model import open_problem

BLOCK = Block((0.04, 0.04, 0.02), element=0.02)
CORNERS = ((0.015, 0.015), (0.025, 0.025))
RANGE = (-0.01, 0.01)

# an interaction, its inputs, and steps of the differences; small for places, since the bump is smooth twice only
CASES = {
    "pad at a place": (
        GluedPad(radius=0.01, at=(0.02, 0.02, 0.02), displacement=(RANGE, RANGE, RANGE), element=0.007),
        (0.001, -0.0015, 0.003),
        (1e-5, 1e-5, 1e-5),
    ),
    "pad on its way": (
        GluedPad(radius=0.01, over=CORNERS, displacement=(RANGE, 0.0, RANGE), element=0.007),
        (0.002, -0.003, 0.018, 0.022),
        (1e-5, 1e-5, 2e-6, 2e-6),
    ),
    "prescribed, two directions": (
        PrescribedDisplacement("top", ("x", (0, 1, 1)), (RANGE, RANGE)),
        (0.003, -0.004),
        (1e-5, 1e-5),
    ),
    "prescribed, part of a surface": (
        PrescribedDisplacement("top", "-z", RANGE, within=((0.01, 0.01, 0), (0.03, 0.03, 1)), element=0.01),
        (0.002,),
        (1e-5,),
    ),
    "sliding": (PrescribedDisplacement("top", "z", RANGE, sliding=True), (-0.003,), (1e-5,)),
    "point force": (PointForce((0.02, 0.02, 0.02), 0.008, (0.0, 1.0), "x", element=0.006), (0.05,), (1e-3,)),
    "traction": (SurfaceTraction("side", "normal", (0.0, 1e3)), (300.0,), (3.0,)),
    "body force": (BodyForce((0.0, 1e5), (1, 0, 1)), (3e4,), (1e2,)),
}
BODY = Body(BLOCK, NeoHookean(9e3, 0.3))
MIXED = Body(BLOCK, NeoHookean(9e3, 0.499), formulation="mixed")
IN_MIXED_FORM = ("pad on its way", "prescribed, two directions", "traction")


@pytest.fixture(
    scope="module",
    params=[*((BODY, name) for name in CASES), *((MIXED, name) for name in IN_MIXED_FORM)],
    ids=[*CASES, *(f"{name}, mixed" for name in IN_MIXED_FORM)],
)
def case(request):
    body, name = request.param
    interaction, q, steps = CASES[name]
    solver = body.problem(interaction).open(tolerance=1e-11)
    return solver, np.array(q), np.diag(steps)


@pytest.mark.full
@pytest.mark.grid
def test_response_is_the_energy_s_slope(case):
    solver, q, steps = case
    response = solver.solve(q).response
    slopes = []
    for step in steps:
        # fourth-order differences, so that the steps can stay far from round-off
        near = [solver.solve(q + k * step).potential_energy for k in (-2, -1, 1, 2)]
        slopes.append(-(near[0] - 8 * near[1] + 8 * near[2] - near[3]) / 12 / step.max())
    np.testing.assert_allclose(slopes, response, atol=1e-5 * np.abs(response).max())


@pytest.mark.full
def test_response_gradient_is_the_response_s_slope_and_symmetric(case):
    solver, q, steps = case
    solution = solver.solve(q)
    gradient = solution.response_gradient
    raw, _ = solver._model.inputs.raw_hessian(solver._model.system, solution.state)
    np.testing.assert_allclose(raw, raw.T, atol=1e-9 * np.abs(raw).max())
    slopes = []
    for step in steps:
        near = [solver.solve(q + k * step).response for k in (-2, -1, 1, 2)]
        slopes.append((near[0] - 8 * near[1] + 8 * near[2] - near[3]) / 12 / step.max())
    scale = np.sqrt(np.outer(np.abs(np.diag(gradient)), np.abs(np.diag(gradient))))
    assert (np.abs(np.array(slopes).T - gradient) <= 1e-5 * scale).all()


@pytest.mark.parametrize(
    "name", ["pad at a place", "prescribed, two directions", "prescribed, part of a surface"]
)
def test_response_is_the_sum_of_the_reactions(name):
    """What the hand feels is what the fixed surface bears."""
    interaction, q, _ = CASES[name]
    problem = BODY.problem(interaction)
    solution = problem.open(tolerance=1e-11).solve(q)
    model = open_problem(problem, "sparsecholesky", 1e-11).model
    model.set(np.array(q))
    moves = np.array([model.field.interpolate(_unit(i)) for i in range(3)])
    borne = moves @ (model.system.gradient(solution.state) * model.field.surface_dofs("bottom"))
    # reactions at the bottom hold against what acts on the top: on the hand the body exerts what the bottom exerts
    directions = {
        "pad at a place": np.eye(3),
        "prescribed, two directions": np.array([[1, 0, 0], [0, 0.5**0.5, 0.5**0.5]]),
        "prescribed, part of a surface": np.array([[0, 0, -1.0]]),
    }[name]
    np.testing.assert_allclose(solution.response, directions @ borne, atol=1e-8 * np.abs(borne).max())


def _unit(axis):
    import ngsolve

    return ngsolve.CF(tuple(float(i == axis) for i in range(3)))


@pytest.mark.parametrize("surface", ["top", "side"])
def test_a_pressure_pushes_along_the_deformed_normal(surface):
    """The derivative of its energy is q n da, whatever the deformation, and its response the swept volume."""
    import ngsolve

    body = Body(BLOCK, NeoHookean(9e3, 0.3), fixed=("bottom", "side" if surface == "top" else "top"))
    solver = body.problem(Pressure(surface, (-3e3, 3e3))).open(tolerance=1e-11)
    q, step = 1.5e3, 15.0
    solution = solver.solve(q)
    near = [solver.solve(q + k * step).potential_energy for k in (-2, -1, 1, 2)]
    slope = (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / 12 / step
    assert solution.response.item() == pytest.approx(-slope, rel=1e-5)
    field = open_problem(body.problem(Pressure(surface, (0.0, 1.0))), "sparsecholesky", 1e-9).model.field
    field.show(solution.state)
    F = ngsolve.Id(3) + ngsolve.Grad(field.displacement)
    shrunk = ngsolve.Integrate((1 - ngsolve.Det(F)) * ngsolve.dx, field.mesh)
    assert solution.response.item() == pytest.approx(shrunk, rel=1e-9)


def test_a_pad_s_displacement_comes_before_its_place():
    """As in the surrogate that is learnt from its solves, whose force is that by the first three inputs."""
    problem = BODY.problem(GluedPad(radius=0.01, over=CORNERS, displacement=(RANGE,) * 3, element=0.007))
    assert [r.name for r in problem.ranges] == ["d_x", "d_y", "d_z", "p_x", "p_y"]
