"""Predictive intervals: coverage on unseen data, calibration, and the way through the network file."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning import refine
from palpate.network import Network, Scaling
from palpate.network.uncertainty import Uncertainty
from palpate.rbf.forms import unit_form
from palpate.rbf.freezing import freeze_refined
from palpate.rbf.refinement.posterior import Posterior
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

RANGES = (Range("Fx", -2.0, 2.0, "N"), Range("Fy", 0.0, 5.0, "N"))
SCALE = 0.03  # m


def response(X):
    """A smooth map with a kink, two inputs to four displacements."""
    x, y = X[:, 0] / 2, X[:, 1] / 2.5 - 1
    q = x * x + (y - 0.2 * x) ** 2
    kinked = np.sin(2 * y) - 0.3 * np.maximum(0.0, np.sin(2 * y) - 0.4)
    return SCALE * np.column_stack([np.exp(-q), kinked, x * y + np.tanh(2 * x), np.cos(3 * x)])


def sampled(N, noise, seed):
    rng = np.random.default_rng(seed)
    X = rng.uniform([-2, 0], [2, 5], (N, 2))
    return X, response(X) + noise * SCALE * rng.normal(size=(N, 4))


@cache
def learnt(noise, name="rotated", radial="gaussian", h=10):
    X, Y = sampled(250, noise, 1)
    scaling = Scaling.of(RANGES, Y)
    x, y = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    r = Regressors(unit_form(name, 2), radial)
    start = np.array([r.form.unit(a, 0.7, seed=i) for i, a in enumerate(x[:h])])
    found = refine(x, y, start, r, iterations=40, ridge=1e-9)
    outputs = tuple(Quantity(f"u{j}", "m") for j in range(4))
    network = freeze_refined(found, RANGES, outputs, scaling)
    return Posterior.of(found, x, y, ridge=1e-9 * len(x)).uncertainty(network)


def coverage(uncertainty, noise, level=0.9, seed=3):
    X, Y = sampled(3000, noise, seed)
    low, high = uncertainty.interval(X, level)
    return ((low <= Y) & (high >= Y)).mean(axis=0)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
@pytest.mark.parametrize(("name", "radial"), [("rotated", "gaussian"), ("rank-1", "matern-5/2")])
def test_calibrated_intervals_cover_what_they_say(noise, name, radial):
    uncertainty = learnt(noise, name, radial).calibrated(*sampled(400, noise, 2))
    covered = coverage(uncertainty, noise)
    assert (covered > 0.85).all()
    assert (covered < 0.95).all()


def test_with_noise_the_posterior_is_right_before_calibration():
    covered = coverage(learnt(0.2), 0.2)
    assert (covered > 0.85).all()
    assert (covered < 0.95).all()


def test_deviation_is_the_noise_where_data_are_dense_and_grows_away_from_them():
    uncertainty = learnt(0.2)
    middle, away = uncertainty.deviation(np.array([[0.0, 2.5], [6.0, 15.0]]))
    np.testing.assert_allclose(middle, 0.2 * SCALE, rtol=0.25)
    assert (away > 1.5 * middle).all()


def test_calibration_is_the_conformal_quantile():
    """With 19 samples and 90 %, the 18th smallest score: one sample of 19 stays out."""
    X, Y = sampled(19, 0.1, 5)
    uncertainty = learnt(0.1).calibrated(X, Y)
    low, high = uncertainty.interval(X)
    assert (((low <= Y + 1e-12) & (high + 1e-12 >= Y)).sum(axis=0) == 18).all()


def test_calibrating_again_changes_nothing():
    X, Y = sampled(100, 0.1, 5)
    once = learnt(0.1).calibrated(X, Y)
    np.testing.assert_allclose(once.calibrated(X, Y).factor, once.factor, rtol=1e-12)


def test_too_few_samples_are_refused():
    uncertainty = learnt(0.1)
    with pytest.raises(UsageError, match="at least 9"):
        uncertainty.calibrated(*sampled(8, 0.1, 5))
    uncertainty.calibrated(*sampled(9, 0.1, 5))
    with pytest.raises(UsageError, match="probability"):
        uncertainty.interval(sampled(8, 0.1, 5)[0], 1.0)


def test_uncertainty_travels_with_the_network_file(tmp_path):
    uncertainty = learnt(0.1).calibrated(*sampled(100, 0.1, 5))
    X = sampled(50, 0.0, 6)[0]
    path = uncertainty.attached().save(tmp_path / "learnt.palpate")
    again = Uncertainty.of(Network.load(path))
    np.testing.assert_array_equal(again.deviation(X), uncertainty.deviation(X))
    assert Uncertainty.of(uncertainty.network) is None


def test_arrays_that_do_not_fit_are_refused():
    network = learnt(0.1).attached()
    for name in ("noise", "root", "through", "coefficients", "factor", "pattern"):
        key = f"uncertainty_{name}"
        bad = {**network.extras, key: np.zeros((3, 7))}
        with pytest.raises(UsageError):
            Uncertainty.of(replace(network, extras=bad))
    outside = {**network.extras, "uncertainty_pattern": network.extras["uncertainty_pattern"] + 5}
    with pytest.raises(UsageError, match="pattern"):
        Uncertainty.of(replace(network, extras=outside))


def test_what_is_certain_is_left_out():
    whole = learnt(0.05)
    c = len(whole.coefficients)
    linear = replace(whole, root=np.zeros((0, 0)), through=np.zeros((c, 0)))
    X = sampled(40, 0.0, 4)[0]
    # beside the whole only the units' own share is missing
    rest = replace(whole, root=np.zeros_like(whole.root))
    np.testing.assert_allclose(linear.deviation(X), rest.deviation(X), rtol=1e-12)
    assert (linear.deviation(X) < whole.deviation(X)).all()
    constant = replace(linear, coefficients=np.zeros((0, 0)), through=np.zeros((0, 0)))
    wanted = np.sqrt(whole.noise) * whole.network.scaling.output_scale
    np.testing.assert_allclose(constant.deviation(X), np.tile(wanted, (40, 1)), rtol=1e-12)
    again = Uncertainty.of(constant.attached())
    np.testing.assert_array_equal(again.deviation(X), constant.deviation(X))


@pytest.mark.parametrize("X", [np.zeros((5, 1)), np.zeros((5, 3)), np.zeros(2), np.zeros((5, 1, 2))])
def test_inputs_of_another_number_are_refused(X):
    uncertainty = learnt(0.1)
    for ask in (uncertainty.deviation, uncertainty.interval):
        with pytest.raises(UsageError, match="network of 2 inputs") as caught:
            ask(X)
        assert caught.value.fix


@pytest.mark.parametrize("change", ["one output", "fewer rows", "a vector", "nan", "nan inputs"])
def test_what_calibrates_nothing_is_refused(change):
    X, Y = sampled(20, 0.1, 5)
    lost = np.where(np.arange(20) == 3, np.nan, 0.0)[:, None]
    X, Y = {
        "one output": (X, Y[:, :1]),
        "fewer rows": (X, Y[:-1]),
        "a vector": (X, Y[:, 0]),
        "nan": (X, Y + lost),
        "nan inputs": (X + lost, Y),
    }[change]
    with pytest.raises(UsageError):
        learnt(0.1).calibrated(X, Y)


def test_no_width_can_not_be_calibrated():
    uncertainty = replace(learnt(0.1), factor=np.zeros(4))
    with pytest.raises(UsageError, match="zero"):
        uncertainty.calibrated(*sampled(20, 0.1, 5))
