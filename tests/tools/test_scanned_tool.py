"""Tools from files: their distance against formulas, what the file of a tool keeps, and surfaces that bound no tool."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate import tools
from palpate.errors import UsageError
from palpate.physics import Body, SurfaceTool
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.surrogates import ContactLaw
from palpate.surrogates.baselines import ToolBaseline, deepest_ball
from palpate.tools import PosedTool, ScannedTool

sys.path.append(str(Path(__file__).parents[1] / "surrogates"))
from touch_made import BOX, plane, touch_energy

RADIUS = 8.0  # mm, of files


@pytest.fixture(scope="module")
def ball_file(tmp_path_factory):
    """A ball's STL of 1,280 triangles, whose facets lie up to 0.04 mm within the ball."""
    import trimesh

    path = tmp_path_factory.mktemp("scans") / "ball.stl"
    trimesh.creation.icosphere(subdivisions=3, radius=RADIUS).export(path)
    return path


@pytest.fixture(scope="module")
def ball(ball_file) -> ScannedTool:
    return pp.read_tool(ball_file, unit="mm")


def around(tool: ScannedTool, radius: float) -> np.ndarray:
    """Points (N, 3) at a distance from the ball's centre, m."""
    points = np.random.default_rng(0).normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points * radius + [0, 0, 1e-3 * RADIUS - tool.front]


@pytest.mark.parametrize("r", [5.0, 7.0, 8.0, 9.0, 9.5])
def test_the_distance_of_a_ball_is_that_of_the_smooth_ball(ball, r):
    """Within a thousandth of its radius, from the depth to which it is one up to the lattice's end."""
    off = ball.distance(around(ball, 1e-3 * r)) - 1e-3 * (r - RADIUS)
    assert np.abs(off).max() < 1e-6 * RADIUS


def test_its_sizes_are_those_of_the_ball(ball):
    assert ball.size == pytest.approx(1e-3 * RADIUS, rel=0.01)
    assert ball.inscribed_radius <= ball.front * 1.0001
    np.testing.assert_allclose(ball.half_widths(0.002), np.sqrt(0.008**2 - 0.006**2), rtol=2e-3)
    directions = around(ball, 1.0) - [0, 0, 1e-3 * RADIUS - ball.front]
    reach = ball.support(directions) - directions[:, 2] * (1e-3 * RADIUS - ball.front)
    np.testing.assert_allclose(reach, 1e-3 * RADIUS, rtol=6e-3)


def test_the_distance_has_two_continuous_derivatives(ball):
    """Across a node of the lattice, where the pieces of a spline meet, no second difference jumps."""
    node = np.array(ball.corner) + ball.spacing * np.array([10, 10, 4])
    h = ball.spacing / 200
    line = node + h * np.arange(-20, 21)[:, None] * np.array([0.3, 0.5, 0.8])
    bend = np.diff(ball.distance(line), 2) / h**2
    assert np.abs(np.diff(bend)).max() < 0.02 * np.abs(bend).max()


def test_a_file_of_a_study_keeps_the_tool_itself(ball):
    posed = PosedTool(ball, (0.1, 0.0, 0.2))
    again = PosedTool.of(json.loads(json.dumps(posed.describe())))
    assert again == posed
    points = around(ball, 0.007)
    np.testing.assert_array_equal(again.shape.distance(points), ball.distance(points))
    assert len(json.dumps(posed.describe())) < 100_000


def test_a_learnt_body_keeps_the_tool_without_its_file(ball, tmp_path):
    posed = PosedTool(ball, (0.05, 0.0, 0.0))
    radius, way = deepest_ball(posed, np.array([0.0, 0.0, 1.0]))
    surface = replace(plane(), frame=plane().frame - np.concatenate([way, np.zeros(len(plane().frame) - 3)]))
    law = ContactLaw("series", 1e-3)
    baseline = ToolBaseline(law, surface, radius, tool=json.dumps(posed.describe()))
    ranges = [pp.Range(f"tip{r.name[1:]}", r.low, r.high, "m") for r in BOX]
    body = pp.Surrogate(touch_energy(box=ranges, baseline=baseline))
    again = pp.load(body.save(tmp_path / "body.palpate"))
    assert again.energy.baseline.posed_tool == posed


def test_beyond_the_lattice_the_distance_goes_on(ball):
    """Positive and growing, and continuous where the lattice ends."""
    far = ball.distance(np.array([[0.0, 0.0, z] for z in np.linspace(0.009, 0.05, 400)]))
    assert (far > 0).all()
    assert (np.diff(far) > 0).all()
    assert np.diff(far).max() < 2 * 0.041 / 399


