"""The survey says what is so, changes nothing, and has a remedy for each miss."""

from __future__ import annotations

import os
import sys

import pytest

from palpate.runtime import realtime


def test_every_miss_has_a_remedy():
    checks = realtime.survey()
    assert len({check.name for check in checks}) == len(checks)
    for check in checks:
        assert check.detail
        assert check.ok or check.remedy


@pytest.mark.skipif(sys.platform != "linux", reason="scheduling policies are Linux's")
def test_survey_leaves_the_callers_scheduling_alone():
    before = os.sched_getscheduler(0)
    realtime.survey()
    assert os.sched_getscheduler(0) == before


def test_refused_scheduling_is_said_so(monkeypatch):
    monkeypatch.setattr(realtime, "_may_use_fifo", lambda: False)
    check = realtime._scheduling()
    assert not check.ok
    assert check.remedy


@pytest.mark.parametrize(("text", "ok"), [("powersave", False), ("performance", True), (None, True)])
def test_governor(monkeypatch, text, ok):
    monkeypatch.setattr(realtime, "_read", lambda path: text)
    assert realtime._governor().ok is ok
