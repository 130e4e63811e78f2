"""Two jaws as one tool: how they lie, what each feels, which isometries keep them, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics import Body, Pinch
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.tools import Box, Capsule, Gripper, Sphere, rotation_matrix

CAPSULE = Capsule(0.005, 0.016)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_the_jaws_face_each_other_as_mirror_images(axis):
    """A point of one jaw has its image in the other, by the plane through the centre across the axis."""
    gripper = Gripper(Box(0.012, 0.010, 0.008, 0.001), axis=axis, roll=0.3)
    x = np.array([0.01, 0.02, 0.03, 0.04])
    mirror = np.eye(3) - 2 * np.outer(gripper.along, gripper.along)
    points = np.random.default_rng(0).uniform(-0.03, 0.03, (50, 3))
    distances = []
    for (jaw, place), image in zip(gripper.solids(x), (np.eye(3), mirror), strict=True):
        turn = rotation_matrix(np.array(jaw.rotation))
        own = (x[:3] + points @ image.T - place) @ turn - [0.0, 0.0, jaw.shape.front]
        distances.append(jaw.shape.distance(own))
        assert turn @ [0.0, 0.0, -1.0] == pytest.approx(
            (x[:3] - place) / np.linalg.norm(x[:3] - place), abs=1e-9
        )
    np.testing.assert_allclose(*distances, atol=1e-9)


def test_the_forces_along_the_axis_follow_from_sum_and_effort():
    gripper = Gripper(CAPSULE, axis="y")
    first, last = np.array([[0.1, 0.7, -0.2]]), np.array([[0.3, -0.4, 0.0]])
    effort = (first - last)[:, 1] / 2
    np.testing.assert_allclose(gripper.axial_forces(first + last, effort), ([0.7], [-0.4]))


def test_isometries_that_swap_equal_jaws_keep_a_gripper():
    swap, along = np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0])
    quarter = rotation_matrix(np.array([0.0, 0.0, np.pi / 2]))
    assert [Gripper(CAPSULE).keeps(m) for m in (swap, along, quarter)] == [True, True, False]
    assert [Gripper(CAPSULE, Sphere(0.005)).keeps(m) for m in (swap, along)] == [False, True]
    assert not Gripper(CAPSULE, roll=0.3).keeps(along)


def test_a_file_brings_the_gripper_back():
    gripper = Gripper(CAPSULE, Sphere(0.004), "z", 0.2, (0.01, 0.02))
    assert Gripper.of(json.loads(json.dumps(gripper.describe()))) == gripper


def test_openings_below_zero_or_beyond_training_are_refused():
    gripper = Gripper(CAPSULE, trained=(0.02, 0.03))
    gripper.require_trained(np.array([[0.0, 0.0, 0.0, 0.02], [0.0, 0.0, 0.0, 0.03]]))
    for opening, words in (
        (-0.001, "pass each other"),
        (0.01, "solves were made"),
        (0.05, "solves were made"),
    ):
        with pytest.raises(UsageError, match=words):
            gripper.require_trained(np.array([[0.0, 0.0, 0.0, opening]]))


def test_what_is_no_pinch_is_refused_in_words():
    body = Body(Block((0.02, 0.02, 0.02), element=0.01), NeoHookean(9e3, 0.45))
    with pytest.raises(UsageError, match="A jaw is"):
        Pinch("a finger")
    with pytest.raises(UsageError, match="jaws close along"):
        Pinch(CAPSULE, axis="w")
    with pytest.raises(UsageError, match="depth of a pinch"):
        Pinch(CAPSULE, depth=(-0.001, 0.002))
    with pytest.raises(UsageError, match="not between the jaws"):
        body.problem(Pinch(CAPSULE, touches="x_max")).design(4)
    with pytest.raises(UsageError, match="lines through the body, and 4 are wanted"):
        body.problem(Pinch(CAPSULE, over=((0.01, 0.009), (1.0, 0.011)), depth=(0.0, 0.002))).design(
            8, depths=2
        )
    with pytest.raises(UsageError, match="all but meet"):
        body.problem(Pinch(CAPSULE, depth=(0.0, 0.009))).inputs(np.zeros(4))
    with pytest.raises(UsageError, match="pad"):
        Pinch(CAPSULE, pad="rigid")
