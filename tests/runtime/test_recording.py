"""Recorded touches and their replay, on time that the test makes: every force comes out again to the last bit."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import held
import pressed
from models import spring_beam
from palpate.devices import device_named, device_traits
from palpate.devices.device import Sample, Traits
from palpate.devices.page import PageDevice
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.devices.stroke import StrokeDevice, StrokeSettings
from palpate.devices.trace_file import read_trace
from palpate.errors import DeviceError, UsageError
from palpate.runtime.loop import Loop
from palpate.runtime.publisher import Publisher
from palpate.runtime.recorder import TraceRecorder
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.replay import Replay, loop_facts, play
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import touchable
from palpate.surrogates.memories import Relaxation

LIMITS = Limits(12.0)


class Recorded:
    """A loop under the test's clock, whose recording goes to a file."""

    def __init__(self, path, body, device, shared=None, *, rate=1000.0, before=0, **options):
        self.body, self.shared = body, shared or Shared.private()
        self.ring = Ring.private(rate)
        self.loop = Loop(
            body, device, self.shared, body.workspace(0.075), LIMITS,
            rate=rate, stiffness=body.stiffness_max, recorder=TickRecorder(self.ring), **options,
        )  # fmt: skip
        self.ring.describe(loop_facts(body, self.loop, LIMITS))
        self.k = 0
        self.tick(before)
        self.recorder = TraceRecorder(self.ring, path, {"device": "test"})
        self.loop.recorder.begin(self.loop)
        self.recorder.start()
        self.path = path

    def tick(self, count, **options):
        for _ in range(count):
            self.loop.tick(5.0 + self.loop.period * (self.k + 1e-3 * (self.k % 7)), 1e-6 * self.k, **options)
            self.k += 1

    def trace(self):
        self.recorder.stop()
        assert self.recorder.error is None
        return read_trace(self.path)


def hand(**settings):
    return SimulatedHand(SimulatedSettings(**settings))


BODIES = {
    "beam": lambda: spring_beam(200.0),
    "stiff block": lambda: pressed.surrogate(factor=50.0),
    "relaxing block": lambda: pressed.surrogate(factor=50.0, memory=Relaxation(((0.4, 0.1),))),
    "yielding rod": held.yielding_rod,
    "rubbed block": lambda: pressed.surrogate(factor=50.0, memory=Relaxation(((0.4, 0.1),))).with_friction(
        0.3, 0.4
    ),
}


def assert_same(trace, body):
    replayed = Replay(trace, body).run()
    assert replayed.identical, str(replayed)
    assert "to the last bit" in str(replayed)
    assert np.abs(trace.ticks["force"]).max() > 1e-3, "something was felt"


@pytest.mark.full
@pytest.mark.parametrize("before", [0, 400])
@pytest.mark.parametrize("name", list(BODIES))
def test_a_simulated_hand_is_replayed_to_the_last_bit(name, before, tmp_path):
    """From the loop's first tick, and from the midst of a touch; with the controller at work, and a late device."""
    body = touchable(BODIES[name]())
    aim = body.stroke(body.workspace(0.075).scale)
    touch = Recorded(
        tmp_path / "a.trace", body, hand(shape="adversarial", delay=0.003, step=1e-5, **aim),
        rate=500.0, override=True, before=before,
    )  # fmt: skip
    touch.tick(600)
    trace = touch.trace()
    assert len(trace) == 600
    assert trace.lost == 0
    assert_same(trace, body)
    if name == "stiff block":
        assert trace.ticks["ledger"][:, 2].max() > 0.0, "damping was added"


def test_a_slide_whose_friction_a_slider_changes_is_replayed(tmp_path):
    """A page that drags a tool over a block, while the coefficient goes from 0 to twice its value and back."""
    block = pressed.surrogate(factor=50.0, memory=Relaxation(((0.4, 0.1),)))
    body = touchable(block.with_friction(0.3, 0.4))
    shared = Shared.private()
    touch = Recorded(tmp_path / "a.trace", body, PageDevice(shared.command), shared)
    for frame in range(40):
        turn = 2 * np.pi * frame / 40
        target = 0.01 * np.array([np.sin(turn), -1.0, np.cos(turn)])  # the hand's y points up
        shared.write_command(
            beat=5.0 + touch.k * touch.loop.period, period=0.02, grabbed=True, target=target,
            parameters=[0.3 - 0.3 * np.cos(turn)],
        )  # fmt: skip
        touch.tick(15)
    trace = touch.trace()
    assert len(np.unique(trace.parameters[:, -1])) > 10
    sideways = np.abs(trace.ticks["force"][:, [0, 2]]).max(axis=1)
    assert sideways.max() > 0.1 * np.abs(trace.ticks["force"]).max()
    assert_same(trace, body)


