"""The mean depth of a tool's balls: where it is known, and that learning sees its derivatives."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from touch_made import ball, plane

import palpate as pp
from palpate.errors import UsageError
from palpate.surrogates import ContactLaw
from palpate.surrogates.baselines import ContactBaseline, PosedBaseline
from palpate.tools import Box, Capsule, Cone, Cylinder, Fingertip, PosedTool, Punch, Sphere, front_balls

LAW = ContactLaw("series", 1e-3)
SHAPES = {
    "sphere": Sphere(0.006),
    "capsule": Capsule(0.006, 0.02),
    "punch": Punch(0.006, 0.002),
    "cylinder": Cylinder(0.006, 0.02, 0.002),
    "cone": Cone(math.radians(70), 0.004),
    "box": Box(0.012, 0.010, 0.010, 0.002),
    "fingertip": Fingertip(),
}


def baseline(shape, surface=None, **options):
    tool = PosedTool(shape, **options)
    described = json.dumps(tool.describe())
    return PosedBaseline(LAW, surface or plane(), shape.size, tool=described)


@pytest.mark.parametrize("name", SHAPES)
def test_the_balls_touch_the_front_from_inside(name):
    """The foremost ball reaches as far as the tool, each touches the front, and their shares add up to 1."""
    shape = SHAPES[name]
    balls = front_balls(shape)
    assert (balls[:, 2] - balls[:, 3]).min() == pytest.approx(-shape.front, abs=1e-7)
    assert balls[:, 4].sum() == pytest.approx(1.0)
    rng = np.random.default_rng(0)
    rays = rng.normal(size=(200, 3))
    rays *= balls[0, 3] / np.linalg.norm(rays, axis=1, keepdims=True)
    # the distance of a fingertip is exact to first order only
    for centre in balls[:, :3]:
        assert shape.distance(centre + rays).max() < (2e-4 if name == "fingertip" else 1e-7)


def test_a_sphere_is_as_deep_as_a_probe():
    """Its place is a radius before the centre, whichever way it is turned from there."""
    posed = baseline(Sphere(0.006), ball(), turns="axis", tilt=0.3)
    probe = ContactBaseline(LAW, ball(), 0.006)
    X = np.random.default_rng(1).uniform(
        [-0.005, -0.005, -0.004, -0.2, -0.2], [0.005, 0.005, 0, 0.2, 0.2], (40, 5)
    )
    place, turn = posed.posed_tool.pose(X)
    wanted = probe.law_depth(place + 0.006 * turn[:, :, 2])
    for ours, theirs in zip(posed.law_depth(X), wanted, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("name", ["capsule", "punch", "box"])
def test_a_flat_tool_on_a_plane_is_as_deep_as_its_place(name):
    """All balls that touch the plane flat are equally deep; the shares of the others are at the edge."""
    shape = SHAPES[name]
    balls = front_balls(shape)
    flat = balls[:, 2] - balls[:, 3] < -shape.front + 1e-6
    X = np.array([[0.002, -0.001, -0.002], [0.0, 0.001, -0.001]])
    depth, slope, _ = baseline(shape).law_depth(X)
    share = balls[flat, 4].sum() ** (1 / 8)
    np.testing.assert_allclose(depth, -X[:, 2] * share, rtol=0.02)
    np.testing.assert_allclose(slope[:, :2], 0.0, atol=1e-9)


def test_it_begins_where_the_tool_touches_a_plane():
    """A tilted capsule's end is lower than its place by what its support function says."""
    tool = PosedTool(SHAPES["capsule"], turns="axis", tilt=0.3)
    posed, up = baseline(SHAPES["capsule"], turns="axis", tilt=0.3), np.array([[0.0, 0.0, 1.0]])
    for angles in ([0.0, 0.2], [-0.1, 0.05], [0.0, 0.0]):
        height = float(tool.offset(up, np.array([angles]))[0])
        rows = np.array([[0.0, 0.0, height + gap, *angles] for gap in (1e-6, -1e-6)])
        depth = posed.coordinate(rows)
        assert depth[0] <= 0 < depth[1]


@pytest.mark.parametrize("name", ["capsule", "punch", "fingertip"])
def test_learning_sees_the_derivatives_by_place_and_angle(name):
    """ln U₀ by central differences, on a curved surface."""
    tool = {"rotation": (0.0, 0.0, 0.4), "turns": "full", "tilt": 0.3}
    posed = baseline(SHAPES[name], ball(), **tool)
    inputs = tuple(pp.Range(n, -1.0, 1.0, "m") for n in "abcdef")
    low, high = [-0.004, -0.004, -0.003, -0.2, -0.2, -0.2], [0.004, 0.004, -0.002, 0.2, 0.2, 0.2]
    X = np.random.default_rng(2).uniform(low, high, (20, 6))
    value, slope, bend = posed.logarithm(X, inputs)
    for i, step in enumerate([1e-7] * 3 + [1e-5] * 3):
        way = step * np.eye(6)[i]
        ends = [posed.logarithm(X + sign * way, inputs) for sign in (1, -1)]
        by_hand = (ends[0][0] - ends[1][0]) / (2 * step)
        np.testing.assert_allclose(slope[:, i], by_hand, atol=1e-5 * np.abs(slope).max())
        curved = (ends[0][1][:, :3] - ends[1][1][:, :3]) / (2 * step)
        np.testing.assert_allclose(bend[:, :3, i], curved, atol=1e-4 * np.abs(bend[:, :3, :3]).max())
    assert np.isfinite(value).all()


def test_it_has_no_graph():
    with pytest.raises(UsageError, match="no ONNX form"):
        baseline(SHAPES["punch"]).graph_form(None, None, None, None)
