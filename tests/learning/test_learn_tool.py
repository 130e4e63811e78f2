"""A body under a tool: a ball as a tool answers at its foremost point; what can't be learnt or shown is refused."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import palpate as pp
import pressed
from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.export import export_c
from palpate.export.onnx_export import export_onnx
from palpate.learning.pressed_solves import PressedSolves
from palpate.runtime.touchable import touchable
from palpate.surrogates.baselines import PosedBaseline, deepest_ball
from palpate.tools import Capsule, PosedTool, Punch, Sphere, left_jacobian
from palpate.validation import TouchSolves
from pressed import DEEPEST, RADIUS

# from the place to the ball's centre, and to where the dataset's mesh has its plane
WAY = np.array([-0.1, -0.1, RADIUS])


def under(tool: PosedTool, touches: str = "top", count: int = 60) -> Dataset:
    """Solves of the closed form, told of as those under a tool a radius before the ball's centre."""
    acting = {"type": "SurfaceTool", "touches": touches, "depth": (0.0, DEEPEST), **tool.describe()}
    inputs = tuple(
        pp.Range(f"tip{r.name[1:]}", r.low - w, r.high - w, "m")
        for r, w in zip(pressed.INPUTS, WAY.tolist(), strict=True)
    )
    X = pressed.places(count)
    test = TouchSolves(X - WAY, pressed.force(X), pressed.energy(X), pressed.stiffness(X))
    return pressed.dataset(test, acting=acting, inputs=inputs)


@pytest.fixture(scope="module")
def ball() -> pp.Surrogate:
    """The closed form, learnt as that of a ball whose place is its foremost point."""
    return pp.learn(under(PosedTool(Sphere(RADIUS))), effort=0.1, shape=False)[0]


