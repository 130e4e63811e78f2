"""The metronome on a clock that the test winds by hand."""

from __future__ import annotations

import pytest

from palpate.runtime.realtime import Metronome

PERIOD = 1e-3


class Hands:
    """A clock that moves 1 µs a look, and sleeps `oversleep` too long."""

    def __init__(self):
        self.time, self.oversleep, self.slept = 100.0, 0.0, []

    def __call__(self):
        self.time += 1e-6
        return self.time

    def sleep(self, duration):
        self.slept.append(duration)
        self.time += duration + self.oversleep


@pytest.fixture
def hands():
    return Hands()


def test_beats_stay_on_their_grid(hands):
    metronome = Metronome(PERIOD, clock=hands, sleep=hands.sleep)
    start = metronome._due
    hands.oversleep = 100e-6  # the spin covers this
    times = [metronome.wait() for _ in range(500)]
    for k, time in enumerate(times):
        assert start + k * PERIOD <= time < start + k * PERIOD + 3e-6
    assert metronome.lateness < 3e-6
    assert max(hands.slept) <= PERIOD - 199e-6, "the last 200 µs are not slept through"


def test_missed_beats_are_skipped_not_made_up_for(hands):
    metronome = Metronome(PERIOD, clock=hands, sleep=hands.sleep)
    metronome.wait()
    hands.time += 3.4 * PERIOD
    late = metronome.wait()
    assert metronome.lateness == pytest.approx(2.4 * PERIOD, rel=0.02)
    assert not metronome.jumped
    after = metronome.wait()
    assert after - late == pytest.approx(0.6 * PERIOD, rel=0.02)
    assert metronome.lateness < 3e-6


@pytest.mark.parametrize("jump", [0.2, 3600.0, -0.01, -3600.0])
def test_jumps_are_noticed_and_survived(hands, jump):
    metronome = Metronome(PERIOD, clock=hands, sleep=hands.sleep)
    metronome.wait()
    assert not metronome.jumped
    hands.time += jump
    metronome.wait()
    assert metronome.jumped
    assert sum(hands.slept) < 5 * PERIOD, "a clock set back must not send the loop to sleep"
    metronome.wait()
    assert not metronome.jumped


def test_rehearses_once_a_beat_before_it_is_due(hands):
    metronome = Metronome(PERIOD, clock=hands, sleep=hands.sleep)
    called = []
    due = metronome._due
    metronome.wait(lambda: called.append(hands.time))
    assert len(called) == 1
    assert due - 201e-6 <= called[0] < due
