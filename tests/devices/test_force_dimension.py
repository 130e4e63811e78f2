"""The Force Dimension driver on a double of the vendor's library, with its faults; no hardware has been touched."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from rigs import ForceDimensionRig

from palpate.devices import device_traits
from palpate.devices.device_search import HARDWARE
from palpate.devices.force_dimension import (
    AXES,
    TYPES,
    WATCHDOG,
    ForceDimensionDevice,
)
from palpate.devices.force_dimension_library import FORCES_OFF, DhdLibrary
from palpate.devices.profiles import device_profile
from palpate.devices.surroundings import Surroundings
from palpate.errors import DeviceError
from palpate.runtime import Fault, LoopProcess


@pytest.fixture
def rig(double):
    with ForceDimensionRig(double("forcedimension")) as rig:
        yield rig


@pytest.fixture
def dhd(rig):
    """The library, whose time stands still until it is moved."""
    return rig.dhd


@pytest.fixture
def device(rig):
    return rig.open()


@pytest.fixture
def loop(rig, dhd, plain, shared):
    """A loop with the hand at rest: a force begins only there."""
    dhd.amplitude = 0
    loop = rig.loop(plain, shared)
    dhd.amplitude = 0.03
    return loop


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


def test_the_order_of_opening(rig, dhd):
    device = rig.open()
    assert (dhd.opened, dhd.early_calls, dhd.late_calls, dhd.foreign_calls) == (1, 0, 0, 0)
    assert (dhd.watchdog, dhd.max_force) == (WATCHDOG, 12.0)
    assert (dhd.force_on, dhd.brakes) == (0.0, 1.0), "nobody pushes before the loop runs"
    assert device.watchdog
    rig.drive(1, (1.0, 0.0, 0.0))
    assert (dhd.force_on, dhd.brakes, dhd.gravity) == (1.0, 0.0, 1.0)
    np.testing.assert_array_equal(rig.force(), np.zeros(3))  # the force grows from nothing
    rig.drive(2, (1.0, 0.0, 0.0))
    np.testing.assert_array_equal(rig.force(), [1.0, 0.0, 0.0])
    device.close()
    device.close()
    assert (dhd.force_on, dhd.brakes, dhd.closed) == (0.0, 1.0, 1.0)
    np.testing.assert_array_equal(rig.force(), np.zeros(3))
    for call in (lambda: device.write(np.zeros(3)), lambda: device.read(0.0)):
        with pytest.raises(DeviceError, match="is closed"):
            call()
    assert dhd.late_calls == 0


@pytest.mark.parametrize("number", sorted(TYPES))
def test_each_type_has_a_profile(rig, dhd, number):
    """A limit of 12 N for every device was a mistake of other drivers."""
    dhd.type = number
    device = rig.open()
    profile = device_profile(TYPES[number])
    assert device.traits.radius == profile.radius
    assert device.traits.max_force == dhd.max_force == profile.max_force
    assert profile.name.partition(".")[0].lower() in device.name.lower()
    assert "1234" in device.name
    device.close()


@pytest.mark.parametrize("number", [81, 91, 999])
def test_an_unknown_type_gets_the_smallest_limits_and_says_so(rig, dhd, number):
    dhd.type = number
    device = rig.open()
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
def test_the_smaller_of_profile_and_the_devices_own_word_wins(rig, dhd, own, limit):
    dhd.device_max_force = own
    device = rig.open()
    assert device.traits.max_force == dhd.max_force == limit
    assert ("the device itself" in device.traits.source) == (limit < 12.0)
    device.close()


def test_a_limit_that_is_not_taken_is_refused(rig, dhd):
    dhd.deaf = 1
    with pytest.raises(DeviceError, match="doesn't take a limit of 12 N"):
        rig.open()
    assert dhd.closed == 1


def test_a_device_that_is_not_homed_is_refused_or_homes_itself(rig, dhd):
    """Positions before homing are wrong, and were used by other drivers."""
    dhd.homed = 0
    with pytest.raises(DeviceError, match="has not been homed") as caught:
        rig.open()
    assert "home=1" in caught.value.fix
    assert (dhd.homings, dhd.closed) == (0.0, 1.0), "it doesn't move unasked"
    device = rig.open(home=1.0)
    assert (dhd.homings, dhd.regulating) == (1.0, 0.0)
    device.close()
    dhd.homed, dhd.homing_fails = 0, 1
    with pytest.raises(DeviceError, match="timed out"):
        rig.open(home=1.0)


def test_a_falcon_is_homed_by_hand(rig, dhd):
    """The vendor's examples wait for the hand; the library doesn't move it."""
    dhd.type, dhd.homed = 60, 0
    with pytest.raises(DeviceError, match="by hand"):
        rig.open()
    dhd.hand_homes = 200
    device = rig.open(home=1.0)
    assert (dhd.homed, dhd.homings) == (1.0, 0.0)
    np.testing.assert_array_equal(rig.force(), np.zeros(3))
    device.close()
    dhd.homed = dhd.hand_homes = 0
    with pytest.raises(DeviceError, match="could not be homed"):
        rig.open(home=1.0)


def test_without_drd_the_status_tells_of_homing(rig, dhd, monkeypatch):
    monkeypatch.setattr(DhdLibrary, "extra", {})
    rig.open().close()
    dhd.homed = 0
    with pytest.raises(DeviceError, match="libdrd instead of libdhd"):
        rig.open()
    with pytest.raises(DeviceError, match="can't reach the vendor's simulator"):
        rig.open(simulator=1.0)


def test_a_library_without_a_function_is_refused(rig, dhd, monkeypatch):
    monkeypatch.setattr(DhdLibrary, "signatures", {"dhdFly": (None, ())})
    with pytest.raises(DeviceError, match="lacks dhdFly"):
        rig.open()


def test_return_codes_are_looked_at_one_by_one(rig, dhd, device):
    """Summed, a time guard (+1) and an error (-1) would cancel: 0, as if all were well."""
    rig.drive(5)
    dhd.guard = 1
    before = device.sample.time
    dhd.fail_force = 1
    with pytest.raises(DeviceError, match="takes no force"):
        rig.drive(1)
    assert device.guarded == 1
    assert device.sample.time == before


def test_the_time_guard_of_the_library_itself(rig, dhd, device):
    rig.drive(3)
    sample = device.read(dhd.time + 1e-5)  # the library's own time has not moved
    assert sample.time == dhd.time
    assert device.guarded == 1


def test_saturated_motors_are_counted_and_keep_the_direction(rig, dhd, device):
    """The code of a force was ignored by other drivers: nobody knew of saturation."""
    dhd.motor_force = 2.0
    rig.drive(5, (3.0, 0.0, 4.0))
    assert device.saturations == dhd.saturations == 4
    np.testing.assert_allclose(rig.force(), [1.2, 0.0, 1.6])
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


def test_a_force_that_fails_is_noticed_by_the_loop(rig, dhd, loop):
    """The code of a force was ignored by other drivers: a lost device passed for a working one."""
    rig.run(200)
    dhd.fail_force = 5
    seen = rig.run(5)
    assert all(force == 0.0 and fault is not Fault.NONE for force, fault in seen)
    assert "takes no force" in loop.device_error
    assert "communication error" in loop.device_error
    again = rig.run(200)
    assert all(force == 0.0 for force, _ in again), "still in the body"
    assert again[-1][1] is Fault.NONE
    forces = np.array([force for force, _ in rig.run(1000)])
    assert forces[-1] > 0.5, "the hand was back at rest after a second"
    assert forces[np.flatnonzero(forces)[:3]].max() < 0.1, "it grew from nothing"


def test_a_lost_cable_is_zero_force_and_a_reason(rig, dhd, loop):
    rig.run(200)
    dhd.lost_after = dhd.commands + 50
    seen = rig.run(100)
    assert seen[40][1] is Fault.NONE
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[52:])
    assert "error 2" in loop.device_error
    loop.end()
    assert dhd.force_on == 0.0


@pytest.mark.parametrize("error", [1, 5, 12])
def test_errors_of_a_position_have_the_librarys_words(rig, dhd, device, error):
    rig.drive(2)
    dhd.fail_position, dhd.fail_error = 1, error
    with pytest.raises(DeviceError, match=rf"\(error {error}\)"):
        device.read(dhd.time)
    rig.drive(2)


def test_the_firmwares_watchdog_is_noticed_and_forces_return_at_rest(rig, dhd, loop):
    rig.run(300)
    dhd.time += 0.1  # the program was asleep: 20 ms are too long for the firmware
    seen = rig.run(400)
    assert all(force == 0.0 and fault is Fault.DEVICE_STOPPED for force, fault in seen[5:])
    assert dhd.force_on == 0.0
    assert FORCES_OFF[3] in loop.device_error
    again = rig.run(400)
    assert dhd.force_on == 1.0
    assert again[-1][1] is Fault.NONE


def test_the_velocity_brake_is_noticed_and_let_go_at_rest(rig, dhd, loop):
    rig.run(300)
    dhd.brake_speed = 0.0
    seen = rig.run(20)
    assert (dhd.force_on, dhd.brakes, dhd.cause) == (0.0, 1.0, 2.0)
    assert seen[-1] == (0.0, Fault.DEVICE_STOPPED)
    assert FORCES_OFF[2] in loop.device_error
    dhd.brake_speed = 2.5
    assert rig.run(700)[-1][1] is Fault.NONE
    assert (dhd.force_on, dhd.brakes) == (1.0, 0.0)


@pytest.mark.parametrize("cause", [1, 4, 5, 6])
def test_other_causes_wait_for_the_user(rig, dhd, loop, cause):
    rig.run(100)
    dhd.force_on, dhd.cause = 0, cause
    seen = rig.run(1000)
    assert all(force == 0.0 and fault is Fault.DEVICE_STOPPED for force, fault in seen[5:])
    assert FORCES_OFF[cause] in loop.device_error
    assert dhd.force_on == 0.0, "nothing turns them on again behind the user's back"
    dhd.force_on = 1  # by the button of the device
    assert rig.run(100)[-1][1] is Fault.NONE


def test_an_error_of_the_devices_own_is_a_fault_while_it_lasts(rig, dhd, loop):
    rig.run(100)
    dhd.broken = 1
    assert rig.run(10)[-1] == (0.0, Fault.DEVICE_STOPPED)
    assert "reports an error of its own" in loop.device_error
    dhd.broken = 0
    assert rig.run(10)[-1][1] is Fault.NONE


def test_garbage_at_first_is_thrown_away_and_a_wild_start_refused(rig, dhd):
    dhd.garbage = 40
    device = rig.open()
    assert np.abs(device.sample.position).max() < 0.1
    device.close()
    dhd.garbage, dhd.amplitude, dhd.frequency, dhd.scripted = 0, 0.06, 5.0, 1
    with pytest.raises(DeviceError, match="m/s"):
        rig.open()


def test_a_clock_that_stands_still_is_refused(rig, dhd):
    dhd.guard = 1e6
    with pytest.raises(DeviceError, match="repeats old positions"):
        rig.open()


def test_a_clutch_is_a_button_and_the_others_are_passed_on(rig, dhd):
    device = rig.open(clutch=1.0)
    dhd.buttons = 0b101
    sample = rig.sample(2)
    assert (sample.clutched, sample.buttons) == (False, 0b11)
    dhd.buttons = 0b110
    sample = rig.sample(2)
    assert (sample.clutched, sample.buttons) == (True, 0b10)
    device.close()
    device = rig.open(clutch=0.0)
    dhd.buttons = 0b010
    assert rig.sample(2).buttons == 1, "the first of the others is the dead-man button"
    device.close()


@pytest.mark.parametrize("left", [0, 1])
def test_a_left_handed_device_has_the_same_axes(rig, dhd, left):
    dhd.left_handed = left
    device = rig.open()
    assert device.left_handed == bool(left)
    assert device.traits.axes == AXES
    device.close()


def test_of_several_devices_one_is_named(rig, dhd):
    dhd.present = 2
    with pytest.raises(DeviceError, match="There are 2"):
        rig.open()
    rig.open(serial=1235.0).close()
    with pytest.raises(DeviceError, match="device 99 can't be opened"):
        rig.open(serial=99.0)


@pytest.mark.parametrize(("fault", "words"), [("present", "no compatible device"), ("in_use", "in use")])
def test_a_device_that_can_not_be_opened_says_why(rig, dhd, fault, words):
    usual = getattr(dhd, fault)
    setattr(dhd, fault, 1.0 - usual)
    with pytest.raises(DeviceError, match="No Force Dimension device") as caught:
        rig.open()
    assert words in caught.value.why
    setattr(dhd, fault, usual)
    rig.open().close()  # nothing is left that a new start doesn't heal


def test_what_a_device_lacks_is_done_without(rig, dhd):
    dhd.plain = 1
    device = rig.open()
    assert not device.watchdog
    rig.drive(10, (0.0, 0.0, 1.0))
    np.testing.assert_array_equal(rig.force(), [0.0, 0.0, 1.0])
    device.close()


def test_gravity_mass_and_the_vendors_simulator_are_options(rig, dhd):
    device = rig.open(gravity=0.0, mass=0.05, simulator=1.0)
    rig.drive(2)
    assert (dhd.gravity, dhd.effector_mass, dhd.simulator) == (0.0, 0.05, 1.0)
    device.close()


def test_the_double_counts_calls_from_other_threads(dhd, device):
    thread = threading.Thread(target=lambda: device.read(dhd.time))
    thread.start()
    thread.join()
    assert dhd.foreign_calls > 0
