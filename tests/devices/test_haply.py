"""The Haply driver on a double of its service, with the service's faults; no hardware has been touched."""

from __future__ import annotations

import contextlib
import http.client
import json
import math
import time

import numpy as np
import pytest

from palpate.devices import device_named
from palpate.devices.device import HARDWARE_PATIENCE
from palpate.devices.doubles.haply_simulator import EVENTS, HaplySimulator, SimulatorSettings
from palpate.devices.haply import AXES, HaplyDevice, HaplySettings
from palpate.devices.profiles import device_profile, weakest_profile
from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceError, PortInUseError, UsageError
from palpate.runtime import Fault, LoopProcess, Workspace, now
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits

pytestmark = pytest.mark.timeout(240)
TICK = 1e-3
OPENING = 50  # messages


class Clock:
    """A clock that stands still until it is moved."""

    time = 0.0

    def __call__(self):
        return self.time


@pytest.fixture
def clock():
    return Clock()


@contextlib.contextmanager
def serve(clock, devices=("04C2",), **settings):
    with HaplySimulator(SimulatorSettings(port=0, events=0, **settings), clock, devices) as service:
        yield service


@pytest.fixture
def service(clock):
    with serve(clock) as simulator:
        yield simulator


def connect(service, **settings):
    usual = {"events": float(service.events_port), "wait": 1.0, "search": 0.0}
    return HaplyDevice(HaplySettings(url=f"ws://127.0.0.1:{service.port}", **(usual | settings)))


@pytest.fixture
def device(service):
    driver = connect(service)
    yield driver
    driver.close()


@pytest.fixture
def loop(device, plain, shared):
    return Loop(plain, device, shared, Workspace(0.1, 10.0), Limits(10.0), rate=1000.0)


def drive(device, clock, ticks, force=(0.0, 0.0, 0.0)):
    """Lock-step without a loop; the samples' places and ages."""
    seen = []
    for _ in range(ticks):
        clock.time += TICK
        sample = device.read(clock.time)
        seen.append((sample.position.copy(), clock.time - sample.time))
        device.write(np.array(force))
    return seen


def run(loop, clock, ticks):
    """Ticks of the loop; the force sent and the fault of each."""
    seen = []
    for _ in range(ticks):
        clock.time += TICK
        loop.tick(clock.time)
        seen.append((float(np.linalg.norm(loop.safety.force)), loop.fault))
    return seen


def test_one_answer_for_each_command(service, device, clock):
    ages = [age for _, age in drive(device, clock, 300)[1:]]
    device.read(clock.time)  # the last one's answer
    assert service.received == OPENING + 300
    assert ages == pytest.approx([TICK] * 299), "a position is that of the tick before"
    assert (device.lost, device.surplus) == (0, 0)


def test_the_device_axes_are_a_rotation(service, device, clock):
    turn = np.array(AXES)
    assert np.linalg.det(turn) == 1.0
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
    service.faults.position = (0.01, 0.02, 0.03)  # right, away, up
    place, _ = drive(device, clock, 3)[-1]
    np.testing.assert_array_equal(place, [0.01, 0.02, 0.03])
    np.testing.assert_allclose(turn @ place, [0.01, 0.03, -0.02])  # right, up, towards the user
    assert device.traits.axes == AXES
    drive(device, clock, 2, force=(1.0, 2.0, 3.0))
    device.read(clock.time)  # the command has been answered, so it has arrived
    np.testing.assert_array_equal(service.force(), [1.0, 2.0, 3.0])


def test_the_loop_pushes_on_the_hand_against_its_way(service, loop, clock):
    seen = run(loop, clock, 500)  # half a second: the hand is at its lowest
    assert all(fault is Fault.NONE for _, fault in seen)
    assert service.force()[2] > 0.5, "pushed down, the hand is pushed up"
    assert loop.device.proven


@pytest.mark.parametrize("spelling", ["vector", "values"])
def test_a_service_that_knows_one_spelling_is_found_out(clock, spelling):
    with serve(clock, spellings=(spelling,)) as service:
        device = connect(service)
        with contextlib.suppress(DeviceError):
            drive(device, clock, 60, force=(0.0, 0.0, 0.5))
        drive(device, clock, 60, force=(0.0, 0.0, 0.5))
        assert (device.proven, device.spelling) == (True, spelling)
        np.testing.assert_allclose(service.force(), [0.0, 0.0, 0.5])
        device.close()


