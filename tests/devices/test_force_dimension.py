"""The Force Dimension driver on a double of the vendor's library, with its faults; no hardware has been touched."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from library_double import LibraryDouble

from palpate.devices import device_named, device_traits
from palpate.devices.device_search import HARDWARE
from palpate.devices.force_dimension import (
    AXES,
    TYPES,
    WATCHDOG,
    ForceDimensionDevice,
    ForceDimensionSettings,
)
from palpate.devices.force_dimension_library import FORCES_OFF, DhdLibrary
from palpate.devices.profiles import device_profile
from palpate.devices.surroundings import Surroundings
from palpate.errors import DeviceError, UsageError
from palpate.runtime import Fault, LoopProcess, Workspace
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits

TICK = 1e-3


@pytest.fixture
def dhd(double):
    """The library, whose time stands still until it is moved."""
    return LibraryDouble(double("forcedimension"), manual=1, time=100)


def connect(dhd, **settings):
    return ForceDimensionDevice(ForceDimensionSettings(library=str(dhd.path), **settings))


@pytest.fixture
def device(dhd):
    driver = connect(dhd)
    yield driver
    driver.close()


@pytest.fixture
def loop(dhd, plain, shared):
    """A loop with the hand at rest: a force begins only there."""
    dhd.amplitude = 0
    device = connect(dhd)
    dhd.amplitude = 0.03
    yield Loop(plain, device, shared, Workspace(0.075, 10.0), Limits(12.0), rate=1000.0)
    device.close()


def drive(device, dhd, ticks, force=(0.0, 0.0, 0.0)):
    """Read and write without a loop; the latest sample."""
    for _ in range(ticks):
        dhd.time += TICK
        sample = device.read(dhd.time)
        device.write(np.array(force))
    return sample


def run(loop, dhd, ticks):
    """Ticks of the loop; the force sent and the fault of each."""
    seen = []
    for _ in range(ticks):
        dhd.time += TICK
        loop.tick(dhd.time)
        seen.append((float(np.linalg.norm(loop.safety.force)), loop.fault))
    return seen


def felt(dhd):
    return np.array([dhd.felt_x, dhd.felt_y, dhd.felt_z])


def asked(dhd):
    return np.array([dhd.force_x, dhd.force_y, dhd.force_z])


def test_nothing_is_loaded_before_a_device_is_opened(monkeypatch, tmp_path):
    """A missing library names what was looked for, where, the variable, and the vendor's download."""
    entry = next(e for e in HARDWARE if e.device == "forcedimension")
    monkeypatch.setattr(type(entry.places), "find", lambda *_: None)
    assert device_traits("forcedimension").radius > 0.0
    with pytest.raises(DeviceError) as caught:
        ForceDimensionDevice()
    text = str(caught.value)
    for words in (
        *entry.places.names(Surroundings().platform),
        *entry.places.folders,
        "PALPATE_DHD",
        "FDSDK",
        "Force Dimension SDK",
    ):
        assert words in text
    assert "palpate devices simulate forcedimension" in entry.look(Surroundings(tmp_path, {}, "linux")).remedy


def test_the_named_library_is_loaded(dhd, monkeypatch):
    monkeypatch.setenv("PALPATE_DHD", str(dhd.path))
    device = ForceDimensionDevice()
    assert dhd.opened == 1
    device.close()


def test_the_order_of_opening(dhd):
    device = connect(dhd)
    assert (dhd.opened, dhd.early_calls, dhd.late_calls, dhd.foreign_calls) == (1, 0, 0, 0)
    assert (dhd.watchdog, dhd.max_force) == (WATCHDOG, 12.0)
    assert (dhd.force_on, dhd.brakes) == (0.0, 1.0), "nobody pushes before the loop runs"
    assert device.watchdog
    drive(device, dhd, 1, (1.0, 0.0, 0.0))
    assert (dhd.force_on, dhd.brakes, dhd.gravity) == (1.0, 0.0, 1.0)
    np.testing.assert_array_equal(asked(dhd), np.zeros(3))  # the force grows from nothing
    drive(device, dhd, 2, (1.0, 0.0, 0.0))
    np.testing.assert_array_equal(asked(dhd), [1.0, 0.0, 0.0])
    device.close()
    device.close()
    assert (dhd.force_on, dhd.brakes, dhd.closed) == (0.0, 1.0, 1.0)
    np.testing.assert_array_equal(asked(dhd), np.zeros(3))
    for call in (lambda: device.write(np.zeros(3)), lambda: device.read(0.0)):
        with pytest.raises(DeviceError, match="is closed"):
            call()
    assert dhd.late_calls == 0


