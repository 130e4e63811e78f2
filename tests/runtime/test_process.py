"""The real child process on real shared memory. What must hold is read from the loop's own tick times."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import DeviceError, UsageError
from palpate.network import shared_memory
from palpate.runtime import Fault, LoopProcess, now
from palpate.runtime.recording import Ring
from standins import STIFFNESS

POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and process ids are POSIX's")
TICK = 1e-3


def watch(loop, seconds, each=lambda: None):
    """Different published states of the next seconds."""
    states, until = [], now() + seconds
    while now() < until:
        each()
        state = loop.read()
        if not states or state.tick > states[-1].tick:
            states.append(state)
        time.sleep(0.0005)
    return states


def wait_for(condition, seconds=20.0):
    until = now() + seconds
    while not condition():
        assert now() < until, "waited in vain"
        time.sleep(0.01)


def exists(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    return not (
        stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] == "Z"
    )  # nobody reaps orphans here


def test_a_stroke_is_felt_and_everything_is_tidied_away(spring_file):
    with LoopProcess(spring_file, device="stroke:frequency=2,amplitude=0.03") as loop:
        block, pid = Path(loop.shared.name), loop.pid
        assert loop.alive
        states = watch(loop, 1.0)
        assert loop.scale == pytest.approx(0.25 / (0.8 * 0.075))
    whole = [s for s in states if s.tick > 100 and s.fault == 0]
    assert len(whole) > 50
    for state in whole:
        if state.faults == 0:  # a jump of this machine's clock would ramp in again
            np.testing.assert_allclose(state.force, [0.0, -STIFFNESS * state.position[1], 0.0], atol=1e-9)
    assert max(s.force[1] for s in whole) > 0.5
    assert min(s.force[1] for s in whole) < -0.5, "the other side by symmetry"
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
def test_work_of_a_tick_is_a_small_part_of_it(spring_file):
    """Some 25 µs of CPU time on a free machine; the bound leaves room for a busy one."""
    with LoopProcess(spring_file) as loop:
        loop.shared.write_command(beat=now() + 60.0, grabbed=True, target=(0.0, -0.02, 0.0))
        states = watch(loop, 1.0)
    assert states[-1].work_p50 < 150e-6
    assert states[-1].work_p50 <= states[-1].work_p99
    assert 0.0 <= states[-1].lateness_p50 <= states[-1].lateness_p999 <= states[-1].lateness_max
    assert loop.report().rate == pytest.approx(1000.0, rel=0.2)


@pytest.mark.full
def test_a_silent_page_gets_zero_force_in_time(spring_file):
    with LoopProcess(spring_file) as loop:
        loop.shared.write_command(beat=now(), period=0.03, grabbed=True, target=(0.0, -0.03, 0.0))
        alive = watch(loop, 0.4, each=lambda: loop.shared.write_command(beat=now()))
        heard = now()
        loop.shared.write_command(beat=heard)
        silent = watch(loop, 0.4)
        assert alive[-1].force.any()
        after = [s for s in silent if s.time > heard + 0.1 + 1e-6]
        assert len(after) > 10
        assert all(s.stalled and not s.force.any() for s in after)
        before = [s for s in silent if s.time < heard + 0.1 - 1e-6 and s.faults == alive[-1].faults]
        assert all(s.force.any() and not s.stalled for s in before)
        assert silent[-1].fault_counts[Fault.INPUT_STALLED] == 1
        again = watch(loop, 0.2, each=lambda: loop.shared.write_command(beat=now()))
        assert again[-1].waiting
        assert not again[-1].force.any(), "not in the middle of the body"
        loop.shared.write_command(grabbed=False)
        watch(loop, 0.1, each=lambda: loop.shared.write_command(beat=now()))
        loop.shared.write_command(grabbed=True)
        again = watch(loop, 0.4, each=lambda: loop.shared.write_command(beat=now()))
        assert again[-1].force.any()
        assert again[-1].fault_counts[Fault.INPUT_STALLED] == 1


@pytest.mark.full
def test_stalled_hardware_gets_zero_force_within_20_ms(spring_file):
    with LoopProcess(spring_file, device="stroke:frequency=0.5,stall_at=0.5") as loop:
        states = watch(loop, 1.0)
    frozen = states[-1].hand
    last_heard = next(
        s.time for s in states if (s.hand == frozen).all()
    )  # or later: the watcher may have missed it
    assert any(s.force.any() for s in states)
    after = [s for s in states if s.time > last_heard + 0.020 + 1e-6]
    assert len(after) > 10
    assert all(s.fault == Fault.INPUT_STALLED and not s.force.any() for s in after)


@pytest.mark.full
def test_a_lost_number_is_survived_and_ramps_in(spring_file):
    with LoopProcess(spring_file, device="stroke:frequency=0.5,nan_at=0.5,lasting=0.1") as loop:
        states = watch(loop, 1.2)
    bad = [s for s in states if s.fault == Fault.INPUT_NOT_FINITE]
    assert bad
    assert all(not s.force.any() and np.isfinite(s.hand).all() for s in bad)
    assert states[-1].fault_counts[Fault.INPUT_NOT_FINITE] == 1
    good = [s for s in states if s.tick > bad[-1].tick]
    assert good[-1].force.any()
    for state in good:
        share = (state.tick - bad[-1].tick) / 50  # the fault lasted at least that long
        assert abs(state.force[1]) <= min(1.0, share) * STIFFNESS * abs(state.position[1]) + 1e-9


@pytest.mark.full
def test_a_hardware_like_failure_is_recorded(spring_file):
    with LoopProcess(spring_file, device="stroke:fail_at=0.2,lasting=0.1") as loop:
        wait_for(lambda: loop.read().tick > 500)
    assert loop.report().faults["device_error"] == 1


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