def test_another_spelling_starts_from_no_force(clock, plain, shared):
    with serve(clock, spellings=("values",)) as service:
        loop = Loop(plain, connect(service), shared, Workspace(0.1, 10.0), Limits(10.0), rate=1000.0)
        felt = []
        for _ in range(400):
            run(loop, clock, 1)
            felt.append(np.linalg.norm(service.force()))
        loop.end()
    assert loop.device.spelling == "values"
    assert "now trying 'values'" in loop.device_error
    assert max(felt) > 0.5
    # two commands at most lie between two looks; at once it would be 2 N
    assert np.abs(np.diff(felt)).max() < 0.3, "it grew from nothing"


def test_a_service_that_knows_no_spelling_is_refused(clock):
    with serve(clock, spellings=()) as service:
        device = connect(service)
        with pytest.raises(DeviceError, match="now trying"):
            drive(device, clock, 100, force=(0.0, 0.0, 0.5))
        with pytest.raises(DeviceError, match="neither as 'vector' nor as 'values'"):
            drive(device, clock, 100, force=(0.0, 0.0, 0.5))
        with pytest.raises(DeviceError, match="took no force"):
            device.read(clock.time)
        device.close()


@pytest.mark.parametrize("factor", [-1.0, 20.0])
def test_an_echo_of_another_direction_or_size_is_refused(clock, factor):
    with serve(clock) as service:
        service.faults.echo = factor
        device = connect(service)
        with pytest.raises(DeviceError, match="echoes a force"):
            drive(device, clock, 100, force=(0.0, 0.0, 0.5))
        device.close()


def test_forces_too_small_to_be_echoed_prove_nothing(clock):
    with serve(clock, spellings=()) as service:
        device = connect(service)
        drive(device, clock, 200, force=(0.0, 0.0, 0.04))
        assert not device.proven
        device.close()


def test_a_scale_is_refused_or_compensated(clock):
    with serve(clock, force_scale=0.5) as service:
        with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
            connect(service)
        device = connect(service, scale="compensate")
        drive(device, clock, 3, force=(0.0, 0.0, 2.0))
        device.read(clock.time)
        np.testing.assert_allclose(service.force(), [0.0, 0.0, 2.0])
        assert device.proven
        device.close()
    with serve(clock, force_scale=50.0) as service, pytest.raises(DeviceError, match="multiplies"):
        connect(service, scale="compensate")


def test_silence_is_zero_force_within_20_ms_a_reason_and_a_way_back(service, loop, clock):
    run(loop, clock, 300)
    before = loop.device.lost
    loop.device.wait, service.faults.held = 0.0, True
    silent = run(loop, clock, 100)
    late = round(HARDWARE_PATIENCE / TICK)
    assert all(force == 0.0 and fault is Fault.INPUT_STALLED for force, fault in silent[late:])
    assert loop.device.lost > before
    service.release()
    loop.device.wait = 1.0
    again = run(loop, clock, 200)
    assert all(force == 0.0 and fault is Fault.NONE for force, fault in again[5:]), "still in the body"
    assert loop.evaluator.waiting
    forces = np.array([force for force, _ in run(loop, clock, 800)])
    assert forces[-1] > 0.5, "the hand was back at rest after a second"
    assert forces[np.flatnonzero(forces)[:3]].max() < 0.1, "it grew from nothing"
    drive(loop.device, clock, 3)
    assert drive(loop.device, clock, 3)[-1][1] == pytest.approx(TICK), "no answer is left behind"


def test_the_zero_force_of_a_stall_is_sent_although_an_answer_is_outstanding(service, device, clock):
    drive(device, clock, 5, force=(0.0, 0.0, 1.0))
    device.wait, service.faults.held = 0.0, True
    drive(device, clock, 1, force=(0.0, 0.0, 1.0))
    device.write(np.zeros(3))
    service.release()
    device.wait = 1.0
    drive(device, clock, 2)
    np.testing.assert_array_equal(service.force(), np.zeros(3))


def test_lost_and_doubled_answers_are_counted_and_survived(service, device, clock):
    drive(device, clock, 5)
    service.faults.doubled = 3
    drive(device, clock, 20)
    until = now() + 20.0
    while device.surplus < 3 and now() < until:
        device.read(clock.time)
    assert device.surplus == 3
    service.faults.dropped, device.wait = 2, 0.02
    drive(device, clock, 40)
    device.wait = 1.0
    ages = [age for _, age in drive(device, clock, 20)[2:]]
    assert device.lost >= 2
    assert max(ages) == pytest.approx(TICK)


