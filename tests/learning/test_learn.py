"""The fold of the step: modes, weights and slopes of whole data sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laws.beams import exact
from palpate.errors import UsageError
from palpate.learning import PRESETS, default, initial, learn, step
from palpate.rbf.output_modes import output_modes
from palpate.units import Quantity, Range

PLANE = (Range("a", -2.0, 2.0, "m"), Range("b", 0.0, 1.0, "m"))


def bowl(N: int, seed: int = 0):
    """An energy J (N, 1) over two places m, and its slopes (N, 1, 2)."""
    rng = np.random.default_rng(seed)
    X = np.column_stack([rng.uniform(-2, 2, N), rng.uniform(0, 1, N)])
    Y = np.log(np.cosh(X[:, :1])) + 0.5 * X[:, :1] * X[:, 1:] ** 2
    slopes = np.stack([np.tanh(X[:, 0]) + 0.5 * X[:, 1] ** 2, X[:, 0] * X[:, 1]], axis=1)[:, None]
    return X, Y, slopes


@pytest.mark.parametrize("shape", [(40, 7), (10, 300)])
def test_modes_are_orthonormal_and_the_best_of_their_number(shape):
    """Eckart & Young 1936: no other directions of that number leave less."""
    rng = np.random.default_rng(0)
    Y = rng.normal(size=shape) * 0.6 ** np.arange(shape[1])
    V = output_modes(Y, 4)
    np.testing.assert_allclose(V.T @ V, np.eye(4), atol=1e-12)
    left = np.linalg.norm(Y - Y @ V @ V.T)
    np.testing.assert_allclose(left, np.sqrt((np.linalg.svd(Y, compute_uv=False)[4:] ** 2).sum()), rtol=1e-9)


def test_no_modes_where_they_would_be_all_directions():
    assert output_modes(np.ones((10, 3)), 3) is None


def test_many_outputs_are_learnt_through_few_modes():
    X, Y, _ = bowl(150)
    wide = np.random.default_rng(1).normal(size=(1, 400))
    outputs = [Quantity(f"u{i}", "m") for i in range(400)]
    settings = replace(PRESETS["shared"](), modes=1)
    learned = learn(X, Y @ wide, PLANE, outputs, settings=settings, passes=3)
    assert learned.state.modes.shape == (400, 1)
    unseen, truth, _ = bowl(200, seed=5)
    error = np.linalg.norm(learned.network.predict(unseen) - truth @ wide)
    assert error < 0.1 * np.linalg.norm(truth @ wide)


@pytest.mark.full
def test_slopes_in_physical_units_help():
    """A force is the slope of an energy: ten energies with their forces say more than ten energies."""
    X, Y, slopes = bowl(12)
    unseen, truth, _ = bowl(300, seed=5)
    energy = [Quantity("U", "J")]

    def error(**more):
        settings = replace(default(), distance_min=0.2, error_min=1e-3, error_rms_min=1e-3)
        network = learn(X, Y, PLANE, energy, settings=settings, passes=40, **more).network
        return np.linalg.norm(network.predict(unseen) - truth) / np.linalg.norm(truth)

    assert error(slopes=slopes) < 0.5 * error()


def test_weighted_samples_equal_repeated_ones_for_a_linear_model():
    X, Y, _ = bowl(20)
    settings = exact(tail="affine", noise=1e-2)
    energy = [Quantity("U", "J")]
    weights = np.where(np.arange(20) < 5, 3.0, 1.0)
    repeated = np.repeat(np.arange(20), weights.astype(int))
    scale = Y.mean(), np.abs(Y - Y.mean()).max()
    once = learn(X, Y, PLANE, energy, settings=settings, passes=1, weights=weights)
    state = initial(2, 1, settings)
    for i in repeated:
        state, _ = step(state, once.scaling.scale_inputs(X[i]), (Y[i] - scale[0]) / scale[1], settings)
    np.testing.assert_allclose(once.state.tail, state.tail, rtol=1e-9)


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ({"weights": np.ones(3)}, "Weights"),
        ({"weights": -np.ones(20)}, "Weights"),
        ({"weights": np.full(20, np.inf)}, "Weights"),
        ({"passes": 0}, "passes"),
        ({"passes": 1.5}, "passes"),
        ({"seed": -1}, "seed"),
        ({"settings": {}}, "Settings"),
        ({"slopes": np.zeros((20, 1, 2)), "slope_weight": float("nan")}, "Slope weights"),
        ({"heldout": (np.zeros((3, 2)), np.zeros(3))}, "Outputs"),
        ({"heldout": (np.zeros((0, 2)), np.zeros((0, 1)))}, "Inputs"),
        ({"slopes": np.zeros((20, 2, 1))}, "Slopes"),
        ({"slopes": np.full((20, 1, 2), np.nan)}, "Slopes"),
    ],
)
def test_weights_and_slopes_that_do_not_fit_are_refused(more, match):
    X, Y, _ = bowl(20)
    with pytest.raises(UsageError, match=match):
        learn(X, Y, PLANE, [Quantity("U", "J")], **more)
