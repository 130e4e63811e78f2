"""Refinement against closed forms, and the way back to the filter."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from laws.beams import INPUT, OUTPUTS, exact, stiffening
from palpate.learning import Settings, initial, posterior, refine, refined_network, step
from palpate.learning.gaussian import activations, value
from palpate.learning.refine import _activations
from palpate.network import Scaling


def two_gaussians(X):
    phi = activations(X, np.array([[-0.4], [0.5]]), np.array([[0.5], [0.8]]))
    return phi @ np.array([[1.0, -0.5], [0.3, 2.0]]) + np.hstack([np.ones_like(X), X]) @ np.array(
        [[0.1, 0.2], [0.5, -1]]
    )


def test_a_network_of_the_same_form_is_found_again():
    X = np.linspace(-1, 1, 40)[:, None]
    found = refine(X, two_gaussians(X), np.array([[-0.7], [0.7]]), np.full((2, 1), 0.6), iterations=500)
    order = np.argsort(found.centres[:, 0])
    np.testing.assert_allclose(found.centres[order, 0], [-0.4, 0.5], atol=1e-4)
    np.testing.assert_allclose(found.widths[order, 0], [0.5, 0.8], atol=1e-4)
    assert found.rms < 1e-7
    assert found.converged


def test_without_units_it_is_least_squares():
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(30, 2)), rng.normal(size=(30, 3))
    found = refine(X, Y, np.zeros((0, 2)), np.ones((0, 2)))
    A = np.hstack([np.ones((30, 1)), X])
    np.testing.assert_allclose(found.tail, np.linalg.lstsq(A, Y, rcond=None)[0], rtol=1e-9)


def test_leave_one_out_in_closed_form_equals_leaving_one_out():
    rng = np.random.default_rng(1)
    X, Y = rng.normal(size=(15, 1)), rng.normal(size=(15, 2))
    found = refine(X, Y, np.zeros((0, 1)), np.ones((0, 1)))
    errors = []
    for i in range(15):
        rest = np.arange(15) != i
        A = np.hstack([np.ones((15, 1)), X])
        errors.append(Y[i] - A[i] @ np.linalg.lstsq(A[rest], Y[rest], rcond=None)[0])
    assert found.loo == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-9)


def test_derivatives_of_the_activations_equal_complex_step():
    rng = np.random.default_rng(2)
    X, theta = rng.uniform(-1, 1, (7, 3)), rng.normal(0, 0.4, (2, 4, 3))
    _, D = _activations(X, theta)
    for k in range(4):
        for p in range(6):
            moved = theta.astype(complex)
            moved[p // 3, k, p % 3] += 1e-30j
            t = (X[:, None, :] - moved[0]) / np.exp(moved[1])
            numeric = np.exp(-(t * t).sum(axis=2))[:, k].imag / 1e-30
            np.testing.assert_allclose(D[:, k, p], numeric, rtol=1e-10, atol=1e-14)


def test_cost_never_rises_with_iterations():
    X, Y = stiffening(26)
    s = Scaling.of(INPUT, Y)
    x, y = s.scale_inputs(X), s.scale_outputs(Y)
    start = np.linspace(-1, 1, 3)[:, None], np.full((3, 1), 0.8)
    errors = [refine(x, y, *start, iterations=k).rms for k in (0, 1, 3, 10, 40)]
    assert all(b <= a for a, b in itertools.pairwise(errors))
    assert errors[-1] < 0.2 * errors[0]


def test_refined_network_is_the_smallest_that_meets_the_target():
    X, Y = stiffening(26)
    unseen, answers = stiffening(333)
    network, found, trials = refined_network(X, Y, INPUT, OUTPUTS, target=1e-5)
    assert [t.units for t in trials] == list(range(network.units + 1))
    assert found.loo <= 1e-5 < min(t.loo for t in trials[:-1])
    assert np.abs(network.predict(unseen) - answers).max() < 2e-5


def test_units_are_limited_by_the_samples_there_are():
    X, Y = stiffening(6)
    network, _, _ = refined_network(X, Y, INPUT, OUTPUTS, target=0.0, units_max=50)
    assert network.units <= 1


def test_duplicate_samples_are_no_trouble():
    X, Y = stiffening(20)
    network, found, _ = refined_network(np.vstack([X, X]), np.vstack([Y, Y]), INPUT, OUTPUTS, units_max=3)
    assert np.isfinite(found.loo)
    assert np.abs(network.predict(X) - Y).max() < 1e-3


def test_posterior_of_a_linear_model_is_the_filters_own_covariance():
    rng = np.random.default_rng(3)
    X = rng.uniform(-1, 1, (30, 1))
    Y = 2 * X + 1 + 0.01 * rng.normal(size=(30, 1))
    settings = exact(noise=1e-2)
    state = initial(1, 1, settings)
    for x, y in zip(X, Y, strict=True):
        state, _ = step(state, x, y, settings)
    found = posterior(refine(X, Y, np.zeros((0, 1)), np.ones((0, 1))), X, settings)
    np.testing.assert_allclose(found.covariance, state.covariance, rtol=1e-8)


def test_learning_goes_on_from_the_posterior_without_harm():
    X, Y = stiffening(26)
    s = Scaling.of(INPUT, Y)
    x, y = s.scale_inputs(X), s.scale_outputs(Y)
    found = refine(x, y, np.linspace(-1, 1, 3)[:, None], np.full((3, 1), 0.8))
    settings = Settings(units_max=3, noise=max(found.rms**2, 1e-12))
    state = posterior(found, x, settings)
    unseen, answers = stiffening(211)
    u, v = s.scale_inputs(unseen), s.scale_outputs(answers)
    before = np.sqrt(((value(state, u, settings) - v) ** 2).mean())
    for i in np.random.default_rng(0).permutation(len(u)):
        state, _ = step(state, u[i], v[i], settings)
    after = np.sqrt(((value(state, u, settings) - v) ** 2).mean())
    assert after < 1.5 * before
    np.linalg.cholesky(state.covariance)
