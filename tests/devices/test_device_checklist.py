"""What every device must do; a new one is tested by being entered in the table of devices.

Hardware is driven on its double, whose time stands still (`rigs`), through one story: it opens, reads, pushes, breaks,
comes back and closes.
"""

from __future__ import annotations

import contextlib
import gc
import math
import sys
import tracemalloc
from pathlib import Path

import evdev_double
import numpy as np
import pytest
from evdev_double import Pad
from rigs import RIGS, PlainRig, rig_of
from spnav_double import Daemon

from palpate import devices
from palpate.devices import Sample, device_named, device_names, device_traits, spacemouse
from palpate.devices.device_search import HARDWARE
from palpate.devices.stroke import StrokeDevice
from palpate.devices.tick_record import FLAGS
from palpate.devices.tick_record import TICK as RECORD
from palpate.devices.trace_file import TraceWriter
from palpate.errors import DeviceError, UsageError
from palpate.runtime import Fault, Workspace
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from standins import STIFFNESS, PlainModel

# right, up and towards the user, 1, 2 and 3 cm, in the axes that each maker documents
IN_MAKERS_AXES = {
    "haply": (0.01, -0.03, 0.02),  # right, away, up
    "crtk": (-0.03, -0.01, 0.02),  # away, left, up
    "forcedimension": (0.03, 0.01, 0.02),  # towards, right, up
    "openhaptics": (0.01, 0.02, 0.03),  # right, up, towards
}
STORIES = {
    "silence": Fault.INPUT_STALLED,
    "stop": Fault.DEVICE_STOPPED,
    "loss": Fault.DEVICE_LOST,
    "no number": Fault.INPUT_NOT_FINITE,
}
OPENED_BY_HARDWARE = sorted(entry.device for entry in HARDWARE)


@pytest.fixture(params=device_names())
def name(request):
    return request.param


@pytest.fixture
def recorded_stroke(tmp_path):
    """A file of a stroke of 40 ms."""
    ticks = np.zeros(41, RECORD)
    ticks["tick"], ticks["time"] = np.arange(41), 1e-3 * np.arange(41)
    ticks["hand"][:, 1] = -0.03 * np.sin(np.linspace(0.0, np.pi, 41))
    ticks["flags"] = 1 << FLAGS.index("holding")
    writer = TraceWriter(
        tmp_path / "a.trace", {"workspace": {"radius": 0.075}, "limits": {"max_force": 12.0}}
    )
    writer.add_ticks(ticks)
    writer.close({})
    return writer.path


@pytest.fixture
def rig(name, request, shared, double):
    """The device, open, on its double if it is hardware."""
    shared.write_command(beat=0.0, grabbed=True, target=(0.0, -0.01, 0.0), period=0.01)
    with contextlib.ExitStack() as stack:
        if name in RIGS:
            rig = stack.enter_context(rig_of(name, double))
        else:
            address = name
            if name == "gamepad":
                request.getfixturevalue("monkeypatch").setitem(
                    sys.modules, "evdev", evdev_double.module(Pad())
                )
            elif name == "spacemouse":
                request.getfixturevalue("monkeypatch").setattr(spacemouse, "_ANSWER", 60.0)
                address = f"spacemouse:socket={stack.enter_context(Daemon()).path}"
            elif name == "trace":
                address = f"trace:file={request.getfixturevalue('recorded_stroke')},repeat=1"
            rig = stack.enter_context(PlainRig(lambda: device_named(address, shared.command)))
            rig.arrive = lambda: shared.write_command(beat=rig.now)  # of the page
        rig.open()
        yield rig


def test_traits_are_physical(name):
    traits = device_traits(name)
    assert 0.0 < traits.radius < 1.0
    assert 0.0 < traits.max_force < 100.0
    assert traits.damping is None or traits.damping >= 0.0
    assert traits.source
    assert (traits.damping is None) <= (traits.resolution == 0.0), (
        "the steps of a sensor are stated where motors push"
    )
    assert device_traits(f"{name}:some=option") == traits
    turn = np.array(traits.axes)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))


def test_reads_one_sample_object_inside_the_workspace(rig):
    device = rig.device
    first = device.read(rig.now)
    assert isinstance(first, Sample)
    position, seen = first.position, first.time
    for _ in range(200):
        rig.advance()
        sample = device.read(rig.now)
        assert sample is first
        assert sample.position is position
        assert position.shape == (3,)
        assert np.isfinite(position).all()
        assert np.linalg.norm(position) <= device.traits.radius
        assert seen <= sample.time <= rig.now + 1e-9, "a sign of life is never of the future"
        assert 0.0 < sample.patience <= 1.0
        seen = sample.time


def test_takes_any_force_and_closes_twice(rig):
    rig.device.read(rig.now)
    for force in (np.zeros(3), np.array([1.0, -2.0, 3.0])):
        kept = force.copy()
        rig.device.write(force)
        np.testing.assert_array_equal(force, kept)
    rig.device.close()
    rig.device.close()


