"""A pinch beside two separate tools, and beside differences of its energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.physics import Body, Pinch
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.tools import Sphere

BODY = Body(Block((0.02, 0.02, 0.02), element=0.01), NeoHookean(9e3, 0.45))
PINCH = Pinch(
    Sphere(0.005),
    touches="x_min + x_max",
    depth=(0.0, 0.002),
    over=((0.009, 0.010), (0.011, 0.012)),
    element=0.004,
)
INPUTS = np.array([0.0105, 0.0095, 0.0112, 0.0175])


@pytest.fixture(scope="module")
def pinched():
    problem = BODY.problem(PINCH)
    return problem, problem.open().solve(INPUTS)


def test_a_pinch_is_two_tools_that_press_together(pinched):
    """Energy, forces and stiffness are those of two tools on one body, with p = c ± w/2 e and the chain rule."""
    problem, solution = pinched
    both = replace(BODY.problem(list(PINCH.tools)), fine=problem.refinements)
    places = np.concatenate(PINCH.gripper.places(INPUTS))
    apart = both.open().solve(places)
    to_inputs = np.vstack(
        [np.tile(np.eye(3), 2), 0.5 * np.concatenate([PINCH.gripper.along, -PINCH.gripper.along])]
    )
    size = np.abs(solution.response).max()
    assert solution.potential_energy == pytest.approx(apart.potential_energy, rel=1e-6)
    np.testing.assert_allclose(solution.response, to_inputs @ apart.response, atol=1e-5 * size)
    stiffness = to_inputs @ apart.response_gradient @ to_inputs.T
    np.testing.assert_allclose(solution.response_gradient, stiffness, atol=1e-4 * np.abs(stiffness).max())
    jaws = PINCH.gripper.axial_forces(solution.response[None, :3], solution.response[3:])
    np.testing.assert_allclose(np.ravel(jaws), apart.response[[0, 3]], atol=1e-5 * size)
    np.testing.assert_allclose(solution.force, solution.response[:3])


@pytest.mark.full
def test_force_and_effort_are_derivatives_of_the_energy(pinched):
    problem, solution = pinched
    along, step = np.array([0.5, -0.3, 0.4, 0.7]), 2e-5
    solver = problem.open()
    energy = {many: solver.solve(INPUTS + many * step * along).potential_energy for many in (-2, -1, 1, 2)}
    slope = (8 * (energy[1] - energy[-1]) - (energy[2] - energy[-2])) / (12 * step)
    assert -slope == pytest.approx(solution.response @ along, abs=1e-5 * np.abs(solution.response).max())


def test_a_design_closes_the_jaws_series_by_series():
    problem = BODY.problem(PINCH)
    X = problem.design(12, 1, depths=3)
    low, high = np.array([[r.low, r.high] for r in problem.ranges]).T
    assert ((low - 1e-12 <= X) & (high + 1e-12 >= X)).all()
    chains = problem.chains(X)
    assert sorted(np.concatenate(chains)) == list(range(12))
    assert all((np.diff(X[chain, 3]) < 0).all() for chain in chains)
    np.testing.assert_array_equal(problem.symmetry["about"], [0.01, 0.01, 0.01])
    assert len(problem.symmetry["isometries"]) == 4
