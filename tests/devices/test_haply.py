"""The Haply driver on a double of its service, with the service's faults; no hardware has been touched."""

from __future__ import annotations

import contextlib
import http.client
import json
import math

import numpy as np
import pytest
from rigs import TICK, HaplyRig

from palpate.devices.doubles.haply_simulator import EVENTS, HaplySimulator, SimulatorSettings
from palpate.devices.haply import HaplyDevice, HaplySettings
from palpate.devices.profiles import device_profile, weakest_profile
from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceError, PortInUseError, UsageError
from palpate.runtime import Fault, LoopProcess
from waiting import wait_for

pytestmark = pytest.mark.timeout(240)
OPENING = 50  # messages


@pytest.fixture
def rig():
    with HaplyRig() as rig:
        yield rig


@pytest.fixture
def service(rig):
    return rig.service


@pytest.fixture
def device(rig):
    return rig.open()


@pytest.fixture
def loop(rig, plain, shared):
    return rig.loop(plain, shared)


def test_one_answer_for_each_command(service, device, rig):
    ages = [age for _, age in rig.drive(300)[1:]]
    device.read(rig.clock.time)  # the last one's answer
    assert service.received == OPENING + 300
    assert ages == pytest.approx([TICK] * 299), "a position is that of the tick before"
    assert (device.lost, device.surplus) == (0, 0)


@pytest.mark.parametrize("spelling", ["vector", "values"])
def test_a_service_that_knows_one_spelling_is_found_out(spelling):
    with HaplyRig(spellings=(spelling,)) as rig:
        service = rig.service
        device = rig.open()
        with contextlib.suppress(DeviceError):
            rig.drive(60, force=(0.0, 0.0, 0.5))
        rig.drive(60, force=(0.0, 0.0, 0.5))
        assert (device.proven, device.spelling) == (True, spelling)
        np.testing.assert_allclose(service.force(), [0.0, 0.0, 0.5])
        device.close()


def test_another_spelling_starts_from_no_force(plain, shared):
    with HaplyRig(spellings=("values",)) as rig:
        service = rig.service
        loop = rig.loop(plain, shared)
        felt = []
        for _ in range(400):
            rig.run(1)
            felt.append(np.linalg.norm(service.force()))
        loop.end()
    assert loop.device.spelling == "values"
    assert "now trying 'values'" in loop.device_error
    assert max(felt) > 0.5
    # two commands at most lie between two looks; at once it would be 2 N
    assert np.abs(np.diff(felt)).max() < 0.3, "it grew from nothing"


def test_a_service_that_knows_no_spelling_is_refused():
    with HaplyRig(spellings=()) as rig:
        device = rig.open()
        with pytest.raises(DeviceError, match="now trying"):
            rig.drive(100, force=(0.0, 0.0, 0.5))
        with pytest.raises(DeviceError, match="neither as 'vector' nor as 'values'"):
            rig.drive(100, force=(0.0, 0.0, 0.5))
        with pytest.raises(DeviceError, match="took no force"):
            device.read(rig.clock.time)
        device.close()


@pytest.mark.parametrize("factor", [-1.0, 20.0])
def test_an_echo_of_another_direction_or_size_is_refused(factor):
    with HaplyRig() as rig:
        service = rig.service
        service.faults.echo = factor
        device = rig.open()
        with pytest.raises(DeviceError, match="echoes a force"):
            rig.drive(100, force=(0.0, 0.0, 0.5))
        device.close()


def test_forces_too_small_to_be_echoed_prove_nothing():
    with HaplyRig(spellings=()) as rig:
        device = rig.open()
        rig.drive(200, force=(0.0, 0.0, 0.04))
        assert not device.proven
        device.close()


def test_a_scale_is_refused_or_compensated():
    with HaplyRig(force_scale=0.5) as rig:
        service = rig.service
        with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
            rig.open()
        device = rig.open(scale="compensate")
        rig.drive(3, force=(0.0, 0.0, 2.0))
        device.read(rig.clock.time)
        np.testing.assert_allclose(service.force(), [0.0, 0.0, 2.0])
        assert device.proven
        device.close()
    with HaplyRig(force_scale=50.0) as rig, pytest.raises(DeviceError, match="multiplies"):
        rig.open(scale="compensate")


def test_the_zero_force_of_a_stall_is_sent_although_an_answer_is_outstanding(service, device, rig):
    rig.drive(5, force=(0.0, 0.0, 1.0))
    device.wait, service.faults.held = 0.0, True
    rig.drive(1, force=(0.0, 0.0, 1.0))
    device.write(np.zeros(3))
    service.release()
    device.wait = 1.0
    rig.drive(2)
    np.testing.assert_array_equal(service.force(), np.zeros(3))


