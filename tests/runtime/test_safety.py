"""The three laws of the last stage, on any sequence of forces and gates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import UsageError
from palpate.runtime.safety import Limits, Safety, stalled

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
            age = age + 1 if gate else 0
            yield gate, np.array(wanted), safety.force.copy(), age


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