FRAMES = 6  # of a call whose allocation is looked at: from json or websockets up to a driver
STRETCH = 100  # ticks


def kept_by_drivers():
    """Bytes that calls of the drivers' files have allocated and not freed; what doubles and others hold is theirs."""
    gc.collect()
    drivers = tracemalloc.Filter(True, "*/palpate/devices/*", all_frames=True)
    doubles = tracemalloc.Filter(False, "*/palpate/devices/doubles/*", all_frames=True)
    kept = tracemalloc.take_snapshot().filter_traces([drivers, doubles])
    return sum(trace.size for trace in kept.traces)


def growth_per_tick(rig):
    """Bytes a tick that a driver keeps in each of three stretches: the least, which a single event doesn't change."""
    force, kept = np.ones(3), []
    rig.drive(STRETCH, force)
    tracemalloc.start(FRAMES)
    try:
        for _ in range(4):
            rig.drive(STRETCH, force)
            kept.append(kept_by_drivers())
    finally:
        tracemalloc.stop()
    return min(np.diff(kept)) / STRETCH


@pytest.mark.grid
def test_keeps_no_memory_per_tick(rig):
    assert growth_per_tick(rig) < 2.0, "the least that a list can grow by is a pointer of eight bytes"


LEAK = """\
from palpate.devices.stroke import StrokeDevice


class LeakingHand(StrokeDevice):
    kept = []

    def read(self, now):
        self.kept.append(None)
        return super().read(now)
"""


@pytest.mark.full
def test_a_driver_that_keeps_a_pointer_a_tick_is_found():
    names = {}
    exec(compile(LEAK, str(Path(devices.__file__).with_name("leaking.py")), "exec"), names)
    with PlainRig(names["LeakingHand"]) as leaking, PlainRig(StrokeDevice) as sound:
        leaking.open(), sound.open()
        assert growth_per_tick(leaking) > 3.0
        assert growth_per_tick(sound) < 2.0


class Sensor:
    """A device whose places have noise, steps, and now and then come a tick late, whatever its own are."""

    def __init__(self, device, noise=5e-5, step=5.5e-5):
        self.device, self.noise, self.step = device, noise, step
        self._random, self._sample, self._before = np.random.default_rng(2), None, np.zeros(3)

    def __getattr__(self, name):
        return getattr(self.device, name)

    def read(self, now):
        sample = self.device.read(now)
        self._sample = self._sample or Sample(sample.patience)
        for field in set(Sample.__slots__) - {"position"}:
            setattr(self._sample, field, getattr(sample, field))
        late = self._random.random() < 0.2
        true, self._before = self._before if late else sample.position, sample.position.copy()
        noisy = true + self.noise * self._random.normal(size=3)
        self._sample.position[:] = self.step * np.round(noisy / self.step)
        return self._sample


@pytest.mark.grid
def test_a_noisy_sensor_of_any_device_does_not_shake_the_force(rig, shared):
    """From tick to tick the force changes by what a spring answers to way and noise, and not by more than 12 K σ."""
    traits, places, forces = rig.device.traits, [], []
    sensor, model = Sensor(rig.device), PlainModel()
    loop = Loop(
        model, sensor, shared, Workspace(traits.radius, 1.0), Limits(traits.max_force), stiffness=STIFFNESS
    )
    # a double's hand may stand anywhere, and never come to where the spring is slack
    loop.evaluator.rest_zone = math.inf
    for _ in range(600):
        rig.advance()
        loop.tick(rig.now)
        rig.arrive()
        places.append(sensor._before.copy())
        if loop.open:
            forces.append(loop.out.force.copy())
    way = np.linalg.norm(np.diff(places, axis=0), axis=1).max()
    assert len(forces) > 500, "the loop sends a force nearly all the time"
    change = np.linalg.norm(np.diff(forces, axis=0), axis=1).max()
    ramp = STIFFNESS * traits.radius * 1e-3 / 0.05
    assert change <= 12.0 * STIFFNESS * 5.5e-5 + 2.0 * STIFFNESS * way + ramp


def test_unknown_options_are_listed(name, shared):
    with pytest.raises(UsageError, match="no option 'colour'"):
        device_named(f"{name}:colour=red", shared.command)


def test_unknown_devices_are_listed(shared):
    with pytest.raises(UsageError) as caught:
        device_named("omega", shared.command)
    assert all(name in str(caught.value) for name in device_names())


OUT_OF_RANGE = {
    "crtk": ("types=ros3", "force=99", "radius=1", "delay=1", "wrench=servo_cp", "axes=xyz", "home=2", "origin=x",
             "gravity=2", "lock=-1", "clutch=coag", "hold=knee"),
    "forcedimension": ("serial=1.5", "home=2", "clutch=99", "mass=5", "gravity=yes"),
    "gamepad": ("mapping=wish", "depth=wheel", "hold=never", "dead=0.9", "speed=0", "rumble=2"),
    "haply": ("spelling=both", "scale=2", "http=1.5", "wait=2", "wait=nan", "force_scale=20"),
    "openhaptics": ("rate=250", "clutch=5", "clutch=0.5", "inkwell=never", "switch=1", "device="),
    "spacemouse": ("mapping=wish", "speed=0", "full=1", "dead=0.9", "centre=0.5", "hold=40", "hold=2"),
}  # fmt: skip