def test_the_device_axes_are_a_rotation(dhd, device, shared, plain):
    turn = np.array(AXES)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
    dhd.scripted, dhd.amplitude = 1, 0
    dhd.x, dhd.y, dhd.z = 0.03, 0.01, 0.02  # towards the user, right, up
    place = drive(device, dhd, 3).position
    np.testing.assert_allclose(place, [0.03, 0.01, 0.02])
    np.testing.assert_allclose(turn @ place, [0.01, 0.02, 0.03])  # right, up, towards the user
    assert device.traits.axes == device_traits("forcedimension").axes == AXES


def test_the_loop_pushes_on_the_hand_against_its_way(dhd, loop):
    seen = run(loop, dhd, 500)  # half a second: the hand is at its lowest
    assert all(fault is Fault.NONE for _, fault in seen)
    assert felt(dhd)[2] > 0.5, "pushed down, the hand is pushed up"
    np.testing.assert_allclose(felt(dhd)[:2], 0.0, atol=1e-12)
    assert dhd.foreign_calls == 0


@pytest.mark.parametrize("number", sorted(TYPES))
def test_each_type_has_a_profile(dhd, number):
    """A limit of 12 N for every device was a mistake of other drivers."""
    dhd.type = number
    device = connect(dhd)
    profile = device_profile(TYPES[number])
    assert device.traits.radius == profile.radius
    assert device.traits.max_force == dhd.max_force == profile.max_force
    assert profile.name.partition(".")[0].lower() in device.name.lower()
    assert "1234" in device.name
    device.close()


@pytest.mark.parametrize("number", [81, 91, 999])
def test_an_unknown_type_gets_the_smallest_limits_and_says_so(dhd, number):
    dhd.type = number
    device = connect(dhd)
    profiles = [device_profile(name) for name in TYPES.values()]
    assert device.traits.max_force == dhd.max_force == min(profile.max_force for profile in profiles)
    assert device.traits.radius == min(profile.radius for profile in profiles)
    assert device.traits.max_stiffness == min(profile.max_stiffness for profile in profiles)
    for words in (device.traits.source, device.traits.name, device.note):
        assert "unknown" in words
    device.close()


def test_a_dead_man_button_can_be_asked_for(dhd, device, spring_file):
    """A kind that tells of no button is refused before it is opened."""
    LoopProcess(spring_file, device="forcedimension", dead_man=True)
    assert device.traits.buttons == device_traits("forcedimension").buttons


@pytest.mark.parametrize(("own", "limit"), [(5.0, 5.0), (30.0, 12.0), (-1.0, 12.0)])
def test_the_smaller_of_profile_and_the_devices_own_word_wins(dhd, own, limit):
    dhd.device_max_force = own
    device = connect(dhd)
    assert device.traits.max_force == dhd.max_force == limit
    assert ("the device itself" in device.traits.source) == (limit < 12.0)
    device.close()


def test_a_limit_that_is_not_taken_is_refused(dhd):
    dhd.deaf = 1
    with pytest.raises(DeviceError, match="doesn't take a limit of 12 N"):
        connect(dhd)
    assert dhd.closed == 1


def test_a_device_that_is_not_homed_is_refused_or_homes_itself(dhd):
    """Positions before homing are wrong, and were used by other drivers."""
    dhd.homed = 0
    with pytest.raises(DeviceError, match="has not been homed") as caught:
        connect(dhd)
    assert "home=1" in caught.value.fix
    assert (dhd.homings, dhd.closed) == (0.0, 1.0), "it doesn't move unasked"
    device = connect(dhd, home=1.0)
    assert (dhd.homings, dhd.regulating) == (1.0, 0.0)
    device.close()
    dhd.homed, dhd.homing_fails = 0, 1
    with pytest.raises(DeviceError, match="timed out"):
        connect(dhd, home=1.0)