@pytest.mark.full
def test_a_ball_as_a_tool_answers_as_the_closed_form(ball):
    unseen = pressed.places(100, seed=9)
    wanted = pressed.force(unseen)
    error = np.linalg.norm(ball.energy.force(unseen - WAY) - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert np.median(error) < 0.01
    above = unseen + np.array([0.0, 0.0, DEEPEST])
    assert (ball.energy.force(above - WAY) == 0.0).all()


@pytest.mark.full
def test_its_file_answers_the_same_and_names_the_tool(ball, tmp_path):
    again = pp.load(ball.save(tmp_path / "ball.palpate"))
    X = pressed.places(20) - WAY
    np.testing.assert_array_equal(again.energy.force(X), ball.energy.force(X))
    assert again.energy.baseline.posed_tool == PosedTool(Sphere(RADIUS))
    assert "sphere of radius 10 mm" in str(again)


@pytest.mark.full
def test_a_hand_feels_it_at_the_foremost_point(ball):
    body = touchable(ball)
    assert abs(body.home[2]) < 2e-6  # the plane z = 0, as true as its distance
    hand, place = body.evaluator(), np.array([0.102, 0.101, -0.003])
    hand.place(place, holding=True, believed=True)
    hand(place, np.zeros(0))
    np.testing.assert_allclose(hand.force, ball.energy.force(place[None])[0], rtol=1e-9)


@pytest.mark.full
def test_what_does_not_know_tools_refuses_them(ball, tmp_path):
    with pytest.raises(UsageError, match="tells no torque"):
        ball.torque(pressed.places(1) - WAY)
    with pytest.raises(UsageError, match="solves of the tool that"):
        pp.validate(ball, under(PosedTool(Capsule(0.006, 0.03))))


@dataclass(frozen=True)
class Rows:
    """Solves with a response to each input."""

    X: np.ndarray
    force: np.ndarray
    energy: np.ndarray
    stiffness: np.ndarray

    def __len__(self) -> int:
        return len(self.X)


TURNING = PosedTool(Sphere(RADIUS), turns="axis", tilt=0.3)
MESH = np.array([0.1, 0.1, 0.0])  # where the dataset's mesh has the plane of `pressed`


def turned_response(X: np.ndarray) -> np.ndarray:
    """Force (N, 3) and Jᵀ T (N, 2) of the ball whose place, its foremost point, turns about its centre."""
    place, turn = TURNING.pose(X)
    arm = RADIUS * turn[:, :, 2]
    force = pressed.force(place + arm - MESH)
    w = np.column_stack([X[:, 3:], np.zeros(len(X))])
    along = np.einsum("nij,ni->nj", left_jacobian(w), np.cross(arm, force))
    return np.column_stack([force, along[:, :2]])


def turned_solves(count: int, seed: int) -> Dataset:
    """Solves of the closed form under a ball that turns, five inputs."""
    rng = np.random.default_rng(seed)
    angles = TURNING.spread_angles(rng.random((count, 2)))
    centres = pressed.places(count, seed=seed)
    X = np.column_stack([centres + MESH - RADIUS * TURNING.rotations(angles)[:, :, 2], angles])
    steps = 1e-6 * np.eye(5)
    slopes = [(turned_response(X + step) - turned_response(X - step)) / 2e-6 for step in steps]
    gradient = np.stack(slopes, axis=2)
    low, high = X[:, :3].min(axis=0), X[:, :3].max(axis=0)
    names = zip(("tip_x", "tip_y", "tip_z"), low.tolist(), high.tolist(), strict=True)
    inputs = (*(pp.Range(name, a, b, "m") for name, a, b in names), *TURNING.angles)
    acting = {"type": "SurfaceTool", "touches": "top", "depth": (0.0, DEEPEST), **TURNING.describe()}
    symmetric = (gradient + gradient.swapaxes(1, 2)) / 2
    rows = Rows(X, turned_response(X), pressed.energy(centres), symmetric)
    torque = np.cross(RADIUS * TURNING.rotations(angles)[:, :, 2], rows.force[:, :3])
    return pressed.dataset(rows, acting=acting, inputs=inputs, torque=torque)


@pytest.mark.full
def test_an_orientation_that_is_an_input_is_learnt_with_its_torque():
    """Of 60 solves; the torque is the energy's own slope, and no arm is learnt beside it."""
    body = pp.learn(turned_solves(60, 1), effort=0.1, shape=False, workers=1)[0]
    energy = body.hand_energy
    assert not body.quantities
    unseen = turned_solves(60, 9)
    X, wanted = unseen.X, unseen.response
    inside = energy.inside(X)
    size = np.linalg.norm(wanted[:, :3], axis=1)
    error = np.linalg.norm(energy.force(X) - wanted[:, :3], axis=1) / size
    assert np.median(error[inside]) < 0.02
    torque = np.linalg.norm(body.torque(X) - unseen["torque"], axis=1) / (size * RADIUS)
    assert np.median(torque[inside]) < 0.02


@pytest.mark.full
def test_a_body_under_a_tool_leaves_as_c_and_onnx(ball, tmp_path):
    for export, name in ((export_c, "ball"), (export_onnx, "ball.onnx")):
        comparison = export(ball, tmp_path / name).comparison
        assert comparison is not None
        assert comparison.passed


def test_the_deepest_point_of_a_tilted_tool():
    """The ball around it touches a plane when the tool does: it is nowhere outside on the side of the plane."""
    normal = np.array([0.0, 0.0, 1.0])
    rng = np.random.default_rng(0)
    for tool in (
        PosedTool(Capsule(0.006, 0.03), (0.1, 0.2, 0.3)),
        PosedTool(Punch(0.006, 0.001), (0.2, 0.0, 0.0)),
    ):
        radius, way = deepest_ball(tool, normal)
        points = rng.uniform(-0.05, 0.05, (20000, 3)) @ np.diag([1.0, 1.0, 0.2])
        for _ in range(60):
            points = points - tool.shape.distance(points)[:, None] * tool.shape.gradient(points)
        lowest = (points @ tool.turn.T + tool.to_centre)[:, 2].min()
        assert way[2] - radius == pytest.approx(lowest, abs=2e-5)
        assert radius >= tool.shape.size


def test_a_tool_on_a_curved_surface_is_known_by_its_balls():
    """The three sides of the tetrahedron face different ways: the deepest point depends on the place."""
    pressed_solves = PressedSolves.of(under(PosedTool(Capsule(0.04, 0.2)), touches="side"))
    assert isinstance(pressed_solves.baseline, PosedBaseline)
