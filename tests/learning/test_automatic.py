"""Thresholds from the data: noise as it is, better or equal with a tighter target, and words where it is missed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning import Settings, learn
from palpate.learning.learn import RUNGS, automatic, ranges_of
from palpate.learning.scatter import noise_variance, spacing
from palpate.rbf.sample_checks import relative_error, spread_of
from palpate.units import Quantity

TARGETS = (0.3, 0.03, 0.003)


def bump(N=60, noise=0.0, seed=0):
    """A bump beside a slope on [−1, 1], two outputs."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (N, 1))
    Y = np.hstack([np.exp(-4 * X**2) + 0.3 * X, np.tanh(3 * X)])
    return X, Y + noise * rng.normal(size=Y.shape)


def named(Y):
    return [Quantity(f"y{i}") for i in range(Y.shape[1])]


@pytest.mark.full
@pytest.mark.parametrize("sigma", [0.02, 0.2])
def test_noise_is_told_by_neighbours(sigma):
    X, Y = bump(500, sigma)
    assert np.sqrt(noise_variance(X, Y)) == pytest.approx(sigma, rel=0.15)
    plane = np.random.default_rng(1).uniform(-1, 1, (400, 3))
    noisy = plane @ [[3.0], [-2.0], [1.0]] + sigma * np.random.default_rng(2).normal(size=(400, 1))
    assert np.sqrt(noise_variance(plane, noisy)) == pytest.approx(sigma, rel=0.15)


def test_curvature_is_not_noise():
    X, Y = bump(200)
    assert noise_variance(X, Y) == 0.0
    plane = np.random.default_rng(1).uniform(-1, 1, (300, 2))
    assert noise_variance(plane, np.sin(6 * plane[:, :1]) * plane[:, 1:]) == 0.0


def test_too_little_tells_no_noise():
    X, Y = bump(6, 0.5)
    assert noise_variance(X, Y) == 0.0
    assert noise_variance(X, np.zeros_like(Y)) == 0.0
    # repeated measurements: what differs at one place is noise
    repeated = np.repeat(np.linspace(-1, 1, 4), 100)[:, None]
    noise = np.random.default_rng(0).normal(size=(400, 1))
    assert noise_variance(repeated, repeated + noise) == pytest.approx(1.0, rel=0.2)


def test_spacing_of_a_grid():
    grid = np.stack(np.meshgrid(np.arange(5) * 0.5, np.arange(5) * 0.5), axis=-1).reshape(-1, 2)
    assert spacing(np.vstack([grid, grid])) == pytest.approx(0.5)
    assert spacing(grid[:1]) == 0.0


@pytest.mark.full
def test_a_tighter_target_takes_finer_steps_and_is_reached():
    X, Y = bump()
    inputs, outputs = ranges_of(X), named(Y)
    places = np.linspace(-1, 1, 201)[:, None]
    truth = np.hstack([np.exp(-4 * places**2) + 0.3 * places, np.tanh(3 * places)])
    found = [learn(X, Y, inputs, outputs, target=t) for t in TARGETS]
    errors = [relative_error(f.network.predict(places), truth, spread_of(truth)) for f in found]
    steps = [f.settings.distance_min for f in found]
    assert steps == sorted(steps, reverse=True)
    assert errors[0] < TARGETS[0]
    assert errors[1] < TARGETS[1]
    assert errors[2] < 0.5 * errors[0]
    assert all(f.reached == (f.error <= t) for f, t in zip(found, TARGETS, strict=True))


@pytest.mark.full
def test_a_reached_target_and_a_missed_one_are_told():
    X, Y = bump(40)
    inputs, outputs = ranges_of(X), named(Y)
    reached = learn(X, Y, inputs, outputs, target=0.3)
    assert reached.reached
    assert "within the target of 3.0e-01" in str(reached)
    assert reached.error == relative_error(reached.network.predict(X), Y, spread_of(Y))
    missed = learn(X, Y, inputs, outputs, settings=replace(reached.settings, units_max=1), target=1e-6)
    assert not missed.reached
    assert "target of 1.0e-06 is not reached" in str(missed)
    assert "limit of 1 units" in str(missed)
    heldout = (X[:10], Y[:10] + 5.0)
    unlike = learn(X, Y, inputs, outputs, settings=reached.settings, target=0.3, heldout=heldout)
    assert unlike.error > 1.0  # judged by what was held out
    assert learn(X, Y, inputs, outputs, settings=reached.settings, passes=1).reached  # nothing was asked


@pytest.mark.full
def test_noise_is_named_as_the_limit():
    X, Y = bump(100, 0.3)
    told = learn(X, Y, ranges_of(X), named(Y), target=1e-3)
    assert told.settings.noise * np.abs(Y - Y.mean(axis=0)).max() ** 2 == pytest.approx(0.09, rel=0.4)
    assert "noise that neighbouring samples show" in str(told)
    assert told.settings.edge_weight == 1.0


def test_units_of_measurement_do_not_matter():
    X, Y = bump(40)
    # powers of two: not one bit may change
    assert automatic(X, Y, target=0.1) == automatic(1024.0 * X, Y / 4096.0, target=0.1)


def test_the_shape_of_the_data_decides_the_rules():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (12, 2))  # too few to try: settings at once
    assert automatic(X, rng.normal(size=(12, 1)), target=0.1).update == "full"
    assert automatic(X, rng.normal(size=(12, 30)), target=0.1).update == "shared"
    assert automatic(X, X, target=0.1).form == "rotated"
    assert automatic(rng.normal(size=(12, 5)), X, target=0.1).form == "axis-aligned"
    many = rng.uniform(-1, 1, (19, 20))
    assert automatic(many, rng.normal(size=(19, 1)), target=0.1).units_max == 0  # a plane takes all there is
    for constant in (np.zeros((30, 2)), np.full((30, 2), 0.3)):
        assert np.isfinite(automatic(rng.uniform(-1, 1, (30, 1)), constant, target=0.1).error_min)


def test_given_settings_stay():
    X, Y = bump(40)
    kept = automatic(X, Y, target=0.3, form="isotropic", radial="matern-5/2", passes=1)
    assert (kept.form, kept.radial) == ("isotropic", "matern-5/2")
    assert min(abs(kept.distance_min - step) for step, _ in RUNGS) < 1e-12
    with pytest.raises(UsageError, match="no such setting"):
        automatic(X, Y, target=0.1, units=3)


@pytest.mark.parametrize("target", [0.0, -1.0, float("nan"), float("inf"), "fine", True])
def test_a_target_is_a_positive_number(target):
    X, Y = bump(30)
    with pytest.raises(UsageError, match="target"):
        learn(X, Y, ranges_of(X), named(Y), target=target)


def test_ranges_of_inputs_that_do_not_vary():
    low, high = zip(
        *[(r.low, r.high) for r in ranges_of(np.array([[0.0, 1e9, 1.0], [0.0, 1e9, 3.0]]))], strict=True
    )
    assert low[2] == 1.0
    assert high[2] == 3.0
    assert low[0] == -0.5
    assert low[1] < 1e9 < high[1]


def test_defaults_are_left_alone():
    X, Y = bump(40)
    assert learn(X, Y, ranges_of(X), named(Y), passes=1).settings == Settings()
