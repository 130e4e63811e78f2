"""A search by several processes: what each finds counts, none outlives the first, and one that dies is only missing."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest

from palpate.errors import UsageError
from palpate.learning.energy import crew
from palpate.learning.energy.crew import processes_for, sought
from palpate.learning.energy.judging import restored
from palpate.learning.energy.search import Problem
from palpate.learning.energy.task import Task
from palpate.processes import available_cores

pytestmark = pytest.mark.timeout(120)


def problem():
    """A wave over two inputs, with slopes."""
    X = np.random.default_rng(0).uniform(-1, 1, (40, 2))
    k = np.array([4.0, 3.0])
    known = {
        "Y": np.sin(X @ k)[:, None],
        "weights": np.ones(40),
        "slopes": (np.cos(X @ k)[:, None] * k)[:, None],
        "slope_weight": np.ones((40, 2)),
        "curvatures": np.zeros((40, 1, 3)),
        "curvature_weight": np.zeros((40, 3)),
        "groups": np.arange(40),
    }
    return Problem(X, known, None, "")


def task(seconds=8.0, target=0.0):
    return Task(problem(), time.monotonic(), seconds, "axis-aligned", "gaussian", 12, target, 3)


def helpers(pid=None):
    """Processes that search for a process."""
    return [
        one for one in psutil.Process(pid).children() if "palpate.learning.energy.searcher" in one.cmdline()
    ]


def test_what_every_process_finds_is_chosen_from():
    found, trials = sought(task(seconds=3.0), 4, 3)
    by_start = [trial for trial in trials if trial.start == "kind"]
    assert len(by_start) == 3  # each process begins with the one kind asked for, from a start of its own
    assert len({trial.loo for trial in by_start}) == 3
    assert 1 <= found.networks <= 4
    assert np.isfinite(found.error)
    assert not helpers()


def test_a_network_judged_elsewhere_is_the_same_network():
    done = task(seconds=1.0)
    _, here = done.done()
    best = min(here, key=lambda one: one.error)
    again = restored(done.problem, best.members[0], best.left_out.errors, best.closed.errors)
    assert again.error == best.error
    np.testing.assert_array_equal(again.left_out.fit.tau, best.left_out.fit.tau)
    np.testing.assert_array_equal(again.left_out.together, best.left_out.together)
    np.testing.assert_array_equal(again.closed.together, best.closed.together)


def test_a_target_that_is_reached_waits_for_nobody():
    begun = time.monotonic()
    sought(task(seconds=100.0, target=0.9), 1, 2)
    assert time.monotonic() - begun < 60.0
    assert not helpers()


def test_a_process_that_is_killed_is_missing_and_said_to_be(caplog):
    killed = []

    def kill():
        while not (found := helpers()):
            time.sleep(0.01)
        found[0].kill()
        killed.append(found[0])

    killer = threading.Thread(target=kill)
    killer.start()
    found, _ = sought(task(seconds=2.0), 1, 2)
    killer.join()
    assert killed
    assert np.isfinite(found.error)
    assert "its networks are missing" in caplog.text


def test_processes_end_with_the_one_that_started_them(tmp_path):
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from test_crew import task\n"
        "from palpate.learning.energy.crew import sought\n"
        "print('begun', flush=True); sought(task(seconds=100.0), 1, 2)\n"
    )
    first = subprocess.Popen(
        [sys.executable, "-c", program, os.path.dirname(__file__)],
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert first.stdout is not None
    with first.stdout:
        assert first.stdout.readline() == b"begun\n"
        until = time.monotonic() + 60.0
        while not (second := helpers(first.pid)):
            assert time.monotonic() < until
            time.sleep(0.05)
        first.kill()
        first.wait()
    assert not psutil.wait_procs(second, timeout=60.0)[1]


def test_how_many_processes_are_worth_it():
    assert processes_for(19.0) == 1  # they would only have started
    assert processes_for(60.0) == min(available_cores(), 8)
    assert processes_for(1.0, 2) == 2
    with pytest.raises(UsageError, match="workers=0"):
        processes_for(60.0, 0)


def test_where_no_process_can_be_started_one_searches(monkeypatch, caplog):
    def refused(*_, **__):
        raise OSError("no more processes")

    monkeypatch.setattr(crew.subprocess, "Popen", refused)
    found, _ = sought(task(seconds=1.0), 1, 3)
    assert np.isfinite(found.error)
    assert caplog.text.count("no more processes") == 1
