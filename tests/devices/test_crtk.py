"""The CRTK driver on a double of an arm behind a ROS bridge, with its faults; no robot has been touched."""

from __future__ import annotations

import json
import math
import select
from pathlib import Path

import numpy as np
import pytest
from rigs import TICK, CrtkRig

from palpate.devices import crtk, device_traits
from palpate.devices.crtk import CrtkDevice
from palpate.devices.crtk_settings import CrtkSettings, axes_in_words
from palpate.devices.doubles.crtk_simulator import CrtkSimulator, CrtkSimulatorSettings
from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceError, DeviceLostError, PortInUseError, UsageError
from palpate.runtime import Fault, Workspace
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from waiting import wait_for

FRAMES = json.loads((Path(__file__).parents[1] / "data/devices/crtk.json").read_text(encoding="utf-8"))
pytestmark = pytest.mark.timeout(240)


@pytest.fixture
def rig():
    with CrtkRig() as rig:
        yield rig


@pytest.fixture
def service(rig):
    return rig.service


@pytest.fixture
def device(rig):
    return rig.open(origin="here")


@pytest.fixture
def loop(rig, plain, shared):
    return rig.loop(plain, shared)


@pytest.mark.parametrize("ros", [1, 2])
def test_both_spellings_of_types_are_found(ros):
    with CrtkRig(ros=ros) as rig:
        service = rig.service
        device = rig.open()
        assert device.types == f"ros{ros}"
        assert service.topics["/arm/body/servo_cf"].count("/") == ros
        rig.drive(3, (0.0, 0.0, 1.0))
        np.testing.assert_array_equal(service.force(), [0.0, 0.0, 1.0])
        device.close()
        with pytest.raises(DeviceError, match="Unable to import"):
            rig.open(types=f"ros{3 - ros}", search=0.5)


def example(topic, ros, side="from_the_arm", value=None):
    """An example message of a topic, of a pedal that of one value."""
    frames = [f for f in FRAMES[side] if f["topic"] == topic and f["ros"] == ros]
    return next(f["msg"] for f in frames if value is None or f["msg"]["buttons"] == [value])


def shape(value):
    """The structure of a message: its fields, and of each whether it is a number, a text or a switch."""
    if isinstance(value, dict):
        return {name: shape(entry) for name, entry in value.items()}
    return (
        "number" if isinstance(value, int | float) and not isinstance(value, bool) else type(value).__name__
    )


@pytest.mark.parametrize("ros", [1, 2])
def test_example_messages_are_read(ros):
    with CrtkRig(ros=ros, arm="MTMR") as rig:
        service = rig.service
        device = rig.open(arm="MTMR", origin="base")
        service.publish("/MTMR/operating_state", example("/MTMR/operating_state", ros))
        message = example("/MTMR/measured_cp", ros)
        now = rig.now
        for delay in (0.0, 0.002):  # the second, 1 s younger by its stamp, came 2 ms later than the first
            service.publish("/MTMR/measured_cp", message)
            sample = read_when_it_comes(device, now + 500.0 * delay + delay)
            np.testing.assert_array_equal(sample.position, [-0.112, 0.034, -0.205])
            assert now + 500.0 * delay + delay - sample.time == pytest.approx(delay, abs=3e-4)
            seconds = "secs" if ros == 1 else "sec"
            message["header"]["stamp"][seconds] += 1
        message["header"]["stamp"][seconds] -= 2
        device.write(np.array([0.0, 0.0, 1.0]))
        assert service.await_wrenches(device.published)
        assert service.stamp[seconds] == message["header"]["stamp"][seconds] + 1
        pedals = (
            ("clutch", 1, (True, 0)),
            ("clutch", 0, (False, 0)),
            ("camera", 2, (False, 0b100)),
            ("coag", 1, (False, 1)),
        )
        for pedal, value, meaning in pedals:
            service.publish(f"/footpedals/{pedal}", example(f"/footpedals/{pedal}", ros, value=value))
            sample = read_when_it_comes(device, now + 1.0)
            assert (sample.clutched, sample.buttons) == meaning, pedal
        device.close()


def read_when_it_comes(device, now):
    """The sample after the next message."""
    assert select.select(device._channel._poll, (), (), 5.0)[0]
    return device.read(now)


