"""The OpenHaptics driver on a double of its library, with the library's faults; no hardware has been touched."""

from __future__ import annotations

import contextlib
import ctypes
import math
import threading
import time

import numpy as np
import pytest
from library_double import LibraryDouble
from rigs import TICK, OpenHapticsRig

from palpate.devices import device_named
from palpate.devices.openhaptics import OpenHapticsDevice, OpenHapticsSettings
from palpate.devices.openhaptics_library import HdLibrary
from palpate.devices.openhaptics_servo import (
    CAUSE,
    FATAL,
    FATAL_INTERNAL,
    HIDDEN,
    INTERNAL,
    STOPS,
    Mailbox,
    servo,
)
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError
from palpate.runtime import LoopProcess, Workspace
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits

SURVIVABLE = {
    0x200: "too warm",
    0x201: "exceeded its maximum",
    0x202: "too suddenly",
    0x203: "moved too fast",
}
ENDING = {
    0x104: "handle",
    0x204: "error of the force",
    0x300: "fault of the device",
    0x302: "connection",
    0x400: "frame",
    0x777: "not in the headers",
}


@pytest.fixture
def rig(double):
    with OpenHapticsRig(double("openhaptics")) as rig:
        yield rig


@pytest.fixture
def library(rig):
    return rig.library


@pytest.fixture
def clock(rig):
    return rig.clock


@pytest.fixture
def device(rig):
    return rig.open()


def felt(library):
    return [library.force_x, library.force_y, library.force_z]


def test_places_are_metres_from_the_middle_of_the_usable_workspace(rig, library):
    library.offset_y = 25
    rig.open()
    library.fixed, library.x, library.y, library.z = 1, 10, 25 + 20, 30
    np.testing.assert_allclose(rig.drive(2)[-1][0], [0.010, 0.020, 0.030])


def test_a_force_is_felt_one_frame_later(rig, device, library):
    rig.drive(2, force=(1.0, -2.0, 0.5))
    assert felt(library) == [1.0, -2.0, 0.5]
    assert device.sample.time == pytest.approx(2 * TICK)
    assert device.traits.delay == 2 * TICK, "which no time stamp shows"


@pytest.mark.parametrize(
    ("model", "own", "profile", "force", "stiffness"),
    [(0, 3.3, "touch", 3.3, 400), (0, 2.5, "touch", 2.5, 400), (1, 7.9, "desktop", 7.9, 1000),
     (2, 12, "desktop", 7.9, 1000), (3, 3.3, "omni", 3.3, 700), (4, 8.5, "unknown", 3.3, 400)],
)  # fmt: skip
def test_of_two_limits_the_smaller_counts(rig, library, model, own, profile, force, stiffness):
    library.model, library.max_force, library.continuous, library.stiffness = model, own, 0.88, 2.0
    device = rig.open()
    traits = device.traits
    assert (device.profile.name, traits.max_force, traits.max_stiffness) == (profile, force, stiffness)
    assert (traits.radius, traits.continuous_force) == (0.035, 0.88)
    assert traits.radius < traits.reach < 0.5
    assert traits.name == device.name
    assert "3D Systems" in device.name


def test_the_stiffness_that_the_device_states_counts_too(rig, library):
    library.stiffness = 0.3
    assert rig.open().traits.max_stiffness == pytest.approx(300)


def test_a_device_that_states_nothing_has_the_profile(rig, library):
    library.gives_limits = 0
    traits = rig.open().traits
    assert (traits.radius, traits.max_force, traits.max_stiffness) == (0.075, 3.3, 400)
    assert math.isinf(traits.continuous_force)


@pytest.mark.parametrize("clamps", [0, 1])
def test_more_than_the_maximum_is_never_sent(rig, device, library, clamps):
    library.clamps = clamps
    rig.drive(3, force=(30.0, -40.0, 0.0))
    np.testing.assert_allclose(felt(library), [0.6 * 3.3, -0.8 * 3.3, 0.0])
    assert library.exceeded == 0


@pytest.mark.parametrize("code", SURVIVABLE)
def test_after_the_motors_own_limits_the_force_comes_back(rig, device, library, clock, code):
    force = (0.0, 1.0, 0.0)
    rig.drive(3, force=force)
    library.error, library.error_frames = code, 1
    with pytest.raises(DeviceStopError, match=SURVIVABLE[code]):
        rig.drive(5, force=force)
    stopped, zero_since = clock.time, None
    while True:  # as the loop does: zero force while the driver complains
        device.write(np.zeros(3))
        try:
            rig.drive(1)
            break
        except DeviceStopError:
            assert felt(library) == [0.0, 0.0, 0.0]
            zero_since = zero_since or clock.time
            assert clock.time - stopped < 1.0
    assert zero_since - stopped <= 2 * TICK
    assert clock.time - stopped >= 0.1
    rig.drive(2, force=force)
    assert felt(library) == [0.0, 1.0, 0.0]
    assert library.scheduled == 1, "the callback has gone on"


