"""The torque on a learnt tool: by a learnt arm, by the energy's slopes along its turns, and in exported forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import palpate as pp
import pressed
import tooled
from palpate.errors import UsageError
from palpate.export import export_c
from palpate.export.c_export import block_of
from palpate.export.check_engine import CheckEngine, engine_library
from palpate.export.fmu_export import export_fmu
from palpate.export.lib_export import export_lib
from palpate.export.onnx_export import export_onnx
from palpate.export.umbridge_server import served_models
from palpate.export.wasm_core import WasmCore
from palpate.runtime.touchable import touchable
from palpate.surrogates.learnt_torque import TurnEvaluator, torque_of_slopes
from palpate.tools.rotations import left_jacobian, rotation_matrix


@pytest.fixture(scope="module")
def body():
    return tooled.surrogate()


def test_a_learnt_arm_times_the_force_is_the_torque(body):
    X = pressed.places(50)
    np.testing.assert_allclose(body.torque(X), tooled.torque(X), rtol=1e-9, atol=1e-18)
    above = X + np.array([0.0, 0.0, 0.02])
    assert (body.torque(above) == 0.0).all()


def test_beyond_the_ranges_the_arm_stays_that_of_their_border(body):
    inside, outside = np.array([[0.02, 0.0, 0.006]]), np.array([[0.05, 0.0, 0.006]])
    arms = [body.torque(X) / np.linalg.norm(body.energy.force(X)) for X in (inside, outside)]
    np.testing.assert_allclose(arms[1], arms[0], rtol=1e-12)


def test_the_hand_and_the_file_tell_the_same_torque(body, tmp_path):
    again, X = pp.load(body.save(tmp_path / "tool.palpate")), pressed.places(20)
    np.testing.assert_array_equal(again.torque(X), body.torque(X))
    hand = touchable(again).evaluator()
    for x, torque in zip(X, body.torque(X), strict=True):
        hand.place(x.copy(), holding=True, believed=True)
        hand(x, np.zeros(0))
        np.testing.assert_allclose(hand.torque, torque, rtol=1e-12)


def test_a_body_under_a_ball_tells_none():
    with pytest.raises(UsageError, match="tells no torque"):
        pressed.surrogate().torque(pressed.places(1))


@pytest.mark.parametrize("names", [("tip_rx", "tip_ry"), ("tip_rx", "tip_ry", "tip_rz")])
def test_the_torque_of_turns_is_the_work_of_every_small_turn(names):
    """U(R) = c · R e: a tool of revolution about its axis e; dU of a small turn φ is −τ · φ."""
    rng = np.random.default_rng(1)
    first, c = rotation_matrix(rng.normal(size=3)), rng.normal(size=3)
    axis = first[:, 2]

    def energy(_, w):
        return float(c @ rotation_matrix(np.array([*w, *[0.0] * (3 - len(w))])) @ axis)

    turns = TurnEvaluator(energy, range(len(names)), names, first)
    w = 0.4 * rng.normal(size=len(names))
    turns(np.zeros(3), w, np.ones(3))
    R = rotation_matrix(np.array([*w, *[0.0] * (3 - len(names))]))
    np.testing.assert_allclose(turns.torque, -np.cross(R @ axis, c), atol=1e-7)
    for phi in 1e-5 * np.eye(3):
        change = float(c @ (rotation_matrix(phi) - rotation_matrix(-phi)) @ R @ axis) / 2.0
        assert change == pytest.approx(-turns.torque @ phi, abs=1e-12)
    assert abs(turns.torque @ R @ axis) < 1e-7  # none about its own axis


def test_slopes_of_an_energy_without_turns_are_the_torque_itself():
    slope = np.array([0.1, -0.2, 0.3])
    np.testing.assert_array_equal(torque_of_slopes(slope, np.zeros(3), (0, 1, 2), np.eye(3)[2]), slope)


def test_a_tool_leaves_as_c_with_its_torque(body, tmp_path):
    comparison = export_c(body, tmp_path / "c").comparison
    assert comparison is not None
    assert comparison.parts["torque"].count >= 500
    assert comparison.passed


@pytest.mark.full
def test_a_tool_leaves_as_a_library_with_its_torque(body, tmp_path):
    comparison = export_lib(body, tmp_path / "lib").comparison
    assert comparison is not None
    assert comparison.passed
    assert comparison.parts["torque"].relative < 1e-9


def test_a_learnt_arm_of_a_sphere_leads_to_its_centre():
    """Of a frictionless ball the force goes through the centre: τ = m × F, m the way there from the place."""
    from palpate.learning.learn_arm import learn_arm
    from palpate.options import FitOptions

    way, X = np.array([0.0, 0.0, pressed.RADIUS]), pressed.places(60)
    data = pressed.dataset(pressed.solves(X), torque=np.cross(way, pressed.force(X)))
    arm = learn_arm(data, data.ranges, FitOptions())
    assert arm is not None
    unseen = pressed.places(40, seed=9)
    F = pressed.force(unseen)
    about_centre = np.linalg.norm(F, axis=1)[:, None] * arm.predict(unseen) - np.cross(way, F)
    size = np.linalg.norm(F, axis=1) * pressed.RADIUS
    assert (np.linalg.norm(about_centre, axis=1) < 1e-3 * size).all()
    assert math.isclose(
        float(np.abs(arm.predict(unseen)[:, 2]).max()), 0.0, abs_tol=1e-12
    )  # none about its axis


def test_the_core_of_pages_and_engines_tells_the_torque(body):
    block, X = block_of(body, field=None, with_field=False, deviation=False), pressed.places(50)
    np.testing.assert_allclose(WasmCore.of(block).torques(X), body.torque(X), rtol=1e-9, atol=1e-15)
    library = engine_library()
    if library is not None:
        with CheckEngine(library, block.to_bytes()) as engine:
            np.testing.assert_allclose(engine.torques(X), body.torque(X), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_tool_leaves_as_an_fmu_with_its_torque(body, tmp_path, version):
    done = export_fmu(body, tmp_path / "tool.fmu", fmi=version)
    assert done.comparison is not None
    assert done.comparison.passed
    assert done.comparison.parts["torque"].relative < 1e-9


def test_mirror_images_among_the_solves_are_not_learnt():
    """Left out, a solve would be told by its image beside it, and a network that swings between the two pass."""
    from palpate.learning.learn_arm import learn_arm
    from palpate.options import FitOptions

    X, mirror = pressed.places(60), np.diag([-1.0, 1.0, 1.0])
    X[0, 0], X[1, 0] = X[:, 0].max() + 1e-4, -(X[:, 0].max() + 1e-4)
    X[:, 0] = np.clip(X[:, 0], X[1, 0], X[0, 0])
    arms = 0.1 * X  # no mirror leaves it as it is: images would change what is learnt
    data = pressed.dataset(pressed.solves(X), torque=np.linalg.norm(pressed.force(X), axis=1)[:, None] * arms)
    learnt = [
        learn_arm(data, data.ranges, FitOptions(), matrices=matrices, about=np.zeros(3))
        for matrices in (None, np.array([np.eye(3), mirror]))
    ]
    np.testing.assert_array_equal(*(one.predict(pressed.places(40, seed=9)) for one in learnt))


def test_an_arm_is_learnt_from_mirror_images_too():
    """Solves on one side of a mirror plane tell the other: an arm along the mirror's normal turns round there."""
    from palpate.learning.learn_arm import learn_arm
    from palpate.options import FitOptions

    def arms(X):
        return np.column_stack([-2e-3 + X[:, 2], 0.1 * X[:, 0], 0.05 * X[:, 0]])  # x-mirror: (a, −b, −c)

    X, mirror = pressed.places(60), np.diag([-1.0, 1.0, 1.0])
    X[:, 0] = np.abs(X[:, 0])
    data = pressed.dataset(
        pressed.solves(X), torque=np.linalg.norm(pressed.force(X), axis=1)[:, None] * arms(X)
    )
    learnt = learn_arm(
        data, data.ranges, FitOptions(), matrices=np.array([np.eye(3), mirror]), about=np.zeros(3)
    )
    assert learnt is not None
    unseen = pressed.places(40, seed=9)
    np.testing.assert_allclose(learnt.predict(unseen), arms(unseen), atol=2e-5)


