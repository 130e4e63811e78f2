"""Work by several processes: the same bits as by one, from any script; none outlives the first; errors are told."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest

from palpate.errors import PalpateError, UsageError
from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.energy_search import search_energy
from palpate.learning.pool import Pool
from palpate.learning.search import Budget

pytestmark = pytest.mark.timeout(120)
KIND = {"form": "axis-aligned", "radial": "gaussian", "units_max": 8, "networks": 4, "target": 0.0, "seed": 3}


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
    return EnergyProblem(X, known, None)


def program(text, *arguments, stdin=False, **options):
    """A Python program that finds this file and what this process finds, given as -c or by standard input."""
    here = [os.path.dirname(__file__), *sys.path]
    return subprocess.Popen(
        [sys.executable, *(("-",) if stdin else ("-c", text)), *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(here), "OMP_NUM_THREADS": "1"},
        **options,
    )


@pytest.mark.full
def test_results_are_in_order_and_of_other_processes():
    found = Pool(2).map(_place, range(6))
    assert [number for number, _ in found] == list(range(6))
    assert os.getpid() not in {process for _, process in found}
    assert Pool(1).map(_place, range(3)) == [(i, os.getpid()) for i in range(3)]


def _place(number):
    return number, os.getpid()


@pytest.mark.full
def test_the_same_seed_finds_the_same_bits_with_one_process_and_with_two_under_load():
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        two, trials = search_energy(problem(), **KIND, budget=Budget(0.3), workers=2)
    finally:
        busy.kill()
        busy.wait()
    one, same = search_energy(problem(), **KIND, budget=Budget(0.3), workers=1)
    assert [(t.start, t.units, t.error) for t in trials] == [(t.start, t.units, t.error) for t in same]
    np.testing.assert_array_equal(one.theta, two.theta)
    np.testing.assert_array_equal(one.coefficients, two.coefficients)
    np.testing.assert_array_equal(one.left_out.errors, two.left_out.errors)
    other, _ = search_energy(problem(), **(KIND | {"seed": 4}), budget=Budget(0.3), workers=1)
    assert other.error != one.error


@pytest.mark.full
def test_a_process_that_is_killed_is_told():
    with pytest.raises(PalpateError, match="ended before it had answered"):
        Pool(2).map(_end, range(2))
    assert Pool(2).map(_place, range(2))  # others are started


def _end(number):
    if number:
        os._exit(9)
    time.sleep(0.5)


@pytest.mark.full
def test_errors_of_the_work_come_back():
    with pytest.raises(UsageError, match="no such number"):
        Pool(2).map(_refuse, range(2))


def _refuse(number):
    raise UsageError(f"There is no such number as {number}.")


@pytest.mark.full
@pytest.mark.parametrize("stdin", [False, True])
def test_a_script_needs_no_guard(stdin):
    text = "from palpate.learning.pool import Pool\nprint(Pool(2).map(abs, [-1, -2, 3]))\n"
    with program(text, stdin=stdin) as script:
        said, _ = script.communicate(text if stdin else "", timeout=60)
    assert said == "[1, 2, 3]\n"


@pytest.mark.full
def test_processes_end_with_the_one_that_started_them():
    text = (
        "import time; from palpate.learning.pool import Pool\n"
        "print('begun', flush=True); Pool(2).map(time.sleep, [100, 100])\n"
    )
    with program(text) as first:
        assert first.stdout.readline() == "begun\n"
        until = time.monotonic() + 60.0
        while len(second := _workers(first.pid)) < 2:
            assert time.monotonic() < until
            time.sleep(0.05)
        first.kill()
    assert not psutil.wait_procs(second, timeout=60.0)[1]


@pytest.mark.full
@pytest.mark.skipif(os.name == "nt", reason="SIGTERM is POSIX")
def test_sigterm_ends_it_without_a_traceback():
    text = (
        "import signal, time; from palpate.learning.pool import Pool; from palpate.processes import end_by_sigterm\n"
        "signal.signal(signal.SIGTERM, end_by_sigterm)\n"
        "print('begun', flush=True); Pool(2).map(time.sleep, [0.2] * 500)\n"
    )
    with program(text, stderr=subprocess.PIPE) as first:
        assert first.stdout.readline() == "begun\n"
        until = time.monotonic() + 60.0
        while len(_workers(first.pid)) < 2:
            assert time.monotonic() < until
            time.sleep(0.05)
        time.sleep(1.0)  # they have begun with the work, most of which waits
        first.terminate()
        _, errors = first.communicate(timeout=60.0)
    assert first.returncode == 128 + signal.SIGTERM
    assert not errors


def _workers(pid):
    children = psutil.Process(pid).children(recursive=True)
    return [
        one
        for one in children
        if "loky" in " ".join(one.cmdline()) and "tracker" not in " ".join(one.cmdline())
    ]


def test_where_no_process_can_be_started_one_learns(monkeypatch, caplog):
    import loky

    def refused(*_, **__):
        raise OSError("no more processes")

    monkeypatch.setattr(loky, "get_reusable_executor", refused)
    assert Pool(3).map(abs, [-1, -2]) == [1, 2]
    assert "no more processes" in caplog.text
    with pytest.raises(UsageError, match="workers=0"):
        Pool(0)