@pytest.mark.parametrize(
    "options", [f"{name}:{text}" for name, texts in OUT_OF_RANGE.items() for text in texts]
)
def test_options_out_of_range_are_refused(shared, options):
    with pytest.raises(UsageError):
        device_named(options, shared.command)


# ---- hardware


@pytest.mark.parametrize("name", OPENED_BY_HARDWARE, indirect=True)
def test_hardware_takes_no_force_that_is_no_number_and_nothing_once_it_is_closed(rig):
    device = rig.device
    rig.drive(3)
    with pytest.raises(DeviceError, match="not a finite number"):
        device.write(np.array([0.0, math.nan, 0.0]))
    device.close()
    for call in (lambda: device.read(rig.now), lambda: device.write(np.zeros(3))):
        with pytest.raises(DeviceError, match="is closed"):
            call()


@pytest.fixture
def motors(name, double):
    """The rig of a device with motors, not open yet, whose hand is held in the middle."""
    with rig_of(name, double) as rig:
        rig.place((0.0, 0.0, 0.0))
        yield rig


WITH_MOTORS = pytest.mark.parametrize("name", RIGS, indirect=True)


@WITH_MOTORS
def test_places_and_forces_are_in_the_axes_of_the_traits(motors, name):
    device = motors.open()
    assert device.traits.axes == device_traits(name).axes
    motors.drive(2)
    motors.lead(IN_MAKERS_AXES[name], 60, motors.drive)
    place = motors.drive(3)[-1][0]
    np.testing.assert_allclose(place, IN_MAKERS_AXES[name])
    np.testing.assert_allclose(np.array(device.traits.axes) @ place, (0.01, 0.02, 0.03))
    motors.drive(3, (0.5, 1.0, -1.5))
    np.testing.assert_allclose(motors.force(), (0.5, 1.0, -1.5))


@pytest.mark.grid
@WITH_MOTORS
def test_the_hand_is_pushed_back_by_what_the_body_answers(motors, plain, shared):
    """Pressed 10 mm down at ten metres of body to one of hand, a spring of 20 N/m pushes up with 2 N."""
    motors.loop(plain, shared)
    assert {fault for _, fault in motors.press()} == {Fault.NONE}
    expected = np.array(motors.device.traits.axes).T @ (0.0, STIFFNESS * motors.scale * 0.01, 0.0)
    np.testing.assert_allclose(motors.force(), expected, atol=0.02)


@WITH_MOTORS
@pytest.mark.parametrize("story", STORIES)
def test_a_fault_takes_the_force_within_20_ms_with_a_reason_and_heals_from_rest(motors, plain, shared, story):
    loop = motors.loop(plain, shared)
    assert motors.press()[-1][0] > 1.0
    motors.begin(story)
    broken = motors.run(30)
    assert all(force == 0.0 and fault is STORIES[story] for force, fault in broken[21:])
    assert {"stop": motors.stopped, "loss": motors.lost}.get(story, "") in loop.device_error
    if story not in motors.final:
        motors.end(story)
        motors.place(motors.at)
        again = motors.run(160)
        assert again[-1] == (0.0, Fault.NONE), "still in the body"
        forces = np.array([force for force, _ in motors.press()])
        assert forces[-1] > 1.0
        assert forces[np.flatnonzero(forces)[:3]].max() < 0.1, "it grew from nothing"


@WITH_MOTORS
def test_closing_sends_zero_force(motors):
    motors.open()
    motors.drive(5, (0.0, 0.0, 1.0))
    assert motors.force()[2] == 1.0
    np.testing.assert_array_equal(motors.close(), np.zeros(3))


@WITH_MOTORS
def test_a_force_that_is_no_number_leaves_the_last_one(motors):
    device = motors.open()
    motors.drive(5, (0.0, 0.0, 1.0))
    with pytest.raises(DeviceError, match="not a finite number"):
        device.write(np.array([math.nan, 0.0, 0.0]))
    np.testing.assert_array_equal(motors.force(), (0.0, 0.0, 1.0))


@WITH_MOTORS
def test_a_wild_start_is_refused_and_leaves_nothing_behind(name, double):
    with rig_of(name, double) as rig:
        rig.begin("wild")
        with pytest.raises(DeviceError, match=rig.wild):
            rig.connect()
        rig.end("wild")
        rig.open()


@pytest.mark.grid
@WITH_MOTORS
def test_a_button_of_the_device_stops_the_force(motors, plain, shared):
    loop = motors.loop(plain, shared)
    assert motors.press()[-1][0] > 1.0
    motors.press_button()
    assert motors.run(3)[-1][0] == 0.0
    assert loop.stop.stopped
