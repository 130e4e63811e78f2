"""The presets of the family do what their papers say, where that differs from ours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.learning import initial, step
from palpate.rbf.filter.growth import significance
from palpate.rbf.filter.settings import gap, ggap, mran, ran, ran_ekf


def shown(settings, *samples):
    """States after each of the samples (x, y)."""
    state = initial(np.size(samples[0][0]), 1, settings)
    states = []
    for x, y in samples:
        state, _ = step(state, np.atleast_1d(np.asarray(x, float)), np.array([float(y)]), settings)
        states.append(state)
    return states


@pytest.mark.parametrize("preset", [ran, ran_ekf, mran, gap, ggap])
def test_a_unit_has_one_width(preset):
    assert preset().regressors(3).form.size == 3 + 1


@pytest.mark.parametrize("preset", [ran, ran_ekf, mran])
def test_the_network_has_a_bias(preset):
    assert preset().regressors(3).tail_size == 1


def test_a_new_width_is_the_overlap_times_the_distance_however_far():
    # Platt 1991: ε_max bounds the width of the first unit alone, which has no neighbour
    settings = replace(ran_ekf(), distance_max=0.5, overlap=0.8, error_min=0.01)
    first, second = shown(settings, (-1.0, 1.0), (1.0, -2.0))
    assert first.widths(settings)[0, 0] == pytest.approx(0.8 * 0.5)
    assert second.widths(settings)[1, 0] == pytest.approx(0.8 * 2.0)


@pytest.mark.parametrize("preset", [ran, ran_ekf, mran, gap])
def test_an_observation_that_adds_a_unit_changes_nothing_else(preset):
    settings = replace(preset(), distance_max=0.5, error_min=0.01, wait_for_window=False)
    before, after = shown(settings, (-1.0, 1.0), (1.0, -2.0))
    assert after.units == before.units + 1
    assert np.array_equal(after.theta[:1], before.theta)
    assert np.array_equal(after.weights[:1], before.weights)
    assert np.array_equal(after.tail, before.tail)


def test_least_mean_squares_leaves_widths_alone():
    settings = replace(ran(), distance_max=0.5, error_min=0.01)
    before, after = shown(settings, (0.0, 1.0), (0.1, 0.5))
    assert after.units == 1
    assert np.array_equal(after.widths(settings), before.widths(settings))
    assert not np.array_equal(after.centres(settings), before.centres(settings))


def test_significance_is_the_mean_over_the_range():
    settings = gap()
    theta = settings.regressors(2).form.unit(np.array([0.1, -0.2]), 0.15)[None]
    side = np.linspace(-1.0, 1.0, 401)
    points = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    mean = 3.0 * settings.regressors(2).phi(points, theta).mean()
    found = significance(initial(2, 1, settings), theta, np.array([3.0]), settings)[0]
    assert found == pytest.approx(mean, rel=0.01)


def test_the_first_unit_is_not_judged_by_its_significance():
    # its width is no distance to another: at ε_max = 0.1 it would hardly count, and none would ever be added
    settings = replace(gap(), distance_max=0.1, distance_min=0.01, error_min=0.1)
    first, second = shown(settings, (-0.9, 1.0), (0.9, 2.0))
    assert (first.units, second.units) == (1, 2)


def test_an_insignificant_unit_is_removed_once_it_is_the_nearest():
    settings = replace(gap(), distance_max=0.1, distance_min=0.01, error_min=0.1)
    *_, grown, judged = shown(settings, (-0.9, 1.0), (0.9, 2.0), (-0.9, 1.0))
    assert grown.units == 2
    assert judged.units == 1
    assert judged.centres(settings)[0, 0] == pytest.approx(0.9)
