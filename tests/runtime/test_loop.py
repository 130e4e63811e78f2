"""The tick, stage by stage, on time that the test makes: every rule is counted in ticks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.devices.device import Sample, Traits
from palpate.devices.hand_kind import HandKind
from palpate.devices.page import PageDevice
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.devices.tick_record import MAX_INPUTS
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError, UsageError
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.workspace import Workspace
from palpate.units import Range
from standins import STIFFNESS, PlainModel

TICK = 1e-3
WORKSPACE = Workspace.for_reach(0.075, 0.25)
LIMITS = Limits(8.0)
RAMP = 50  # ticks


class Handle:
    """Hardware as the test wants it."""

    traits = Traits(0.075, 8.0, 1.0, "made up")

    def __init__(self):
        self.sample = Sample()
        self.sample.holding = True
        self.sample.position[:] = (0.0, -0.03, 0.0)
        self.silent, self.read_error, self.write_error = False, None, None
        self.sent, self.closed = None, 0

    def read(self, now):
        if self.read_error is not None:
            raise self.read_error
        if not self.silent:
            self.sample.time = now
        return self.sample

    def write(self, force):
        if self.write_error is not None:
            raise self.write_error
        self.sent = force.copy()

    def close(self):
        self.closed += 1


class Bench:
    """A loop with its clock wound by hand; `ticks` returns the published states."""

    def __init__(self, model, device, shared, **options):
        self.shared, self.device, self.now = shared, device, 10.0
        self.loop = Loop(model, device, shared, WORKSPACE, LIMITS, **options)

    def ticks(self, count, *, jumped=False):
        states = []
        for _ in range(count):
            self.now += TICK
            self.loop.tick(self.now, 1e-6, jumped=jumped)
            states.append(self.shared.read_state())
        return states

    def grab(self):
        """Take hold anew: nothing is held for one tick."""
        self.device.sample.holding = False
        self.ticks(1)
        self.device.sample.holding = True

    def come_back(self):
        """The hand is still in the body, and feels nothing; then it lets go and takes hold anew."""
        states = self.ticks(20)
        assert zero(states)
        assert all(state.waiting and state.fault == Fault.NONE for state in states)
        assert Fault(states[-1].withheld).meaning_for(HandKind.DEVICE) in states[-1].reason()
        self.grab()

    def settle(self):
        last = self.ticks(RAMP + 80)[-1]
        assert np.linalg.norm(last.force) > 0.5
        return last


@pytest.fixture
def handle():
    return Handle()


@pytest.fixture
def bench(plain, handle, shared):
    bench = Bench(plain, handle, shared)
    bench.grab()
    return bench


@pytest.fixture
def page(plain, shared):
    bench = Bench(plain, PageDevice(shared.command), shared)
    shared.write_command(beat=bench.now + 1.0, period=0.03, grabbed=True, target=(0.0, -0.03, 0.0))
    return bench


def zero(states):
    return all(not state.force.any() for state in states)


def sizes(states):
    return np.array([np.linalg.norm(state.force) for state in states])


def assert_ramps_in(states, full):
    """From zero, at most linearly over the ramp, to the full force."""
    shares = sizes(states) / full
    assert shares[0] == 0.0
    assert (shares <= np.arange(len(shares)) / RAMP + 1e-9).all()
    assert shares[-1] == pytest.approx(1.0)


def test_the_hand_feels_the_body(bench):
    state = bench.settle()
    np.testing.assert_allclose(state.position, state.hand * WORKSPACE.scale)
    np.testing.assert_allclose(state.force, -STIFFNESS * state.position)
    np.testing.assert_allclose(bench.device.sent, state.force)
    assert (state.fault, state.faults, state.stalled, state.grabbed) == (0, 0, False, True)
    assert state.tick == 1 + RAMP + 80
    assert (state.waiting, state.stopped, state.released, state.reason()) == (False, False, False, "")
    assert state.scale == WORKSPACE.scale


def test_a_grab_ramps_in(bench):
    states = bench.ticks(RAMP + 5)
    assert_ramps_in(states, STIFFNESS * 0.03 * WORKSPACE.scale)


def test_a_strong_body_is_clamped_and_counted(bench, plain):
    plain.answer.spring = 1000.0
    states = bench.ticks(200)
    np.testing.assert_allclose(states[-1].force, [0.0, LIMITS.max_force, 0.0])
    assert states[-1].clamped
    assert states[-1].clamped_ticks == 200


def test_a_device_with_motors_starts_without_force_in_the_middle_of_a_body(plain, handle, shared):
    bench = Bench(plain, handle, shared)
    states = bench.ticks(100)
    assert zero(states)
    assert states[-1].waiting
    assert "out of the body" in states[-1].reason()
    for y in np.arange(-0.03, -0.0025, 0.001):
        handle.sample.position[1] = y
        state = bench.ticks(1)[0]
        assert state.waiting == (y < -0.05 * 0.075), "as good as at rest"


BREAK = {
    Fault.INPUT_NOT_FINITE: lambda b, m: b.device.sample.position.__setitem__(2, math.inf),
    Fault.OUTPUT_NOT_FINITE: lambda b, m: setattr(m.answer, "poison", math.nan),
    Fault.EVALUATOR_ERROR: lambda b, m: setattr(m.answer, "error", ZeroDivisionError()),
    Fault.DEVICE_ERROR: lambda b, m: setattr(b.device, "read_error", OSError("cable")),
    Fault.INPUT_STALLED: lambda b, m: setattr(b.device.sample, "asleep", True),
}
MEND = {
    Fault.INPUT_NOT_FINITE: lambda b, m: b.device.sample.position.__setitem__(2, 0.0),
    Fault.OUTPUT_NOT_FINITE: lambda b, m: setattr(m.answer, "poison", 0.0),
    Fault.EVALUATOR_ERROR: lambda b, m: setattr(m.answer, "error", None),
    Fault.DEVICE_ERROR: lambda b, m: setattr(b.device, "read_error", None),
    Fault.INPUT_STALLED: lambda b, m: setattr(b.device.sample, "asleep", False),
}


@pytest.mark.parametrize("fault", list(BREAK), ids=lambda f: f.name.lower())
def test_a_fault_is_zero_force_a_record_and_a_ramp(bench, plain, fault):
    full = np.linalg.norm(bench.settle().force)
    BREAK[fault](bench, plain)
    bad = bench.ticks(30)
    assert zero(bad), "from the very tick"
    assert not bench.device.sent.any()
    assert {state.fault for state in bad} == {fault}
    assert bad[-1].faults == 1, "one onset, not thirty"
    assert bad[-1].fault_counts[fault] == 1
    for state in bad:
        numbers = [*state.hand, *state.position, *state.contact, *state.loads]
        assert np.isfinite(numbers).all(), "what is published stays finite"
    assert bad[-1].onsets == ((bad[0].time, fault),)
    assert fault.meaning_for(HandKind.DEVICE) in bad[-1].reason()
    MEND[fault](bench, plain)
    bench.come_back()
    good = bench.ticks(RAMP + 30)
    assert_ramps_in(good, full)
    assert good[0].withheld == Fault.NONE
    assert (good[0].fault, good[-1].last_fault, good[-1].faults) == (Fault.NONE, fault, 1)


def test_a_clock_jump_is_a_fault(bench):
    full = np.linalg.norm(bench.settle().force)
    assert zero(bench.ticks(1, jumped=True))
    bench.come_back()
    after = bench.ticks(RAMP + 30)
    assert after[-1].last_fault == Fault.CLOCK_JUMP
    assert_ramps_in(after, full)


def test_a_force_that_was_not_delivered_is_not_claimed(bench):
    bench.settle()
    bench.device.write_error = DeviceError("The motor amplifier is off.")
    states = bench.ticks(5)
    assert zero(states)
    assert states[-1].fault == Fault.DEVICE_ERROR


@pytest.mark.parametrize(
    "error", [KeyError("axis"), RuntimeError("driver"), AttributeError("x"), MemoryError()]
)
def test_whatever_a_driver_raises_the_loop_goes_on(bench, error):
    full = np.linalg.norm(bench.settle().force)
    bench.device.read_error, bench.device.write_error = error, RuntimeError("and again")
    bad = bench.ticks(5)
    assert zero(bad)
    assert bad[-1].fault_counts[Fault.DEVICE_ERROR] == 1
    assert bench.loop.device_error == f"{type(error).__name__}: {error}"
    bench.device.read_error = bench.device.write_error = None
    bench.come_back()
    assert_ramps_in(bench.ticks(RAMP + 30), full)


@pytest.mark.parametrize("step", [-0.5, 0.021, 1.0, math.nan], ids=["back", "21 ms", "1 s", "no number"])
def test_the_loop_sees_a_jump_of_the_clock_itself(bench, step):
    bench.settle()
    bench.now += step
    state = bench.ticks(1)[0]
    assert state.fault == Fault.CLOCK_JUMP
    assert not bench.device.sent.any()


@pytest.mark.parametrize(
    ("error", "fault"),
    [
        (DeviceLostError("The cable is out."), Fault.DEVICE_LOST),
        (ConnectionResetError("reset by peer"), Fault.DEVICE_LOST),
        (DeviceStopError("The brake is on."), Fault.DEVICE_STOPPED),
        (DeviceError("Busy."), Fault.DEVICE_ERROR),
    ],
    ids=["lost", "reset", "stopped", "error"],
)
def test_drivers_say_what_became_of_the_device(bench, error, fault):
    bench.settle()
    bench.device.read_error = error
    state = bench.ticks(3)[-1]
    assert (state.fault, state.words) == (fault, str(error))
    assert str(error) in state.reason()


def test_an_impossible_place_is_passed_over_once_and_a_fault_when_it_lasts(bench):
    full = bench.settle().force.copy()
    bench.device.sample.position[:] = (0.0, -0.03, 0.5)
    states = bench.ticks(2)
    assert all(state.fault == Fault.NONE for state in states)
    np.testing.assert_allclose(states[-1].force, full, err_msg="the last good place stays")
    bench.device.sample.position[:] = (0.0, -0.03, 0.0)
    np.testing.assert_allclose(bench.ticks(20)[-1].force, full)  # the count of doubts is empty again
    bench.device.sample.position[:] = (0.0, -0.03, 0.5)
    states = bench.ticks(30)
    assert [state.fault for state in states[:3]] == [Fault.NONE, Fault.NONE, Fault.IMPOSSIBLE_PLACE]
    assert zero(states[2:])
    assert states[-1].fault == Fault.IMPOSSIBLE_PLACE, "as long as it is out of reach"
    bench.device.sample.position[:] = (0.0, -0.03, 0.0)
    bench.ticks(12)  # until the count of doubts has leaked below three
    bench.come_back()
    assert_ramps_in(bench.ticks(RAMP + 30), np.linalg.norm(full))


def test_a_leap_within_reach_is_a_fault_and_then_the_new_place(bench):
    bench.settle()
    bench.device.sample.position[:] = (0.0, 0.03, 0.0)
    states = bench.ticks(30)
    assert states[2].fault == Fault.IMPOSSIBLE_PLACE
    assert states[-1].fault == Fault.NONE
    assert states[-1].waiting
    assert zero(states[2:])


def test_places_to_and_fro_are_a_fault_as_long_as_they_last(bench):
    bench.settle()
    states = []
    for tick in range(200):
        bench.device.sample.position[1] = -0.03 + 0.02 * (tick % 2)
        states += bench.ticks(1)
    first = next(k for k, state in enumerate(states) if state.fault != Fault.NONE)
    assert first < 12
    assert {state.fault for state in states[first:]} == {Fault.IMPOSSIBLE_PLACE}
    assert zero(states[first:])


def test_beyond_the_workspace_nothing_pushes(bench):
    bench.settle()
    sample = bench.device.sample
    for _ in range(20):
        sample.position[1] -= 0.0045
        state = bench.ticks(1)[0]
        assert state.force.any() == (sample.position[1] > -1.25 * 0.075)
    assert state.last_fault == Fault.OUT_OF_REGION
    assert state.faults == 1
    assert state.waiting


def test_a_stop_lasts_until_it_is_resumed_and_the_hand_has_left_the_body(bench):
    full = np.linalg.norm(bench.settle().force)
    bench.shared.write_command(stop=True)
    states = bench.ticks(200)
    assert zero(states)
    assert states[-1].stopped
    assert states[-1].fault_counts[Fault.STOPPED] == 1
    assert "resume" in states[-1].reason()
    bench.grab()
    assert zero(bench.ticks(100)), "letting go is no leave to push"
    bench.shared.write_command(stop=True, resume=True)
    assert bench.ticks(1)[0].stopped, "of both the stop counts"
    bench.shared.write_command(resume=True)
    bench.ticks(1)
    bench.come_back()
    assert_ramps_in(bench.ticks(RAMP + 30), full)


@pytest.mark.parametrize("way", ["switch", "button"])
def test_the_device_stops_the_force_by_its_own_buttons(bench, way):
    bench.settle()
    sample = bench.device.sample
    if way == "switch":
        sample.stop = True
    else:
        sample.buttons = 0b100
    assert zero(bench.ticks(1))
    sample.stop, sample.buttons = False, 0
    states = bench.ticks(100)
    assert zero(states)
    assert states[-1].stopped, "a stop needs no held button"


def test_with_a_dead_man_button_there_is_force_only_while_it_is_held(plain, handle, shared):
    bench = Bench(plain, handle, shared, dead_man=True)
    bench.grab()
    states = bench.ticks(100)
    assert zero(states)
    assert states[-1].released
    assert "dead-man" in states[-1].reason()
    handle.sample.buttons = 1
    assert zero(bench.ticks(20)), "pressed in the middle of the body"
    bench.grab()
    full = np.linalg.norm(bench.settle().force)
    handle.sample.buttons = 0
    assert zero(bench.ticks(1))
    handle.sample.buttons = 1
    bench.grab()
    assert_ramps_in(bench.ticks(RAMP + 30), full)
    assert bench.shared.read_state().faults == 0


def test_a_driver_that_reports_no_position_is_a_fault(bench):
    bench.settle()
    bench.device.sample.position = None
    assert zero(bench.ticks(2))
    assert bench.shared.read_state().fault == Fault.DEVICE_ERROR


def test_a_driver_that_fails_at_the_end_is_closed_all_the_same(bench):
    bench.device.write_error = RuntimeError("unplugged")
    bench.loop.end()
    assert bench.device.closed == 1
    assert bench.loop.device_error == "RuntimeError: unplugged"


def test_silent_hardware_gets_zero_force_within_20_ms(bench):
    bench.settle()
    bench.device.silent = True
    heard = bench.now
    states = bench.ticks(40)
    assert states[0].time - heard < 0.020 < states[-1].time - heard
    for state in states:
        age = state.time - heard
        if age > 0.019 + 1e-9:
            assert not state.force.any(), "the next tick would be too late"
            assert state.stalled
            assert state.fault == Fault.INPUT_STALLED
        elif age < 0.019 - 1e-9:
            assert state.force.any(), "no sooner than agreed"


def test_the_delay_is_the_mean_age_of_fresh_samples(plain, handle, shared):
    bench = Bench(plain, handle, shared)
    bench.device.silent, bench.device.sample.holding = True, False
    bench.ticks(5)
    assert bench.shared.read_state().delay == 0.0, "a device that was never heard of has no age"
    bench.device.sample.holding = True
    for k in range(1000):
        bench.device.sample.time = bench.now + TICK - (0.002 if k % 2 else 0.004)
        bench.ticks(1)
    assert bench.shared.read_state().delay == pytest.approx(0.003, rel=0.05)


def test_a_clutch_is_no_force_and_no_fault(bench):
    full = np.linalg.norm(bench.settle().force)
    bench.device.sample.clutched = True
    bench.device.sample.position[:] = 0.02
    states = bench.ticks(5)
    assert zero(states)
    assert states[-1].faults == 0
    bench.device.sample.clutched = False
    assert_ramps_in(bench.ticks(RAMP + 90), full)


@pytest.mark.parametrize(("period", "limit"), [(0.01, 0.100), (0.05, 0.150)])
def test_a_page_that_falls_silent(page, period, limit):
    page.settle()
    heard = page.now
    page.shared.write_command(beat=heard, period=period)
    states = page.ticks(200)
    assert states[0].time - heard < limit < states[-1].time - heard
    for state in states:
        age = state.time - heard
        if age > limit + 1e-9:
            assert not state.force.any()
            assert state.stalled
        elif age < limit - 1e-9:
            assert state.force.any()


def test_a_resting_mouse_is_no_stall(page):
    page.settle()
    for _ in range(50):  # 1.5 s of heartbeats without a single new target
        page.shared.write_command(beat=page.now)
        assert sizes(page.ticks(30)).min() > 0.5


def test_a_hidden_tab_is_a_stall_at_once(page):
    full = np.linalg.norm(page.settle().force)
    page.shared.write_command(hidden=True)
    states = page.ticks(10)
    assert zero(states)
    assert {state.fault for state in states} == {Fault.INPUT_STALLED}
    page.shared.write_command(hidden=False, beat=page.now + 1.0)
    assert zero(page.ticks(20))
    page.shared.write_command(grabbed=False)
    page.ticks(1)
    page.shared.write_command(grabbed=True)
    assert_ramps_in(page.ticks(RAMP + 30), full)


def test_letting_go_is_zero_and_no_fault(page):
    page.settle()
    page.shared.write_command(grabbed=False, beat=0.0)
    states = page.ticks(300)
    assert zero(states)
    assert states[-1].faults == 0, "nothing held, nothing at fault, even without heartbeats"
    assert states[-1].stalled
    assert not states[-1].grabbed
    assert np.linalg.norm(states[-1].contact) < 1e-3, "the drawn body springs back"


def test_parameters_start_in_the_middle_and_follow_the_page(handle, shared):
    model = PlainModel([Range("p", 0.0, 4.0, "N"), Range("q", -1.0, 3.0, "N")])
    bench = Bench(model, handle, shared)
    bench.ticks(1)
    assert model.answer.seen.tolist() == [2.0, 1.0]
    shared.write_command(parameters=[3.5])
    bench.ticks(1)
    assert model.answer.seen.tolist() == [3.5, 1.0]


@pytest.mark.full
def test_orphans_stop_and_let_go(plain, handle, shared):
    gone = []
    loop = Loop(plain, handle, shared, WORKSPACE, LIMITS, rate=2000.0, orphaned=lambda: bool(gone))
    gone.append(True)
    loop.run()
    state = shared.read_state()
    assert state.last_fault == Fault.PARENT_GONE
    assert not state.force.any()
    assert not handle.sent.any()
    assert handle.closed == 1


@pytest.mark.full
def test_an_unforeseen_error_still_lets_go(plain, handle, shared):
    plain.answer.error = SystemExit()  # as a signal that ends the process raises it, wherever it strikes
    loop = Loop(plain, handle, shared, WORKSPACE, LIMITS)
    with pytest.raises(SystemExit):
        loop.run()
    assert not handle.sent.any()
    assert handle.closed == 1


def test_refuses_what_it_cannot_do(plain, handle, shared):
    for rate in (0.0, -1.0, math.nan, 1e6):
        with pytest.raises(UsageError, match="Hz"):
            Loop(plain, handle, shared, WORKSPACE, LIMITS, rate=rate)
    many = PlainModel([Range(f"p{i}", 0.0, 1.0) for i in range(MAX_INPUTS + 1)])
    with pytest.raises(UsageError, match="carries 8"):
        Loop(many, handle, shared, WORKSPACE, LIMITS)


def test_every_fault_has_its_meaning():
    meanings = {fault.meaning for fault in Fault}
    assert len(meanings) == len(Fault)
    assert len(Fault) <= 16, "the shared memory counts 16 kinds"


@pytest.mark.parametrize(("rate", "delay"), [(20.0, 0.0), (100.0, 0.010), (200.0, 0.015), (1000.0, 0.015)])
def test_slow_loops_and_late_devices_are_no_faults(plain, shared, rate, delay):
    """What a device is late by its nature is no stall, at any rate."""
    hand = SimulatedHand(SimulatedSettings(delay=delay))
    loop = Loop(plain, hand, shared, WORKSPACE, LIMITS, rate=rate)
    loop.run_for(2.0)
    assert shared.read_state().faults == 0


def test_whatever_a_driver_says_and_a_body_raises_stays_in_the_loop(bench, plain):
    bench.settle()
    bench.device.read_error = DeviceError(
        "the bridge complains: \ud800"
    )  # as JSON may spell it, and no encoding
    states = bench.ticks(3)
    assert zero(states)
    assert states[-1].fault == Fault.DEVICE_ERROR
    assert "the bridge complains: ?" in states[-1].reason()
    assert "complains: ?" in bench.loop.device_error
    bench.device.read_error = None
    bench.grab()
    bench.settle()
    plain.answer.error = KeyError("a body of foreign code")
    states = bench.ticks(3)
    assert zero(states)
    assert states[-1].fault == Fault.EVALUATOR_ERROR