def test_a_falcon_is_homed_by_hand(dhd):
    """The vendor's examples wait for the hand; the library doesn't move it."""
    dhd.type, dhd.homed = 60, 0
    with pytest.raises(DeviceError, match="by hand"):
        connect(dhd)
    dhd.hand_homes = 200
    device = connect(dhd, home=1.0)
    assert (dhd.homed, dhd.homings) == (1.0, 0.0)
    np.testing.assert_array_equal(asked(dhd), np.zeros(3))
    device.close()
    dhd.homed = dhd.hand_homes = 0
    with pytest.raises(DeviceError, match="could not be homed"):
        connect(dhd, home=1.0)


def test_without_drd_the_status_tells_of_homing(dhd, monkeypatch):
    monkeypatch.setattr(DhdLibrary, "extra", {})
    connect(dhd).close()
    dhd.homed = 0
    with pytest.raises(DeviceError, match="libdrd instead of libdhd"):
        connect(dhd)
    with pytest.raises(DeviceError, match="can't reach the vendor's simulator"):
        connect(dhd, simulator=1.0)


def test_a_library_without_a_function_is_refused(dhd, monkeypatch):
    monkeypatch.setattr(DhdLibrary, "signatures", {"dhdFly": (None, ())})
    with pytest.raises(DeviceError, match="lacks dhdFly"):
        connect(dhd)


def test_return_codes_are_looked_at_one_by_one(dhd, device):
    """Summed, a time guard (+1) and an error (-1) would cancel: 0, as if all were well."""
    drive(device, dhd, 5)
    dhd.guard = 1
    before = device.sample.time
    dhd.fail_force = 1
    with pytest.raises(DeviceError, match="takes no force"):
        drive(device, dhd, 1)
    assert device.guarded == 1
    assert device.sample.time == before


def test_a_reading_that_came_too_soon_is_not_fresh(dhd, loop):
    run(loop, dhd, 100)
    dhd.guard = 200
    seen = run(loop, dhd, 60)
    assert all(fault is Fault.NONE for _, fault in seen[:18])
    assert all(force == 0.0 and fault is Fault.INPUT_STALLED for force, fault in seen[22:])
    dhd.guard = 0
    assert run(loop, dhd, 100)[-1][1] is Fault.NONE


def test_the_time_guard_of_the_library_itself(dhd, device):
    drive(device, dhd, 3)
    sample = device.read(dhd.time + 1e-5)  # the library's own time has not moved
    assert sample.time == dhd.time
    assert device.guarded == 1


def test_saturated_motors_are_counted_and_keep_the_direction(dhd, device):
    """The code of a force was ignored by other drivers: nobody knew of saturation."""
    dhd.motor_force = 2.0
    drive(device, dhd, 5, (3.0, 0.0, 4.0))
    assert device.saturations == dhd.saturations == 4
    np.testing.assert_allclose(asked(dhd), [1.2, 0.0, 1.6])
    assert "saturated 4 times" in device.note


@pytest.mark.full
def test_a_process_touches_through_the_library_and_reports_saturation(double, spring_file):
    library = double("forcedimension", MOTOR_FORCE=0.001, FREQUENCY=1.5, AMPLITUDE=0.02)
    with LoopProcess(spring_file, device=f"forcedimension:library={library}") as loop:
        state = loop.read()
        while np.linalg.norm(state.force) < 0.01 and state.tick < 10_000:
            state = loop.read()
    report = loop.report()
    assert report.faults.keys() <= {"device_stopped", "clock_jump", "input_stalled"}, "a busy machine's"
    assert "saturated" in report.device_note
    assert report.device_note in str(report)


def test_a_force_that_fails_is_noticed_by_the_loop(dhd, loop):
    """The code of a force was ignored by other drivers: a lost device passed for a working one."""
    run(loop, dhd, 200)
    dhd.fail_force = 5
    seen = run(loop, dhd, 5)
    assert all(force == 0.0 and fault is not Fault.NONE for force, fault in seen)
    assert "takes no force" in loop.device_error
    assert "communication error" in loop.device_error
    again = run(loop, dhd, 200)
    assert all(force == 0.0 for force, _ in again), "still in the body"
    assert again[-1][1] is Fault.NONE
    forces = np.array([force for force, _ in run(loop, dhd, 1000)])
    assert forces[-1] > 0.5, "the hand was back at rest after a second"
    assert forces[np.flatnonzero(forces)[:3]].max() < 0.1, "it grew from nothing"