def test_a_force_does_not_come_back_while_the_loop_still_asks_for_it(rig, device, library):
    rig.drive(3, force=(0.0, 1.0, 0.0))
    library.error, library.error_frames = 0x200, 1
    for _ in range(400):
        with contextlib.suppress(DeviceStopError):
            rig.drive(1)
        device.write(np.array([0.0, 1.0, 0.0]))
    assert felt(library) == [0.0, 0.0, 0.0], "it would start with a jerk"


def test_an_error_that_comes_again_pauses_longer(rig, device, library, clock):
    pauses = []
    for _ in range(3):
        library.error, library.error_frames = 0x203, 1
        began = clock.time
        for _ in range(1000):
            device.write(np.zeros(3))
            with contextlib.suppress(DeviceStopError):
                rig.drive(1)
                if clock.time > began + 2 * TICK:
                    break
        pauses.append(clock.time - began)
    assert pauses == pytest.approx([0.1, 0.2, 0.4], abs=0.01)


@pytest.mark.parametrize("code", ENDING)
def test_any_other_error_ends_the_callback_with_zero_force(rig, device, library, code):
    rig.drive(3, force=(0.0, 1.0, 0.0))
    library.error, library.error_frames = code, 1
    kind = DeviceLostError if code in {0x104, 0x300, 0x302} else DeviceError
    with pytest.raises(kind, match=ENDING[code]) as caught:
        rig.drive(5, force=(0.0, 1.0, 0.0))
    assert type(caught.value) is kind
    assert f"0x{code:04x}, internal {code + 7}" in str(caught.value)
    assert library.scheduled == 0
    if code not in {0x104, 0x400}:
        assert felt(library) == [0.0, 0.0, 0.0]
    with pytest.raises(DeviceError):
        device.read(0.0)


@pytest.mark.full
def test_a_user_can_try_its_faults(double, shared):
    """As `palpate devices simulate openhaptics` compiles it."""
    simulated = LibraryDouble(double("openhaptics", MODEL=3.0, LOST_AFTER=2000.0, WARM_EVERY=500.0), speed=5)
    device = device_named(f"openhaptics:library={simulated.path}", shared.command)
    assert device.profile.name == "omni"
    words, now = [], 0.0
    while "connection" not in str(words[-1:]):
        now += TICK
        try:
            device.read(now)
        except DeviceError as error:
            if str(error) not in words:
                words.append(str(error))
    device.close()
    assert len(words) == 2
    assert "too warm" in words[0]


def test_of_several_errors_none_is_left(rig, device, library):
    library.error, library.error_frames, library.lost = 0x200, 1, 1
    with pytest.raises(DeviceLostError, match="connection"):
        rig.drive(2)
    assert device.close() is None


def test_a_loop_that_has_stopped_sends_nothing_any_more(rig, device, library, clock):
    rig.drive(3, force=(0.0, 1.0, 0.0))
    for _ in range(30):
        clock.time += TICK
        library.library.double_step(1)
        if clock.time > 3.5 * TICK + 0.020:
            assert felt(library) == [0.0, 0.0, 0.0]
    with pytest.raises(DeviceStopError, match="no force for 20 ms"):
        rig.drive(1, force=(0.0, 1.0, 0.0))


def test_buttons_clutch_inkwell_and_switch(rig, library):
    device = rig.open(clutch=2.0, switch="hold")
    library.safety_switch, library.buttons = 1, 0b1011
    rig.drive(1)
    sample = device.sample
    assert (sample.holding, sample.clutched, sample.buttons) == (True, True, 0b101)
    library.inkwell = 1
    rig.drive(1)
    assert not sample.holding
    library.inkwell = library.safety_switch = library.buttons = 0
    rig.drive(1)
    assert (sample.holding, sample.clutched, sample.buttons) == (False, False, 0)


