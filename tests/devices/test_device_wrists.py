"""Handles that tell how they are turned, and wrists with motors: each driver on the double of its maker's library."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import ForceDimensionRig, HaplyRig, OpenHapticsRig

from palpate.devices.orientation import rotation_into
from palpate.errors import DeviceError, DeviceStopError
from palpate.runtime.hand_turn import rotation_of
from palpate.tools.rotations import rotation_matrix

TURN = np.array([0.3, -0.8, 0.5])  # rad, in the device's axes
TORQUE = np.array([0.01, -0.02, 0.005])  # N m


@pytest.fixture(params=["forcedimension", "openhaptics"])
def wrist(request, double):
    """The rig of a device with motors in its wrist, and its double."""
    if request.param == "forcedimension":
        with ForceDimensionRig(double("forcedimension")) as rig:
            rig.dhd.type, rig.dhd.wrist = 104, 2
            yield rig, rig.dhd
    else:
        with OpenHapticsRig(double("openhaptics")) as rig:
            rig.library.output_dof = 6
            yield rig, rig.library


def told(sample):
    """The rotation (3, 3) that a sample tells."""
    R = np.zeros((3, 3))
    assert rotation_of(sample.orientation, R)
    return R


def send(rig, force, torque, ticks=3):
    """Send force and torque for some ticks, and return the torque that the double was given last, N m."""
    for _ in range(ticks):
        rig.advance()
        rig.device.read(rig.now)
        rig.device.write(np.array(force), np.array(torque))
    rig.advance()
    rig.device.read(rig.now)
    double = rig.dhd if isinstance(rig, ForceDimensionRig) else rig.library
    unit = 1.0 if isinstance(rig, ForceDimensionRig) else 1e-3
    return unit * np.array([double.torque_x, double.torque_y, double.torque_z])


def test_a_wrist_tells_its_turn(wrist):
    rig, double = wrist
    device = rig.open()
    assert device.traits.orients
    double.turn_x, double.turn_y, double.turn_z = TURN
    np.testing.assert_allclose(told(rig.sample(3)), rotation_matrix(TURN), atol=1e-12)


def test_a_wrist_with_motors_is_given_the_torque_and_is_left_without(wrist):
    rig, double = wrist
    device = rig.open()
    assert device.traits.max_torque > np.linalg.norm(TORQUE)
    np.testing.assert_allclose(send(rig, [0.0, 0.1, 0.0], TORQUE), TORQUE, rtol=1e-12)
    np.testing.assert_allclose(send(rig, [0.0, 0.1, 0.0], np.zeros(3)), 0.0)
    send(rig, [0.0, 0.1, 0.0], TORQUE)
    rig.close()
    assert double.torque_x == double.torque_y == double.torque_z == 0.0


def test_a_torque_that_is_no_number_is_kept_from_the_wrist(wrist):
    rig, _ = wrist
    device = rig.open()
    rig.drive(2)
    with pytest.raises(DeviceError, match="not a finite number"):
        device.write(np.zeros(3), np.array([np.nan, 0.0, 0.0]))


@pytest.mark.parametrize("kind", ["forcedimension", "openhaptics"])
def test_a_wrist_without_motors_tells_its_turn_and_takes_no_torque(kind, double):
    rig = ForceDimensionRig(double(kind)) if kind == "forcedimension" else OpenHapticsRig(double(kind))
    with rig:
        if kind == "forcedimension":
            rig.dhd.type, rig.dhd.wrist = 34, 1
        traits = rig.open().traits
        assert traits.orients
        assert traits.max_torque == 0.0
        rig.drive(5, (0.0, 0.1, 0.0))


def test_a_handle_without_a_wrist_tells_no_turn(double):
    with ForceDimensionRig(double("forcedimension")) as rig:
        assert not rig.open().traits.orients
    with OpenHapticsRig(double("openhaptics")) as rig:
        rig.library.input_dof = 3
        assert not rig.open().traits.orients


def test_an_error_of_the_motors_takes_the_torque_with_the_force(double):
    """OpenHaptics' own callback sends zero of both, whatever the loop has left for it."""
    with OpenHapticsRig(double("openhaptics")) as rig:
        rig.library.output_dof = 6
        rig.open()
        assert send(rig, [0.0, 0.1, 0.0], TORQUE).any()
        rig.begin("stop")
        for _ in range(2):
            rig.advance()
            rig.device.write(np.array([0.0, 0.1, 0.0]), TORQUE)
        with pytest.raises(DeviceStopError):
            rig.device.read(rig.now)
        assert rig.library.torque_x == rig.library.torque_y == rig.library.torque_z == 0.0


def test_a_grip_tells_its_turn():
    with HaplyRig() as rig:
        device = rig.open()
        assert device.traits.orients
        assert device.traits.max_torque == 0.0
        rig.service.turn(0.8, 0.0, 0.6, 0.0)
        np.testing.assert_array_equal(rig.sample(4).orientation, [0.8, 0.0, 0.6, 0.0])


def test_quaternions_of_rotations_at_any_angle():
    rng, quaternion = np.random.default_rng(0), np.zeros(4)
    for size in (0.0, 1e-9, 1.0, 3.0, np.pi):
        w = rng.normal(size=3)
        R = rotation_matrix(w * size / np.linalg.norm(w))
        rotation_into(R.ravel().tolist(), quaternion)
        again = np.zeros((3, 3))
        assert rotation_of(quaternion, again)
        np.testing.assert_allclose(again, R, atol=1e-12)
    rotation_into([np.nan] * 9, quaternion)
    assert not rotation_of(quaternion, again)
