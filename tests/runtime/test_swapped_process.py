"""Swaps in the real process: recorded, replayed, refused, and one after the other."""

from __future__ import annotations

import os
import signal
import threading

import pytest

import held
import pressed
from palpate.devices.trace_file import read_trace
from palpate.errors import DeviceError, FileFormatError, UsageError
from palpate.runtime import Fault, LoopProcess
from palpate.runtime.replay import Replay, is_recorded_model
from palpate.runtime.touchable import load_touchable
from waiting import wait_for


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bodies")
    return {
        factor: pressed.surrogate(factor=factor).save(folder / f"{factor}.palpate")
        for factor in (1.0, 1.5, 0.8)
    }


def other_faults(state):
    """The count of all faults but jumps of a busy machine's clock."""
    return state.faults - state.fault_counts[Fault.CLOCK_JUMP]


@pytest.mark.full
def test_surrogates_take_over_while_the_loop_ticks_and_are_replayed(files, tmp_path):
    whole, part = tmp_path / "whole.trace", tmp_path / "part.trace"
    with LoopProcess(files[1.0], device="simulated:frequency=3", record=whole) as loop:
        wait_for(lambda: loop.recording.ticks > 300)
        first = loop.swap(files[1.5])
        assert loop.read().blending or loop.read().swaps == 1
        second = loop.swap(files[0.8], seconds=0.1)
        assert second - first >= 200, "a second one waits for the first"
        wait_for(lambda: loop.read().swaps == 2)
        loop.stop_recording()
        loop.start_recording(part)
        wait_for(lambda: loop.recording.ticks > 200)
        assert other_faults(loop.read()) == 0
    trace = read_trace(whole)
    assert [event["loop_tick"] for event in trace.events if event["kind"] == "swap"] == [first, second]
    assert is_recorded_model(trace, files[1.0])
    replayed = Replay(trace, load_touchable(files[1.0])).run()
    assert replayed.identical, str(replayed)
    trace = read_trace(part)
    assert is_recorded_model(trace, files[0.8]), (
        "a later recording tells of the surrogate that it begins with"
    )
    assert Replay(trace, load_touchable(files[0.8])).run().identical


@pytest.mark.full
def test_what_can_not_take_over_leaves_the_old_body_in_the_hand(files, tmp_path):
    pad = held.pad().save(tmp_path / "pad.palpate")
    damaged = tmp_path / "damaged.palpate"
    damaged.write_bytes(files[1.5].read_bytes()[:-200])
    with LoopProcess(files[1.0]) as loop:
        before = loop.read().tick
        with pytest.raises(UsageError, match="which stays in the hand: the body is pressed there, and held"):
            loop.swap(pad)
        for path in (damaged, tmp_path / "none.palpate"):
            with pytest.raises(FileFormatError):
                loop.swap(path)
        with pytest.raises(UsageError, match="at least"):
            loop.swap(files[1.5], seconds=0.01)
        state = loop.read()
        assert state.tick > before
        assert (state.swaps, state.blending, other_faults(state)) == (0, False, 0)
        loop.swap(files[1.5])
    assert loop.report().obtained, "what it said besides is not lost"


@pytest.mark.full
def test_several_at_once_wait_for_each_other(files):
    begun = []
    with LoopProcess(files[1.0]) as loop:
        asked = [
            threading.Thread(target=lambda f=f: begun.append(loop.swap(files[f]))) for f in (1.5, 0.8, 1.0)
        ]
        for thread in asked:
            thread.start()
        for thread in asked:
            thread.join(60.0)
        wait_for(lambda: loop.read().swaps == 3)
    assert len(set(begun)) == 3


@pytest.mark.full
def test_a_replay_takes_no_other_surrogate(files, tmp_path):
    path = tmp_path / "a.trace"
    with LoopProcess(files[1.0], device="simulated:frequency=3", record=path) as loop:
        wait_for(lambda: loop.recording.ticks > 100)
    with LoopProcess(files[1.0], replay=path) as loop, pytest.raises(UsageError, match="replayed"):
        loop.swap(files[1.5])


@pytest.mark.full
def test_a_loop_that_has_died_takes_nothing_and_stops_in_good_order(files):
    with LoopProcess(files[1.0], device="simulated:frequency=3") as loop:
        os.kill(loop.pid, signal.SIGKILL)
        wait_for(lambda: not loop.alive)
        with pytest.raises(DeviceError, match="has ended"):
            loop.swap(files[1.5])