def test_an_inkwell_can_be_ignored(rig, library):
    library.inkwell = 1
    device = rig.open(inkwell="ignore")
    rig.drive(1)
    assert device.sample.holding


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"present": 0}, "fault of the device"),
        ({"licence": 0}, "licence"),
        ({"calibration": 0x5002}, "inkwell"),
        ({"calibration": 0x5001, "calibrates": 0}, "inkwell"),
        ({"calibration": 0x5001, "calibration_style": 1}, "inkwell"),
        ({"lost": 1}, "connection"),
    ],
)
def test_a_device_that_is_not_fit_is_refused(library, clock, settings, words):
    for name, value in settings.items():
        setattr(library, name, value)
    with pytest.raises(DeviceError, match=words):
        OpenHapticsDevice(OpenHapticsSettings(library=str(library.path)))


@pytest.mark.parametrize("style", [2, 4])
def test_a_device_that_can_be_calibrated_as_it_stands_is(rig, library, style):
    library.calibration, library.calibration_style = 0x5001, style
    rig.open()
    assert library.calibration == 0x5000


def test_nonsense_at_the_start_is_thrown_away(rig, library):
    library.garbage = 20
    rig.open()
    assert np.abs(rig.drive(1)[0][0]).max() < 0.01


def test_the_first_reading_is_where_the_hand_is(rig, library):
    library.fixed, library.y = 1, -20
    sample = rig.open().read(5.0)
    np.testing.assert_allclose(sample.position, [0.0, -0.020, 0.0])
    assert (sample.time, sample.holding) == (5.0, True)


def test_after_closing_nothing_is_left(device, rig, library):
    rig.drive(3, force=(0.0, 1.0, 0.0))
    rig.close()
    assert (library.open, library.running, library.scheduled, int(library.enabled) & 1) == (0, 0, 0, 0)


def test_a_hand_that_starts_in_the_body_feels_nothing_until_it_has_been_at_rest(
    rig, library, clock, plain, shared
):
    library.fixed, library.y = 1, -20
    device = rig.open()
    loop = Loop(plain, device, shared, Workspace(0.035, 10.0), Limits(device.traits.max_force))
    for y, pushed in ((-20, False), (-1, True), (-20, True)):
        for step in np.linspace(library.y, y, 200):
            clock.time += TICK
            library.y = step
            library.library.double_step(1)
            loop.tick(clock.time)
        assert bool(felt(library)[1]) is pushed


def test_neither_side_sees_half_of_what_the_other_wrote(library):
    library.counting = 1
    device = OpenHapticsDevice(OpenHapticsSettings(library=str(library.path)))
    over, uneven = threading.Event(), library.uneven

    def write():
        k = 0
        while not over.is_set():
            k += 1
            with contextlib.suppress(DeviceError):
                device.write(np.full(3, 0.1 * (k % 7)))

    writer = threading.Thread(target=write)
    writer.start()
    try:
        while library.frames < 2000:
            with contextlib.suppress(DeviceStopError):  # a starved writer
                device.read(time.perf_counter())
            place = device.sample.position
            assert place[0] == place[1] == place[2]
    finally:
        over.set()
        writer.join()
        device.close()
    assert library.uneven == uneven
    assert library.largest > 0.0


@pytest.mark.full
def test_a_process_touches_through_the_library(library, spring_file):
    with LoopProcess(spring_file, device=f"openhaptics:library={library.path}") as loop:
        state = loop.read()
        while state.tick < 200:
            state = loop.read()
    report = loop.report()
    assert report.ticks >= 200
    assert not {"device_error", "device_lost", "impossible_place"} & report.faults.keys()


def test_errors_that_come_back_by_a_hidden_pointer_are_taken_too(library):
    """The calling convention of Windows, by a function of the double."""
    hd = HdLibrary(library.library)
    device = hd.hdInitDevice(b"Default Device")
    into = ctypes.cast(library.library.double_error_into, ctypes.c_void_p).value
    box = Mailbox(hd.addresses() | {"hdGetError": into}, device, 18)
    box.cells[HIDDEN] = 1.0
    call = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)(servo().address)
    assert call(box.cells.ctypes.data) == 1
    library.error, library.error_frames = 0x202, 1
    assert call(box.cells.ctypes.data) == 1
    assert box.cells[[STOPS, CAUSE, INTERNAL]].tolist() == [1, 0x202, 0x202 + 7]
    library.error, library.error_frames = 0x302, 1
    assert call(box.cells.ctypes.data) == 0
    assert box.cells[[FATAL, FATAL_INTERNAL]].tolist() == [0x302, 0x302 + 7]
    hd.hdDisableDevice(device)


def test_a_library_of_something_else_is_refused():
    with pytest.raises(DeviceError, match="lacks hdBeginFrame"):
        HdLibrary(ctypes.CDLL(None))