@pytest.mark.full
def test_lost_and_doubled_answers_are_counted_and_survived(service, device, rig):
    rig.drive(5)
    service.faults.doubled = 3
    rig.drive(20)
    wait_for(lambda: device.read(rig.clock.time) and device.surplus >= 3)
    assert device.surplus == 3
    service.faults.dropped, device.wait = 2, 0.02
    rig.drive(40)
    device.wait = 1.0
    ages = [age for _, age in rig.drive(20)[2:]]
    assert device.lost >= 2
    assert max(ages) == pytest.approx(TICK)


def test_a_force_lapses_when_its_program_is_gone(service, device, rig):
    rig.drive(5, force=(0.0, 0.0, 1.0))
    device.read(rig.clock.time)  # nothing is on its way
    assert service.force()[2] == 1.0
    rig.clock.time += 0.2
    channel = WebsocketChannel(f"ws://127.0.0.1:{service.port}", "service")
    channel.receive(1.0)
    channel.send("{}")
    channel.receive(1.0)
    channel.close()
    np.testing.assert_array_equal(service.force(), np.zeros(3))


def test_a_closed_connection_is_a_fault_with_its_reason(service, loop, rig):
    rig.run(200)
    service.faults.closing = True
    seen = rig.run(50)
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[20:])
    assert "Haply Inverse Service" in loop.device_error


def test_a_restarted_service_is_found_by_the_name_of_the_device():
    with HaplyRig(devices=("04C2", "0B11")) as rig:
        service = rig.service
        with pytest.raises(DeviceError, match="2 devices: 04C2, 0B11"):
            rig.open()
        device = rig.open(device="0B11")
        rig.drive(5, force=(0.0, 0.0, 1.0))
        assert service.force(1)[2] == 1.0
        service.restart()
        with pytest.raises(DeviceError):
            rig.drive(2)
        device.close()
        device = rig.open(device="0B11")
        rig.drive(5, force=(0.0, 0.0, 2.0))
        assert (service.force(0)[2], service.session) == (2.0, 2), "the order has changed, the device has not"
        device.close()


STOPPING = [
    ("device-disconnected", {}),
    ("device-busy", {}),
    ("device-battery-critical", {}),
    *(
        ("device-safety-triggered", {"safety_type": t})
        for t in ("ebrake_triggered", "stall_detected", "stability_ceiling")
    ),
]


@pytest.mark.grid
@pytest.mark.parametrize(("name", "data"), STOPPING, ids=str)
def test_events_of_safety_are_zero_force_and_a_reason(service, loop, name, data, rig):
    rig.run(100)
    rig.tell(name, "as the test wants", **data)
    seen = rig.run(20)
    kind = Fault.DEVICE_LOST if name == "device-disconnected" else Fault.DEVICE_STOPPED
    assert all(force == 0.0 and fault is kind for force, fault in seen)
    assert data.get("safety_type", name) in loop.device_error
    assert "as the test wants" in loop.device_error


def test_a_released_brake_lets_the_loop_go_on(service, loop, rig):
    rig.run(100)
    rig.tell("device-safety-triggered", safety_type="ebrake_triggered")
    assert rig.run(5)[-1] == (0.0, Fault.DEVICE_STOPPED)
    rig.tell("device-safety-triggered", safety_type="ebrake_released")
    assert rig.run(100)[-1][1] is Fault.NONE


def test_other_events_change_nothing(service, loop, rig):
    rig.run(100)
    for name in EVENTS.keys() - {n for n, _ in STOPPING}:
        rig.tell(name, "by the way")
    rig.tell("device-safety-triggered", safety_type="fod_stage_changed")
    rig.tell("device-busy", device_id="another")
    assert all(fault is Fault.NONE for _, fault in rig.run(20))


def test_a_device_may_be_plugged_in_while_it_is_looked_for(service, rig):
    service.faults.absent = 3
    rig.open(search=5.0).close()
    service.faults.absent = -1
    with pytest.raises(DeviceError, match="0 devices: none"):
        rig.open()


@pytest.mark.parametrize(
    ("fault", "value", "message"),
    [
        ("in_use", True, "in use by another program"),
        ("powered", False, "not power supply"),
        ("calibrated", False, "not calibrated"),
        ("silent_http", True, "does not say how it scales forces"),
        ("deaf", True, "keeps the preset 'defaults'"),
        ("position", (math.nan, 0.0, 0.0), "from its centre"),
        ("closing", True, "closed the connection"),
    ],
)
def test_what_is_wrong_at_the_start_is_refused(service, fault, value, message, rig):
    setattr(service.faults, fault, value)
    with pytest.raises(DeviceError, match=message):
        rig.open()
    setattr(service.faults, fault, type(service.faults)().__getattribute__(fault))
    rig.open().close()  # nothing is left that a new start doesn't heal