def test_a_force_lapses_when_its_program_is_gone(service, device, clock):
    drive(device, clock, 5, force=(0.0, 0.0, 1.0))
    device.read(clock.time)  # nothing is on its way
    assert service.force()[2] == 1.0
    clock.time += 0.2
    channel = WebsocketChannel(f"ws://127.0.0.1:{service.port}", "service")
    channel.receive(1.0)
    channel.send("{}")
    channel.receive(1.0)
    channel.close()
    np.testing.assert_array_equal(service.force(), np.zeros(3))


def test_closing_sends_zero_and_refuses_more(service, device, clock):
    drive(device, clock, 5, force=(0.0, 0.0, 1.0))
    device.close()
    device.close()
    with pytest.raises(DeviceError, match="is closed"):
        device.write(np.zeros(3))
    service.restart()  # after the last message was obeyed
    np.testing.assert_array_equal(service.force(), np.zeros(3))


def test_a_closed_connection_is_a_fault_with_its_reason(service, loop, clock):
    run(loop, clock, 200)
    service.faults.closing = True
    seen = run(loop, clock, 50)
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[20:])
    assert "Haply Inverse Service" in loop.device_error


def test_a_restarted_service_is_found_by_the_name_of_the_device(clock):
    with serve(clock, devices=("04C2", "0B11")) as service:
        with pytest.raises(DeviceError, match="2 devices: 04C2, 0B11"):
            connect(service)
        device = connect(service, device="0B11")
        drive(device, clock, 5, force=(0.0, 0.0, 1.0))
        assert service.force(1)[2] == 1.0
        service.restart()
        with pytest.raises(DeviceError):
            drive(device, clock, 2)
        device.close()
        device = connect(service, device="0B11")
        drive(device, clock, 5, force=(0.0, 0.0, 2.0))
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


@pytest.mark.parametrize(("name", "data"), STOPPING, ids=str)
def test_events_of_safety_are_zero_force_and_a_reason(service, loop, clock, name, data):
    run(loop, clock, 100)
    service.send_event(name, "as the test wants", **data)
    seen = run(loop, clock, 20)
    kind = Fault.DEVICE_LOST if name == "device-disconnected" else Fault.DEVICE_STOPPED
    assert all(force == 0.0 and fault is kind for force, fault in seen)
    assert data.get("safety_type", name) in loop.device_error
    assert "as the test wants" in loop.device_error


def test_a_released_brake_lets_the_loop_go_on(service, loop, clock):
    run(loop, clock, 100)
    service.send_event("device-safety-triggered", safety_type="ebrake_triggered")
    assert run(loop, clock, 5)[-1] == (0.0, Fault.DEVICE_STOPPED)
    service.send_event("device-safety-triggered", safety_type="ebrake_released")
    assert run(loop, clock, 100)[-1][1] is Fault.NONE


def test_other_events_change_nothing(service, loop, clock):
    run(loop, clock, 100)
    for name in EVENTS.keys() - {n for n, _ in STOPPING}:
        service.send_event(name, "by the way")
    service.send_event("device-safety-triggered", safety_type="fod_stage_changed")
    service.send_event("device-busy", device_id="another")
    assert all(fault is Fault.NONE for _, fault in run(loop, clock, 20))


def test_a_device_that_is_unplugged_is_a_fault(service, loop, clock):
    run(loop, clock, 100)
    service.faults.absent = -1
    seen = run(loop, clock, 20)
    assert all(force == 0.0 and fault is Fault.DEVICE_LOST for force, fault in seen[1:])
    assert "04C2 is no longer there" in loop.device_error
    service.faults.absent = 0
    assert run(loop, clock, 100)[-1][1] is Fault.NONE


def test_a_device_may_be_plugged_in_while_it_is_looked_for(service):
    service.faults.absent = 3
    connect(service, search=5.0).close()
    service.faults.absent = -1
    with pytest.raises(DeviceError, match="0 devices: none"):
        connect(service)


@pytest.mark.parametrize(
    ("fault", "value", "message"),
    [
        ("in_use", True, "in use by another program"),
        ("powered", False, "not power supply"),
        ("calibrated", False, "not calibrated"),
        ("silent_http", True, "does not say how it scales forces"),
        ("deaf", True, "keeps the preset 'defaults'"),
        ("position", (5.0, 0.0, 0.0), "starts at"),
        ("position", (math.nan, 0.0, 0.0), "starts at"),
        ("closing", True, "closed the connection"),
    ],
)
def test_what_is_wrong_at_the_start_is_refused(service, fault, value, message):
    setattr(service.faults, fault, value)
    with pytest.raises(DeviceError, match=message):
        connect(service)
    setattr(service.faults, fault, type(service.faults)().__getattribute__(fault))
    connect(service).close()  # nothing is left that a new start doesn't heal


