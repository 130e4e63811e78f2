"""Spaces, designs and the order in which samples are solved."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc

from palpate.errors import UsageError
from palpate.sweeps import DESIGNS, Space, grid, random, sobol
from palpate.sweeps.plan import neighbour_chains
from palpate.sweeps.space import design_points
from palpate.units import Range

LINE = Space([Range("P", 0.0, 5.0, "N")])
BOX = Space([Range("P", -1.0, 5.0, "N"), Range("d", 0.001, 0.002, "m"), Range("t", 20, 40, "°C")])


def test_a_space_says_what_it_is():
    assert "P 0 … 5 N" in str(LINE)
    assert BOX.names == ("P", "d", "t")
    assert BOX["d"].unit == "m"
    with pytest.raises(UsageError, match="'q'") as caught:
        BOX["q"]
    assert "P, d, t" in caught.value.why


def test_a_space_needs_distinct_names():
    with pytest.raises(UsageError):
        Space([])
    with pytest.raises(UsageError):
        Space([Range("P", 0, 1), Range("P", 0, 2)])


def test_scaling_there_and_back():
    x = random(BOX, 50, seed=3)
    np.testing.assert_allclose(BOX.from_unit(BOX.to_unit(x)), x, rtol=1e-14)
    np.testing.assert_array_equal(BOX.from_unit(np.ones(3)), BOX.high)
    np.testing.assert_array_equal(BOX.from_unit(np.zeros(3)), BOX.low)


@pytest.mark.parametrize("bad", [[[1.0, 2.0]], [np.nan], [[[1.0]]]])
def test_points_of_another_shape_are_refused(bad):
    with pytest.raises(UsageError):
        LINE.points(bad)


def test_the_founding_grids():
    np.testing.assert_allclose(grid(LINE, step=0.01)[:, 0], np.arange(501) / 100, atol=1e-15)
    np.testing.assert_array_equal(grid(LINE, samples=501), grid(LINE, step=0.01))
    ten = Space([Range("P", 0.0, 10.0, "N")])
    assert len(grid(ten, step=0.05)) == 201


def test_a_grid_of_several_inputs():
    points = grid(BOX, counts=(2, 3, 4))
    assert points.shape == (24, 3)
    assert len(np.unique(points, axis=0)) == 24
    np.testing.assert_array_equal(points.min(axis=0), BOX.low)
    np.testing.assert_array_equal(points.max(axis=0), BOX.high)
    assert len(grid(BOX, samples=27)) == 27
    assert len(grid(BOX, samples=63)) == 27


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"samples": 3, "step": 1.0},
        {"step": 0.03},
        {"step": -1},
        {"step": 7},
        {"counts": 1},
        {"samples": 1},
    ],
)
def test_grids_that_cannot_be(arguments):
    with pytest.raises(UsageError):
        grid(LINE, **arguments)


@pytest.mark.parametrize("design", DESIGNS.values())
@pytest.mark.parametrize("samples", [8, 100, 127])
def test_designs_stay_inside_and_repeat(design, samples):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one, other = (design(BOX, samples, seed=5) for _ in range(2))
    assert one.shape[1] == 3
    assert len(one) <= samples
    assert (one >= BOX.low).all()
    assert (one <= BOX.high).all()
    np.testing.assert_array_equal(one, other)


def test_seeds_differ():
    assert not np.array_equal(sobol(BOX, 16, 0), sobol(BOX, 16, 1))
    assert not np.array_equal(random(BOX, 16, 0), random(BOX, 16, 1))


def test_sobol_fills_the_space_more_evenly_than_chance():
    even, chance = (qmc.discrepancy(BOX.to_unit(design(BOX, 256, 0))) for design in (sobol, random))
    assert even < chance / 3


def test_a_longer_sobol_design_begins_with_the_shorter():
    np.testing.assert_array_equal(sobol(BOX, 64, 0)[:40], sobol(BOX, 40, 0))


def test_a_design_of_ones_own():
    def corners(space, samples, seed):
        return np.array([space.low, space.high])

    np.testing.assert_array_equal(design_points(corners, BOX, 2, 0), [BOX.low, BOX.high])
    with pytest.raises(UsageError, match="'spiral'"):
        design_points("spiral", BOX, 2, 0)


@settings(deadline=None, max_examples=60)
@given(st.integers(1, 300), st.integers(1, 4), st.integers(0, 5))
def test_chains_hold_every_row_once(count, inputs, seed):
    unit = np.random.default_rng(seed).random((count, inputs))
    chains = neighbour_chains(unit, np.zeros(inputs))
    np.testing.assert_array_equal(np.sort(np.concatenate(chains)), np.arange(count))
    assert max(map(len, chains)) <= 32


def test_chains_of_one_input_are_ascending_intervals():
    unit = np.random.default_rng(0).permutation(501)[:, None] / 500
    chains = neighbour_chains(unit, np.zeros(1))
    np.testing.assert_array_equal(unit[np.concatenate(chains), 0], np.arange(501) / 500)


def test_chains_shorten_the_way_between_samples():
    unit = np.random.default_rng(0).random((512, 2))

    def way(rows):
        return np.linalg.norm(np.diff(unit[rows], axis=0), axis=1).mean()

    assert np.mean([way(rows) for rows in neighbour_chains(unit, np.zeros(2))]) < way(np.arange(512)) / 5
