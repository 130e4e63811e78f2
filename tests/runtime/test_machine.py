"""The survey says what is so, changes nothing, and has a remedy for each miss."""

from __future__ import annotations

import os
import sys

import pytest

from palpate.runtime import machine


def test_every_miss_has_a_remedy():
    checks = machine.survey()
    assert len({check.name for check in checks}) == len(checks)
    for check in checks:
        assert check.detail
        assert check.ok or check.remedy


@pytest.mark.skipif(sys.platform != "linux", reason="scheduling policies are Linux's")
def test_survey_leaves_the_callers_scheduling_alone():
    before = os.sched_getscheduler(0)
    machine.survey()
    assert os.sched_getscheduler(0) == before


def test_refused_scheduling_is_said_so(monkeypatch):
    monkeypatch.setattr(machine, "_may_use_fifo", lambda: False)
    check = machine._scheduling()
    assert not check.ok
    assert check.remedy


def lay_out(root, **files):
    """Write files below `root`; a double underscore in a name stands for a slash."""
    for name, text in files.items():
        path = root / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n", encoding="ascii")


@pytest.mark.parametrize(("text", "ok"), [("powersave", False), ("performance", True), (None, True)])
def test_governor(tmp_path, text, ok):
    if text is not None:
        lay_out(tmp_path, sys__devices__system__cpu__cpu0__cpufreq__scaling_governor=text)
    assert machine._governor(tmp_path).ok is ok


def test_a_limit_of_cpu_time_is_a_miss_and_a_container_without_one_is_none(tmp_path):
    assert machine._container(tmp_path).detail == "none found"
    lay_out(tmp_path, proc__1__cgroup="0::/kubepods/pod1")
    check = machine._container(tmp_path)
    assert check.ok
    assert check.detail == "yes"
    path = tmp_path / "sys/fs/cgroup/cpu.max"
    path.parent.mkdir(parents=True)
    path.write_text("max 100000\n", encoding="ascii")
    assert machine._container(tmp_path).ok
    path.write_text("150000 100000\n", encoding="ascii")
    check = machine._container(tmp_path)
    assert not check.ok
    assert "1.5 CPUs" in check.detail
    assert check.remedy


@pytest.mark.parametrize(("text", "ok"), [("0.10 1 1 1/9 9", True), ("99.0 1 1 1/9 9", False), ("", True)])
def test_load(tmp_path, monkeypatch, text, ok):
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    lay_out(tmp_path, proc__loadavg=text)
    assert machine._load(tmp_path).ok is ok


def test_a_real_time_kernel_is_named(tmp_path):
    lay_out(tmp_path, sys__kernel__realtime="1")
    assert "PREEMPT_RT" in machine._kernel(tmp_path).detail
