"""The metronome on a clock that the test winds by hand."""

from __future__ import annotations

import math

import pytest

import pressed
from palpate.devices.device import Sample, Traits
from palpate.runtime.loop import Loop
from palpate.runtime.realtime import SLOW, Metronome, Rest
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import touchable

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


class FallingHand:
    """Hardware whose handle moves up or down at a set speed."""

    traits = Traits(0.075, 12.0, 0.5, "made up")

    def __init__(self):
        self.sample, self.height, self.speed = Sample(), 0.0, 0.0
        self.sample.holding = True

    def place(self, height, speed):
        self.height, self.speed = height, speed

    def move(self, elapsed):
        self.height += elapsed * self.speed

    def read(self, now):
        self.sample.time, self.sample.position[1] = now, self.height
        return self.sample

    def write(self, force):
        pass

    def close(self):
        pass


@pytest.fixture
def hands():
    return Hands()


@pytest.fixture
def plain_air():
    body, hand = touchable(pressed.surrogate()), FallingHand()
    workspace = body.workspace(hand.traits.radius)
    return Loop(body, hand, Shared.private(), workspace, Limits(12.0)), hand


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


def test_a_resting_loop_beats_slowly_and_comes_back_on_its_grid(hands):
    metronome, rehearsed = Metronome(PERIOD, clock=hands, sleep=hands.sleep), []
    times = [metronome.wait() for _ in range(3)]
    looks = hands.time - sum(hands.slept)
    times += [metronome.wait(lambda: rehearsed.append(1), resting=True) for _ in range(10)]
    assert not rehearsed
    assert times[-1] - times[2] == pytest.approx(10 * SLOW, rel=1e-2)
    assert hands.time - sum(hands.slept) - looks < 100e-6, "no spin"
    assert not metronome.jumped
    back = metronome.wait(lambda: rehearsed.append(1))
    assert rehearsed
    assert back - times[-1] == pytest.approx(PERIOD, rel=1e-2)
    hands.time -= 1.0
    metronome.wait(resting=True)
    assert metronome.jumped


def test_a_loop_rests_without_a_hand_and_not_near_a_body():
    rest = Rest(PERIOD)

    def after(seconds, distance, speed):
        for _ in range(round(seconds / PERIOD)):
            rest.see(PERIOD, distance, speed * PERIOD)
        return rest.resting

    assert not after(0.2, math.inf, 0.0), "a tap comes sooner"
    assert after(0.2, math.inf, 0.0)
    assert not after(PERIOD, 0.0, 0.0), "from the first tick of a touch"
    assert after(0.5, 0.05, 0.1)
    assert not after(PERIOD, 0.05, 4.0), "four slow beats away"
    assert not after(1.0, 0.009, 0.0)


def test_a_loop_comes_back_to_its_rate_before_a_hand_touches(plain_air):
    """A hand comes down from rest at up to 2 m/s: the loop has ticked at its rate for a while before the contact."""
    loop, hand = plain_air
    for speed in (0.1, 0.5, 1.0, 2.0):
        hand.place(0.06, 0.0)
        now = loop.now
        for _ in range(400):
            now += PERIOD
            loop.tick(now)
        assert loop.rest.resting
        hand.place(0.06, -speed)
        beats = 0
        while not loop.out.force.any() and hand.height > -0.02:
            step = SLOW if loop.rest.resting else PERIOD
            beats = 0 if loop.rest.resting else beats + 1
            now += step
            hand.move(step)
            loop.tick(now)
        assert loop.out.force.any()
        assert beats >= 5
