"""Two tools on one body: each feels its own force far apart, and pairs that are too near are refused."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest
from touch_made import PROBE, SOFT, touch_energy

from palpate.errors import UsageError
from palpate.surrogates.two_tools import APART, two_tool_forces

DEEP = np.array([[0.0, 0.0, 0.009]])  # m: a ball of 10 mm, 1 mm deep


def test_two_tools_far_apart_feel_their_own_forces():
    energy, radius = touch_energy(), np.sqrt(2 * 0.010 * 0.001)
    far = DEEP + np.array([1.01 * APART * radius, 0.0, 0.0])
    first, second = two_tool_forces(energy, DEEP, far)
    np.testing.assert_array_equal(first, energy.force(DEEP))
    np.testing.assert_array_equal(second, energy.force(far))
    with pytest.raises(UsageError, match="learn both tools together"):
        two_tool_forces(energy, DEEP, DEEP + np.array([0.99 * APART * radius, 0.0, 0.0]))


def test_a_radius_that_is_an_input_counts():
    energy = touch_energy(extra=(SOFT, PROBE), radius_at=4, radius=np.nan)
    deep = np.array([[0.0, 0.0, 0.009, (SOFT.low + SOFT.high) / 2, PROBE.high]])
    radius = np.sqrt(2 * PROBE.high * energy.depth(deep)[0])
    for share, refused in ((0.99, True), (1.01, False)):
        other = deep + np.array([share * APART * radius, 0.0, 0.0, 0.0, 0.0])
        with pytest.raises(UsageError, match="learn both") if refused else nullcontext():
            two_tool_forces(energy, deep, other)


def test_places_of_unequal_number_are_refused():
    with pytest.raises(UsageError, match="2 places of the first tool and 3"):
        two_tool_forces(touch_energy(), np.tile(DEEP, (2, 1)), np.tile(DEEP, (3, 1)))