def test_places_that_no_arm_reaches_are_faults(service, loop, rig):
    rig.run(100)
    service.faults.position = (5.0, 0.0, 0.0)
    seen = rig.run(6)
    assert seen[1][1] is Fault.NONE, "a single wild sample is passed over"
    assert seen[-1] == (0.0, Fault.DEVICE_ERROR)
    assert "no arm reaches" in loop.device_error.lower()


def test_frames_without_what_is_optional(service, rig):
    service.faults.bare = True
    device = rig.open(spelling="values")
    assert np.isfinite(rig.drive(100, force=(0.0, 0.0, 1.0))[-1][0]).all()
    device.close()


def test_a_dead_mans_button_holds(service, rig):
    device = rig.open(hold="a")
    rig.drive(3)
    assert not device.sample.holding
    service.press("a")
    rig.drive(3)
    assert device.sample.holding
    device.close()


@pytest.mark.parametrize(("hand", "first"), [("a", "b"), ("b", "a")])
def test_the_first_button_that_is_not_the_hand_is_the_dead_mans(service, hand, first, rig):
    device = rig.open(hold=hand)
    service.press(hand, first)
    rig.drive(3)
    assert (device.sample.holding, device.sample.buttons) == (True, 1)
    device.close()


def test_buttons_of_the_grip_reach_the_loop(service, rig):
    device = rig.open(hold="a")
    service.press("a", "c")
    rig.drive(3)
    assert (device.sample.holding, device.sample.buttons) == (True, 0b10)
    service.press("a", "c", down=False)
    rig.drive(3)
    assert (device.sample.holding, device.sample.buttons) == (False, 0)
    device.close()


def test_the_button_of_a_wired_grip_stops_holds_and_is_the_dead_mans(plain, shared):
    """One Boolean named button, where a wireless grip has several by name: nobody saw it pressed."""
    with HaplyRig(grip="wired") as rig:
        service = rig.service
        loop = rig.loop(plain, shared)
        assert rig.run(400)[-1][0] > 0.1
        service.press("button")
        assert rig.run(3)[-1][0] == 0.0
        assert loop.device.sample.buttons == 1
        loop.end()
        device = rig.open(hold="button")
        assert device.traits.buttons == 0, "the one that there is holds"
        rig.drive(3)
        assert (device.sample.holding, device.sample.buttons) == (True, 0)
        service.press("button", down=False)
        rig.drive(3)
        assert not device.sample.holding
        device.close()


@pytest.mark.full
@pytest.mark.parametrize("grip", ["wired", "wireless"])
def test_a_dead_man_button_gives_force_while_it_is_held(plain, shared, grip):
    button = {"wired": "button", "wireless": "a"}[grip]
    with HaplyRig(grip=grip) as rig:
        service = rig.service
        loop = rig.loop(plain, shared, dead_man=True)
        assert not any(force for force, _ in rig.run(400))
        service.press(button)
        assert max(force for force, _ in rig.run(1500)) > 0.1
        service.press(button, down=False)
        assert rig.run(3)[-1][0] == 0.0
        loop.end()


@pytest.mark.parametrize("field", ["connected", "awake"])
def test_a_grip_that_is_away_holds_nothing(service, field, rig):
    """Its buttons are those of a time ago: pressed for ever."""
    device = rig.open(hold="a")
    service.press("a", "b")
    rig.drive(3)
    assert device.sample.holding
    service.grips["wireless_verse_grip"][0]["status"][field] = False
    rig.drive(3)
    assert (device.sample.holding, device.sample.buttons) == (False, 0)
    device.close()


@pytest.mark.parametrize(
    ("grip", "hold", "words"),
    [
        ("wired", "a", "Its buttons: button"),
        ("wireless", "button", "Its buttons: a, b, c"),
        ("none", "a", "no grip"),
    ],
)
def test_a_button_to_hold_that_no_grip_has_is_refused(grip, hold, words):
    with HaplyRig(grip=grip) as rig, pytest.raises(DeviceError, match=words):
        rig.open(hold=hold)


def test_of_two_grips_one_is_named():
    with HaplyRig(grip="both") as rig:
        service = rig.service
        device = rig.open(grip=service.grips["verse_grip"][0]["device_id"])
        assert device.traits.buttons == 1
        service.press("a")
        rig.drive(3)
        assert device.sample.buttons == 0
        service.press("button")
        rig.drive(3)
        assert device.sample.buttons == 1
        device.close()


def test_a_grip_whose_buttons_are_not_understood_is_said():
    with HaplyRig() as rig:
        service = rig.service
        state = service.grips["wireless_verse_grip"][0]["state"]
        state["keys"] = state.pop("buttons")
        device = rig.open()
        assert "no button in a form that is known" in device.note
        assert device.traits.buttons == 0
        device.close()


