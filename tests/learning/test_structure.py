"""How many units: the smallest network that meets a target, by growth, by pruning, for every form."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from laws.beams import INPUT, OUTPUTS, stiffening
from palpate.learning import refine, refined_network
from palpate.learning.starts import units_at_residuals
from palpate.learning.structure import grow, prune
from palpate.rbf.forms import unit_form
from palpate.rbf.regressors import Regressors

RADIALS = ("gaussian", "inverse-multiquadric", "matern-5/2")


def bumps(N, seed=0):
    """Two rotated bumps of two inputs."""
    X = np.random.default_rng(seed).uniform(-1, 1, (N, 2))
    q = lambda c, a, b: (a * (X[:, 0] - c) + b * X[:, 1]) ** 2 + 2 * (X[:, 1] - c) ** 2  # noqa: E731
    return X, np.column_stack([np.exp(-q(0.3, 1, 2)), np.exp(-q(-0.4, 2, -1)) + X[:, 0]])


@pytest.mark.full
def test_refined_network_is_the_smallest_that_meets_the_target():
    X, Y = stiffening(26)
    unseen, answers = stiffening(333)
    network, found, trials = refined_network(X, Y, INPUT, OUTPUTS, target=1e-5)
    assert [t.units for t in trials] == list(range(network.units + 1))
    assert found.loo <= 1e-5 < min(t.error for t in trials[:-1])
    assert np.abs(network.predict(unseen) - answers).max() < 2e-5


@pytest.mark.grid
@pytest.mark.parametrize("radial", RADIALS)
def test_refined_networks_of_every_radial_function_are_frozen_as_they_are(radial):
    X, Y = stiffening(26)
    network, found, _ = refined_network(X, Y, INPUT, OUTPUTS, units_max=3, radial=radial, tail="constant")
    assert network.radial == radial
    scaled = found.predict(network.scaling.scale_inputs(X))
    again = network.scaling.scale_outputs(network.predict(X))
    np.testing.assert_allclose(again, scaled, atol=1e-9 * np.abs(found.weights).max())
    assert np.abs(network.predict(X) - Y).max() < 2e-3


def test_units_are_limited_by_the_samples_there_are():
    X, Y = stiffening(6)
    network, _, _ = refined_network(X, Y, INPUT, OUTPUTS, target=0.0, units_max=50)
    assert network.units <= 1


def test_growth_goes_on_to_the_target():
    X, Y = bumps(200)
    r = Regressors(unit_form("rotated", 2))
    found, trials = grow(X, Y, r, target=1e-3, units_max=12)
    assert found.loo <= 1e-3
    assert trials[0].units == 0
    assert trials[-1].units == len(found.theta) < 12
    unseen, answers = bumps(300, seed=1)
    assert np.sqrt(((found.predict(unseen) - answers) ** 2).mean()) < 3e-3


def test_growth_stops_at_the_limit():
    X, Y = bumps(60)
    found, trials = grow(X, Y, Regressors(unit_form("isotropic", 2)), target=0.0, units_max=5)
    assert max(t.units for t in trials) == 5
    assert found.loo == min(t.error for t in trials)


@pytest.mark.full
@pytest.mark.parametrize("N", [6, 12, 20])
@pytest.mark.parametrize("n", [1, 2])
def test_noise_is_never_learnt(N, n):
    """Independent noise of variance one: whatever was fitted misses the next sample by one at least."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        X, Y = rng.uniform(-1, 1, (N, n)), rng.normal(size=(N, 1))
        found, trials = grow(X, Y, Regressors(unit_form("axis-aligned", n)), target=1e-3, units_max=40)
        assert all(t.error > 0.1 for t in trials)
        assert found.loo > 0.1


def test_growth_has_room_for_what_slopes_decide_as_well():
    X = np.linspace(-1, 1, 11)[:, None]
    r = Regressors(unit_form("axis-aligned", 1))
    curve, slope = np.sin(5 * X), 5 * np.cos(5 * X)
    fit = functools.partial(refine, slopes=slope[:, :, None], iterations=20)
    plain = grow(X, curve, r, target=0.0, units_max=40)[1]
    sloped = grow(X, curve, r, target=0.0, units_max=40, fit=fit)[1]
    assert max(t.units for t in plain) == (11 - 2) // 3
    assert max(t.units for t in sloped) == (22 - 2) // 3


def test_new_units_stand_where_the_error_is():
    X, Y = bumps(200)
    found = refine(X, Y, np.zeros((0, 3)), Regressors(unit_form("isotropic", 2)))
    new = units_at_residuals(X, Y, found, 3)[:, :2]
    error = ((Y - found.predict(X)) ** 2).sum(axis=1)
    np.testing.assert_array_equal(new[0], X[error.argmax()])
    assert min(np.linalg.norm(new[i] - new[j]) for i in range(3) for j in range(i)) > 0.1


def test_pruning_finds_back_to_the_units_that_made_the_data():
    r = Regressors(unit_form("axis-aligned", 1))
    X = np.linspace(-1, 1, 60)[:, None]
    truth = np.array([[-0.4, np.log(0.4)], [0.5, np.log(0.6)]])
    Y = r.phi(X, truth) @ np.array([[1.0, -0.5], [0.3, 2.0]])
    start = np.vstack([truth + 0.02, [[0.0, 0.0], [-0.9, -0.5], [0.9, -0.3]]])
    fit = functools.partial(refine, iterations=300)
    found, trials = prune(X, Y, fit(X, Y, start, r), target=1e-5, fit=fit)
    assert len(found.theta) == 2
    assert found.loo <= 1e-5 < trials[-1].error
    assert [t.units for t in trials] == [4, 3, 2, 1]


def test_pruning_keeps_what_already_misses_the_target():
    X, Y = bumps(60)
    found, _ = grow(X, Y, Regressors(unit_form("isotropic", 2)), target=0.0, units_max=3)
    kept, trials = prune(X, Y, found, target=0.0)
    assert kept is found
    assert len(trials) == 1
