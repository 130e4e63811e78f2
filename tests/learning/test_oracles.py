"""What must hold of the sequential filter by mathematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laws.beams import INPUT, OUTPUTS, exact, stiffening
from palpate.learning import State, default, founding, freeze, initial, learn, step
from palpate.learning.ekf import updated
from palpate.learning.gaussian import activations, jacobian, value
from palpate.learning.growth import grown
from palpate.learning.pruning import without
from palpate.network import Scaling
from palpate.units import Quantity, Range


def populated(n: int, m: int, h: int, settings, seed: int = 0) -> State:
    """A random state with h units and a random symmetric positive definite P."""
    rng = np.random.default_rng(seed)
    state = initial(n, m, settings)
    for _ in range(h):
        state = grown(state, rng.uniform(-1, 1, n), rng.normal(size=m), settings)
    units = state.units.copy()
    units[:, m + n :] = (
        np.log(rng.uniform(0.4, 1.5, (h, n))) if settings.widths == "log" else rng.uniform(0.4, 1.5, (h, n))
    )
    A = rng.normal(size=state.covariance.shape)
    return replace(
        state,
        tail=rng.normal(size=state.tail.shape),
        units=units,
        covariance=A @ A.T / len(A) + np.eye(len(A)),
    )


@pytest.mark.parametrize("widths", ["log", "plain"])
@pytest.mark.parametrize("tail", ["affine", "constant", "none"])
def test_jacobian_equals_complex_step(widths, tail):
    settings = exact(widths=widths, tail=tail)
    state = populated(3, 4, 5, settings)
    x = np.array([0.3, -0.2, 0.7])
    _, H = jacobian(state, x, settings)
    z, step_size = state.vector(), 1e-30
    numeric = np.empty_like(H)
    for j in range(z.size):
        moved = z.astype(complex)
        moved[j] += 1j * step_size
        numeric[:, j] = _complex_value(state, moved, x, settings).imag / step_size
    np.testing.assert_allclose(H, numeric, rtol=1e-10, atol=1e-12)


def _complex_value(state, z, x, settings):
    """f(x) written out once more, for complex parameters."""
    tail, units = state.split(z)
    m, n = state.outputs, state.inputs
    sigma = np.exp(units[:, m + n :]) if settings.widths == "log" else units[:, m + n :]
    phi = np.exp(-(((x - units[:, m : m + n]) / sigma) ** 2).sum(axis=1))
    return tail @ np.concatenate([[1.0], x])[: tail.shape[1]] + phi @ units[:, :m]


def linear_problem(seed: int):
    """Random samples of a map that is linear in fixed regressors: the tail alone."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (40, 2))
    Y = np.hstack([np.ones((40, 1)), X]) @ rng.normal(size=(3, 2)) + 0.1 * rng.normal(size=(40, 2))
    return X, Y


@pytest.mark.parametrize("order", [0, 1, 2])
def test_sequential_equals_batch_ridge_in_any_order(order):
    settings = exact(noise=0.04, tail_prior=2.0)
    X, Y = linear_problem(3)
    state = initial(2, 2, settings)
    for i in np.random.default_rng(order).permutation(len(X)):
        state, _ = step(state, X[i], Y[i], settings)
    A = np.hstack([np.ones((len(X), 1)), X])
    ridge = np.linalg.solve(A.T @ A + settings.noise / settings.tail_prior * np.eye(3), A.T @ Y)
    np.testing.assert_allclose(state.tail.T, ridge, rtol=1e-10)


def test_covariance_of_a_linear_model_is_the_batch_posterior():
    settings = exact(noise=0.04, tail_prior=2.0)
    X, Y = linear_problem(4)
    state = initial(2, 2, settings)
    for x, y in zip(X, Y, strict=True):
        state, _ = step(state, x, y, settings)
    A = np.hstack([np.ones((len(X), 1)), X])
    one = np.linalg.inv(A.T @ A / settings.noise + np.eye(3) / settings.tail_prior)
    np.testing.assert_allclose(state.covariance, np.kron(np.eye(2), one), rtol=1e-9, atol=1e-14)


def test_relinearising_a_linear_model_changes_neither_estimate_nor_covariance():
    settings = exact()
    X, Y = linear_problem(5)
    once = updated(initial(2, 2, settings), X[0], Y[0], settings)
    often = updated(initial(2, 2, settings), X[0], Y[0], replace(settings, iterations=7))
    np.testing.assert_allclose(often.tail, once.tail, rtol=1e-13)
    np.testing.assert_allclose(often.covariance, once.covariance, rtol=1e-12, atol=1e-16)


