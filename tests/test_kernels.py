"""Kernels that are interpreted until they are compiled, and the process that compiles them beside other work."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest

from held import INPUTS, drawn
from models import linear_network
from palpate.kernels import FEW, MANY, for_rows, is_ready, python_source
from palpate.network import TrainedRegion
from palpate.runtime import warm_up
from palpate.runtime.warm_up import WarmUp
from palpate.units import Quantity

SOURCE = """
from palpate.kernels import kernel, part

@part
def ratio(a, b):
    return a / b

@kernel
def one(x, y, i):
    y[i] = ratio(x[i], 3.0 - x[i])

@kernel
def rows(x, y):
    for i in range(x.size):
        one(x, y, i)
"""


@pytest.fixture(params=[True, False], ids=["tried", "another Numba"])
def made(request, tmp_path, monkeypatch):
    """A module of a part and of kernels that nobody has compiled, with a Numba that parts fit and with another."""
    if not request.param:
        monkeypatch.setattr("palpate.kernels._TRIED", ())
    (tmp_path / "made_kernels.py").write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("made_kernels", tmp_path / "made_kernels.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["made_kernels"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["made_kernels"]


def test_few_rows_are_interpreted_and_many_compiled_to_the_same_bits(made):
    x, few, many = np.linspace(0.0, 2.0, 7), np.zeros(7), np.zeros(7)
    for_rows(made.one, 1)(x, few, 6)
    assert few[6] == 2.0
    assert not is_ready(made.one)
    for_rows(made.one, FEW)(x, many, 6)
    assert is_ready(made.one)
    assert few[6] == many[6]


@pytest.mark.full
def test_a_kernel_for_all_rows_goes_through_that_for_one_until_many_rows_were_asked(made):
    x, y = np.linspace(0.0, 2.0, 7), np.zeros(7)
    for_rows(made.rows, FEW + 1, made.one)(x, y)
    assert is_ready(made.one)
    assert not is_ready(made.rows)
    for_rows(made.rows, MANY, made.one)(x, y)
    assert is_ready(made.rows)
    assert np.array_equal(y, x / (3.0 - x))


def test_what_python_refuses_is_answered_as_a_processor_does(made):
    x, y = [np.float64(3.0), 3.0], np.zeros(2)
    for_rows(made.one, 1)(np.array(x), y, 0)
    assert np.isinf(y[0])
    with pytest.raises(ZeroDivisionError):
        python_source(made.ratio)(1.0, 0.0)


def test_a_part_is_interpreted_where_python_calls_it(made):
    assert made.ratio(1.0, 4.0) == 0.25
    made.one(np.ones(1), np.zeros(1), 0)  # linked and compiled
    assert made.ratio(1.0, 4.0) == 0.25


def test_few_inputs_of_networks_and_regions_are_answered_as_many(monkeypatch):
    X = drawn(20)
    network = linear_network(list(INPUTS), [Quantity("f")], np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]]))
    region = TrainedRegion.of(drawn(50, seed=1))
    compiled = [network.predict(X), network.jacobian(X[0]), network.hessian(X[0]), region.distances(X)]
    for module in ("palpate.network.network", "palpate.network.region"):
        monkeypatch.setattr(f"{module}.for_rows", lambda own, rows: python_source(own))
    few = [network.predict(X), network.jacobian(X[0]), network.hessian(X[0]), region.distances(X)]
    for a, b in zip(compiled, few, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-13, atol=0)


def test_nothing_is_started_where_all_is_ready(monkeypatch):
    monkeypatch.setattr(warm_up, "is_ready", lambda own: True)
    with WarmUp("loop", "held", "pressed") as warm:
        assert warm.pid is None
        assert warm.words == ""


@pytest.mark.full
def test_a_person_is_told_how_long_it_takes_and_the_process_ends_with_its_command(monkeypatch):
    monkeypatch.setattr(warm_up, "is_ready", lambda own: False)
    with WarmUp("held", "loop") as warm:
        assert warm.words.startswith("warming up, 11 s")
        assert psutil.pid_exists(warm.pid)
    assert not psutil.pid_exists(warm.pid)
    assert warm.words == ""


KILLED = """
import os, signal
from palpate.runtime import warm_up
warm_up.is_ready = lambda own: False
warm = warm_up.WarmUp("pressed", "held", "loop")
print(warm.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.full
def test_it_outlives_no_command_that_was_killed(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # empty: there is work for a while
    done = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True, check=False)
    pid, until = int(done.stdout), time.monotonic() + 30.0
    while psutil.pid_exists(pid) and time.monotonic() < until:
        time.sleep(0.05)
    assert not psutil.pid_exists(pid)
