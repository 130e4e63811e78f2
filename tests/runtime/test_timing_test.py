"""The timing test on a clock that is wound by hand, and its verdict against the sentences of its docstring."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from palpate.runtime import LoopReport, timing_test
from palpate.runtime.machine import Check
from palpate.runtime.timing_test import judge_timing, measure_timing

SECONDS = 0.3


class Clock:
    """A clock that moves 5 µs a look; every `every`-th sleep lasts `late` too long."""

    def __init__(self, late=0.0, every=1):
        self.time, self.late, self.every, self.sleeps = 100.0, late, every, 0

    def __call__(self):
        self.time += 5e-6
        return self.time

    def sleep(self, duration):
        self.sleeps += 1
        self.time += duration + (self.late if self.sleeps % self.every == 0 else 0.0)


def run(clock):
    return measure_timing(SECONDS, clock=clock, sleep=clock.sleep)


@pytest.fixture(scope="module")
def punctual():
    """A run on time; its work, which the machine under the tests decides, is set to a usual figure."""
    return replace(run(Clock()), work_p50=30e-6, work_p99=40e-6)


@pytest.mark.full
def test_a_punctual_machine_is_good(punctual):
    assert punctual.ticks == pytest.approx(1000 * SECONDS, abs=1)
    assert not punctual.faults
    verdict = judge_timing(punctual, SECONDS, checks=[Check("load", ok=False, detail="9", remedy="wait")])
    assert verdict.grade == "good"
    assert verdict.reasons == ()
    assert verdict.missed == 0.0


@pytest.mark.grid
@pytest.mark.parametrize(
    ("late", "every", "grade"),
    [
        (150e-6, 1, "good"),  # the spin covers it
        (450e-6, 5, "usable"),  # 250 µs late: a quarter of the period
        (900e-6, 5, "not fit"),  # 700 µs late: more than half of it
        (0.025, 100, "not fit"),  # a device's watchdog has let go
    ],
)
def test_lateness_decides(punctual, late, every, grade):
    slow = replace(run(Clock(late, every)), work_p50=punctual.work_p50, work_p99=punctual.work_p99)
    verdict = judge_timing(slow, SECONDS)
    assert verdict.grade == grade
    assert bool(verdict.reasons) == (grade != "good")
    assert verdict.sentence.startswith(grade)


def test_the_verdict_scales_with_the_rate(punctual):
    late = replace(punctual, lateness_p99=250e-6, lateness_max=300e-6)
    assert judge_timing(late, SECONDS, 1000.0).grade == "usable"
    assert judge_timing(replace(late, ticks=60), SECONDS, 200.0).grade == "good"


@pytest.mark.parametrize(
    ("change", "grade", "word"),
    [
        ({"ticks": 297}, "not fit", "missed"),
        ({"work_p99": 600e-6}, "not fit", "CPU time"),
        ({"lateness_max": 2e-3}, "usable", "a period or more"),
        ({"lateness_max": 0.021}, "not fit", "watchdog"),
    ],
)
def test_each_figure_has_its_reason(punctual, change, grade, word):
    verdict = judge_timing(replace(punctual, **change), SECONDS)
    assert verdict.grade == grade
    assert any(word in reason for reason in verdict.reasons)


def test_misses_of_the_survey_are_possible_causes(punctual):
    checks = [Check("CPU governor", ok=False, detail="powersave"), Check("CPUs", ok=True, detail="4")]
    reasons = judge_timing(replace(punctual, lateness_p99=1e-3), SECONDS, checks=checks).reasons
    assert reasons[-1] == "possible cause: CPU governor, powersave"


def test_the_child_prints_the_whole_report(punctual, monkeypatch, capsys):
    granted = {"scheduler": "SCHED_FIFO 40"}
    monkeypatch.setattr(timing_test, "obtain", lambda: granted)
    monkeypatch.setattr(timing_test, "measure_timing", lambda seconds, rate: punctual)
    timing_test.main(["10", "1000"])
    said = LoopReport(**json.loads(capsys.readouterr().out))
    assert said.as_dict() == replace(punctual, obtained=granted).as_dict()