def test_power_that_is_lost_is_a_fault(service, loop, clock):
    run(loop, clock, 100)
    service.faults.powered = False
    assert run(loop, clock, 5)[-1] == (0.0, Fault.DEVICE_STOPPED)
    assert "power supply" in loop.device_error


def test_places_that_are_no_numbers_or_impossible_are_faults(service, loop, clock):
    run(loop, clock, 100)
    service.faults.position = (math.nan, 0.0, 0.0)
    assert run(loop, clock, 3)[-1] == (0.0, Fault.INPUT_NOT_FINITE)
    service.faults.position = None
    assert run(loop, clock, 100)[-1][1] is Fault.NONE
    service.faults.position = (5.0, 0.0, 0.0)
    seen = run(loop, clock, 6)
    assert seen[1][1] is Fault.NONE, "a single wild sample is passed over"
    assert seen[-1] == (0.0, Fault.DEVICE_ERROR)
    assert "no arm reaches" in loop.device_error.lower()


def test_frames_without_what_is_optional(service, clock):
    service.faults.bare = True
    device = connect(service, spelling="values")
    assert np.isfinite(drive(device, clock, 100, force=(0.0, 0.0, 1.0))[-1][0]).all()
    device.close()


def test_a_dead_mans_button_holds(service, clock):
    device = connect(service, hold="a")
    drive(device, clock, 3)
    assert not device.sample.holding
    service.press("a")
    drive(device, clock, 3)
    assert device.sample.holding
    device.close()


@pytest.mark.parametrize(("hand", "first"), [("a", "b"), ("b", "a")])
def test_the_first_button_that_is_not_the_hand_is_the_dead_mans(service, clock, hand, first):
    device = connect(service, hold=hand)
    service.press(hand, first)
    drive(device, clock, 3)
    assert (device.sample.holding, device.sample.buttons) == (True, 1)
    device.close()


def test_buttons_of_the_grip_reach_the_loop(service, clock):
    device = connect(service, hold="a")
    service.press("a", "c")
    drive(device, clock, 3)
    assert (device.sample.holding, device.sample.buttons) == (True, 0b10)
    service.press("a", "c", down=False)
    drive(device, clock, 3)
    assert (device.sample.holding, device.sample.buttons) == (False, 0)
    device.close()


def test_the_button_of_a_wired_grip_stops_holds_and_is_the_dead_mans(clock, plain, shared):
    """One Boolean named button, where a wireless grip has several by name: nobody saw it pressed."""
    with serve(clock, grip="wired") as service:
        loop = Loop(plain, connect(service), shared, Workspace(0.1, 10.0), Limits(10.0), rate=1000.0)
        assert run(loop, clock, 400)[-1][0] > 0.1
        service.press("button")
        assert run(loop, clock, 3)[-1][0] == 0.0
        assert loop.device.sample.buttons == 1
        loop.end()
        device = connect(service, hold="button")
        assert device.traits.buttons == 0, "the one that there is holds"
        drive(device, clock, 3)
        assert (device.sample.holding, device.sample.buttons) == (True, 0)
        service.press("button", down=False)
        drive(device, clock, 3)
        assert not device.sample.holding
        device.close()


@pytest.mark.parametrize("grip", ["wired", "wireless"])
def test_a_dead_man_button_gives_force_while_it_is_held(clock, plain, shared, grip):
    button = {"wired": "button", "wireless": "a"}[grip]
    with serve(clock, grip=grip) as service:
        limits = Limits(10.0)
        loop = Loop(plain, connect(service), shared, Workspace(0.1, 10.0), limits, rate=1000.0, dead_man=True)
        assert not any(force for force, _ in run(loop, clock, 400))
        service.press(button)
        assert max(force for force, _ in run(loop, clock, 1500)) > 0.1
        service.press(button, down=False)
        assert run(loop, clock, 3)[-1][0] == 0.0
        loop.end()


