"""The beam's solutions against balance laws, symmetries and known answers."""

import itertools
import pickle

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics import (
    PRESETS,
    Cantilever,
    Circle,
    LinearElastic,
    PointLoad,
    Rectangle,
    Stop,
    TipLoad,
    preset,
)
from palpate.physics.beam.beam_solver import STANDARD_GRAVITY

SECTION, MATERIAL = Circle(0.005), LinearElastic(2e9, 0.43, 1150.0)
BENDING = MATERIAL.young * SECTION.second_moment
SHEAR = SECTION.shear_factor(0.43) * MATERIAL.shear_modulus * SECTION.area
WEIGHT = STANDARD_GRAVITY * MATERIAL.density * SECTION.area
THREE = (
    PointLoad("a", 0.4, -5, 5),
    PointLoad("b", 0.73, -5, 5, direction=(1.0, 1.0)),
    TipLoad(-5, 5, direction=(1, -2), name="c"),
)


def beam(**changes):
    return Cantilever(**{"length": 1.0, "section": SECTION, "material": MATERIAL, **changes})


@pytest.mark.parametrize("weight", [False, True])
@pytest.mark.parametrize("x", [(1.0, 0.5, 2.0), (-3.0, 2.0, 5.0)])
def test_root_reaction_balances_loads_and_weight_in_the_deformed_shape(x, weight):
    body = beam(self_weight=weight)
    problem = body.problem(THREE)
    solution = problem.solve(x)
    where = problem.rest + solution.displacement[:, :2]
    forces = np.array([size * np.array(load.direction) for size, load in zip(x, THREE, strict=True)])
    arms = where[list(problem.load_nodes)]
    total = forces.sum(axis=0)
    moment = (arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()
    if weight:
        total[1] -= WEIGHT
        # the weight's lever is the centre line's mean x; nodes alone give it by Simpson's rule to a few digits
        moment -= WEIGHT * np.trapezoid(where[:, 0], problem.rest[:, 0])
    np.testing.assert_allclose(solution.root_reaction[:2], -total, atol=1e-9)
    assert solution.root_reaction[2] == pytest.approx(-moment, abs=1e-3 if weight else 1e-9)


@pytest.mark.parametrize("kinematics", ["large", "small"])
def test_energy_falls_by_the_displacement_along_the_load(kinematics):
    """dΠ/dP = -u·direction (envelope theorem), by central differences."""
    solver = beam(kinematics=kinematics, self_weight=True).problem(THREE).open()
    x, h = np.array([1.0, -0.5, 1.5]), 1e-3
    here = solver.solve(x)
    for i, load in enumerate(THREE):
        step = h * np.eye(3)[i]
        slope = (solver.solve(x + step).potential_energy - solver.solve(x - step).potential_energy) / (2 * h)
        node = beam().problem(THREE).load_nodes[i]
        along = here.displacement[node, :2] @ np.array(load.direction)
        assert slope == pytest.approx(-along, rel=1e-5)


@pytest.mark.parametrize("kinematics", ["large", "small"])
def test_mirrored_loads_give_mirrored_answers(kinematics):
    solver = beam(kinematics=kinematics).problem(TipLoad(-5, 5)).open()
    up, down = solver.solve(-4.0), solver.solve(4.0)
    np.testing.assert_allclose(up.displacement, down.displacement * (1, -1, -1), atol=1e-11)
    assert up.strain_energy == pytest.approx(down.strain_energy, rel=1e-11)


def test_the_answer_does_not_depend_on_the_path():
    problem = preset("beam-plane").problem()
    target = (-1.2, 4.0)
    cold = problem.solve(target)
    warm = problem.open()
    for x in ((1.0, -3.0), (1.5, 5.0), (-1.4, -4.9), target):
        found = warm.solve(x)
    np.testing.assert_allclose(found.displacement, cold.displacement, atol=1e-12)
    restarted = problem.open().solve(target, start=found)
    np.testing.assert_allclose(restarted.displacement, cold.displacement, atol=1e-12)
    assert restarted.iterations < cold.iterations


def ruler(**changes):
    """A ruler of aluminium, 0.3 m by 25 mm by 1 mm, under its own weight."""
    section, material = Rectangle(width=0.025, height=0.001), LinearElastic(70e9, 0.33, 2700.0)
    return Cantilever(0.3, section, material, self_weight=True, **changes)


@pytest.mark.grid
@pytest.mark.parametrize("load", [-500.0, -300.0, 300.0, 500.0])
def test_far_beyond_the_linear_range_cold_and_warm_starts_agree(load):
    """P L²/EI up to 300: a whole load step from rest ends in an equilibrium with a loop."""
    problem = ruler().problem(TipLoad(-500, 500))
    solver = problem.open()
    for x in np.linspace(-abs(load), load, 33):
        warm = solver.solve(x)
    cold = problem.solve(load)
    assert cold.converged, cold.message
    assert warm.converged, warm.message
    np.testing.assert_allclose(cold.displacement, warm.displacement, atol=1e-10)
    assert -np.sign(load) * cold.displacement[-1, 2] == pytest.approx(np.pi / 2, abs=1e-3)


@pytest.mark.full
@pytest.mark.parametrize("load", [1000.0, 2000.0])
def test_a_finer_mesh_reaches_further_by_the_same_branch(load):
    """The tip's turn is a quarter of a circle, without a loop."""
    solution = ruler(elements=40).problem(TipLoad(0, 2000)).solve(load)
    assert solution.converged, solution.message
    assert -solution.displacement[-1, 2] == pytest.approx(np.pi / 2, abs=1e-6)


def test_small_kinematics_are_linear():
    problem = beam(kinematics="small").problem(THREE)
    solver = problem.open()
    x, y = np.array([1.0, 2.0, -1.0]), np.array([0.5, -1.0, 3.0])
    one, other, both = (solver.solve(v).displacement for v in (x, y, 2 * x - 3 * y))
    np.testing.assert_allclose(both, 2 * one - 3 * other, atol=1e-13)


def test_small_kinematics_are_the_limit_of_small_loads():
    large, small = (beam(kinematics=k).problem(TipLoad(0, 1)).solve(1e-6) for k in ("large", "small"))
    np.testing.assert_allclose(large.displacement[:, 1:], small.displacement[:, 1:], rtol=1e-8)


def test_the_largest_strain_is_that_of_the_outer_fibre_at_the_clamp():
    """κ = P L/EI at the clamp of a beam that bends little; on a pull ε = P/EA (Euler-Bernoulli)."""
    bent = beam(kinematics="small").problem(TipLoad(0, 5)).solve(3.0)
    assert bent.largest_strain == pytest.approx(3.0 / BENDING * SECTION.radius, rel=1e-6)
    pulled = beam().problem(TipLoad(0, 100, direction=(1, 0))).solve(50.0)
    assert pulled.largest_strain == pytest.approx(50.0 / (MATERIAL.young * SECTION.area), rel=1e-9)


def test_the_largest_strain_of_a_large_bend_follows_from_the_clamps_moment():
    """κ = M/EI at the clamp, whatever the shape."""
    solution = ruler().problem(TipLoad(0, 50)).solve(10.0)
    section = Rectangle(width=0.025, height=0.001)
    bending = abs(solution.root_reaction[2]) / (70e9 * section.second_moment) * section.half_height
    assert solution.largest_strain == pytest.approx(bending, rel=0.01)


@pytest.mark.parametrize("load", [0.0, 3.0])
def test_self_weight_adds_its_own_deflection(load):
    """W L³/8EI + W L/2kGA at the tip of a small-displacement beam, for a weight W."""
    body = beam(kinematics="small", self_weight=True)
    tip = -body.problem(TipLoad(0, 5)).solve(load).displacement[-1, 1]
    own = WEIGHT / (8 * BENDING) + WEIGHT / (2 * SHEAR)
    assert tip == pytest.approx(own + load / (3 * BENDING) + load / SHEAR, rel=1e-9)


def test_axial_pull_stretches():
    solution = beam().problem(TipLoad(0, 100, direction=(1, 0))).solve(50.0)
    assert solution.displacement[-1, 0] == pytest.approx(50.0 / (MATERIAL.young * SECTION.area), rel=1e-9)
    assert solution.strain_energy == pytest.approx(50.0**2 / (2 * MATERIAL.young * SECTION.area), rel=1e-9)


def test_rotations_follow_the_load_for_a_beam_pulled_sideways():
    """A long thread aligns with the load: the tip turns towards -90°."""
    turns = [beam().problem(TipLoad(0, 50)).solve(load).displacement[-1, 2] for load in (1, 5, 20, 50)]
    assert all(later < earlier for earlier, later in itertools.pairwise(turns))
    assert turns[-1] == pytest.approx(-np.pi / 2, abs=0.01)


@pytest.mark.parametrize(("order", "rate"), [(2, 4), (3, 6)])
def test_energy_converges_with_twice_the_order_of_the_elements(order, rate):
    """The energy's error is O(h^2p) (Strang & Fix 1973): p = 2 and 3."""

    def energy(elements, p):
        return beam(elements=elements, order=p).problem(TipLoad(0, 10)).solve(2.0).potential_energy

    exact = energy(40, 6)
    errors = [energy(n, order) - exact for n in (10, 20)]
    assert np.log2(errors[0] / errors[1]) > rate - 0.7
    assert min(errors) > 0  # a minimum over a smaller space is higher


def test_loads_and_nodes_of_interest_are_vertices():
    body = beam(nodes=(0.0, 1 / 3, 0.55, 1.0), elements=7)
    problem = body.problem(THREE)
    x = problem.rest[:, 0]
    assert np.all(np.diff(x) > 1e-3)
    np.testing.assert_allclose(x[list(problem.load_nodes)], (0.4, 0.73, 1.0), atol=1e-9)
    np.testing.assert_allclose(x[problem.of_interest], (0.0, 1 / 3, 0.55, 1.0), atol=1e-9)


def test_the_founding_presets_have_the_founding_nodes():
    for name in PRESETS:
        problem = preset(name).problem()
        np.testing.assert_allclose(problem.rest[problem.of_interest, 0], np.arange(6) / 5, atol=1e-12)
        assert len(problem.rest) == 21


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_preset_converges_at_all_its_corners(name):
    problem = preset(name).problem()
    solver = problem.open()
    for corner in itertools.product(*((r.low, r.high) for r in problem.ranges)):
        solution = solver.solve(corner)
        assert solution.converged, (corner, solution.message)
        assert solution.residual < 1e-9


def test_unknown_preset_names_the_nearest():
    with pytest.raises(UsageError) as caught:
        preset("beam-coper")
    assert "'beam-copper'" in caught.value.fix


@pytest.mark.parametrize(
    ("load", "reasons"),
    [
        (1e3, {Stop.COARSE_MESH}),
        (1e9, {Stop.STRAIN_LIMIT, Stop.STEP_TOO_SMALL, Stop.COARSE_MESH, Stop.ITERATION_LIMIT}),
        (1e300, {Stop.NOT_FINITE, Stop.STRAIN_LIMIT, Stop.STEP_TOO_SMALL}),
        (np.inf, {Stop.BAD_INPUT}),
        (np.nan, {Stop.BAD_INPUT}),
    ],
)
def test_pointless_loads_fail_with_a_reason_and_leave_the_solver_usable(load, reasons):
    solver = beam().problem(TipLoad(0, 5)).open()
    before = solver.solve(3.0)
    failed = solver.solve(load)
    assert not failed.converged
    assert failed.stop in reasons
    assert failed.message
    assert failed.iterations <= 1200
    assert np.isnan(failed.displacement).all()
    assert np.isnan(failed.root_reaction).all()
    assert np.isnan(failed.largest_strain)
    np.testing.assert_allclose(solver.solve(3.0).displacement, before.displacement, atol=1e-12)


def test_a_perfectly_straight_column_beyond_eulers_load_is_called_unstable():
    solution = beam().problem(TipLoad(0, 5, direction=(-1, 0))).solve(3.0)
    assert not solution.converged
    assert solution.stop is Stop.UNSTABLE


def test_zero_load_is_rest():
    solver = beam().problem(TipLoad(0, 5)).open()
    solver.solve(5.0)
    for solution in (beam().problem(TipLoad(0, 5)).solve(0.0), solver.solve(0.0)):
        assert solution.converged
        np.testing.assert_allclose(solution.displacement, 0, atol=1e-12)


def test_a_warm_start_pays():
    problem = preset("beam-nylon").problem()
    solver = problem.open()
    solver.solve(2.99)
    solver.solve(3.0)
    assert solver.solve(3.01).iterations <= 4
    assert problem.solve(3.01).iterations > 4


def test_problems_are_values():
    one, other = (preset("beam-plane").problem() for _ in range(2))
    assert one == other
    assert one.hash == other.hash
    assert pickle.loads(pickle.dumps(one)) == one
    assert preset("beam-nylon").problem().hash != preset("beam-nylon-10n").problem().hash
    assert beam().problem(THREE).hash != beam(order=4).problem(THREE).hash
