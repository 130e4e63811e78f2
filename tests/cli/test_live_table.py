"""The live table in words, the keys of a terminal, and the device of a page."""

from __future__ import annotations

import os
import sys

import numpy as np
import pytest

from models import spring_beam
from palpate.cli.live_table import live_rows, live_table
from palpate.cli.terminal_keys import RESUME, STOP, terminal_keys
from palpate.devices.simulated import SimulatedHand
from palpate.errors import UsageError
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import aim_device, touchable


@pytest.fixture
def touched():
    """A loop on a beam in a simulated hand, and its shared memory; half a second of its own time has passed."""
    body, shared = touchable(spring_beam(200.0)), Shared.private()
    loop = Loop(
        body, SimulatedHand(), shared, body.workspace(0.075), Limits(12.0), stiffness=body.stiffness_max
    )
    loop.out.device("simulated")
    loop.run_for(0.5)
    yield loop, shared
    shared.close()


def test_the_table_says_what_the_loop_publishes(touched):
    loop, shared = touched
    state = shared.read_state()
    rows = dict(live_rows(state, holds=True, keys=True))
    assert rows["device"] == "simulated: pushing"
    assert rows["force"].startswith(f"{np.linalg.norm(state.force):.3g}"[:3])
    assert "at most 12 N" in rows["force"]
    assert rows["displaced"].endswith("mm")
    assert "of 1000 Hz" in rows["loop"]
    assert rows["energy"].count("mJ") == 2
    assert rows["faults"] == "none"
    assert "Esc" in rows["keys"]
    shared.write_command(stop=True)
    loop.run_for(0.01, 0.501)
    state = shared.read_state()
    rows = dict(live_rows(state, holds=True))
    assert rows["device"] == f"simulated: {state.reason()}"
    assert rows["force"].startswith("0 N")
    assert "1 × stopped; the last one" in rows["faults"]
    assert "keys" not in rows
    assert live_table(state, holds=True).row_count == len(rows)


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is POSIX")
def test_keys_stop_and_resume_without_a_line(request):
    leader, follower = os.openpty()
    request.addfinalizer(lambda: (os.close(leader), os.close(follower)))
    with terminal_keys(follower) as keys:
        assert keys.heard
        assert keys.wish() == ""
        for typed, wish in ((b"\x1b", STOP), (b" ", STOP), (b"x", ""), (b"r", RESUME), (b"r\x1bx", STOP)):
            os.write(leader, typed)
            assert keys.wish() == wish


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is POSIX")
def test_in_the_background_no_keys_are_heard(request, monkeypatch):
    """The system would stop a program that changes a terminal which another one uses."""
    leader, follower = os.openpty()
    request.addfinalizer(lambda: (os.close(leader), os.close(follower)))
    monkeypatch.setattr(os, "tcgetpgrp", lambda _: os.getpgrp() + 1)
    with terminal_keys(follower) as keys:
        assert not keys.heard


def test_without_a_terminal_no_keys_are_heard(tmp_path):
    with (tmp_path / "no terminal").open("w+") as file, terminal_keys(file.fileno()) as keys:
        assert not keys.heard
        assert keys.wish() == ""


def test_a_stroke_presses_where_a_body_was_trained_and_other_devices_stay(touched):
    body = touchable(spring_beam(200.0))
    for device in ("page", "haply:ws://localhost:10001", "simulated:mass=0.2"):
        assert aim_device(device, body) == device
    with pytest.raises(UsageError, match="There is no device"):
        aim_device("omega", body)
