"""Inputs whose scale is bent: ratios become steps, derivatives are those of the formula, and nothing is infinite."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from network.networks import any_network, formula, points
from palpate.errors import UsageError
from palpate.learning.arrays.input_bends import choose_bends, log_bend
from palpate.network import Network, Scaling
from palpate.network.network_kernels import gram
from palpate.units import Range, bounds

RANGES = (Range("k", 5.0, 50.0), Range("h", -40.0, -10.0), Range("s", -1.0, 1.0))
BENDS = np.array([log_bend(r.low, r.high) for r in RANGES])


def bent(m: int = 2, **more) -> Network:
    """A random network of these ranges, the first two bent."""
    plain = any_network(3, m, 9, **more)
    outer = Scaling.of(RANGES, np.zeros((1, m)), bends=BENDS)
    scaling = dataclasses.replace(
        outer, output_centre=plain.scaling.output_centre, output_scale=plain.scaling.output_scale
    )
    return dataclasses.replace(plain, inputs=RANGES, scaling=scaling)


def test_the_ends_and_the_geometric_mean_of_a_range_are_at_minus_one_one_and_zero():
    scaling = bent().scaling
    low, high = bounds(RANGES)
    np.testing.assert_allclose(scaling.scale_inputs(np.array([low, high])), [[-1] * 3, [1] * 3], atol=1e-14)
    np.testing.assert_allclose(scaling.scale_inputs(np.array([np.sqrt(250.0), -20.0, 0.0])), 0.0, atol=1e-14)
    X = np.random.default_rng(0).uniform(low, high, (50, 3))
    np.testing.assert_allclose(scaling.unscale_inputs(scaling.scale_inputs(X)), X, rtol=1e-13)
    assert not any_network(3, 2, 4).scaling.is_bent
    assert log_bend(-1.0, 1.0) == 0.0


@pytest.mark.parametrize("modes", [None, 2])
@pytest.mark.parametrize("radial", ["gaussian", "inverse-multiquadric", "matern-5/2"])
def test_values_and_derivatives_are_those_of_the_formula(radial, modes):
    network = bent(5, radial=radial, modes=modes)
    X = points(network, 20)
    np.testing.assert_allclose(network.predict(X), formula(network, X), rtol=1e-11, atol=1e-11)
    only, evaluator = network.select([1]), network.evaluator(jacobian=True)
    step = np.diag(1e-20 * np.ones(3))
    for x in X:
        slopes = np.array([formula(network, (x + 1j * d)[None])[0].imag / 1e-20 for d in step]).T
        np.testing.assert_allclose(network.jacobian(x), slopes, rtol=1e-9, atol=1e-11)
        np.testing.assert_array_equal(evaluator(x), network.predict(x[None])[0])
        np.testing.assert_array_equal(evaluator.jacobian, network.jacobian(x))
        # differences of slopes that are exact to rounding
        near = 1e-5 * np.diag(np.ptp(bounds(RANGES), axis=0))
        twice = [(only.jacobian(x + d)[0] - only.jacobian(x - d)[0]) / (2 * d.max()) for d in near]
        np.testing.assert_allclose(only.hessian(x), twice, rtol=1e-5, atol=1e-6 * np.abs(twice).max())


def test_far_outside_of_the_range_answers_and_slopes_are_finite_and_agree():
    network = bent()
    for k in (-1e3, -20.0, -5.0, 1e3):  # the first lies beyond the end that the bent scale would have
        x = np.array([k, -20.0, 0.3])
        assert np.isfinite(network.predict(x[None])).all()
        d = np.array([1e-4, 0.0, 0.0])
        slope = (network.predict((x + d)[None]) - network.predict((x - d)[None]))[0] / 2e-4
        np.testing.assert_allclose(network.jacobian(x)[:, 0], slope, rtol=1e-5, atol=1e-7)


def test_it_is_saved_with_its_bends_and_a_hands_energy_refuses_them(tmp_path):
    network = bent()
    back = Network.load(network.save(tmp_path / "bent.palpate"))
    np.testing.assert_array_equal(back.scaling.input_bend, BENDS)
    X = points(network, 5)
    np.testing.assert_array_equal(back.predict(X), network.predict(X))
    with pytest.raises(UsageError, match="bent scales"):
        gram(network.select([0]), 2)
    with pytest.raises(UsageError, match="bent by one or more"):
        dataclasses.replace(
            network, scaling=dataclasses.replace(network.scaling, input_bend=np.array([1.0, 0, 0]))
        )


def test_an_input_that_is_divided_by_is_bent_and_one_that_multiplies_is_not():
    ranges = (Range("flux", 1.0, 10.0), Range("conductivity", 1.0, 10.0), Range("offset", -1.0, 1.0))
    X = np.random.default_rng(0).uniform(*bounds(ranges), (60, 3))
    bends = choose_bends(X, [(X[:, 0] / X[:, 1] + X[:, 2])[:, None]], ranges)
    assert bends[1] > 0.0
    assert bends[2] == 0.0
    np.testing.assert_array_equal(choose_bends(X, [X @ np.eye(3)], ranges), 0.0)
