"""The CRTK driver on a double of an arm behind a ROS bridge, with its faults; no robot has been touched."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.errors import DeviceError, DeviceLostError, PortInUseError, UsageError
from palpate.runtime import Fault, Workspace
from palpate.runtime.devices import crtk, device_named, device_traits
from palpate.runtime.devices.crtk import CrtkDevice, CrtkSettings, axes_in_words
from palpate.runtime.devices.crtk_simulator import CrtkSimulator, CrtkSimulatorSettings
from palpate.runtime.loop import Loop
from palpate.runtime.safety import HARDWARE_PATIENCE, Limits

pytestmark = pytest.mark.timeout(240)
TICK = 1e-3


class Clock:
    """The arm's clock: it goes on by itself while a driver opens, and stands still until it is moved after that.

    The loop's clock is another, an hour behind.
    """

    time, running = 5000.0, True

    @property
    def loop(self):
        return self.time - 3600.0

    def __call__(self):
        self.time += TICK if self.running else 0.0
        return self.time


@pytest.fixture
def clock():
    return Clock()


def serve(clock, **settings):
    return CrtkSimulator(CrtkSimulatorSettings(port=0, **settings), clock)


@pytest.fixture
def service(clock):
    with serve(clock) as simulator:
        yield simulator


def connect(service, **settings):
    usual = {"arm": "arm", "delay": 0.0, "search": 10.0}
    service.stream(True)
    service.clock.running = True
    device = CrtkDevice(CrtkSettings(url=f"ws://127.0.0.1:{service.port}", **(usual | settings)))
    service.stream(False)
    service.clock.running = False
    while device._channel.receive(0.0):
        pass  # what came while it was opened
    return device


@pytest.fixture
def device(service):
    driver = connect(service)
    yield driver
    driver.close()


def drive(device, service, ticks, force=(0.0, 0.0, 0.0)):
    """Positions and their ages of some ticks of an arm and a driver in step."""
    seen = []
    for _ in range(ticks):
        service.clock.time += TICK
        service.step()
        sample = device.read(service.clock.loop)
        seen.append((sample.position.copy(), service.clock.loop - sample.time))
        device.write(np.array(force))
        assert service.await_wrenches(device.published)
    return seen


class Rig:
    """A loop on an arm, in step; the hand begins at rest, since a force begins only there."""

    def __init__(self, service, plain, shared, **settings):
        self.service = service
        self.device = connect(service, force=12.0, **settings)
        self.loop = Loop(plain, self.device, shared, Workspace(0.15, 10.0), Limits(12.0), rate=1000.0)

    def run(self, ticks):
        seen = []
        for _ in range(ticks):
            self.service.clock.time += TICK
            self.service.step()
            self.loop.tick(self.service.clock.loop)
            self.service.await_wrenches(self.device.published)
            seen.append((float(np.linalg.norm(self.loop.safety.force)), self.loop.fault))
        return seen


@pytest.fixture
def rig(clock, plain, shared):
    with serve(clock, frequency=4.0, amplitude=0.02) as service:
        rig = Rig(service, plain, shared)
        yield rig
        rig.loop.end()


@pytest.mark.parametrize("ros", [1, 2])
def test_both_spellings_of_types_are_found(clock, ros):
    with serve(clock, ros=ros) as service:
        device = connect(service)
        assert device.types == f"ros{ros}"
        assert service.topics["/arm/body/servo_cf"].count("/") == ros
        drive(device, service, 3, (0.0, 0.0, 1.0))
        np.testing.assert_array_equal(service.force(), [0.0, 0.0, 1.0])
        device.close()
        with pytest.raises(DeviceError, match="Unable to import"):
            connect(service, types=f"ros{3 - ros}", search=0.5)


def test_one_wrench_for_each_fresh_position(service, device):
    drive(device, service, 20, (0.0, 1.0, 0.0))
    assert device.published == service.wrenches == 20
    now = service.clock.loop
    for k in range(5):  # no position, no wrench
        device.read(now + 1e-4 * k)
        device.write(np.array([0.0, 1.0, 0.0]))
    assert device.published == 20
    device.write(np.zeros(3))  # but a zero force at once
    assert device.published == 21
    assert service.await_wrenches(21)
    np.testing.assert_array_equal(service.force(), np.zeros(3))
    device.read(now + 0.1)
    device.write(np.zeros(3))
    assert device.published == 22, "and again from time to time: ROS may lose one"


def test_a_wrench_bears_the_stamp_of_its_position(service, device):
    drive(device, service, 3, (0.0, 0.0, 1.0))
    assert service.stamp["sec"] + 1e-9 * service.stamp["nanosec"] == pytest.approx(
        service.clock.time, abs=2e-9
    )


@pytest.mark.parametrize("wrench", ["body/servo_cf", "servo_cf"])
def test_the_force_is_in_the_axes_of_the_base(service, wrench):
    device = connect(service, wrench=wrench)
    drive(device, service, 3, (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(service.force(), [1.0, 2.0, 3.0])
    device.close()


def test_the_device_axes_are_a_rotation(service):
    device = connect(service, origin="base")
    service.faults.position = (0.01, 0.02, 0.03)  # away, left, up
    place = drive(device, service, 2)[-1][0]
    np.testing.assert_allclose(place, [0.01, 0.02, 0.03])
    turn = np.array(device.traits.axes)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(turn @ place, [-0.02, 0.03, -0.01])  # right, up, towards the user
    assert device.traits.axes == device_traits("crtk").axes
    device.close()


def test_other_axes_are_given_in_words():
    np.testing.assert_array_equal(axes_in_words("+x+y+z"), np.eye(3))
    for text in ("+x+y-z", "+x+x+z", "xyz", "+x+y+", "+x+y+w", ""):
        with pytest.raises(UsageError, match="no rotation"):
            axes_in_words(text)


def test_the_centre_is_where_the_handle_is_while_it_is_opened(clock):
    with serve(clock, amplitude=0.0) as service:
        service.faults.position = (0.3, 0.2, 0.1)
        device = connect(service)
        np.testing.assert_allclose(drive(device, service, 2)[-1][0], 0.0, atol=1e-12)
        device.close()


def test_ages_come_from_the_stamps_whatever_clock_they_are_of(service, device):
    ages = [age for _, age in drive(device, service, 50)]
    assert ages == pytest.approx([0.0] * 50, abs=1e-5)
    for _ in range(30):  # each position takes 5 ms longer than the fastest
        service.clock.time += TICK
        service.step()
        sample = device.read(service.clock.loop + 0.005)
    assert service.clock.loop + 0.005 - sample.time == pytest.approx(0.005, abs=1e-4)


def test_clocks_that_part_slowly_make_no_sample_old(service, device):
    for k in range(300):
        service.clock.time += 0.1
        service.step()
        now = service.clock.loop + 1e-4 * 0.1 * k
        sample = device.read(now)
    assert now - sample.time < 1e-3


def test_half_the_round_trip_is_the_age_of_the_youngest_and_half_the_devices_delay(service):
    device = connect(service, delay=0.006)
    assert device.traits.delay == 0.003
    assert [age for _, age in drive(device, service, 5)] == pytest.approx([0.003] * 5, abs=1e-6)
    device.close()


def test_the_delay_softens_a_body(clock, plain, shared):
    """K < b/(T/2 + d): with 0.5 N·s/m and 10 ms of delay 48 N/m."""
    with serve(clock) as service:
        device = connect(service, delay=0.010)
        loop = Loop(plain, device, shared, Workspace(0.1, 1.0), Limits(3.0), rate=1000.0, stiffness=300.0)
        for _ in range(50):
            service.clock.time += TICK
            service.step()
            loop.tick(service.clock.loop)
        assert loop.bounds.bound == pytest.approx(0.5 / (0.0005 + 0.010), rel=0.05)
        assert loop.bounds.warning
        loop.end()


def test_the_round_trip_is_measured(clock, monkeypatch):
    monkeypatch.setattr(crtk, "_LONGEST_DELAY", 1.0)  # the machine may have much else to do
    with serve(clock, rate=200.0) as service:
        device = connect(service, delay=-1.0)
        assert 0.0 < device.round_trip < 1.0
        assert device.traits.delay == 0.5 * device.round_trip
        device.close()
        service.faults.deaf = True
        with pytest.raises(DeviceError, match="sends nothing back") as caught:
            connect(service, delay=-1.0, search=0.5)
        assert "crtk:delay=SECONDS" in caught.value.fix
        service.faults.deaf = False
        monkeypatch.setattr(crtk, "_LONGEST_DELAY", 1e-6)
        with pytest.raises(DeviceError, match="and back takes"):
            connect(service, delay=-1.0)


def test_the_loop_pushes_on_the_hand_against_its_way(rig):
    places, forces = [], []
    for _ in range(250):  # a whole stroke: on the way back from the first press, damping may turn the force
        assert rig.run(1)[0][1] is Fault.NONE
        places.append(rig.device.sample.position.copy())
        forces.append(rig.service.force())
    k = np.argmax(np.abs(np.array(forces)[:, 2]))
    assert forces[k][2] * places[k][2] < 0.0
    assert abs(forces[k][2]) > 0.3
    np.testing.assert_allclose(np.array(forces)[:, :2], 0.0, atol=1e-9)


def test_a_silent_arm_is_zero_force_within_20_ms_and_a_reason(rig):
    assert rig.run(60)[-1][0] > 0.0
    rig.service.faults.held = True
    silent = rig.run(50)
    late = round(HARDWARE_PATIENCE / TICK) + 1
    assert all(force == 0.0 and fault is Fault.INPUT_STALLED for force, fault in silent[late:])
    np.testing.assert_array_equal(rig.service.force(), np.zeros(3))
    rig.service.release()  # fifty old positions at once
    again = rig.run(200)
    assert again[-1][1] is Fault.NONE
    assert max(force for force, _ in again) > 0.0


def test_late_doubled_and_lost_messages_are_no_fresh_samples(service, device):
    drive(device, service, 5)
    service.faults.doubled = 3
    drive(device, service, 4)
    assert device.repeated == 3
    service.faults.swapped = 1
    drive(device, service, 4)
    assert device.repeated == 4
    assert device.note.startswith("4 positions")
    service.faults.dropped = 3
    ages = [age for _, age in drive(device, service, 6)]
    assert max(ages) == pytest.approx(0.003, abs=1e-5)
    assert ages[-1] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize(
    ("state", "homed", "words"),
    [
        ("DISABLED", True, "its motors are off"),
        ("PAUSED", True, "it is paused"),
        ("FAULT", True, "it has a fault"),
        ("", True, "no state"),
        ("ENABLED", False, "has not been homed"),
    ],
)
def test_states_are_faults_in_words_and_refused_at_the_start(rig, state, homed, words):
    assert rig.run(60)[-1][0] > 0.0
    rig.service.state, rig.service.homed = state, homed
    seen = rig.run(5)
    assert seen[-1] == (0.0, Fault.DEVICE_STOPPED)
    assert words in rig.loop.device_error
    np.testing.assert_array_equal(rig.service.force(), np.zeros(3))
    if state:
        with pytest.raises(DeviceError, match=words):
            connect(rig.service)
    rig.service.stream(False)
    rig.service.clock.running = False
    rig.service.state, rig.service.homed = "ENABLED", True
    assert rig.run(200)[-1][1] is Fault.NONE


def test_an_arm_is_enabled_and_homed_only_when_asked(service):
    service.state, service.homed = "DISABLED", False
    for settings in ({}, {"home": 1.0}):
        with pytest.raises(DeviceError, match="its motors are off") as caught:
            connect(service, **settings)
        assert "enable=1" in caught.value.fix
    assert (service.state, service.homed) == ("DISABLED", False), "it doesn't move unasked"
    with pytest.raises(DeviceError, match="homed"):
        connect(service, enable=1.0)
    connect(service, enable=1.0, home=1.0).close()
    assert (service.state, service.homed) == ("ENABLED", True)


def test_an_arm_without_a_state(service):
    service.faults.stateless = True
    with pytest.raises(DeviceError, match="state=0"):
        connect(service, search=0.3)
    device = connect(service, state=0.0)
    drive(device, service, 3, (0.0, 0.0, 1.0))
    assert device.sample.holding
    device.close()


def test_headers_without_stamps(service):
    service.faults.stampless = True
    device = connect(service, delay=0.004)
    assert [age for _, age in drive(device, service, 5)] == pytest.approx([0.002] * 5)
    device.close()


def test_a_position_that_is_no_number_is_a_fault(rig):
    rig.run(50)
    rig.service.faults.position = (math.nan, 0.0, 0.0)
    assert rig.run(3)[-1] == (0.0, Fault.INPUT_NOT_FINITE)
    rig.service.faults.position = None
    assert rig.run(60)[-1][1] is Fault.NONE


def test_a_force_that_is_no_number_is_not_sent(service, device):
    drive(device, service, 3, (1.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="not a finite number"):
        device.write(np.array([math.nan, 0.0, 0.0]))
    np.testing.assert_array_equal(service.force(), [1.0, 0.0, 0.0])


def test_complaints_of_the_bridge_are_a_fault_with_its_words(rig):
    rig.run(50)
    rig.service.faults.complaint = "publish: the arm is shy"
    assert rig.run(1)[-1] == (0.0, Fault.DEVICE_ERROR)
    assert "the arm is shy" in rig.loop.device_error
    assert rig.run(20)[-1][1] is Fault.NONE


def test_a_closed_bridge_is_a_fault_with_its_reason_and_found_again(rig, service):
    rig.run(60)
    rig.service.restart()
    seen = rig.run(30)
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[3:])
    assert "ROS bridge" in rig.loop.device_error
    connect(rig.service).close()  # nothing is left that a new start doesn't heal
    service.faults.closing = True
    with pytest.raises(DeviceLostError, match="closed the connection"):
        connect(service)


def test_closing_sends_zero_and_refuses_more(service, device):
    drive(device, service, 5, (0.0, 0.0, 1.0))
    device.close()
    device.close()
    assert service.await_wrenches(device.published)
    np.testing.assert_array_equal(service.force(), np.zeros(3))
    for call in (lambda: device.write(np.zeros(3)), lambda: device.read(0.0)):
        with pytest.raises(DeviceError, match="is closed"):
            call()


def test_a_hanging_bridge_can_not_hold_up_the_driver(service, device):
    drive(device, service, 3)
    service.hang()
    now = service.clock.loop
    for k in range(200):
        device.read(now + k * TICK)
        device.write(np.array([0.0, 0.0, 1.0]))
    assert device.sample.time <= now, "its samples get old"


def test_a_start_that_is_wild_or_slow_is_refused(clock):
    with serve(clock) as service:
        service.faults.runaway = 0.01
        with pytest.raises(DeviceError, match="Hold it still"):
            connect(service)
        service.faults.runaway = 0.0
        connect(service).close()
    with serve(clock, rate=20.0) as service, pytest.raises(DeviceError, match="positions within"):
        connect(service, search=0.5)


def test_addresses_and_namespaces_that_are_wrong(service):
    with pytest.raises(DeviceError, match="No position comes from /leg/measured_cp"):
        connect(service, arm="leg", search=0.2)
    with pytest.raises(DeviceError, match="ROS bridge at ws://127"):
        CrtkDevice(CrtkSettings("ws://127.0.0.1:9"))
    with pytest.raises(PortInUseError, match="other ports"):
        CrtkSimulator(CrtkSimulatorSettings(port=service.port)).start()


@pytest.mark.parametrize(
    "options",
    ["types=ros3", "force=99", "radius=1", "delay=1", "wrench=servo_cp", "axes=xyz", "home=2", "origin=x"],
)
def test_options_out_of_range(shared, options):
    with pytest.raises(UsageError):
        device_named(f"crtk:{options}", shared.command)