@pytest.mark.parametrize("ros", [1, 2])
def test_what_is_sent_has_the_fields_and_types_of_the_example_messages(ros):
    with CrtkRig(ros=ros, arm="MTMR") as rig:
        service = rig.service
        service.state = "DISABLED"
        device = rig.open(arm="MTMR", enable=1.0)
        types = dict(service.topics)
        rig.drive(2, (0.0, 0.0, 1.0))
        device.close()
        assert service.await_wrenches(device.published)
        wait_for(lambda: "/MTMR/unlock_orientation" in service.received)
        for frame in (f for f in FRAMES["to_the_arm"] if f["ros"] == ros):
            sent, known = shape(service.received[frame["topic"]]), shape(frame["msg"])
            header, full = sent.pop("header", {}), known.pop("header", {})
            assert sent == known, frame["topic"]
            assert header.items() <= full.items(), "the bridge fills in what is left out of a header"
            assert types[frame["topic"]] == frame["type"]


@pytest.mark.parametrize("ros", [1, 2])
def test_the_double_writes_what_the_example_messages_have(ros):
    """Its messages, and none of the driver's, are compared: the double learns nothing from what it feeds."""
    with CrtkRig(ros=ros, arm="MTMR") as rig:
        service = rig.service
        told = {}
        channel = WebsocketChannel(f"ws://127.0.0.1:{service.port}", "ROS bridge")
        frames = [f for f in FRAMES["from_the_arm"] if f["ros"] == ros]
        for frame in frames:
            channel.send(json.dumps({"op": "subscribe", "topic": frame["topic"], "type": frame["type"]}))
        for pedal in {f["topic"] for f in frames if f["type"].endswith("Joy")}:
            service.press(pedal, 1)
        while len(told) < len({f["topic"] for f in frames}):
            for text in channel.receive(0.1):
                message = json.loads(text)
                assert message["op"] == "publish", message
                told[message["topic"]] = shape(message["msg"])
        channel.close()
        assert told == {f["topic"]: shape(f["msg"]) for f in frames}


