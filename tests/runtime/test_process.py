"""The real child process on real shared memory. What must hold is read from the loop's own tick times."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import DeviceError, UsageError
from palpate.network import shared_memory
from palpate.runtime import Fault, LoopProcess, now
from palpate.runtime.recording import Ring
from standins import STIFFNESS
from waiting import press, settled, wait_for, watch

POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and process ids are POSIX's")
TICK = 1e-3


def exists(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    return not (
        stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] == "Z"
    )  # nobody reaps orphans here


def both_sides(states):
    """Whether the hand was pushed up and down: the other side by symmetry."""
    forces = [s.force[1] for s in states]
    return max(forces) > 0.5 and min(forces) < -0.5


def test_a_stroke_is_felt_and_everything_is_tidied_away(spring_file):
    with LoopProcess(spring_file, device="stroke:frequency=2,amplitude=0.03") as loop:
        block, pid = Path(loop.shared.name), loop.pid
        assert loop.alive
        states = watch(loop, lambda seen: len(whole := settled(seen)) > 50 and both_sides(whole))
        assert loop.scale == pytest.approx(0.25 / (0.8 * 0.075))
    for state in settled(states):
        np.testing.assert_allclose(state.force, [0.0, -STIFFNESS * state.position[1], 0.0], atol=1e-9)
    assert not loop.alive
    assert not block.exists()
    assert not exists(pid)
    report = loop.report()
    assert report.ticks >= states[-1].tick
    assert report.foreign == (), "nothing of physics, SciPy or the command line in the running loop"
    assert set(report.obtained) == {"scheduler", "timer slack", "memory"}
    assert json.loads(json.dumps(report.as_dict()))["ticks"] == report.ticks
    assert "ticks at" in str(report)


@pytest.mark.full
def test_work_and_lateness_of_ticks_are_measured(spring_file):
    """How small they are on a free machine is said by the benchmarks runtime and punctuality."""
    with LoopProcess(spring_file) as loop:
        press(loop, (0.0, -0.02, 0.0), lambda state: state.tick > 500)
        state = loop.read()
    assert 0.0 < state.work_p50 <= state.work_p99
    assert 0.0 <= state.lateness_p50 <= state.lateness_p999 <= state.lateness_max
    assert loop.report().rate > 0.0


@pytest.mark.full
def test_a_silent_page_gets_zero_force_in_time(spring_file):
    with LoopProcess(spring_file) as loop:
        target = (0.0, -0.03, 0.0)
        loop.shared.write_command(period=0.03)
        press(loop, target, lambda state: state.force.any())
        alive, heard = loop.read(), now()
        loop.shared.write_command(beat=heard)  # and no other after it
        silent = watch(loop, lambda seen: sum(s.time > heard + 0.1 + 1e-6 for s in seen) > 10)
        after = [s for s in silent if s.time > heard + 0.1 + 1e-6]
        assert all(s.stalled and not s.force.any() for s in after)
        before = [s for s in silent if heard < s.time < heard + 0.1 - 1e-6 and s.faults == alive.faults]
        assert all(s.force.any() and not s.stalled for s in before)
        loop.shared.write_command(beat=now() + 60.0)
        again = watch(loop, lambda seen: seen[-1].fault == 0 and seen[-1].tick > silent[-1].tick + 100)
        assert again[-1].waiting
        assert not again[-1].force.any(), "not in the middle of the body"
        press(loop, target, lambda state: state.force.any())
        jumps = loop.read().fault_counts[Fault.CLOCK_JUMP]
        assert 1 <= loop.read().fault_counts[Fault.INPUT_STALLED] <= 1 + jumps


def stalled(states):
    """The states from 20 ms after the hand has come to where it is in the last one."""
    heard = next(s.time for s in states if (s.hand == states[-1].hand).all())  # or later: one may be missed
    return [s for s in states if s.time > heard + 0.020 + 1e-6]


@pytest.mark.full
def test_stalled_hardware_gets_zero_force_within_20_ms(spring_file):
    with LoopProcess(spring_file, device="stroke:frequency=0.5,stall_at=0.5") as loop:
        states = watch(loop, lambda seen: len(stalled(seen)) > 10 and (seen[-1].hand == seen[-50].hand).all())
    assert any(s.force.any() for s in states)
    after = stalled(states)
    assert not any(s.force.any() for s in after)
    assert {s.fault for s in after} <= {Fault.INPUT_STALLED, Fault.CLOCK_JUMP}, "a jump is a busy machine's"


def last_bad(states):
    """The last tick with a place that was no number; never where there was none."""
    return max((s.tick for s in states if s.fault == Fault.INPUT_NOT_FINITE), default=math.inf)


@pytest.mark.full
def test_a_lost_number_is_survived_and_ramps_in(spring_file):
    with LoopProcess(spring_file, device="stroke:frequency=0.5,nan_at=0.5,lasting=0.1") as loop:
        states = watch(loop, lambda seen: any(s.force.any() for s in seen if s.tick > last_bad(seen)))
    bad = [s for s in states if s.fault == Fault.INPUT_NOT_FINITE]
    assert all(not s.force.any() and np.isfinite(s.hand).all() for s in bad)
    counts = states[-1].fault_counts
    assert 1 <= counts[Fault.INPUT_NOT_FINITE] <= 1 + counts[Fault.CLOCK_JUMP]
    good = [s for s in states if s.tick > bad[-1].tick]
    for state in good:
        share = (state.tick - bad[-1].tick) / 50  # the fault lasted at least that long
        assert abs(state.force[1]) <= min(1.0, share) * STIFFNESS * abs(state.position[1]) + 1e-9


@pytest.mark.full
def test_a_hardware_like_failure_is_recorded(spring_file):
    with LoopProcess(spring_file, device="stroke:fail_at=0.2,lasting=0.1") as loop:
        wait_for(lambda: loop.read().tick > 500 and loop.read().fault == 0)
    faults = loop.report().faults
    assert 1 <= faults["device_error"] <= 1 + faults.get("clock_jump", 0), "a jump is a busy machine's"


def test_a_dead_man_button_needs_a_button(spring_file):
    with pytest.raises(UsageError, match="no button to hold"):
        LoopProcess(spring_file, device="page", dead_man=True)
    with pytest.raises(UsageError, match="'gamepad:hold=button' has no button to hold"):
        LoopProcess(spring_file, device="gamepad:hold=button", dead_man=True)
    LoopProcess(spring_file, device="gamepad", dead_man=True)


def test_a_python_that_cannot_run_is_explained(spring_file, monkeypatch):
    monkeypatch.setattr(sys, "executable", os.devnull)
    loop = LoopProcess(spring_file)
    with pytest.raises(DeviceError, match="could not be started"):
        loop.start()
    assert not Path(loop.shared.name).exists()


@pytest.mark.full
@POSIX
def test_the_opened_devices_own_limits_count_and_a_killed_loop_is_noticed(spring_file):
    with LoopProcess(spring_file, device="simulated:profile=falcon", max_force=100.0) as loop:
        block, state = Path(loop.shared.name), loop.read()
        assert (state.max_force, state.radius, state.device_stiffness) == (8.0, 0.04, 3000.0)
        assert state.device == "simulated falcon"
        os.kill(loop.pid, signal.SIGKILL)
        wait_for(lambda: not loop.alive)
        with pytest.raises(DeviceError, match="has ended"):
            loop.read()
    assert not block.exists()
    with pytest.raises(DeviceError, match="has ended"):
        loop.read()
    assert loop.report().ticks > 0


@pytest.mark.full
@POSIX
def test_ctrl_c_is_the_parents_business_and_terminate_is_clean(spring_file):
    with LoopProcess(spring_file, device="stroke") as loop:
        os.kill(loop.pid, signal.SIGINT)
        seen = loop.read().tick
        wait_for(lambda: loop.read().tick > seen + 50)
        os.kill(loop.pid, signal.SIGTERM)
        wait_for(lambda: not loop.alive)
        assert not loop.shared.read_state().force.any(), "it let go before it went"


PARENT = """
import sys, time
from palpate.runtime import LoopProcess
loop = LoopProcess(sys.argv[1], device="stroke").start()
print(loop.pid, loop.shared.name, flush=True)
time.sleep(600)
"""


@pytest.mark.full
@POSIX
def test_a_dead_parent_takes_the_loop_and_its_memory_along(spring_file):
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT, str(spring_file)], stdout=subprocess.PIPE, text=True
    )
    pid, block = parent.stdout.readline().split()
    assert exists(int(pid))
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_for(lambda: not exists(int(pid)))
    assert not Path(block).exists()


@pytest.mark.full
def test_bad_beginnings_are_explained(spring_file, tmp_path):
    broken = tmp_path / "broken.palpate"
    broken.write_bytes(b"not a model")
    with pytest.raises(UsageError, match="no device 'omega'"):
        LoopProcess(spring_file, device="omega")
    for model, options, message in (
        (broken, {}, "broken"),
        (spring_file, {"device": "stroke:colour=red"}, "no option 'colour'"),
    ):
        loop = LoopProcess(model, **options)
        with pytest.raises(UsageError, match=message):
            loop.start()
        assert not Path(loop.shared.name).exists()
    with pytest.raises(UsageError, match="not started"):
        LoopProcess(spring_file).read()


@pytest.mark.full
def test_a_start_that_fails_leaves_no_shared_memory(spring_file, monkeypatch):
    names, most, create = [], [1], shared_memory.create

    def created(head, size):
        if len(names) == most[0]:
            raise OSError("no room")
        names.append(create(head, size))
        return names[-1]

    monkeypatch.setattr(shared_memory, "create", created)
    for room, options, error in (
        (1, {}, DeviceError),
        (2, {"parameters": [0.0] * 99}, UsageError),
        (2, {"rate": 1e9}, UsageError),
    ):
        names.clear()
        most[0] = room
        with pytest.raises(error):
            LoopProcess(spring_file, **options).start()
        assert names
        assert not any(Path(name).exists() for name in names)


def test_no_rate_makes_a_ring_that_fills_the_memory():
    for rate in (math.inf, math.nan, -1.0, 1e9):
        assert Ring.private(rate).length <= 40_100


@pytest.mark.full
def test_parameters_reach_the_loop(spring_file):
    with LoopProcess(spring_file, parameters=[1.5]) as loop:
        assert loop.shared.command.record["parameters"][0] == 1.5
