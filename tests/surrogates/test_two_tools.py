"""Two tools on one body: each feels its own force far apart, and pairs that are too near are refused."""

from __future__ import annotations

import numpy as np
import pytest
from touch_made import touch_energy

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
