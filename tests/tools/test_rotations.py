"""Rotation vectors: their matrices against SciPy's, their left Jacobian against how rotations follow each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.errors import UsageError
from palpate.tools import Capsule, Cone, PosedTool, Punch, left_jacobian, rotation_matrix

VECTORS = np.array(
    [[0.0, 0.0, 0.0], [1e-9, 0.0, 2e-9], [4e-3, -5e-3, 1e-3], [0.3, -0.2, 0.5], [1.0, 2.0, -1.5]]
)


def test_matrices_are_those_of_rotation_vectors():
    wanted = Rotation.from_rotvec(VECTORS).as_matrix()
    np.testing.assert_allclose(rotation_matrix(VECTORS), wanted, atol=4e-16 * 4)


def test_the_left_jacobian_is_the_turn_by_which_a_rotation_changes():
    """exp [w + dw]× exp [w]×ᵀ is the turn J dw: by central differences, which err by the square of the step."""
    step = 1e-4
    for w, J in zip(VECTORS, left_jacobian(VECTORS), strict=True):
        ends = [
            Rotation.from_rotvec(w + sign * step * np.eye(3)) * Rotation.from_rotvec(w).inv()
            for sign in (1.0, -1.0)
        ]
        turn = (ends[0].as_rotvec() - ends[1].as_rotvec()).T / (2 * step)
        np.testing.assert_allclose(J, turn, atol=10 * step**2)


def test_a_pose_is_place_and_rotation_after_the_fixed_one():
    tool = PosedTool(Capsule(0.006, 0.03), (0.0, 0.0, 0.7), turns="axis", tilt=0.4)
    place, turn = tool.pose(np.array([0.1, 0.2, 0.3, 0.2, -0.3]))
    np.testing.assert_array_equal(place, [0.1, 0.2, 0.3])
    wanted = Rotation.from_rotvec([0.2, -0.3, 0.0]) * Rotation.from_rotvec([0.0, 0.0, 0.7])
    np.testing.assert_allclose(turn, wanted.as_matrix(), atol=1e-15)
    assert [r.name for r in tool.angles] == ["tip_rx", "tip_ry"]
    assert PosedTool.of(tool.describe()) == tool


def test_angles_fill_the_disc_of_tilts():
    tool = PosedTool(Capsule(0.006, 0.03), turns="full", tilt=0.4)
    angles = tool.spread_angles(np.random.default_rng(0).random((2000, 3)))
    tilt = np.linalg.norm(angles[:, :2], axis=1)
    assert tilt.max() < 0.4
    # even over a disc: half of its area is within the radius over √2
    assert np.mean(tilt < 0.4 / np.sqrt(2)) == pytest.approx(0.5, abs=0.05)
    assert np.abs(angles[:, 2]).max() < 0.4


def test_a_mirror_image_of_a_tool_is_the_tool_in_another_pose():
    mirror, quarter = np.diag([-1.0, 1.0, 1.0]), rotation_matrix(np.array([0.0, 0.0, np.pi / 2]))
    over = np.diag([1.0, -1.0, -1.0])
    assert PosedTool(Punch(0.006, 0.002)).keeps(quarter)
    assert PosedTool(Capsule(0.006, 0.03)).keeps(mirror)
    assert not PosedTool(Capsule(0.006, 0.03)).keeps(quarter)
    assert not PosedTool(Capsule(0.006, 0.03), (0.0, 0.0, 0.5)).keeps(mirror)
    assert PosedTool(Cone(1.2, 0.004), (0.3, 0.0, 0.0)).keeps(mirror)
    assert not PosedTool(Cone(1.2, 0.004), (0.3, 0.0, 0.0)).keeps(quarter)
    assert not PosedTool(Capsule(0.006, 0.03)).keeps(over)


def test_an_angle_beyond_the_training_is_refused_with_the_one_that_would_do():
    tool = PosedTool(Capsule(0.006, 0.03), turns="full", tilt=0.4)
    tool.require_trained(np.array([[0.0, 0.0, 0.0, 0.28, -0.28, -0.4]]))
    for angles in ([0.3, 0.3, 0.0], [0.0, 0.0, -0.41]):
        with pytest.raises(UsageError, match=r"trained up to 0.4 rad \(22.9°\)"):
            tool.require_trained(np.array([[0.0, 0.0, 0.0, *angles]]))
    PosedTool(Capsule(0.006, 0.03)).require_trained(np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"turns": "round"}, "'axis'"),
        ({"turns": "axis"}, "tilt"),
        ({"turns": "axis", "tilt": 20.0}, "math.radians"),
    ],
)
def test_impossible_turns_are_refused(options, words):
    with pytest.raises(UsageError, match=words):
        PosedTool(Capsule(0.006, 0.03), **options)