@pytest.mark.parametrize("field", ["connected", "awake"])
def test_a_grip_that_is_away_holds_nothing(service, clock, field):
    """Its buttons are those of a time ago: pressed for ever."""
    device = connect(service, hold="a")
    service.press("a", "b")
    drive(device, clock, 3)
    assert device.sample.holding
    service.grips["wireless_verse_grip"][0]["status"][field] = False
    drive(device, clock, 3)
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
def test_a_button_to_hold_that_no_grip_has_is_refused(clock, grip, hold, words):
    with serve(clock, grip=grip) as service, pytest.raises(DeviceError, match=words):
        connect(service, hold=hold)


def test_of_two_grips_one_is_named(clock):
    with serve(clock, grip="both") as service:
        device = connect(service, grip=service.grips["verse_grip"][0]["device_id"])
        assert device.traits.buttons == 1
        service.press("a")
        drive(device, clock, 3)
        assert device.sample.buttons == 0
        service.press("button")
        drive(device, clock, 3)
        assert device.sample.buttons == 1
        device.close()


def test_a_grip_whose_buttons_are_not_understood_is_said(clock):
    with serve(clock) as service:
        state = service.grips["wireless_verse_grip"][0]["state"]
        state["keys"] = state.pop("buttons")
        device = connect(service)
        assert "no button in a form that is known" in device.note
        assert device.traits.buttons == 0
        device.close()


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
def test_each_type_has_limits_of_its_own(clock, kind, profile):
    """A Minverse passed for an Inverse3: 10 N and 0.10 m."""
    with serve(clock, kind=kind) as service:
        device = connect(service)
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


def test_a_service_without_the_setting_needs_an_explicit_scale(service, clock):
    """Before version 3.5 nothing tells by how much forces are scaled."""
    service.faults.silent_http = True
    with pytest.raises(DeviceError, match="force_scale=1"):
        connect(service)
    device = connect(service, force_scale=1.0)
    assert "no route /settings/devices/force_scale" in device.note
    drive(device, clock, 3, force=(0.0, 0.0, 2.0))
    device.read(clock.time)
    np.testing.assert_allclose(service.force(), [0.0, 0.0, 2.0])
    device.close()
    with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
        connect(service, force_scale=0.5)


def test_what_the_service_tells_goes_before_an_explicit_scale(clock):
    with serve(clock, force_scale=0.5) as service:
        with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
            connect(service, force_scale=1.0)
        service.faults.plain_http = True
        with pytest.raises(DeviceError, match=r"multiplies every force by 0\.5"):
            connect(service, force_scale=1.0)
    with serve(clock, force_scale=0.0) as service, pytest.raises(DeviceError, match="every force by 0"):
        connect(service, force_scale=1.0)


def test_addresses_that_are_none_of_the_service(service, clock):
    with pytest.raises(DeviceError, match="legacy format"):
        HaplyDevice(
            HaplySettings(f"ws://127.0.0.1:{service.legacy_port}", http=float(service.port), events=0.0)
        )
    with pytest.raises(DeviceError, match="events=0"):
        connect(service, events=9.0)
    connect(service, events=0.0).close()
    with pytest.raises(DeviceError, match="palpate devices simulate haply"):
        HaplyDevice(HaplySettings("ws://127.0.0.1:9"))
    with pytest.raises(UsageError, match="encrypted"):
        WebsocketChannel("wss://localhost:1", "service")
    with pytest.raises(UsageError, match="no address"):
        WebsocketChannel("http://localhost:1", "service")
    taken = SimulatorSettings(port=service.port, events=0)
    with pytest.raises(PortInUseError, match="other ports"):
        HaplySimulator(taken).start()


@pytest.mark.parametrize(
    "options", ["spelling=both", "scale=2", "http=1.5", "wait=2", "wait=nan", "force_scale=20"]
)
def test_options_out_of_range(shared, options):
    with pytest.raises(UsageError):
        device_named(f"haply:{options}", shared.command)


def test_a_force_that_is_no_number_is_not_sent(device):
    with pytest.raises(DeviceError, match="not a finite number"):
        device.write(np.array([math.nan, 0.0, 0.0]))


def test_the_double_refuses_slips_of_units(service, device, clock):
    drive(device, clock, 3, force=(0.0, 0.0, 5000.0))
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
            until, force = now() + 20.0, 0.0
            while now() < until and force < 0.2:
                time.sleep(0.01)
                force = loop.read().force[1]
            assert "unknown type" in loop.read().device
            assert "least of each limit" in loop.report().device_note, "while it runs"
    assert force >= 0.2, "the hand goes down and is pushed up"
    assert loop.report().foreign == ()