def test_the_same_distance_in_finite_elements(ball):
    import ngsolve as ngs
    from netgen.csg import unit_cube

    mesh = ngs.Mesh(unit_cube.GenerateMesh(maxh=1))
    middle = np.array([0.5, 0.45, 0.6])
    scaled = 0.025 * (ngs.CF((ngs.x, ngs.y, ngs.z)) - ngs.CF(tuple(middle)))
    places = np.random.default_rng(5).random((40, 3))
    found = [ball.distance(scaled)(mesh(*place)) for place in places]
    np.testing.assert_allclose(found, ball.distance(0.025 * (places - middle)), atol=1e-12)


def test_the_direction_in_which_it_presses_comes_from_the_file(tmp_path):
    import trimesh

    capsule = trimesh.creation.capsule(height=20.0, radius=5.0, count=(24, 24))  # along z
    capsule.export(path := tmp_path / "capsule.stl")
    tip, side = (pp.read_tool(path, unit="mm", presses=way) for way in ("+z", "+x"))
    assert tip.half_widths(0.02)[0] == pytest.approx(0.005, rel=0.02)
    np.testing.assert_allclose(sorted(side.half_widths(0.005)), [0.005, 0.015], rtol=0.02)


@pytest.mark.full
@pytest.mark.timeout(300)
def test_a_scanned_ball_presses_as_the_exact_one(ball):
    """Force within 1 %."""
    body = Body(Block((0.04, 0.04, 0.02), element=0.02), NeoHookean(9e3, 0.45))
    force = []
    for shape in (ball, tools.Sphere(1e-3 * RADIUS)):
        tool = SurfaceTool(shape, depth=(0.0, 0.003), over=((0.019, 0.020), (0.021, 0.022)), element=0.005)
        place = [0.020, 0.021, 0.018 + float(tool.offset(np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 0)))[0])]
        force.append(body.problem(tool).open().solve(place).response)
    assert np.linalg.norm(force[0] - force[1]) < 0.01 * np.linalg.norm(force[1])


def test_surfaces_that_bound_no_tool_are_refused(ball_file, tmp_path):
    import trimesh

    surface = trimesh.load_mesh(ball_file)
    hole, inverted = surface.copy(), surface.copy()
    hole.update_faces(np.arange(len(surface.faces)) > 3)
    hole.export(tmp_path / "hole.stl")
    inverted.invert()
    inverted.export(tmp_path / "inverted.stl")
    with pytest.raises(UsageError, match="is open"):
        pp.read_tool(tmp_path / "hole.stl", unit="mm")
    with pytest.raises(UsageError, match="inside out"):
        pp.read_tool(tmp_path / "inverted.stl", unit="mm")
    with pytest.raises(UsageError, match="unit"):
        pp.read_tool(ball_file, unit="feet")
    with pytest.raises(UsageError, match="press along"):
        pp.read_tool(ball_file, unit="mm", presses="down")
    with pytest.raises(UsageError, match="can't be kept at places"):
        pp.read_tool(ball_file, unit="mm", spacing=0.005)


@pytest.mark.parametrize(
    ("place", "radius", "words"),
    [
        (30.0, RADIUS, "2 closed shells"),
        (0.8 * RADIUS, RADIUS, "2 closed shells"),
        (0.0, RADIUS / 2, "2 closed shells"),
    ],
    ids=["apart", "overlapping", "cavity"],
)
def test_a_tool_of_two_shells_is_refused(ball_file, tmp_path, place, radius, words):
    import trimesh

    other = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    other.apply_translation([place, 0.0, 0.0])
    if radius < RADIUS:
        other.invert()
    trimesh.util.concatenate([trimesh.load_mesh(ball_file), other]).export(tmp_path / "two.stl")
    with pytest.raises(UsageError, match=words):
        pp.read_tool(tmp_path / "two.stl", unit="mm")


@pytest.mark.parametrize(("radius", "fix"), [(3.0, 'unit="mm"'), (0.00001, 'unit="m"')])
def test_a_tool_in_a_mistaken_unit_is_refused(tmp_path, radius, fix):
    """Millimetres taken as metres, also of a tool that is no longer than a body may be, and the other way round."""
    import trimesh

    trimesh.creation.icosphere(subdivisions=2, radius=radius).export(tmp_path / "ball.stl")
    with pytest.raises(UsageError, match=fix):
        pp.read_tool(tmp_path / "ball.stl", unit="m" if radius > 1 else "mm")


def test_a_damaged_lattice_is_refused(ball):
    with pytest.raises(UsageError, match="is damaged"):
        replace(ball, ranks=(2, 2, 2))