def test_a_limp_arm_bears_its_weight_and_holds_its_wrist(service, device, rig):
    """As the maker's own example begins: gravity compensation, the base's axes, no force, and the wrist as it is."""
    assert (service.gravity, service.absolute, service.limp) == (True, True, True)
    wait_for(lambda: device.locked or rig.drive(1) is None)
    assert service.locked == pytest.approx({"x": 0.0, "y": 0.0, "z": math.sqrt(0.5), "w": math.sqrt(0.5)})
    assert device.note == ""
    rig.drive(3, (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(service.force(), [1.0, 2.0, 3.0])
    device.close()
    wait_for(lambda: service.locked is None)
    assert service.gravity, "an arm that is let go must not fall"


def test_gravity_and_wrist_are_left_alone_where_that_is_asked_for(service, rig):
    device = rig.open(gravity=0.0, lock=0.0)
    rig.drive(3)
    assert (service.gravity, service.locked) == (False, None)
    np.testing.assert_array_equal(service.force(), [0.0, 0.0, -service.settings.weight])
    device.close()


def test_an_arm_that_was_restarted_is_asked_for_all_again(rig, loop):
    """Else it would sink, its wrist swing, and a force in its own axes push in another direction."""
    service = rig.service
    rig.run(60)
    service.state = "DISABLED"
    rig.run(5)
    service.absolute, service.gravity = False, False
    service.state = "ENABLED"
    assert rig.run(30)[-1][1] is Fault.NONE
    wait_for(lambda: service.locked is not None)
    assert (service.absolute, service.gravity, service.limp) == (True, True, True)


def test_a_wrist_that_swings_again_is_told(service, device, rig):
    rig.drive(2)
    service.publish("/arm/orientation_locked", {"data": False})
    wait_for(lambda: device.locked is False or rig.drive(1) is None)
    assert device.note == "its wrist does not hold its orientation"


def test_an_arm_that_could_not_be_opened_was_not_made_limp(service, rig):
    service.state = "DISABLED"
    with pytest.raises(DeviceError, match="motors are off"):
        rig.open()
    assert (service.limp, service.wrenches) == (False, 0)
    service.state, service.faults.runaway = "ENABLED", 0.01
    with pytest.raises(DeviceError, match="Hold it still"):
        rig.open()
    wait_for(lambda: "/arm/unlock_orientation" in service.received)
    assert service.locked is None, "the wrist is free again"


def pedal_sample(rig, pedal, value):
    rig.service.press(pedal, value)
    rig.drive(1)
    return rig.device.sample


def test_pedals_clutch_stop_and_are_dead_man(service, rig):
    service.press("footpedals/clutch", 1)  # before it is opened
    device = rig.open()
    assert device.traits.buttons == 5
    sample = pedal_sample(rig, "footpedals/cam_plus", 0)
    assert (sample.clutched, sample.holding, sample.buttons) == (True, True, 0)
    assert not pedal_sample(rig, "footpedals/clutch", 0).clutched
    assert pedal_sample(rig, "footpedals/coag", 1).buttons == 1, "the dead-man pedal is the first"
    others = ("bicoag", "camera", "cam_minus", "cam_plus")
    for k, pedal in enumerate(others, start=1):
        assert pedal_sample(rig, f"footpedals/{pedal}", 1).buttons == 1 | 1 << k
        assert pedal_sample(rig, f"footpedals/{pedal}", 0).buttons == 1
    assert pedal_sample(rig, "footpedals/coag", 2).buttons == 0, "a tap holds nothing"
    service.press("footpedals/camera", 2)
    wait_for(lambda: rig.drive(1) and device.sample.buttons == 0b100)
    rig.drive(1)
    assert device.sample.buttons == 0, "a tap is one sample long: it stops, and a person resumes"
    device.close()


def test_other_pedals_and_consoles(service, rig):
    device = rig.open(hold="console1/operator_present", dead_man="", clutch="camera", pedals="a/footpedals")
    assert (device.traits.buttons, device_traits("crtk").buttons) == (0, 5)
    assert device_traits("crtk:dead_man=").buttons == 0
    assert device_traits("crtk:hold=coag,dead_man=bicoag").buttons == 4
    rig.drive(1)
    assert not device.sample.holding, "an operator who was not seen is not there"
    assert pedal_sample(rig, "console1/operator_present", 1).holding
    assert pedal_sample(rig, "a/footpedals/camera", 1).clutched
    assert pedal_sample(rig, "a/footpedals/clutch", 1).buttons == 0b10, "any other button stops"
    device.close()
    device = rig.open(pedals="")
    assert pedal_sample(rig, "footpedals/clutch", 1).clutched is False
    device.close()


def test_a_pedal_without_a_button_is_a_fault(service, device, rig):
    rig.drive(1)
    for message in ({"axes": [], "buttons": []}, {"buttons": [7]}, {}):
        service.publish("/footpedals/coag", message)
        with pytest.raises(DeviceError, match="sends no button"):
            read_when_it_comes(device, rig.now)


def test_one_wrench_for_each_fresh_position(service, device, rig):
    began = device.published
    rig.drive(20, (0.0, 1.0, 0.0))
    assert device.published == service.wrenches == began + 20
    now = rig.now
    for k in range(5):  # no position, no wrench
        device.read(now + 1e-4 * k)
        device.write(np.array([0.0, 1.0, 0.0]))
    assert device.published == began + 20
    device.write(np.zeros(3))  # but a zero force at once
    assert device.published == began + 21
    assert service.await_wrenches(began + 21)
    np.testing.assert_array_equal(service.force(), np.zeros(3))
    device.read(now + 0.1)
    device.write(np.zeros(3))
    assert device.published == began + 22, "and again from time to time: ROS may lose one"


def test_a_wrench_bears_the_stamp_of_its_position(service, device, rig):
    rig.drive(3, (0.0, 0.0, 1.0))
    assert service.stamp["sec"] + 1e-9 * service.stamp["nanosec"] == pytest.approx(rig.clock.time, abs=2e-9)


@pytest.mark.parametrize("wrench", ["body/servo_cf", "servo_cf"])
def test_the_force_is_in_the_axes_of_the_base(service, wrench, rig):
    device = rig.open(wrench=wrench)
    rig.drive(3, (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(service.force(), [1.0, 2.0, 3.0])
    device.close()


def test_other_axes_are_given_in_words():
    np.testing.assert_array_equal(axes_in_words("+x+y+z"), np.eye(3))
    for text in ("+x+y-z", "+x+x+z", "xyz", "+x+y+", "+x+y+w", ""):
        with pytest.raises(UsageError, match="no rotation"):
            axes_in_words(text)


def test_the_centre_is_where_the_handle_is_while_it_is_opened():
    with CrtkRig(amplitude=0.0) as rig:
        service = rig.service
        service.faults.position = (0.3, 0.2, 0.1)
        device = rig.open(origin="here")
        np.testing.assert_allclose(rig.drive(2)[-1][0], 0.0, atol=1e-12)
        device.close()


def test_ages_come_from_the_stamps_whatever_clock_they_are_of(service, device, rig):
    ages = [age for _, age in rig.drive(50)]
    assert ages == pytest.approx([0.0] * 50, abs=1e-5)
    for _ in range(30):  # each position takes 5 ms longer than the fastest
        rig.clock.time += TICK
        service.step()
        sample = device.read(rig.now + 0.005)
    assert rig.now + 0.005 - sample.time == pytest.approx(0.005, abs=1e-4)


@pytest.mark.full
def test_clocks_that_part_slowly_make_no_sample_old(service, device, rig):
    for k in range(300):
        rig.clock.time += 0.1
        service.step()
        now = rig.now + 1e-4 * 0.1 * k
        sample = device.read(now)
    assert now - sample.time < 1e-3


def test_half_the_round_trip_is_the_age_of_the_youngest_and_half_the_devices_delay(service, rig):
    device = rig.open(delay=0.006)
    assert device.traits.delay == 0.003
    assert [age for _, age in rig.drive(5)] == pytest.approx([0.003] * 5, abs=1e-6)
    device.close()


def test_the_delay_softens_a_body(plain, shared):
    """K < b/(T/2 + d): with 0.5 N·s/m and 10 ms of delay 48 N/m."""
    with CrtkRig() as rig:
        device = rig.open(delay=0.010)
        rig.looped = loop = Loop(plain, device, shared, Workspace(0.1, 1.0), Limits(3.0), stiffness=300.0)
        rig.run(50)
        assert loop.bounds.bound == pytest.approx(0.5 / (0.0005 + 0.010), rel=0.05)
        assert loop.bounds.warning
        loop.end()


@pytest.mark.full
def test_the_round_trip_is_measured(monkeypatch):
    monkeypatch.setattr(crtk, "LONGEST_DELAY", 60.0)  # the machine may have much else to do
    with CrtkRig(rate=200.0) as rig:
        service = rig.service
        device = rig.open(delay=-1.0)
        assert 0.0 < device.round_trip < 60.0
        assert device.traits.delay == 0.5 * device.round_trip
        device.close()
        service.faults.deaf = True
        with pytest.raises(DeviceError, match="sends nothing back") as caught:
            rig.open(delay=-1.0, search=0.5)
        assert "crtk:delay=SECONDS" in caught.value.fix
        service.faults.deaf = False
        monkeypatch.setattr(crtk, "LONGEST_DELAY", 1e-6)
        with pytest.raises(DeviceError, match="and back takes"):
            rig.open(delay=-1.0)


def test_late_doubled_and_lost_messages_are_no_fresh_samples(service, device, rig):
    rig.drive(5)
    service.faults.doubled = 3
    rig.drive(4)
    assert device.repeated == 3
    service.faults.swapped = 1
    rig.drive(4)
    assert device.repeated == 4
    assert device.note.startswith("4 positions")
    service.faults.dropped = 3
    ages = [age for _, age in rig.drive(6)]
    assert max(ages) == pytest.approx(0.003, abs=1e-5)
    assert ages[-1] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.full
@pytest.mark.grid
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
def test_states_are_faults_in_words_and_refused_at_the_start(rig, state, homed, words, loop):
    rig.press()
    rig.service.state, rig.service.homed = state, homed
    seen = rig.run(5)
    assert seen[-1] == (0.0, Fault.DEVICE_STOPPED)
    assert words in loop.device_error
    np.testing.assert_array_equal(rig.service.force(), np.zeros(3))
    device = rig.device
    if state:
        with pytest.raises(DeviceError, match=words):
            rig.connect()
    rig.stand(device)
    rig.service.state, rig.service.homed = "ENABLED", True
    assert rig.run(200)[-1][1] is Fault.NONE


def test_an_arm_is_enabled_and_homed_only_when_asked(service, rig):
    service.state, service.homed = "DISABLED", False
    for settings in ({}, {"home": 1.0}):
        with pytest.raises(DeviceError, match="its motors are off") as caught:
            rig.open(**settings)
        assert "enable=1" in caught.value.fix
    assert (service.state, service.homed) == ("DISABLED", False), "it doesn't move unasked"
    with pytest.raises(DeviceError, match="homed"):
        rig.open(enable=1.0)
    rig.open(enable=1.0, home=1.0).close()
    assert (service.state, service.homed) == ("ENABLED", True)


def test_an_arm_without_a_state(service, rig):
    service.faults.stateless = True
    with pytest.raises(DeviceError, match="state=0"):
        rig.open(search=0.3)
    device = rig.open(state=0.0)
    rig.drive(3, (0.0, 0.0, 1.0))
    assert device.sample.holding
    device.close()


def test_headers_without_stamps(service, rig):
    service.faults.stampless = True
    device = rig.open(delay=0.004)
    assert [age for _, age in rig.drive(5)] == pytest.approx([0.002] * 5)
    device.close()


def test_complaints_of_the_bridge_are_a_fault_with_its_words(rig, loop):
    rig.run(50)
    rig.service.faults.complaint = "publish: the arm is shy"
    assert rig.run(1)[-1] == (0.0, Fault.DEVICE_ERROR)
    assert "the arm is shy" in loop.device_error
    assert rig.run(20)[-1][1] is Fault.NONE


def test_a_closed_bridge_is_a_fault_with_its_reason_and_found_again(rig, service, loop):
    rig.run(60)
    rig.service.restart()
    seen = rig.run(30)
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[3:])
    assert "ROS bridge" in loop.device_error
    rig.device.close()
    rig.connect().close()  # nothing is left that a new start doesn't heal
    wait_for(lambda: not service._clients)  # the last words of those before have been heard
    service.faults.closing = True
    with pytest.raises(DeviceLostError, match="closed the connection"):
        rig.open()


def test_the_last_zero_arrives_though_positions_were_left_unread():
    """A socket closed with messages unread resets the connection, and the other end may lose what was sent last."""
    with CrtkRig(rate=10_000.0) as rig:
        service = rig.service
        for k in range(1, 21):
            channel = WebsocketChannel(f"ws://127.0.0.1:{service.port}", "ROS bridge")
            for topic, kind in (("measured_cp", "PoseStamped"), ("measured_cv", "TwistStamped")):
                message = {"op": "subscribe", "topic": f"/arm/{topic}", "type": f"geometry_msgs/msg/{kind}"}
                channel.send(json.dumps(message))
            wrench = {"topic": "/arm/body/servo_cf", "type": "geometry_msgs/msg/WrenchStamped"}
            channel.send(json.dumps({"op": "advertise", **wrench}))
            message = example("/MTMR/body/servo_cf", 2, "to_the_arm")
            assert select.select(channel._poll, (), (), 5.0)[0]
            channel.send(json.dumps({"op": "publish", "topic": wrench["topic"], "msg": message}))
            channel.close()
            assert service.await_wrenches(k), f"the last message of connection {k} was lost"


def test_a_hanging_bridge_can_not_hold_up_the_driver(service, device, rig):
    rig.drive(3)
    service.hang()
    now = rig.now
    for k in range(200):
        device.read(now + k * TICK)
        device.write(np.array([0.0, 0.0, 1.0]))
    assert device.sample.time <= now, "its samples get old"


@pytest.mark.full
def test_an_arm_that_sends_too_seldom_is_refused():
    with CrtkRig(rate=20.0) as rig, pytest.raises(DeviceError, match="positions within"):
        rig.open(search=0.5)


def test_addresses_and_namespaces_that_are_wrong(service, rig):
    with pytest.raises(DeviceError, match="No position comes from /leg/measured_cp"):
        rig.open(arm="leg", search=0.2)
    with pytest.raises(DeviceError, match="ROS bridge at ws://127"):
        CrtkDevice(CrtkSettings("ws://127.0.0.1:9"))
    with pytest.raises(PortInUseError, match="other ports"):
        CrtkSimulator(CrtkSimulatorSettings(port=service.port)).start()