def test_a_lost_cable_is_zero_force_and_a_reason(dhd, loop):
    run(loop, dhd, 200)
    dhd.lost_after = dhd.commands + 50
    seen = run(loop, dhd, 100)
    assert seen[40][1] is Fault.NONE
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[52:])
    assert "error 2" in loop.device_error
    loop.end()
    assert dhd.force_on == 0.0


@pytest.mark.parametrize("error", [1, 5, 12])
def test_errors_of_a_position_have_the_librarys_words(dhd, device, error):
    drive(device, dhd, 2)
    dhd.fail_position, dhd.fail_error = 1, error
    with pytest.raises(DeviceError, match=rf"\(error {error}\)"):
        device.read(dhd.time)
    drive(device, dhd, 2)


def test_the_firmwares_watchdog_is_noticed_and_forces_return_at_rest(dhd, loop):
    run(loop, dhd, 300)
    dhd.time += 0.1  # the program was asleep: 20 ms are too long for the firmware
    seen = run(loop, dhd, 400)
    assert all(force == 0.0 and fault is Fault.DEVICE_STOPPED for force, fault in seen[5:])
    assert dhd.force_on == 0.0
    assert FORCES_OFF[3] in loop.device_error
    again = run(loop, dhd, 400)
    assert dhd.force_on == 1.0
    assert again[-1][1] is Fault.NONE


def test_the_velocity_brake_is_noticed_and_let_go_at_rest(dhd, loop):
    run(loop, dhd, 300)
    dhd.brake_speed = 0.0
    seen = run(loop, dhd, 20)
    assert (dhd.force_on, dhd.brakes, dhd.cause) == (0.0, 1.0, 2.0)
    assert seen[-1] == (0.0, Fault.DEVICE_STOPPED)
    assert FORCES_OFF[2] in loop.device_error
    dhd.brake_speed = 2.5
    assert run(loop, dhd, 700)[-1][1] is Fault.NONE
    assert (dhd.force_on, dhd.brakes) == (1.0, 0.0)


@pytest.mark.parametrize("cause", [1, 4, 5, 6])
def test_other_causes_wait_for_the_user(dhd, loop, cause):
    run(loop, dhd, 100)
    dhd.force_on, dhd.cause = 0, cause
    seen = run(loop, dhd, 1000)
    assert all(force == 0.0 and fault is Fault.DEVICE_STOPPED for force, fault in seen[5:])
    assert FORCES_OFF[cause] in loop.device_error
    assert dhd.force_on == 0.0, "nothing turns them on again behind the user's back"
    dhd.force_on = 1  # by the button of the device
    assert run(loop, dhd, 100)[-1][1] is Fault.NONE


@pytest.mark.parametrize(
    ("flag", "value", "fault", "words"),
    [
        ("powered", 0, Fault.DEVICE_STOPPED, "has no power"),
        ("absent", 1, Fault.DEVICE_LOST, "is no longer there"),
        ("broken", 1, Fault.DEVICE_STOPPED, "reports an error of its own"),
    ],
)
def test_the_status_is_a_fault_while_it_lasts(dhd, loop, flag, value, fault, words):
    run(loop, dhd, 100)
    setattr(dhd, flag, value)
    assert run(loop, dhd, 10)[-1] == (0.0, fault)
    assert words in loop.device_error
    setattr(dhd, flag, 1 - value)
    assert run(loop, dhd, 10)[-1][1] is Fault.NONE


def test_a_position_that_is_no_number_is_a_fault(dhd, loop):
    run(loop, dhd, 100)
    dhd.nan = 1
    assert run(loop, dhd, 3)[-1] == (0.0, Fault.INPUT_NOT_FINITE)
    dhd.nan = 0
    assert run(loop, dhd, 100)[-1][1] is Fault.NONE


