"""The saturation that keeps the learnt factor within reach of its training."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.surrogates.continuation import Continuation, saturated
from palpate.units import Range

RANGES = [
    Range("c_x", 0.0, 0.1, "m"),
    Range("c_y", 0.0, 0.2, "m"),
    Range("c_z", 0.0, 0.012, "m"),
    Range("E", 4e3, 8e3),
]


def test_nothing_changes_up_to_the_edge():
    for t in (-7.0, 0.3, 1.0):
        assert saturated(t, 1.0, 0.25) == (t, 1.0, 0.0)


def test_beyond_it_ends_within_the_width_and_never_turns_back():
    t = np.linspace(1.0, 9.0, 4001)
    values, slopes, _ = np.array([saturated(v, 1.0, 0.25) for v in t]).T
    assert values.max() <= 1.25
    assert values[-1] == pytest.approx(1.25, rel=1e-15)
    assert (np.diff(values) >= 0).all()
    assert (slopes >= 0).all()


def test_slope_and_curvature_are_derivatives_and_meet_at_the_edge():
    t = np.linspace(1.001, 2.5, 300)
    h = 1e-4
    at = lambda x: np.array([saturated(v, 1.0, 0.25) for v in x]).T  # noqa: E731
    up, here, down = at(t + h), at(t), at(t - h)
    # third derivatives of tanh are below 4/w² per unit: h²/6 of them remain
    np.testing.assert_allclose((up[0] - down[0]) / (2 * h), here[1], atol=4 / 0.25**2 * h**2 / 6)
    np.testing.assert_allclose((up[1] - down[1]) / (2 * h), here[2], atol=24 / 0.25**3 * h**2 / 6)
    value, slope, curvature = saturated(1.0 + 1e-9, 1.0, 0.25)
    assert (value, slope, curvature) == pytest.approx((1.0, 1.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(("power", "steepest"), [(2.0, 1.2), (2.5, 3.6), (3.0, 12.0)])
def test_bending_a_growing_factor_down_leaves_the_stiffness_positive(power, steepest):
    """Along the depth, in units of the deepest trained one, with the default width of a quarter."""
    depth = np.linspace(1.0, 3.0, 4001)
    _, slope, curvature = np.array([saturated(s, 1.0, 0.25) for s in depth]).T
    for e in np.linspace(0.0, steepest - 0.01, 60):
        stiffness = (
            power * (power - 1) / depth**2 + 2 * power * e * slope / depth + e**2 * slope**2 + e * curvature
        )
        assert (stiffness > 0).all()


def test_widths_are_shares_of_the_ranges_positions_together():
    going = Continuation.of(RANGES, deepest=0.01)
    np.testing.assert_allclose(going.widths, [0.003, 0.003, 0.003, 1e3])
    assert (going.deepest, going.depth_width) == (0.01, 0.0025)


@pytest.mark.parametrize(
    "arguments",
    [
        ([1.0, 0.0], 1.0, 1.0),
        ([1.0, np.nan], 1.0, 1.0),
        ([1.0], -1.0, 1.0),
        ([1.0], 1.0, np.inf),
        ([[1.0]], 1.0, 1.0),
    ],
)
def test_widths_that_are_none_are_refused(arguments):
    with pytest.raises(UsageError, match=r"widths|Widths"):
        Continuation(*arguments)
