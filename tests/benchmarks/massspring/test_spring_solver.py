"""Springs under a probe: derivatives by differences, balance of forces, symmetry, and steps in time."""

from __future__ import annotations

import numpy as np
import pytest
from lattice import Elastic, Sphere, kuhn_block

from benchmarks.massspring import MassSpringBody, MassSpringMotion, MassSpringSolver

AT = np.array([0.031, 0.029, 0.046])  # 4 mm deep
SHALLOW = np.array([0.031, 0.029, 0.048])  # points at rest lie within the pad


@pytest.fixture(scope="module")
def solver() -> MassSpringSolver:
    return MassSpringBody(kuhn_block(), Elastic()).open(Sphere())


@pytest.fixture
def rumpled(solver: MassSpringSolver) -> np.ndarray:
    """Positions off rest at random by up to a millimetre, m."""
    x = solver.energy.network.points.copy()
    free = solver.energy.free
    x[free] += np.random.default_rng(0).uniform(-1e-3, 1e-3, (int(free.sum()), 3))
    return x


def test_the_gradient_is_the_energys(solver, rumpled):
    d = np.random.default_rng(1).standard_normal(rumpled.shape) * solver.energy.free[:, None]
    h = 1e-8
    ends = [solver.energy.value(rumpled + s * h * d, SHALLOW) for s in (1, -1)]
    slope = np.vdot(solver.energy.gradient(rumpled, SHALLOW), d)
    assert slope == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6)


def test_the_tangent_is_the_gradients(solver, rumpled):
    d = np.random.default_rng(2).standard_normal(rumpled.shape) * solver.energy.free[:, None]
    h = 1e-8
    ends = [solver.energy.gradient(rumpled + s * h * d, SHALLOW) for s in (1, -1)]
    product = solver.energy.tangent(rumpled, SHALLOW).apply(d)
    difference = (ends[0] - ends[1]) / (2 * h)
    assert np.linalg.norm(product - difference) < 1e-6 * np.linalg.norm(difference)


def test_springs_and_volumes_neither_push_nor_turn_the_whole(solver, rumpled):
    _, g = solver.energy.elastic(rumpled)
    assert np.abs(g.sum(axis=0)).max() < 1e-12 * np.abs(g).sum()
    assert np.abs(np.cross(rumpled, g).sum(axis=0)).max() < 1e-12 * np.abs(np.cross(rumpled, g)).sum()


@pytest.mark.full
def test_force_is_the_slope_of_the_energy_and_the_fixed_points_bear_it(solver):
    solver.tolerance = 1e-10
    solver.reset()
    answer = solver.solve(AT, gradient=True)
    assert answer.converged
    assert answer.response[2] > 0.05  # N, up
    _, g = solver.energy.elastic(solver.x)
    assert g[~solver.energy.free].sum(axis=0) == pytest.approx(answer.response, abs=1e-7 * answer.response[2])
    h, slope, stiffness = 1e-5, np.zeros(3), np.zeros((3, 3))
    for j in range(3):
        ends = [solver.solve(AT + s * h * np.eye(3)[j]) for s in (1, -1)]
        slope[j] = -(ends[0].potential_energy - ends[1].potential_energy) / (2 * h)
        stiffness[:, j] = (ends[0].response - ends[1].response) / (2 * h)
    scale = np.abs(stiffness).max()
    assert slope == pytest.approx(answer.response, abs=1e-5 * answer.response[2])
    assert np.allclose(answer.response_gradient, answer.response_gradient.T, rtol=0, atol=1e-8 * scale)
    assert np.allclose(answer.response_gradient, stiffness, rtol=0, atol=1e-4 * scale)


def test_a_mirrored_probe_feels_the_mirrored_force(solver):
    """The lattice is symmetric under exchange of x and y."""
    solver.tolerance = 1e-8
    forces = []
    for at in ((0.034, 0.028, 0.047), (0.028, 0.034, 0.047)):
        solver.reset()
        forces.append(solver.solve(at).response)
    assert forces[0] == pytest.approx(forces[1][[1, 0, 2]], abs=1e-6 * forces[0][2])


def test_out_of_contact_there_is_no_force(solver):
    solver.reset()
    answer = solver.solve((0.03, 0.03, 0.051))
    assert answer.response.tolist() == [0.0, 0.0, 0.0]
    assert np.all(answer.displacement == 0.0)


def test_a_swallowed_sphere_is_said_to_be_one():
    """A coarse lattice lets the sphere slip in; the answer must not pass for an equilibrium."""
    solver = MassSpringBody(kuhn_block((4, 4, 3)), Elastic(), volume=False).open(Sphere(pad=1e5))
    answers = [solver.solve((0.03, 0.03, 0.05 - depth)) for depth in (0.002, 0.012, 0.018, 0.024)]
    assert answers[0].converged
    assert not answers[-1].converged
    assert answers[-1].message


def test_explicit_steps_are_stable_just_below_their_limit_and_not_above(solver):
    solver.reset()
    solver.solve(AT)
    for share, stable in ((0.9, True), (1.2, False)):
        motion = MassSpringMotion(solver)
        longest = 2 / motion.highest_frequency(AT)
        motion.v[motion.energy.free] = 1e-6 * np.random.default_rng(3).standard_normal(
            (int(motion.energy.free.sum()), 3)
        )
        for _ in range(150):
            motion.explicit(AT, share * longest)
            moved = np.abs(motion.x - solver.x).max()
            if moved > 1e-4:
                break
        assert (moved < 1e-6) == stable


@pytest.mark.full
def test_implicit_steps_of_any_length_settle_at_the_equilibrium(solver):
    solver.tolerance = 1e-8
    solver.reset()
    solver.solve(AT + np.array([0, 0, 1e-4]))
    motion = MassSpringMotion(solver)
    for _ in range(30):
        motion.implicit(AT, 1.0, tolerance=1e-8)
    wanted = solver.solve(AT).displacement
    assert np.abs(motion.x - solver.energy.network.points - wanted).max() < 1e-5 * np.abs(wanted).max()
    costs = motion.costs(AT, repeats=3)
    assert costs.explicit_ratio > 0
    assert costs.implicit_ratio > 0
