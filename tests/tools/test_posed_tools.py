"""Force and torque on a posed tool against differences of the energy, and a ball against the sphere probe."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from palpate import tools
from palpate.errors import UsageError
from palpate.physics import Body, SphereProbe, SurfaceTool
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.tools import left_jacobian

BODY = Body(Block((0.04, 0.04, 0.02), element=0.02), NeoHookean(9e3, 0.45))
FOOT = (0.020, 0.021)
DEPTH = 0.002
UP = np.array([[0.0, 0.0, 1.0]])
POSED = {
    "capsule": SurfaceTool(tools.Capsule(0.006, 0.020), rotation=(0.08, -0.05, 0.5)),
    "punch": SurfaceTool(tools.Punch(0.006, 0.002), rotation=(0.05, 0.02, 0.0)),
    "cone": SurfaceTool(tools.Cone(math.radians(70), 0.004), rotation=(0.0, 0.09, 0.0)),
    "fingertip": SurfaceTool(tools.Fingertip(0.016, 0.014, 0.014), rotation=(0.3, 0.1, 0.0)),
}


def on_block(tool, fine=None):
    """Problem of a tool on the block, and its place at the depth."""
    tool = replace(tool, depth=(0.0, 0.003), over=((0.019, 0.020), (0.021, 0.022)), element=0.004, pad=2e7)
    problem = BODY.problem(tool)
    place = np.array([*FOOT, 0.02 - DEPTH + float(tool.posed_tool.offset(UP)[0])])
    return replace(problem, fine=fine or problem.refinements), place


def turned(tool, axis, angle):
    """The tool turned further about an axis (3,) through its place by an angle in rad."""
    from scipy.spatial.transform import Rotation

    more = Rotation.from_rotvec(angle * axis) * Rotation.from_rotvec(tool.rotation)
    return replace(tool, rotation=tuple(more.as_rotvec().tolist()))


@pytest.mark.full
@pytest.mark.timeout(240)
@pytest.mark.parametrize("name", POSED)
def test_force_and_torque_are_derivatives_of_the_energy(name):
    """By fourth-order differences along a direction of places and of turns that favours no axis."""
    tool = POSED[name]
    problem, place = on_block(tool)
    solver = problem.open()
    here = solver.solve(place)
    along = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    step = 2e-5
    energies = {many: solver.solve(place + many * step * along).potential_energy for many in (-2, -1, 1, 2)}
    size = np.linalg.norm(here.response)
    assert -slope(energies, step) == pytest.approx(here.response @ along, abs=1e-5 * size)

    # the place stays where the tool is turned about it; the depth of its deepest point does not
    angle, fine = 2e-3, problem.fine
    energies = {
        many: on_block(turned(tool, along, many * angle), fine)[0].open().solve(place).potential_energy
        for many in (-2, -1, 1, 2)
    }
    torque = here.torque @ along
    assert -slope(energies, angle) == pytest.approx(torque, abs=1e-5 * size * tool.shape.size)


def slope(energies, step):
    """The derivative at the middle of four values, of fourth order."""
    return (8 * (energies[1] - energies[-1]) - (energies[2] - energies[-2])) / (12 * step)


@pytest.mark.full
@pytest.mark.timeout(240)
@pytest.mark.parametrize("turns", ["axis", "full"])
def test_responses_to_angles_are_derivatives_of_the_energy(turns):
    """By fourth-order differences along all inputs at once; the torque does the same work along the angles."""
    problem, place = on_block(replace(POSED["capsule"], turns=turns, tilt=0.3))
    angles = np.array([0.1, -0.15, 0.2])[: 2 if turns == "axis" else 3]
    x, solver = np.append(place, angles), problem.open()
    x[2] += 0.001
    here = solver.solve(x)
    along = np.append([1e-5, -1.2e-5, 0.7e-5], [1e-3, -0.7e-3, 0.6e-3][: angles.size])
    found = {many: solver.solve(x + many * along) for many in (-2, -1, 1, 2)}
    energies = {many: one.potential_energy for many, one in found.items()}
    size = np.abs(here.response) @ np.abs(along)
    assert -slope(energies, 1.0) == pytest.approx(here.response @ along, abs=1e-5 * size)
    turn = left_jacobian(np.append(angles, np.zeros(3 - angles.size)))
    np.testing.assert_allclose((turn.T @ here.torque)[: angles.size], here.response[3:], rtol=1e-6, atol=1e-9)
    # points of the contact's rule come and go: along a way so short that few do
    ends = [solver.solve(x + sign * 1e-2 * along).response for sign in (1, -1)]
    change = here.response_gradient @ along
    np.testing.assert_allclose((ends[0] - ends[1]) / 2e-2, change, atol=0.01 * np.abs(change).max())
    np.testing.assert_allclose(here.force, here.response[:3])


@pytest.mark.full
@pytest.mark.parametrize("name", ["punch", "cone"])
def test_a_tool_of_revolution_has_no_torque_about_its_axis(name):
    problem, place = on_block(POSED[name])
    found = problem.solve(place)
    axis = problem.interactions[0].posed_tool.turn @ [0.0, 0.0, 1.0]
    assert abs(found.torque @ axis) < 1e-3 * np.linalg.norm(found.response) * 1e-3


@pytest.fixture(scope="module")
def ball():
    """A ball as a tool, its place, and its answer."""
    problem, place = on_block(SurfaceTool(tools.Sphere(0.008)))
    return problem, place, problem.solve(place)


def test_a_ball_answers_as_the_sphere_probe(ball):
    """Its place is a radius below the centre; the two derive their forces in different ways."""
    problem, place, found = ball
    tool = problem.interactions[0]
    probe = SphereProbe(0.008, pad=tool.pad, stop=tool.stop, depth=tool.depth, over=tool.over)
    wanted = replace(problem, interactions=(probe,)).solve(place + np.array([0.0, 0.0, 0.008]))
    assert found.potential_energy == pytest.approx(wanted.potential_energy, rel=1e-9)
    np.testing.assert_allclose(found.response, wanted.response, atol=1e-7 * np.linalg.norm(wanted.response))
    gradient = wanted.response_gradient
    np.testing.assert_allclose(found.response_gradient, gradient, atol=1e-6 * np.abs(gradient).max())


def test_a_ball_has_no_torque_about_its_centre(ball):
    """About its foremost point it has that of the force through the centre."""
    _, _, found = ball
    arm = np.array([0.0, 0.0, 0.008])
    size = np.linalg.norm(found.response) * 0.008
    np.testing.assert_allclose(found.torque, np.cross(arm, found.response), atol=1e-6 * size)
    assert "torque" in str(found)


def test_places_touch_the_surface_at_the_least_depth_and_fit_into_their_ranges():
    """The deepest point of a tilted capsule lies as deep below a plane as the design says."""
    tool = replace(POSED["capsule"], depth=(0.001, 0.003), over=((0.015, 0.015), (0.025, 0.025)))
    problem = BODY.problem(tool)
    places = problem.design(12)
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(20000, 3))
    points = 0.02 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    for _ in range(4):
        points = points - tool.shape.distance(points)[:, None] * tool.shape.gradient(points)
    lowest = (points @ tool.posed_tool.turn.T)[:, 2].min() + tool.posed_tool.to_centre[2]
    depths = 0.02 - (places[:, 2] + lowest)
    assert depths.min() > 0.001 - 2e-5
    assert depths.max() < 0.003 + 1e-9
    low, high = np.array([(r.low, r.high) for r in problem.ranges]).T
    assert (places >= low - 1e-12).all()
    assert (places <= high + 1e-12).all()
    assert [r.name for r in problem.ranges] == ["tip_x", "tip_y", "tip_z"]


def test_a_design_of_poses_keeps_its_depths_and_chains_in_one_orientation():
    tool = replace(
        POSED["capsule"], turns="axis", tilt=0.3, depth=(0.001, 0.003), over=((0.015, 0.015), (0.025, 0.025))
    )
    problem = BODY.problem(tool)
    rows = problem.design(12)
    depths = 0.02 + tool.offset(np.tile(UP, (len(rows), 1)), rows[:, 3:]) - rows[:, 2]
    assert depths.min() > 0.001 - 1e-9
    assert depths.max() < 0.003 + 1e-9
    low, high = np.array([(r.low, r.high) for r in problem.ranges]).T
    assert (rows >= low - 1e-12).all()
    assert (rows <= high + 1e-12).all()
    chains = problem.chains(rows)
    np.testing.assert_array_equal(np.sort(np.concatenate(chains)), np.arange(len(rows)))
    for chain in chains:
        assert len(chain) > 1
        assert np.ptp(rows[chain, 3:], axis=0).max() == 0
        assert (np.diff(rows[chain, 2]) < 0).all()


def test_its_hash_follows_from_its_shape_and_pose():
    problems = [BODY.problem(tool) for tool in (*POSED.values(), turned(POSED["cone"], UP[0], 0.1))]
    assert len({problem.hash for problem in problems}) == len(problems)
    assert problems[0].describe()["interactions"][0]["shape"] == {
        "type": "Capsule",
        "radius": 0.006,
        "length": 0.020,
    }


def test_a_rigid_tool_gets_its_pad_from_the_body():
    """Softer than the sphere's by the width of its contact, as the law of the rigid limit has it."""
    tool = SurfaceTool(tools.Punch(0.006, 0.002), pad="rigid", depth=(0.0, 0.004))
    acting = BODY.problem(tool).acting[0]
    modulus = 9e3 / (1 - 0.45**2)
    assert acting.pad * tool.shape.half_widths(0.002)[0] / modulus == pytest.approx(75, rel=0.01)
    assert acting.stop is None
    assert "rigid" in str(tool)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SurfaceTool("capsule"), "one of palpate.tools"),
        (lambda: SurfaceTool(tools.Punch(0.006, 1e-4)), "0.00037|element=0.0002"),
        (lambda: SurfaceTool(tools.Punch(0.006, 1e-3), element=0.003), "edge of at least 0.0015"),
        (
            lambda: BODY.problem(SurfaceTool(tools.Punch(0.006, 1e-3)), element=0.003),
            "edge of at least 0.0015",
        ),
        (lambda: SurfaceTool(tools.Sphere(0.006), rotation=(0.1, 0.2)), "rotation"),
        (lambda: SurfaceTool(tools.Sphere(0.006), pad="soft"), "pad"),
        (
            lambda: BODY.problem(SurfaceTool(tools.Box(0.05, 0.05, 0.01, 0.004))).ranges,
            "at most half that width, 0.02",
        ),
        (
            lambda: BODY.problem(SurfaceTool(tools.Punch(0.006, 0.002), rotation=(2.0, 0, 0))).ranges,
            "side of the punch",
        ),
    ],
)
def test_impossible_tools_are_refused_with_what_would_do(make, words):
    with pytest.raises(UsageError, match=words):
        make()