def test_more_linearisations_come_closer_to_the_posterior_mode():
    settings = exact(noise=1e-4)
    state = populated(1, 2, 3, settings, seed=8)
    x = np.array([0.4])
    y = value(state, x, settings) + np.array([0.3, -0.2])

    def cost(z):
        d, e = z - state.vector(), y - value(state.moved(z), x, settings)
        return d @ np.linalg.solve(state.covariance, d) + e @ e / settings.noise

    costs = [cost(updated(state, x, y, replace(settings, iterations=k)).vector()) for k in (1, 10)]
    assert costs[1] < costs[0]


def test_a_unit_of_zero_weight_changes_no_prediction_when_added_or_removed():
    settings = exact()
    state = populated(2, 3, 4, settings)
    X = np.random.default_rng(1).uniform(-1, 1, (50, 2))
    scaling = Scaling(np.zeros(2), np.ones(2), np.zeros(3), np.ones(3))
    inputs, outputs = [Range("a", -1, 1), Range("b", -1, 1)], [Quantity(c) for c in "xyz"]

    def predictions(s):
        return freeze(s, settings, inputs, outputs, scaling).predict(X)

    more = grown(state, np.array([0.1, 0.2]), np.zeros(3), settings)
    fewer = without(more, np.array([4]))
    np.testing.assert_array_equal(predictions(more), predictions(state))
    np.testing.assert_array_equal(predictions(fewer), predictions(state))
    np.testing.assert_allclose(value(more, X, settings), predictions(state), rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(fewer.covariance, state.covariance)


def test_pruning_takes_the_units_own_rows_of_the_covariance():
    settings = exact()
    state = populated(2, 3, 4, settings)
    fewer = without(state, np.array([1]))
    keep = np.r_[0 : state.block(1).start, state.block(1).stop : len(state.covariance)]
    np.testing.assert_array_equal(fewer.covariance, state.covariance[np.ix_(keep, keep)])
    np.testing.assert_array_equal(fewer.units, state.units[[0, 2, 3]])


def test_a_new_unit_meets_its_observation():
    settings = exact()
    state = populated(2, 3, 2, settings)
    x, y = np.array([0.9, -0.9]), np.array([1.0, 2.0, 3.0])
    after = grown(state, x, y - value(state, x, settings), settings)
    np.testing.assert_allclose(value(after, x, settings), y, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("make", [default, founding])
def test_covariance_stays_symmetric_positive_definite(make):
    """10⁵ random steps at P₀ = 100 and R = 1e-4, with growth and pruning."""
    settings = replace(
        make(),
        prior=100.0,
        width_prior=100.0,
        tail_prior=100.0,
        noise=1e-4,
        prune_below=0.05,
        prune_after=20,
        units_max=5,
    )
    settings = replace(
        settings, iterations=1, forgetting=0.0
    )  # guards would make the steps smaller, not larger
    rng = np.random.default_rng(0)
    state, grew, pruned = initial(1, 1, settings), 0, 0
    for t in range(100_000):
        x = rng.uniform(-1, 1, 1)
        state, event = step(state, x, np.sin(3 * x) + 0.3 * np.sign(x) + 0.1 * rng.normal(size=1), settings)
        grew, pruned = grew + event.grew, pruned + event.pruned
        if t % 50 == 0 or event.grew or event.pruned:
            np.testing.assert_array_equal(state.covariance, state.covariance.T)
            if state.covariance.size:
                np.linalg.cholesky(state.covariance)
    assert grew > 20
    assert pruned > 20


def test_seed_decides_every_bit():
    X, Y = stiffening(60)
    runs = [learn(X, Y, INPUT, OUTPUTS, passes=2, seed=s) for s in (4, 4, 5)]
    np.testing.assert_array_equal(runs[0].state.vector(), runs[1].state.vector())
    np.testing.assert_array_equal(runs[0].state.covariance, runs[1].state.covariance)
    assert not np.array_equal(runs[0].history.error, runs[2].history.error)


def test_an_observation_that_is_not_finite_is_skipped_and_says_so():
    settings = default()
    state = populated(1, 2, 2, settings)
    after, event = step(state, np.array([np.nan]), np.zeros(2), settings)
    assert after is state
    assert event.why == "not finite"


def test_activations_at_a_centre_are_one():
    rng = np.random.default_rng(0)
    centres = rng.normal(size=(6, 3))
    phi = activations(centres, centres, np.full((6, 3), 0.5))
    np.testing.assert_array_equal(np.diag(phi), 1.0)
    assert (phi <= 1.0).all()
