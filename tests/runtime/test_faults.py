"""One fault of every kind in the midst of a touch, and a process that is killed."""

from __future__ import annotations

import os
import signal
import time

import pytest
from benchmarks.fault_injection import FAULTS, FaultInjector

import pressed
from models import spring_beam
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.errors import UsageError
from palpate.runtime import LoopProcess
from palpate.runtime.safety import Fault
from palpate.runtime.touchable import touchable
from palpate.surrogates.memories import Relaxation
from waiting import wait_for


@pytest.fixture(scope="module")
def beam():
    return FaultInjector(touchable(spring_beam(200.0)))


@pytest.fixture(scope="module")
def relaxing():
    return FaultInjector(touchable(pressed.surrogate(factor=5.0, memory=Relaxation(((0.4, 0.1),)))), seed=3)


@pytest.mark.grid
@pytest.mark.parametrize("kind", list(FAULTS))
def test_a_fault_takes_the_force_is_recorded_and_heals(beam, kind):
    outcome = beam.inject(kind)
    assert outcome.silence <= 0.020 + 1e-9
    assert outcome.recorded
    assert outcome.withheld, "until the hand is where the body holds no energy"
    assert outcome.good
    assert outcome.restarted == (kind == "parent gone")


@pytest.mark.grid
@pytest.mark.parametrize("kind", ["leap", "answer no number", "clock back", "stop switch"])
def test_a_body_that_remembers_heals_too(relaxing, kind):
    outcome = relaxing.inject(kind)
    assert outcome.good, outcome


def test_every_fault_of_the_loop_is_injected(beam):
    assert {known.fault for known in FAULTS.values()} == set(Fault) - {Fault.NONE}
    with pytest.raises(UsageError, match="Choose one of"):
        beam.inject("coffee")


@pytest.mark.full
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="a kill that nothing survives is POSIX")
def test_a_killed_process_leaves_no_force_and_is_healed_by_a_restart(tmp_path):
    """What drops the force is the device's own watchdog; here it is that of a double."""
    path = pressed.surrogate(factor=5.0).save(tmp_path / "slab.palpate")
    settings = SimulatorSettings(port=0, events=0, silence=0.020, frequency=2.0)
    with HaplySimulator(settings) as service:
        device = f"haply:ws://127.0.0.1:{service.port},events={service.events_port}"
        with LoopProcess(path, device=device) as loop:
            wait_for(lambda: service.force().any(), pause=0.001)
            os.kill(loop.pid, signal.SIGKILL)
            wait_for(
                lambda: not loop.alive and not service._clients
            )  # so all that it had sent has been obeyed
            wait_for(lambda: time.monotonic() > service.lapses_at())
            assert not service.force().any()
        with LoopProcess(path, device=device):
            wait_for(lambda: service.force().any(), pause=0.001)
