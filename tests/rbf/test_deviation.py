"""The filter's own deviation is H P Hᵀ + R, for every covariance it may keep."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laws.filters import COVARIANT, populated
from palpate.errors import UsageError
from palpate.learning import Settings, initial, observe
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.prediction import predictive_deviation, predictive_variance, value

N, M, H = 70, 3, 5  # more points than are taken at a time


def by_parameters(state, x, settings):
    """∂f/∂z (m, d) by central differences."""
    z, columns = state.vector(), []
    for i in range(z.size):
        step = np.zeros_like(z)
        step[i] = 1e-6
        high, low = (value(state.with_parameters(z + s), x, settings) for s in (step, -step))
        columns.append((high - low) / 2e-6)
    return np.array(columns).T


def joint(state):
    """P (d, d) in the order of z."""
    if state.covariance.matrix.shape[0] == state.vector().size:
        return state.covariance.matrix
    m, h, p_t = state.outputs, state.units, len(state.coefficients) - state.units
    P = state.covariance.matrix
    c, size = len(state.coefficients), state.unit_size
    dense = np.zeros((state.vector().size,) * 2)
    unit = m * p_t + size * np.arange(h)
    for j in range(m):
        mine = np.r_[j * p_t + np.arange(p_t), unit + j]
        dense[np.ix_(mine, mine)] = P[:c, :c]
    shapes = (unit[:, None] + np.arange(m, size)).ravel()
    dense[np.ix_(shapes, shapes)] = P[c:, c:]
    return dense


@pytest.mark.parametrize("form", ["axis-aligned", "rank-1"])
@pytest.mark.parametrize("update", COVARIANT)
def test_variance_is_that_of_the_linearised_network(update, form):
    settings = Settings(form=form, update=update)
    state = populated(2, M, H, settings)
    X = np.random.default_rng(1).uniform(-1, 1, (N, 2))
    found, P = predictive_variance(state, X, settings), joint(state)
    assert found.shape == (N, M)
    for i in (0, 1, 63, 64, 69):
        rows = by_parameters(state, X[i], settings)
        np.testing.assert_allclose(found[i], np.diag(rows @ P @ rows.T), rtol=1e-6)


@pytest.mark.parametrize("update", COVARIANT)
def test_deviation_adds_the_noise_and_holds_without_units(update):
    settings = Settings(update=update, noise=0.04, noise_share=0.5)
    state = replace(initial(2, M, settings), innovation=0.5)
    X = np.random.default_rng(1).uniform(-1, 1, (4, 2))
    tail = settings.tail_prior * (1 + (X**2).sum(axis=1))
    wanted = np.sqrt(tail + 0.25)[:, None].repeat(M, axis=1)
    np.testing.assert_allclose(predictive_deviation(state, X, settings), wanted, rtol=1e-12)
    quiet = replace(state, innovation=0.0)
    assert predictive_deviation(quiet, X, settings)[0, 0] == pytest.approx(np.sqrt(tail[0] + 0.04))
    assert predictive_deviation(state, X[:0], settings).shape == (0, M)


@pytest.mark.parametrize("update", COVARIANT)
def test_it_is_less_where_something_was_seen(update):
    settings = Settings(update=update, units_max=0, noise=1e-4, noise_share=0.0, gate=0.0)
    state, rng = initial(1, 1, settings), np.random.default_rng(0)
    for x in rng.uniform(-1, 0, (40, 1)):
        state = observe(state, Observation(x, 2 * x + 0.01 * rng.normal(size=1)), settings)[0]
    near, far = predictive_deviation(state, np.array([[-0.5], [5.0]]), settings)[:, 0]
    assert near < far
    assert near < 0.1


def test_the_gradient_rule_has_none():
    settings = Settings(update="gradient")
    with pytest.raises(UsageError, match="no predictive variance"):
        predictive_deviation(initial(2, 1, settings), np.zeros((3, 2)), settings)
