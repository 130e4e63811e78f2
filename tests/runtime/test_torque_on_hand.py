"""The turn of a hand and the torque on it: limits, faults, noise, passivity, and recordings."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tooled
from palpate.devices import Sample
from palpate.devices.device import Traits
from palpate.devices.trace_file import read_trace
from palpate.errors import DeviceLostError, UsageError
from palpate.runtime import Fault
from palpate.runtime.hand_turn import LEVER, rotation_of
from palpate.runtime.loop import Loop
from palpate.runtime.recorder import TraceRecorder
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.replay import Replay, loop_facts
from palpate.runtime.safety import Limits
from palpate.runtime.touchable import touchable
from palpate.tools.rotations import rotation_matrix, rotation_vector

TICK, MOST = 1e-3, 1e-3  # s, N m
AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))  # of a device: towards the user, right, up
UP = np.array([0.0, 0.0, 1.0])  # in these


class Wrist:
    """A handle that a test leads and turns; what was written is kept."""

    def __init__(self, *, torque=MOST, orients=True):
        self.traits = Traits(
            0.05, 10.0, 0.5, "a test", axes=AXES, orients=orients, max_torque=torque, resolution=1e-6
        )
        self.sample, self.fails, self.breaks = Sample(), None, None
        self.sample.holding = True
        self.forces, self.torques = [], []

    def read(self, now):
        """Return the sample."""
        if self.fails is not None:
            raise self.fails
        self.sample.time = now
        return self.sample

    def write(self, force, *torque):
        """Keep force and torque; a device without motors in its wrist is given none."""
        assert len(torque) == (self.traits.max_torque > 0.0)
        if self.breaks is not None:
            raise self.breaks
        self.forces.append(force.copy())
        self.torques.append(torque[0].copy() if torque else np.zeros(3))

    def close(self):
        """Let go."""

    def turn(self, w):
        """Turn the handle to a rotation vector (3,), rad, in its own axes."""
        angle = float(np.linalg.norm(w))
        axis = np.asarray(w) / angle if angle else np.zeros(3)
        self.sample.orientation[:] = [math.cos(angle / 2), *(math.sin(angle / 2) * axis)]


class Bench:
    """A loop around a wrist and a body; `press` and `turn` lead the hand evenly."""

    def __init__(self, body, shared, device=None, *, stiffness=0.0, recorder=None, limit=math.inf):
        self.body, self.device, self.now = touchable(body), device or Wrist(), 0.0
        traits = self.device.traits
        self.loop = Loop(
            self.body, self.device, shared, self.body.workspace(traits.radius),
            Limits(traits.max_force, max_torque=limit), stiffness=stiffness, recorder=recorder,
        )  # fmt: skip
        self.w, self.at = np.zeros(3), 0.01 * UP
        self.device.sample.position[:] = self.at
        self.run(20)

    def run(self, ticks, at=None, w=None):
        """Lead the hand to a place and a turn in so many ticks; return the faults."""
        places = np.linspace(self.at, self.at if at is None else at, ticks + 1)[1:]
        turns = np.linspace(self.w, self.w if w is None else w, ticks + 1)[1:]
        faults = []
        for self.at, self.w in zip(places, turns, strict=True):
            self.device.sample.position[:] = self.at
            self.device.turn(self.w)
            faults.append(self.tick())
        return faults

    def tick(self):
        """Pass one tick; return its fault."""
        self.now += TICK
        self.loop.tick(self.now)
        return self.loop.fault

    def press(self, ticks=150):
        """Press to three quarters of the trained depth."""
        return self.run(ticks, at=-0.75 * self.body.deepest / self.loop.workspace.scale * UP)

    def lift(self, ticks=150):
        """Go back into the air."""
        return self.run(ticks, at=0.01 * UP)

    @property
    def torques(self):
        """Torques (N, 3) that were sent, N m."""
        return np.array(self.device.torques)

    def parameters(self):
        """The further inputs in force."""
        return self.loop.parameters.copy()


@pytest.fixture(scope="module")
def body():
    return tooled.surrogate()


def test_the_torque_is_limited_and_grows_evenly_from_nothing(body, shared):
    bench = Bench(body, shared)
    assert not any(bench.press())
    torques = bench.torques
    sizes, steps = np.linalg.norm(torques, axis=1), np.linalg.norm(np.diff(torques, axis=0), axis=1)
    assert sizes.max() <= MOST * (1 + 1e-12)
    assert sizes.max() > 0.9 * MOST  # it asks for more
    assert steps.max() <= MOST / 0.020 * TICK * (1 + 1e-9)
    assert (torques[:20] == 0.0).all()


def test_the_torque_is_the_tools_in_the_devices_axes(body, shared):
    bench = Bench(body, shared, Wrist(torque=1e3))
    bench.press()
    bench.run(200)
    place = bench.loop.out.position
    x, y, z = body.torque(place[None])[0] / bench.loop.workspace.scale
    # the body's z is up, its y away from the user
    np.testing.assert_allclose(bench.torques[-1], [-y, x, z], rtol=1e-6, atol=1e-9)


def test_a_limit_of_torque_below_the_devices_own_holds(body, shared):
    bench = Bench(body, shared, limit=0.2 * MOST)
    bench.press()
    bench.run(200)
    assert np.linalg.norm(bench.torques, axis=1).max() == pytest.approx(0.2 * MOST)
    with pytest.raises(UsageError, match="torque limit of -1 N m"):
        Limits(1.0, max_torque=-1.0)


def test_a_torque_on_a_handle_whose_turn_nobody_knows_is_refused():
    with pytest.raises(UsageError, match="must tell how its handle is turned"):
        Wrist(orients=False)


def test_a_device_without_motors_in_its_wrist_is_given_forces_alone(body, shared):
    bench = Bench(body, shared, Wrist(torque=0.0))
    bench.press()
    assert bench.device.forces[-1].any()
    assert bench.loop.out.torque.any()  # what the tool feels is published


@pytest.mark.parametrize("how", ["not a number", "a jump", "gone", "stop", "let go"])
def test_what_ends_the_force_ends_the_torque_at_once(body, shared, how):
    bench = Bench(body, shared)
    bench.press()
    assert np.linalg.norm(bench.torques[-1]) > 0.5 * MOST
    wanted, patience = {
        "not a number": (Fault.IMPOSSIBLE_PLACE, 3),
        "a jump": (Fault.IMPOSSIBLE_PLACE, 3),
    }.get(how, (Fault.DEVICE_LOST if how == "gone" else Fault.NONE, 1))
    if how == "not a number":
        bench.device.sample.orientation[1] = math.nan
    elif how == "a jump":
        bench.device.turn([1.5, 0.0, 0.0])
    elif how == "gone":
        bench.device.fails = DeviceLostError("gone")
    elif how == "stop":
        shared.write_command(stop=True)
    else:
        bench.device.sample.holding = False
    faults = [bench.tick() for _ in range(patience)]
    assert faults[-1] is wanted
    assert faults[:-1] == [Fault.NONE] * (patience - 1)
    assert (bench.torques[-1] == 0.0).all()


def test_a_torque_that_was_not_delivered_is_not_claimed(body, shared):
    bench = Bench(body, shared)
    bench.press()
    assert bench.loop.out.torque.any()
    bench.device.breaks = DeviceLostError("gone")
    assert bench.tick() is Fault.DEVICE_LOST
    assert not bench.loop.out.torque.any()
    assert not bench.loop.out.force.any()


def test_the_end_of_the_loop_writes_and_publishes_no_force_and_no_torque(body, shared):
    bench = Bench(body, shared)
    bench.press()
    bench.loop.end()
    assert not bench.loop.device_error
    assert not bench.device.forces[-1].any()
    assert not bench.torques[-1].any()
    assert not bench.loop.out.torque.any()


@pytest.mark.parametrize("torque", [0.0, MOST])
def test_a_torque_that_is_no_number_is_a_fault_and_not_published(body, shared, torque):
    bench = Bench(body, shared, Wrist(torque=torque))
    bench.press()
    answer = bench.loop.evaluator

    def nonsense(position, parameters, force):
        answer.torque[:] = math.nan

    answer._torque_at = nonsense
    assert bench.tick() is Fault.OUTPUT_NOT_FINITE
    np.testing.assert_array_equal(bench.loop.out.torque, np.zeros(3))
    np.testing.assert_array_equal(bench.torques[-1], np.zeros(3))


def test_one_bad_orientation_is_passed_over(body, shared):
    bench = Bench(body, shared)
    bench.press()
    bench.device.turn([1.5, 0.0, 0.0])
    assert bench.tick() is Fault.NONE
    assert not any(bench.run(50))
    assert bench.loop.turn.angle == pytest.approx(np.zeros(3))


def test_noise_of_the_sensor_neither_faults_nor_shakes(body, shared):
    """2 mrad of noise on a tool of fixed orientation leave the torque what it is."""
    bench, rng = Bench(body, shared), np.random.default_rng(0)
    bench.press()
    for _ in range(500):
        bench.device.turn(2e-3 * rng.normal(size=3))
        assert bench.tick() is Fault.NONE
    sizes = np.linalg.norm(bench.torques[-500:], axis=1)
    assert sizes.max() <= MOST * (1 + 1e-12)
    assert np.ptp(sizes) < 0.1 * MOST


def given_to_hand(bench, start):
    """Work of the torque on the hand since a tick, J, from what was sent and how the handle was turned."""
    return -bench.loop.turn_torque.work - start


def turn_with_the_torque(bench, control):
    """Turn by 0.6 rad along the torque while the tool presses, and back in the air; return the work on the hand, J."""
    if not control:
        bench.loop.turn_torque.passivity.mass = 0.0
    for _ in range(3):
        bench.press()
        along = bench.torques[-1] / np.linalg.norm(bench.torques[-1])
        bench.run(600, w=0.6 * along)
        bench.lift()
        bench.run(300, w=np.zeros(3))
    return given_to_hand(bench, 0.0)


def test_a_hand_that_turns_with_the_torque_and_back_in_the_air_gains_little(body, shared):
    """A tool whose orientation is no input pushes on a turning hand for nothing: the controller takes that back."""
    free = turn_with_the_torque(Bench(body, shared), control=False)
    assert free > 0.5 * 3 * 0.6 * MOST  # three rounds, without it
    damped = turn_with_the_torque(Bench(body, shared), control=True)
    assert damped < 0.5 * free


@pytest.mark.parametrize("turns", [2, 3])
def test_a_tool_turns_with_the_hand_from_where_it_was(shared, turns):
    bench = Bench(tooled.turned_surrogate(turns), shared)
    w = np.array([0.05, 0.1, 0.0])  # of the device: towards the user, right
    bench.run(100, w=w)
    in_body = np.array([w[1], -w[0], 0.0])  # right, away, up
    np.testing.assert_allclose(bench.parameters(), in_body[:turns], atol=1e-9)
    bench.device.sample.holding = False
    bench.run(100, w=np.array([0.0, -0.2, 0.0]))
    np.testing.assert_allclose(bench.parameters(), in_body[:turns], atol=1e-9)
    bench.device.sample.holding = True
    bench.run(100)
    np.testing.assert_allclose(bench.parameters(), in_body[:turns], atol=1e-9)
    bench.run(400, w=np.array([0.0, 0.8, 0.0]))
    assert bench.parameters()[0] == tooled.TILT  # the border of what was trained


def test_a_handle_that_is_rolled_on_and_on_keeps_its_tool_at_the_border(shared):
    """Beyond half a turn a rotation vector leaps to the other side; the tool does not, and comes back with the hand."""
    bench = Bench(tooled.turned_surrogate(3), shared)
    for angle in np.linspace(0.0, 1.8 * math.pi, 600):
        bench.device.turn(angle * UP)
        assert bench.tick() is Fault.NONE
        assert bench.parameters()[2] == pytest.approx(min(angle, tooled.TILT), abs=1e-9)
    for angle in np.linspace(1.8 * math.pi, -0.1, 600):
        bench.device.turn(angle * UP)
        assert bench.tick() is Fault.NONE
    assert bench.parameters()[2] == -tooled.TILT


def test_a_turned_tool_gives_nothing_back_on_closed_ways_of_place_and_turn(shared):
    bench = Bench(tooled.turned_surrogate(), shared, Wrist(torque=1e3))
    for _ in range(3):
        bench.press()
        bench.run(150, w=np.array([0.1, 0.2, 0.05]))
        bench.lift()
        bench.run(150, w=np.zeros(3))
    torque = bench.loop.turn_torque
    put_in = torque.work + torque.way_work
    assert abs(put_in) < 0.05 * abs(torque.work)


def test_a_recording_holds_turn_and_torque_and_replays_to_the_last_bit(shared, tmp_path):
    body, ring = tooled.turned_surrogate(), Ring.private()
    bench = Bench(body, shared, recorder=TickRecorder(ring))
    loop, limits = bench.loop, Limits(bench.device.traits.max_force)
    ring.describe(loop_facts(bench.body, loop, limits))
    bench.run(20, w=np.array([0.02, 0.0, 0.0]))
    recorder = TraceRecorder(ring, tmp_path / "a.trace", {"device": "test"})
    loop.recorder.begin(loop)
    recorder.start()
    bench.press()
    bench.run(100, w=np.array([0.05, -0.1, 0.02]))
    bench.lift()
    recorder.stop()
    trace = read_trace(recorder.path)
    ticks = trace.ticks
    assert ticks["sent_torque"].any()
    assert np.ptp(ticks["parameters"][:, 0]) > 0.05
    np.testing.assert_array_equal(ticks["sent_torque"], bench.torques[-len(ticks) :])
    replayed = Replay(trace, bench.body).run()
    assert replayed.identical, str(replayed)
    np.testing.assert_array_equal(replayed.ticks["parameters"], ticks["parameters"])


def test_quaternions_are_rotations_or_nothing():
    R, w = np.zeros((3, 3)), np.array([0.3, -0.2, 0.5])
    angle = float(np.linalg.norm(w))
    assert rotation_of(np.array([math.cos(angle / 2), *(math.sin(angle / 2) * w / angle)]), R)
    np.testing.assert_allclose(R, rotation_matrix(w), atol=1e-15)
    np.testing.assert_allclose(rotation_vector(R), w, rtol=1e-12)
    for wrong in ([0.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [math.nan, 0.0, 0.0, 1.0]):
        assert not rotation_of(np.array(wrong), R)


def test_a_turn_counts_as_a_way_at_the_fingers():
    assert 0.02 < LEVER < 0.1