def test_a_force_that_is_no_number_is_not_sent(dhd, device):
    drive(device, dhd, 3, (1.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="not a finite number"):
        device.write(np.array([math.nan, 0.0, 0.0]))
    np.testing.assert_array_equal(asked(dhd), [1.0, 0.0, 0.0])


def test_garbage_at_first_is_thrown_away_and_a_wild_start_refused(dhd):
    dhd.garbage = 40
    device = connect(dhd)
    assert np.abs(device.sample.position).max() < 0.1
    device.close()
    dhd.garbage = 90
    with pytest.raises(DeviceError, match="starts at"):
        connect(dhd)
    dhd.garbage, dhd.amplitude, dhd.frequency, dhd.scripted = 0, 0.06, 5.0, 1
    with pytest.raises(DeviceError, match="m/s"):
        connect(dhd)


def test_a_clock_that_stands_still_is_refused(dhd):
    dhd.guard = 1e6
    with pytest.raises(DeviceError, match="repeats old positions"):
        connect(dhd)


def test_a_clutch_is_a_button_and_the_others_are_passed_on(dhd):
    device = connect(dhd, clutch=1.0)
    dhd.buttons = 0b101
    sample = drive(device, dhd, 2)
    assert (sample.clutched, sample.buttons) == (False, 0b11)
    dhd.buttons = 0b110
    sample = drive(device, dhd, 2)
    assert (sample.clutched, sample.buttons) == (True, 0b10)
    device.close()
    device = connect(dhd, clutch=0.0)
    dhd.buttons = 0b010
    assert drive(device, dhd, 2).buttons == 1, "the first of the others is the dead-man button"
    device.close()


def test_a_button_of_the_device_stops_the_force(dhd, loop):
    assert run(loop, dhd, 200)[-1][0] > 0.0
    dhd.buttons = 1
    assert run(loop, dhd, 2)[-1][0] == 0.0


@pytest.mark.parametrize("left", [0, 1])
def test_a_left_handed_device_has_the_same_axes(dhd, left):
    dhd.left_handed = left
    device = connect(dhd)
    assert device.left_handed == bool(left)
    assert device.traits.axes == AXES
    device.close()


def test_of_several_devices_one_is_named(dhd):
    dhd.present = 2
    with pytest.raises(DeviceError, match="There are 2"):
        connect(dhd)
    connect(dhd, serial=1235.0).close()
    with pytest.raises(DeviceError, match="device 99 can't be opened"):
        connect(dhd, serial=99.0)


@pytest.mark.parametrize(("fault", "words"), [("present", "no compatible device"), ("in_use", "in use")])
def test_a_device_that_can_not_be_opened_says_why(dhd, fault, words):
    usual = getattr(dhd, fault)
    setattr(dhd, fault, 1.0 - usual)
    with pytest.raises(DeviceError, match="No Force Dimension device") as caught:
        connect(dhd)
    assert words in caught.value.why
    setattr(dhd, fault, usual)
    connect(dhd).close()  # nothing is left that a new start doesn't heal


def test_what_a_device_lacks_is_done_without(dhd):
    dhd.plain = 1
    device = connect(dhd)
    assert not device.watchdog
    drive(device, dhd, 10, (0.0, 0.0, 1.0))
    np.testing.assert_array_equal(asked(dhd), [0.0, 0.0, 1.0])
    device.close()


def test_gravity_mass_and_the_vendors_simulator_are_options(dhd):
    device = connect(dhd, gravity=0.0, mass=0.05, simulator=1.0)
    drive(device, dhd, 2)
    assert (dhd.gravity, dhd.effector_mass, dhd.simulator) == (0.0, 0.05, 1.0)
    device.close()


def test_the_double_counts_calls_from_other_threads(dhd, device):
    thread = threading.Thread(target=lambda: device.read(dhd.time))
    thread.start()
    thread.join()
    assert dhd.foreign_calls > 0


@pytest.mark.parametrize("options", ["serial=1.5", "home=2", "clutch=99", "mass=5", "gravity=yes"])
def test_options_out_of_range(shared, options):
    with pytest.raises(UsageError):
        device_named(f"forcedimension:{options}", shared.command)
