"""A learnt body in a MuJoCo scene: what a tool feels, what it keeps and loses, and what is refused."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

import pressed
from exported_bodies import body as body_of
from palpate.errors import UsageError

mujoco = pytest.importorskip("mujoco")

from palpate.adapters.extra import import_extra
from palpate.adapters.mujoco import SENSOR_VALUES, StiffStepWarning, attach
from palpate.adapters.mujoco_mesh import MeshDrawing, add_mesh

TOP, MASS, GRAVITY = 0.1, 0.05, 9.81  # m, kg, m/s²
BALL = f'<geom name="tool" type="sphere" size="{pressed.RADIUS}" mass="{MASS}"/>'


def scene_text(step=5e-4, *, lift=0.02, damping=0.0, more="", ball=BALL, options=""):
    """A ball on a vertical slide, `lift` above the top of a body whose frame lies at (0.3, 0, TOP)."""
    return f"""<mujoco><option timestep="{step}" gravity="0 0 -{GRAVITY}" {options}/><worldbody>
        <body name="carrier" pos="0.3 0 {TOP + lift}">
        <joint type="slide" axis="0 0 1" damping="{damping}"/>{ball}</body>
        <body name="table" pos="0 0 0"><geom size=".01" mass="1"/>{more}</body></worldbody>
        <sensor><user name="touch" dim="{len(SENSOR_VALUES)}" needstage="acc" datatype="real"/></sensor></mujoco>"""


def scene(*args, **options):
    return mujoco.MjModel.from_xml_string(scene_text(*args, **options))


def placed(model, body, data=None, **options):
    data = mujoco.MjData(model) if data is None else data
    return attach(model, data, body, geom="tool", at=(0.3, 0.0, TOP), **options), data


def test_a_tool_rests_where_the_force_bears_it():
    """In the end the learnt force is the weight, at the depth at which the energy says so."""
    body, model = pressed.surrogate(), scene(damping=1.0)
    contact, data = placed(model, body, sensor="touch")
    mujoco.mj_step(model, data, nstep=8000)
    weight = MASS * GRAVITY
    borne = brentq(lambda d: body.energy.force([[0, 0, pressed.RADIUS - d]])[0, 2] - weight, 1e-4, 0.02)
    assert contact.depth == pytest.approx(borne, rel=1e-6)
    assert contact.force == pytest.approx([contact.force[0], 0.0, weight], rel=1e-6)
    assert data.sensor("touch").data[:3] == pytest.approx(contact.force)
    assert data.sensor("touch").data[4] == float(contact.inside)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_a_bounce_keeps_its_energy(integrator):
    """Over 10 s a drop that is not damped gains and loses less than 1e-5 of what it exchanges with the body.

    Euler's velocities are those of half a step before, as of a leapfrog.
    """
    body, step = pressed.surrogate(), 2.5e-4
    model = scene(step, lift=0.012, options=f'integrator="{integrator}"')
    contact, data = placed(model, body)
    start, energies, stored = data.qpos[0], [], []
    for _ in range(int(10.0 / step)):
        mujoco.mj_step(model, data)
        if contact.energy == 0.0 and data.qpos[0] + 0.012 > pressed.RADIUS:
            speed = data.qvel[0] - 0.5 * step * GRAVITY
            energies.append(0.5 * MASS * speed**2 + MASS * GRAVITY * (data.qpos[0] - start))
        stored.append(contact.energy)
    assert np.ptp(energies) < 1e-5 * max(stored)
    assert contact.damped_steps == 0


@pytest.mark.full
@pytest.mark.parametrize("modulus", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("step", [5e-4, 5e-3])
def test_no_step_is_too_long_and_no_body_too_stiff(modulus, step):
    """A dropped ball never rises above where it was let go by more than the step can tell, whatever its stiffness."""
    model = scene(step)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        contact, data = placed(model, pressed.surrogate(factor=modulus / 9e3))
        heights = []
        for _ in range(100_000):
            mujoco.mj_step(model, data)
            heights.append(data.qpos[0])
    assert np.isfinite(heights).all()
    # Euler's velocities are half a step late, which may lift an apex by half of a step's way at full speed
    assert max(heights) < 0.5 * step * math.sqrt(2 * GRAVITY * 0.02)
    assert bool(contact.damped_steps) == any(w.category is StiffStepWarning for w in told)


def test_a_damped_step_holds_the_tool_where_an_explicit_one_would():
    body, model = pressed.surrogate(factor=1e3), scene(5e-3, lift=0.0101)
    contact, data = placed(model, body)
    with pytest.warns(StiffStepWarning, match="too long for the stiffness"):
        mujoco.mj_step(model, data, nstep=2000)
    assert contact.force[2] == pytest.approx(MASS * GRAVITY, rel=1e-9)
    place = pressed.RADIUS - contact.depth
    assert body.energy.force([[0.0, 0.0, place]])[0, 2] == pytest.approx(MASS * GRAVITY, rel=1e-6)


def test_the_reaction_acts_on_what_the_body_stands_on():
    """A table on a spring sinks as if the ball lay on it."""
    more = '<joint name="spring" type="slide" axis="0 0 1" stiffness="500" damping="20"/>'
    model = scene(damping=1.0, more=more)
    with pytest.raises(UsageError, match="can move"):
        placed(model, pressed.surrogate(), on="table")
    contact, data = placed(model, pressed.surrogate(), on="table", moves=True)
    mujoco.mj_step(model, data, nstep=20_000)
    assert data.joint("spring").qpos[0] == pytest.approx(-(MASS + 1.0) * GRAVITY / 500, rel=1e-6)
    assert contact.force[2] == pytest.approx(MASS * GRAVITY, rel=1e-6)


def test_a_body_lies_as_it_was_put():
    """Turned by 90° about x, its top faces −y: a ball from there is pushed to −y."""
    model = scene()
    data = mujoco.MjData(model)
    half = math.sqrt(0.5)
    contact = attach(
        model, data, pressed.surrogate(), geom="tool", at=(0.3, 0.0, TOP + 0.02, half, half, 0, 0)
    )
    data.geom("tool").xpos[:] = [0.3, -0.006, TOP + 0.02]
    assert contact.place(data) == pytest.approx([0.0, 0.0, 0.006], abs=1e-12)
    contact.add_force(model, data)
    assert contact.force[1] == pytest.approx(-pressed.surrogate().energy.force([[0.0, 0.0, 0.006]])[0, 2])


def test_rollouts_and_other_scenes_are_served_alike():
    """Several states of one scene in threads give what each alone gives; a scene without a body is left alone."""
    from mujoco import rollout

    model = scene()
    contact, data = placed(model, pressed.surrogate())
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.zeros((4, size))
    states[:, 1] = [-0.011, -0.012, -0.013, 0.0]
    threads = [mujoco.MjData(model) for _ in range(2)]
    together, _ = rollout.rollout(model, threads, states, nstep=200)
    for k in range(4):
        mujoco.mj_setState(model, data, states[k], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        mujoco.mj_step(model, data, nstep=200)
        assert data.qpos[0] == together[k, -1, 1]
    other = scene()  # compiling it steps it once
    free = mujoco.MjData(other)
    mujoco.mj_step(other, free, nstep=400)
    assert free.qpos[0] < -0.15
    contact.detach()
    mujoco.mj_resetData(model, data)
    mujoco.mj_step(model, data, nstep=400)
    assert data.qpos[0] == free.qpos[0]


def test_the_mesh_is_the_body_as_it_is_pressed():
    """The drawn vertices are the field's, in the scene's frame, though MuJoCo keeps a mesh in axes of its own."""
    body = body_of("contact")
    ball = f'<geom name="tool" type="sphere" size="{body.energy.baseline.radius}"/>'
    spec = mujoco.MjSpec.from_string(
        '<mujoco><option timestep="5e-4"/><worldbody><body pos="0.3 0 0.2"><freejoint/>'
        f"{ball}</body></worldbody></mujoco>"
    )
    add_mesh(spec, body, at=(0.3, 0.0, 0.1))
    model = spec.compile()
    data = mujoco.MjData(model)
    low = np.array([r.low for r in body.inputs])
    contact = attach(model, data, body, geom="tool", at=(0.3, 0.0, 0.1), parameters=low[3:])
    middle = np.array([(r.low + r.high) / 2 for r in body.inputs[:3]])
    data.qpos[:3] = np.array([0.3, 0.0, 0.1]) + middle
    mujoco.mj_forward(model, data)
    drawing, updated = MeshDrawing(contact), []
    drawing.draw(data, updated.append)
    assert updated == [drawing.mesh]
    geom = data.geom("soft body")
    shown = geom.xpos + model.mesh_vert @ geom.xmat.reshape(3, 3).T
    shift = body.fields["displacement"].values(np.concatenate([middle, low[3:]])[None])[0]
    rest = body.fields["displacement"].points
    nearest = np.linalg.norm(shown[:, None] - (rest + shift + [0.3, 0.0, 0.1])[None], axis=2).min(axis=1)
    assert nearest.max() < 1e-6  # single precision
    assert np.abs(shift).max() > 1e-4


@pytest.mark.parametrize(
    ("ball", "options", "message"),
    [
        (BALL.replace("0.01", "10"), {}, "millimetres"),
        (BALL.replace("0.01", "0.012"), {}, "another ball"),
        (BALL.replace("sphere", "box"), {}, "no sphere"),
        (BALL, {"sensor": "tuch"}, "no sensor named 'tuch'"),
        (BALL, {"parameters": (1.0,)}, "further inputs are none"),
        (BALL.replace('"tool"', '"rod"'), {}, "no geom named 'tool'"),
        (BALL, {"on": "floor"}, "no body named 'floor'"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(ball, options, message):
    model = scene(ball=ball.replace('type="box" size="0.01"', 'type="box" size="0.01 0.01 0.01"'))
    with pytest.raises(UsageError, match=message):
        placed(model, pressed.surrogate(), **options)


def test_ground_that_is_led_about_counts_as_moving():
    """MuJoCo takes a mocap body for welded to the world, and so does it what hangs on one."""
    text = scene_text().replace('<body name="table"', '<body mocap="true"><body name="table"', 1)
    model = mujoco.MjModel.from_xml_string(text.replace("</worldbody>", "</body></worldbody>"))
    with pytest.raises(UsageError, match="which can move"):
        placed(model, pressed.surrogate(), on="table")
    placed(model, pressed.surrogate(), on="table", moves=True)


def test_a_missing_package_is_named_with_the_command_that_installs_it():
    with pytest.raises(UsageError, match="needs the package no_such_simulator") as caught:
        import_extra("no_such_simulator", "mujoco")
    assert "pip install 'palpate[mujoco]'" in caught.value.fix


def test_a_body_that_remembers_is_refused():
    with pytest.raises(UsageError, match="remembers"):
        placed(scene(), body_of("relaxation"))