def test_a_tool_leaves_as_onnx_and_as_functions_of_arrays_with_its_torque(body, tmp_path):
    pytest.importorskip("onnxruntime")
    comparison = export_onnx(body, tmp_path / "tool.onnx").comparison
    assert comparison is not None
    assert comparison.passed
    assert comparison.parts["torque"].relative < 1e-9


def test_a_tool_is_a_function_of_arrays_with_its_torque(body):
    jax, X = pytest.importorskip("jax"), pressed.places(20)
    jax.config.update("jax_enable_x64", True)
    from palpate.adapters.jax import JaxBody

    np.testing.assert_allclose(np.asarray(JaxBody(body).torque(X)), body.torque(X), rtol=1e-9)


@pytest.mark.parametrize("turns", ["axis", "full"])
def test_a_tool_in_any_pose_leaves_as_c_with_its_torque(turns, tmp_path):
    comparison = export_c(tooled.posed_surrogate(turns), tmp_path / "c").comparison
    assert comparison is not None
    assert comparison.passed
    assert comparison.parts["torque"].relative < 1e-9
    assert comparison.parts["force"].relative < 1e-9


@pytest.mark.parametrize("turns", ["axis", "full"])
def test_the_torque_of_a_posed_tool_is_the_work_of_every_small_turn(turns):
    """dU of a small turn φ about the place is −τ · φ, along every turn that the inputs reach."""
    body = tooled.posed_surrogate(turns)
    tool, energy = body.energy.baseline.posed_tool, body.energy
    count = len(tool.angles)
    x = np.array([0.002, -0.003, -0.003, 0.1, -0.12, 0.05])[: 3 + count]
    torque = body.torque(x[None])[0]
    assert np.linalg.norm(torque) > 0
    J = left_jacobian(np.append(x[3:], np.zeros(3 - count)))
    for way in np.eye(count):
        step = 1e-5
        moved = np.array([x, x])
        moved[:, 3:] += step * np.array([way, -way])
        upper, lower = energy.energy(moved)
        turn = J[:, :count] @ way
        assert (upper - lower) / (2 * step) == pytest.approx(-torque @ turn, rel=1e-5, abs=1e-9)


