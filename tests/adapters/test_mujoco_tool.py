"""A tool in a MuJoCo scene: force and torque against differences of the energy, and their reactions."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tooled
from palpate.errors import UsageError
from palpate.tools.rotations import rotation_matrix

mujoco = pytest.importorskip("mujoco")

from palpate.adapters.mujoco import attach

AT = (0.3, 0.1, 0.2, math.cos(0.2), math.sin(0.2), 0.0, 0.0)  # place and quaternion of the body's frame


def scene(first, *, table=""):
    """A tool on a free joint, its site turned as the learnt tool is, and a table that may be free."""
    w, x, y, z = _quaternion(first)
    return mujoco.MjModel.from_xml_string(f"""<mujoco><option gravity="0 0 0"/><worldbody>
        <body name="tool"><freejoint/><geom size=".01" mass=".1" pos="0.02 0 0.03"/>
        <site name="tip" pos="0.004 -0.003 0.01" quat="{w} {x} {y} {z}"/></body>
        <body name="table">{table}<geom size=".05" mass="1"/></body></worldbody></mujoco>""")


def _quaternion(R):
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(R).ravel())
    return quaternion


def put(model, data, body, place, turn):
    """Bring the site to a place (3,) and the tool to a turn (3, 3) beside its first one, in the body's axes."""
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, np.array(AT[3:]))
    frame = frame.reshape(3, 3)
    R = frame @ turn @ tooled_first(body) @ tooled_first(body).T  # the tool's frame is the site's
    data.qpos[3:7] = _quaternion(R)
    data.qpos[:3] = np.array(AT[:3]) + frame @ place - R @ model.site_pos[0]
    mujoco.mj_forward(model, data)


def tooled_first(body):
    turn = body.hand_energy.baseline.posed_tool.turn
    return np.eye(3) if turn is None else turn


@pytest.fixture(scope="module")
def turned():
    return tooled.turned_surrogate()


def test_force_and_torque_are_the_slopes_of_the_energy_along_every_joint(turned):
    model = scene(tooled_first(turned))
    data = mujoco.MjData(model)
    contact = attach(model, data, turned, site="tip", at=AT)
    put(model, data, turned, np.array([0.005, -0.004, 0.006]), rotation_matrix(np.array([0.1, -0.15, 0.05])))
    felt, start = data.qfrc_passive.copy(), data.qpos.copy()
    assert contact.torque.any()
    step = 1e-6
    for joint in range(6):
        energies = []
        for side in (1.0, -1.0):
            way = np.zeros(model.nv)
            way[joint] = side * step
            data.qpos[:] = start
            mujoco.mj_integratePos(model, data.qpos, way, 1.0)
            mujoco.mj_forward(model, data)
            energies.append(contact.energy)
        slope = (energies[0] - energies[1]) / (2.0 * step)
        assert felt[joint] == pytest.approx(-slope, abs=1e-6 * np.abs(felt).max())


def test_what_the_tool_feels_the_table_feels_the_other_way():
    """Force and torque about one point sum up to nothing: neither momentum nor its moment is made."""
    body = tooled.surrogate()
    model = scene(tooled_first(body), table="<freejoint/>")
    data = mujoco.MjData(model)
    contact = attach(model, data, body, site="tip", at=AT, on="table", moves=True)
    put(model, data, body, np.array([0.005, -0.004, 0.006]), np.eye(3))
    assert contact.inside
    f, places = data.qfrc_passive.reshape(2, 6), data.qpos.reshape(2, 7)[:, :3]
    about = [
        np.cross(place, g[:3]) + data.xmat[1 + i].reshape(3, 3) @ g[3:]
        for i, (place, g) in enumerate(zip(places, f, strict=True))
    ]
    np.testing.assert_allclose(f[0, :3], -f[1, :3], rtol=1e-12)
    np.testing.assert_allclose(about[0], -about[1], atol=1e-12 * np.abs(about[0]).max())
    np.testing.assert_allclose(f[0, :3], contact.force, rtol=1e-12)


def test_a_fixed_tool_tells_its_torque_and_when_it_is_turned():
    body = tooled.surrogate()
    model = scene(tooled_first(body))
    data = mujoco.MjData(model)
    contact = attach(model, data, body, site="tip", at=AT)
    place = np.array([0.005, -0.004, 0.006])
    put(model, data, body, place, np.eye(3))
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, np.array(AT[3:]))
    np.testing.assert_allclose(
        contact.torque, frame.reshape(3, 3) @ body.torque(place[None])[0], rtol=1e-9, atol=1e-15
    )
    assert contact.inside
    put(model, data, body, place, rotation_matrix(np.array([0.05, 0.0, 0.0])))
    assert not contact.inside


def test_a_tool_is_named_by_its_site_and_a_ball_by_its_geom():
    body = tooled.surrogate()
    model = scene(tooled_first(body))
    with pytest.raises(UsageError, match="Give site=NAME"):
        attach(model, mujoco.MjData(model), body, geom="tool", at=AT)
