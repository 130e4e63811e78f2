"""The three laws of the last stage, on any sequence of forces and gates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import UsageError
from palpate.runtime.safety import Limits, PlaceCheck, Safety, Stop, stalled

PERIOD = 1e-3
component = st.floats(-1e3, 1e3)
history = st.lists(
    st.tuples(st.tuples(component, component, component), st.booleans(), st.integers(1, 40)), max_size=12
)
limits = st.builds(Limits, st.floats(0.1, 50.0), st.floats(50.0, 1e4), st.floats(0.05, 0.5))


def sent(limits, pieces):
    """(gate, wanted, force, ticks since the gate opened) of every tick of a piecewise constant history."""
    safety = Safety(limits, PERIOD, np.zeros(3))
    age = 0
    for wanted, gate, ticks in pieces:
        for _ in range(ticks):
            safety.apply(np.array(wanted), gate=gate)
            if gate:
                safety.slew()
            age = age + 1 if gate else 0
            yield gate, np.array(wanted), safety.force.copy(), age


@pytest.mark.full
@settings(deadline=None)  # a shared machine's pauses are no failures
@given(limits, history)
def test_limit_slew_and_gate(limits, pieces):
    before = np.zeros(3)
    for gate, _, force, _ in sent(limits, pieces):
        assert np.linalg.norm(force) <= limits.max_force * (1 + 1e-12)
        if gate:
            assert np.linalg.norm(force - before) <= limits.slew * PERIOD * (1 + 1e-9)
        else:
            assert not force.any()
        before = force


@settings(deadline=None)  # a shared machine's pauses are no failures
@given(limits, history)
def test_ramp_bounds_the_force_after_every_opening(limits, pieces):
    for gate, _, force, age in sent(limits, pieces):
        if gate:
            assert (
                np.linalg.norm(force) <= limits.max_force * min(1.0, (age - 1) * PERIOD / limits.ramp) + 1e-9
            )


@settings(deadline=None)  # a shared machine's pauses are no failures
@given(limits, st.tuples(component, component, component))
def test_clamp_keeps_the_direction(limits, wanted):
    wanted = np.array(wanted)
    settle = int((limits.ramp + limits.max_force / limits.slew) / PERIOD) + 3
    *_, (_, _, force, _) = sent(limits, [(tuple(wanted), True, settle)])
    size = np.linalg.norm(wanted)
    expected = wanted * min(1.0, limits.max_force / size) if size > 0.0 else wanted
    np.testing.assert_allclose(force, expected, atol=1e-9 * limits.max_force)


def test_clamped_says_so():
    safety = Safety(Limits(2.0), PERIOD, np.zeros(3))
    safety.apply(np.array([0.0, 3.0, 0.0]), gate=True)
    assert safety.clamped
    safety.apply(np.array([0.0, 1.9, 0.0]), gate=True)
    assert not safety.clamped


def test_the_slew_holds_for_all_that_is_sent_and_damping_does_not_add_up():
    """A damper that pushes more than the slew allows a tick is reached by and by, and is not subtracted from itself."""
    limits, damping = Limits(2.0, slew=100.0), np.array([0.0, 0.0, 1.0])
    safety = Safety(limits, PERIOD, np.zeros(3))
    before = np.zeros(3)
    for wanted in [*np.linspace(0.0, 1.5, 200), *np.full(100, 1.5)]:
        safety.apply(np.array([0.0, wanted, 0.0]), gate=True)
        safety.force -= damping
        changed = safety.slew()
        step = np.linalg.norm(safety.force - before)
        assert step <= 0.1 + 1e-12
        assert not changed or step == pytest.approx(0.1)
        before = safety.force.copy()
    np.testing.assert_allclose(safety.force, [0.0, 1.5, -1.0])


@pytest.mark.parametrize(
    "arguments",
    [(0.0,), (-1.0,), (math.inf,), (math.nan,), (1.0, -1.0), (1.0, 1.0, 0.049), (1.0, 1.0, math.nan)],
)
def test_limits_that_protect_nobody_are_refused(arguments):
    with pytest.raises(UsageError):
        Limits(*arguments)


def test_stall_is_an_age():
    assert not stalled(1.0, 1.0 - 0.0199, 0.02)
    assert stalled(1.0, 1.0 - 0.0201, 0.02)
    assert stalled(1.0, -math.inf, 0.02), "never heard of"
    assert stalled(1.0, math.nan, 0.02)
    assert stalled(1.0, 1.0, math.nan)


def test_damping_warms_the_motors_too():
    """A body that pushes little, and damping on top of it: what is allowed comes down to the continuous force."""
    limits = Limits(10.0, continuous=4.0)
    safety = Safety(limits, 0.01, np.zeros(3))
    squares = []
    for _ in range(6000):
        safety.apply(np.array([0.0, 1.0, 0.0]), gate=True)
        safety.force *= safety.bearable_force / max(np.linalg.norm(safety.force), 1e-9)
        squares.append(float(safety.force @ safety.force))
    mean = np.convolve(squares, np.ones(1000) / 1000, mode="valid")  # of ten seconds
    assert max(squares) == pytest.approx(limits.max_force**2)
    assert mean[-1] <= limits.continuous**2 * 1.1


def test_warm_motors_get_their_continuous_force():
    """At the limit for a minute: at first the largest force, at last no more than the motors bear for long."""
    period, limits = 0.01, Limits(10.0, continuous=4.0)
    safety = Safety(limits, period, np.zeros(3))
    squares = []
    for _ in range(6000):
        safety.apply(np.array([0.0, 20.0, 0.0]), gate=True)
        squares.append(float(safety.force @ safety.force))
    assert max(squares) == pytest.approx(limits.max_force**2)
    mean = np.convolve(squares, np.ones(1000) / 1000, mode="valid")  # of ten seconds
    assert math.sqrt(squares[-1]) == pytest.approx(limits.continuous, rel=0.05)
    assert mean[-1] <= limits.continuous**2 * 1.1
    for _ in range(6000):
        safety.apply(np.zeros(3), gate=False)
    for _ in range(20):
        safety.apply(np.array([0.0, 20.0, 0.0]), gate=True)
    assert np.linalg.norm(safety.force) == pytest.approx(limits.max_force), "they have cooled"


def seen(check, places, time=0.0):
    """Doubts and fault after each place (x along one axis, m), a millisecond apart."""
    found = []
    for k, x in enumerate(places):
        check.see(x, 0.0, 0.0, time + 1e-3 * k, time + 1e-3 * k)
        found.append((check.doubts, check.fault))
    return found


@pytest.mark.parametrize(
    ("places", "faults"),
    [
        ([0.0, 0.004, 0.008, 0.004], [False] * 4),  # 4 m/s
        ([0.0, 0.05, 0.0, 0.05, 0.0], [False] * 5),  # single bad samples
        ([0.0, 0.05, 0.05, 0.0], [False] * 4),
        (
            [0.0, 0.05, 0.05, 0.05, 0.05, 0.052],
            [False, False, False, True, False, False],
        ),  # then it is the place
        ([0.2, 0.2, 0.2, 0.2], [False, False, True, True]),  # out of reach from the start
        (
            [0.0, *[0.2] * 4, *[0.0] * 14],
            [False] * 3 + [True] * 12 + [False] * 4,
        ),  # the count leaks by a tenth
    ],
    ids=["fast", "sparks", "two", "leap", "far", "far and back"],
)
def test_places_that_cannot_be_are_doubted_and_then_a_fault(places, faults):
    assert [fault for _, fault in seen(PlaceCheck(0.15, 5.0, PERIOD), places)] == faults


def in_three_axes(x):
    """Places (N, 3), m, that move as x (N,) along a direction of no axis."""
    return np.outer(x, [0.48, 0.6, 0.64])


def checked(places, period, times=None, **traits):
    """Samples that were doubted, and the first ones with a fault, of places (N, 3) that come every `period`, s."""
    check, doubted, faults = PlaceCheck(0.15, 5.0, PERIOD, **traits), [], []
    for k, place in enumerate(places):
        check.see(*place.tolist(), k * period if times is None else times[k], k * period)
        doubted += [k] if check.doubts else []
        faults += [k] if check.fault else []
    return doubted, faults


def fast_hand(times):
    """A hand that shakes as fast as a hand can: 5 cm at 6 Hz, 71 m/s² and 1.9 m/s."""
    return in_three_axes(0.05 * np.sin(2.0 * math.pi * 6.0 * times))


@pytest.mark.parametrize("period", [1e-3, 5e-3], ids=["1 kHz", "200 Hz"])
@pytest.mark.parametrize("stroke", [0.004, 0.02], ids=["4 mm", "2 cm"])
@pytest.mark.parametrize("moving", [0.0, 1.0], ids=["held still", "moving"])
def test_places_to_and_fro_are_a_fault_that_stays(period, stroke, moving):
    """The handle would have to turn at once; a count of doubts in a row begins anew at each good sample."""
    noise = np.random.default_rng(3).normal(0.0, 1e-4, (200, 3))
    places = noise + moving * fast_hand(period * np.arange(200)) / 5.0
    places[1::2] += in_three_axes([stroke])
    _, faults = checked(places, period)
    assert faults[0] < 12
    assert faults == list(range(faults[0], 200))


@pytest.mark.parametrize("period", [1e-3, 5e-3], ids=["1 kHz", "200 Hz"])
def test_a_glitch_in_eleven_samples_is_passed_over_for_ever_and_one_in_five_is_a_fault(period):
    for every, bad in ((11, False), (50, False), (5, True)):
        places = fast_hand(period * np.arange(5000)) / 5.0
        glitches = np.arange(7, 5000, every)
        places[glitches] += in_three_axes(np.where(glitches % 2, 0.05, -0.02))
        doubted, faults = checked(places, period)
        assert set(glitches) <= set(doubted)
        assert bool(faults) == bad


@pytest.mark.parametrize("period", [1e-3, 5e-3], ids=["1 kHz", "200 Hz"])
@pytest.mark.parametrize("sensor", ["true", "noise of 0.3 mm", "steps of 0.1 mm", "late by up to 0.2 ms"])
def test_fast_hands_and_the_noise_of_sensors_are_no_fault(period, sensor):
    times = period * np.arange(10000)
    rng = np.random.default_rng(4)
    if sensor.startswith("late"):
        times = times - rng.uniform(0.0, 2e-4, 10000)
    places = fast_hand(times)
    if sensor.startswith("noise"):
        places = places + rng.normal(0.0, 3e-4, (10000, 3))
    if sensor.startswith("steps"):
        places = np.round(places / 1e-4) * 1e-4
    doubted, faults = checked(places, period)
    assert not faults
    assert len(doubted) <= 10, "one in a thousand"


@pytest.mark.parametrize("period", [1e-3, 5e-3], ids=["1 kHz", "200 Hz"])
def test_a_handle_that_hits_its_end_stop_is_doubted_once_and_followed(period):
    places = in_three_axes(np.minimum(4.0 * period * np.arange(60), 0.1))  # 4 m/s, and then none
    doubted, faults = checked(places, period)
    assert len(doubted) == 1
    assert not faults


def test_a_sensor_of_more_noise_is_granted_what_it_states():
    places = np.random.default_rng(5).normal(0.0, 1e-3, (3000, 3))
    assert checked(places, PERIOD)[1]
    assert not checked(places, PERIOD, noise=1e-3)[1]


def test_doubts_end_in_a_fault_after_15_ms_also_of_a_slow_source():
    check = PlaceCheck(0.15, 5.0, PERIOD)
    check.see(0.0, 0.0, 0.0, 1.0, 1.0)
    faults = []
    for k in range(1, 21):  # one bad sample, 20 ticks
        check.see(0.5, 0.0, 0.0, 1.001, 1.0 + 1e-3 * k)
        faults.append(check.fault)
    assert faults.index(True) in {15, 16}


def test_a_stop_wins_over_a_resume_and_needs_no_held_button():
    stop = Stop()
    stop.heed(0, 0, pressed=False)
    assert not stop.stopped
    stop.heed(0, 0, pressed=True)
    stop.heed(0, 0, pressed=False)
    assert stop.stopped
    stop.heed(0, 1, pressed=True)
    assert stop.stopped, "resumed while the button is pressed"
    stop.heed(0, 2, pressed=False)
    assert not stop.stopped
    stop.heed(1, 3, pressed=False)
    assert stop.stopped, "of both the stop counts"