def test_the_generic_core_knows_tools_in_any_pose():
    body = tooled.posed_surrogate("axis")
    block = block_of(body, field=None, with_field=False, deviation=False)
    low, high = np.array([[r.low, r.high] for r in body.inputs]).T
    X = np.random.default_rng(0).uniform(low, high, (30, len(low)))
    torque = body.torque(X)
    np.testing.assert_allclose(WasmCore.of(block).torques(X), torque, atol=1e-9 * np.abs(torque).max())


def test_um_bridge_serves_the_torque_without_slopes(body):
    model, x = served_models(body)["torque"], pressed.places(1)[0]
    np.testing.assert_allclose(model.value(x), body.torque(x[None])[0], rtol=1e-12)
    assert model.support == {
        "Evaluate": True,
        "Gradient": False,
        "ApplyJacobian": False,
        "ApplyHessian": False,
    }
    assert "torque" not in served_models(pressed.surrogate())


def test_a_validation_says_how_far_the_torque_is_off(body):
    X = pressed.places(40, seed=3)
    acting = {"type": "SurfaceTool", "touches": "top", "depth": (0.0, 0.006), **tooled.TOOL.describe()}
    data = pressed.dataset(pressed.solves(X), acting=acting, torque=1.01 * tooled.torque(X))
    figure = pp.validate(body, data).torque
    off = 0.01 * np.linalg.norm(tooled.torque(X), axis=1) / np.linalg.norm(pressed.force(X), axis=1)
    heavy = np.linalg.norm(pressed.force(X), axis=1) > 0.05 * np.linalg.norm(pressed.force(X), axis=1).max()
    assert figure.median == pytest.approx(np.median(off[heavy]) / tooled.TOOL.shape.size, rel=1e-6)