@pytest.mark.full
def test_a_dead_man_button_that_is_not_there_is_refused(spring_file):
    """Only the opened device knows its grips: here the one button is the hand."""
    with HaplySimulator(SimulatorSettings(port=0, events=0, grip="wired")) as service:
        device = f"haply:ws://127.0.0.1:{service.port},events={service.events_port},hold=button"
        loop = LoopProcess(spring_file, device=device, dead_man=True)
        with pytest.raises(UsageError, match="no button to hold"):
            loop.start()


@pytest.mark.parametrize(
    ("kind", "profile"),
    [("inverse3", "inverse3"), ("inverse3x", "inverse3x"), ("minverse", "minverse"), ("inverse4", "unknown")],
)
def test_each_type_has_limits_of_its_own(kind, profile):
    """A Minverse passed for an Inverse3: 10 N and 0.10 m."""
    with HaplyRig(kind=kind) as rig:
        device = rig.open()
        limits = weakest_profile("haply") if profile == "unknown" else device_profile(profile)
        assert device.profile == limits
        assert (device.traits.radius, device.traits.max_force) == (limits.radius, limits.max_force)
        assert kind in device.traits.name
        assert (
            ("unknown type" in device.traits.name)
            is ("least of each" in device.note)
            is (profile == "unknown")
        )
        device.close()


def test_a_service_without_the_setting_needs_an_explicit_scale(service, rig):
    """Before version 3.5 nothing tells by how much forces are scaled."""
    service.faults.silent_http = True
    with pytest.raises(DeviceError, match="force_scale=1"):
        rig.open()
    device = rig.open(force_scale=1.0)
    assert "no route /settings/devices/force_scale" in device.note
    rig.drive(3, force=(0.0, 0.0, 2.0))
    device.read(rig.clock.time)
    np.testing.assert_allclose(service.force(), [0.0, 0.0, 2.0])
    device.close()
    with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
        rig.open(force_scale=0.5)


def test_what_the_service_tells_goes_before_an_explicit_scale():
    with HaplyRig(force_scale=0.5) as rig:
        service = rig.service
        with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
            rig.open(force_scale=1.0)
        service.faults.plain_http = True
        with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
            rig.open(force_scale=1.0)
    with HaplyRig(force_scale=0.0) as rig, pytest.raises(DeviceError, match="every force by 0"):
        rig.open(force_scale=1.0)


def test_addresses_that_are_none_of_the_service(service, rig):
    with pytest.raises(DeviceError, match="legacy format"):
        HaplyDevice(
            HaplySettings(f"ws://127.0.0.1:{service.legacy_port}", http=float(service.port), events=0.0)
        )
    with pytest.raises(DeviceError, match="events=0"):
        rig.open(events=9.0)
    rig.open(events=0.0).close()
    with pytest.raises(DeviceError, match="palpate devices simulate haply"):
        HaplyDevice(HaplySettings("ws://127.0.0.1:9"))
    with pytest.raises(UsageError, match="encrypted"):
        WebsocketChannel("wss://localhost:1", "service")
    with pytest.raises(UsageError, match="no address"):
        WebsocketChannel("http://localhost:1", "service")
    taken = SimulatorSettings(port=service.port, events=0)
    with pytest.raises(PortInUseError, match="other ports"):
        HaplySimulator(taken).start()


def test_the_double_refuses_slips_of_units(service, device, rig):
    rig.drive(3, force=(0.0, 0.0, 5000.0))
    np.testing.assert_array_equal(service.force(), np.zeros(3))


@pytest.mark.parametrize("path", ["/version", "/devices", "/sessions", "/force_scale", "/nowhere"])
def test_the_double_answers_http(service, path):
    connection = http.client.HTTPConnection("127.0.0.1", service.port, timeout=5)
    connection.request("GET", path)
    answer = json.loads(connection.getresponse().read())
    connection.close()
    assert answer["ok"] is (path != "/nowhere")
    assert ("data" in answer) is answer["ok"]


def test_the_real_loop_on_the_double(spring_file):
    """In its own process and in real time: the hand moves by itself and feels the body; an unknown type is said."""
    with HaplySimulator(SimulatorSettings(port=0, events=0, frequency=2.0, kind="inverse4")) as service:
        device = f"haply:ws://127.0.0.1:{service.port},events={service.events_port}"
        with LoopProcess(spring_file, device=device) as loop:
            wait_for(lambda: loop.read().force[1] >= 0.2)  # the hand goes down and is pushed up
            assert "unknown type" in loop.read().device
            assert "least of each limit" in loop.report().device_note, "while it runs"
    assert loop.report().foreign == ()