def test_a_page_drive_with_pauses_and_moved_parameters_is_replayed(tmp_path):
    """Grabs, releases, a hidden tab, silence, and a slider: a page in the hands of a child."""
    body = touchable(held.pad())
    shared = Shared.private()
    touch = Recorded(tmp_path / "a.trace", body, PageDevice(shared.command), shared)
    rng = np.random.default_rng(0)
    for frame in range(60):
        now = 5.0 + touch.k * touch.loop.period
        if frame not in range(40, 50):
            shared.write_command(
                beat=now, period=0.02, grabbed=frame % 17 > 2, hidden=frame in {25, 26},
                target=rng.uniform(-0.03, 0.03, 3), parameters=[rng.uniform(-0.02, 0.02), 0.0],
            )  # fmt: skip
        touch.tick(15)
    trace = touch.trace()
    assert len(np.unique(trace.parameters[:, 0])) > 20
    assert trace.flag("stalled").any()
    assert_same(trace, body)


class Troubled:
    """A stroke whose driver fails, loses numbers, presses a clutch and refuses forces now and then."""

    traits = Traits(0.075, 12.0, 0.5, "a test", axes=((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))

    def __init__(self):
        self.sample, self.count = Sample(), 0
        self.sample.holding = True

    def read(self, now):
        self.count += 1
        if self.count % 97 == 0:
            raise DeviceError("unplugged")
        self.sample.time = now - 1e-3 * (self.count % 3)
        self.sample.position[:] = 0.03 * np.sin(0.02 * self.count + np.arange(3))
        self.sample.clutched = 300 < self.count < 340
        self.sample.holding = self.count % 211 > 10
        if self.count % 131 == 0:
            self.sample.position[1] = np.nan
        return self.sample

    def write(self, force):
        if self.count % 53 == 0:
            raise OSError("no room in the pipe")

    def close(self):
        pass


@pytest.mark.full
@pytest.mark.parametrize("name", ["beam", "relaxing block"])
def test_faults_are_replayed_as_they_came(name, tmp_path):
    body = touchable(BODIES[name]())
    touch = Recorded(tmp_path / "a.trace", body, Troubled())
    touch.tick(500)
    touch.tick(1, jumped=True)
    touch.tick(100)
    trace = touch.trace()
    assert len(np.unique(trace.ticks["fault"])) >= 4
    assert trace.flag("write_failed").any()
    assert trace.flag("clutched").any()
    assert_same(trace, body)


def test_every_slot_of_a_sample_is_recorded():
    """One that the loop learns to heed must be recorded too, or a replay goes its own way."""
    figures = {"position", "orientation", "time", "patience", "holding", "clutched", "asleep"}
    as_flags = {"buttons", "stop"}  # what they ask for: stopped, released
    assert set(Sample.__slots__) == figures | as_flags


@pytest.mark.full
def test_stops_and_a_dead_man_button_are_replayed(tmp_path):
    body, shared = touchable(spring_beam(200.0)), Shared.private()
    device = StrokeDevice(StrokeSettings(frequency=2.0))
    touch = Recorded(tmp_path / "a.trace", body, device, shared, dead_man=True)
    for k in range(60):
        device.sample.buttons = 0 if k % 20 == 7 else 1
        device.sample.stop = k == 25
        shared.write_command(stop=k == 40, resume=k in {27, 43})
        touch.tick(20)
    trace = touch.trace()
    for name in ("stopped", "released", "waiting"):
        assert 0.0 < trace.flag(name).mean() < 0.5
    assert_same(trace, body)


def test_a_recording_that_begins_during_a_stop_is_replayed(tmp_path):
    body, shared = touchable(spring_beam(200.0)), Shared.private()
    for wish in ({"stop": True}, {"resume": True}, {"stop": True}):
        shared.write_command(**wish)
    device = StrokeDevice(StrokeSettings(frequency=2.0))
    touch = Recorded(tmp_path / "a.trace", body, device, shared, before=200)
    assert touch.loop.stop.stopped
    touch.tick(50)
    shared.write_command(resume=True)
    touch.tick(500)
    trace = touch.trace()
    assert 0.0 < trace.flag("stopped").mean() < 0.2
    assert_same(trace, body)


def test_another_body_under_the_same_hand_differs_and_says_by_how_much(tmp_path):
    body = touchable(spring_beam(200.0))
    touch = Recorded(tmp_path / "a.trace", body, StrokeDevice(StrokeSettings(frequency=2.0)))
    touch.tick(300)
    trace = touch.trace()
    replayed = Replay(trace, touchable(spring_beam(210.0)), same=False).run()
    assert not replayed.identical
    force = np.abs(trace.ticks["force"]).max()
    assert 0.0 < replayed.largest == pytest.approx(0.05 * force, rel=0.1)
    assert f"{replayed.differing.size} forces differ" in str(replayed)
    assert replayed.as_dict()["first"] == replayed.differing[0]


def test_a_recorded_hand_drives_another_body(tmp_path):
    """At the recorded places, in straight lines between them, twice as fast where that is asked for."""
    body = touchable(spring_beam(200.0))
    touch = Recorded(tmp_path / "a.trace", body, StrokeDevice(StrokeSettings(frequency=2.0)))
    touch.tick(400)
    trace = touch.trace()
    hand = device_named(f"trace:file={trace.path}", Shared.private().command)
    assert hand.traits.radius == 0.075
    assert device_traits(f"trace:file={trace.path}") == hand.traits
    for k in (0, 1, 200, 399):
        np.testing.assert_allclose(
            hand.read(2.0 + trace.time[k]).position, trace.ticks["hand"][k], atol=1e-15
        )
        assert hand.sample.holding
    assert not hand.read(2.0 + trace.time[-1] + 0.01).holding
    fast = device_named(f"trace:file={trace.path},speed=2,repeat=1", Shared.private().command)
    fast.read(0.0)
    middle = (trace.ticks["hand"][100] + trace.ticks["hand"][101]) / 2
    seen = fast.read((trace.time[100] + trace.time[101]) / 4).position
    np.testing.assert_allclose(seen, middle, atol=1e-12)
    assert fast.read(trace.time[-1]).holding
    other = touchable(spring_beam(100.0))
    loop = Loop(other, hand := device_named(f"trace:file={trace.path}", Shared.private().command),
                Shared.private(), other.workspace(hand.traits.radius), LIMITS)  # fmt: skip
    loop.run_for(0.4)
    assert loop.fault is Fault.NONE
    with pytest.raises(UsageError, match="the file of a recorded touch"):
        device_named("trace:speed=2", Shared.private().command)


@pytest.mark.full
def test_a_ring_that_nobody_empties_counts_what_it_loses():
    ring = Ring.private(1000.0)
    loop = Loop(
        body := touchable(spring_beam()), StrokeDevice(), Shared.private(), body.workspace(0.075), LIMITS,
        recorder=TickRecorder(ring),
    )  # fmt: skip
    ring.asked[()] = 1
    loop.recorder.begin(loop)
    loop.run_for(0.1)
    assert ring.take()["tick"].tolist() == list(range(1, 101))
    loop.run_for(1e-3 * (ring.length + 50))
    rows = ring.take()
    assert ring.lost == 51
    assert len(rows) == ring.length - 1
    assert (np.diff(rows["tick"]) == 1).all()


def test_a_torn_tick_waits_for_its_rest():
    ring = Ring.private()
    loop = Loop(
        body := touchable(spring_beam()), StrokeDevice(), Shared.private(), body.workspace(0.075), LIMITS,
        recorder=TickRecorder(ring),
    )  # fmt: skip
    ring.asked[()] = 1
    loop.recorder.begin(loop)
    loop.run_for(0.01)
    whole = ring.slots[7].copy()
    ring.slots[7, 40] ^= 255
    assert len(ring.take()) == 7
    ring.slots[7] = whole
    assert ring.take()["tick"].tolist() == [8, 9, 10]
    assert ring.lost == 0


@pytest.mark.full
def test_a_replay_that_is_looked_at_has_faults_at_its_own_time_and_ends_within_a_gap(tmp_path):
    shared = Shared.private()
    out = Publisher(shared, 0)
    out.offset = 100.0
    out.tick(5.0, 0.0, Fault.DEVICE_ERROR)
    assert shared.read_state().onsets == ((105.0, Fault.DEVICE_ERROR),)
    touch = Recorded(tmp_path / "a.trace", body := touchable(spring_beam(200.0)), hand())
    touch.tick(20)
    trace = touch.trace()
    ticks = trace.ticks.copy()
    ticks["time"][1:] += 1e6  # the machine slept
    asked, shared = itertools.count(), Shared.private()
    play(replace(trace, ticks=ticks), body, shared, lambda: next(asked) > 20)
    assert shared.read_state().tick == 1
