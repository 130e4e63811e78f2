"""The automatic choice finds what the target is made of, and falls back on a kernel layer where nothing small is."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import FitWarning, UsageError
from palpate.learning.arrays.fit import fit
from palpate.learning.arrays.fit_notes import wild_note, wild_rows
from palpate.learning.arrays.held_out import HeldOut, carry, start_units
from palpate.learning.arrays.members import Crossed, CrossedLayers, clearly_less, refit_weights
from palpate.learning.ensemble import Ensemble
from palpate.learning.folds import fold_masks, near_places
from palpate.learning.kernel_layer import KernelLayer, Metric, likely_metric, negative_likelihood
from palpate.learning.search import Candidate
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.rbf.forms import unit_form
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

INPUTS = tuple(Range(f"x{i}", 2.0, 6.0, "N") for i in range(3))
OUTPUTS = tuple(Quantity(f"y{i}", "m") for i in range(4))


def samples(of, seed=0, count=300):
    """X in the declared range, and outputs mixed from the terms `of` of scaled inputs, a metre or so."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(2, 6, (count + 400, 3))
    Y = of((X - 4) / 2) @ np.random.default_rng(9).normal(size=(6, 4)) * 3 + 7
    return X[:count], Y[:count], X[count:], Y[count:]


def ridges(x):
    rng = np.random.default_rng(1)
    return np.tanh(x @ rng.normal(0, 1.2, (3, 6)) + rng.normal(0, 0.5, 6))


def rotated_bumps(x):
    rng = np.random.default_rng(2)
    q = [(((x - rng.uniform(-1, 1, 3)) @ rng.normal(0, 1.2, (3, 3))) ** 2).sum(axis=1) for _ in range(6)]
    return 1 / (1 + np.array(q).T)


def relative(found, X, Y, train):
    return np.linalg.norm(found.network.predict(X) - Y) / np.linalg.norm(Y - train.mean(axis=0))


def cubic_error(X, Y, X_test, Y_test):
    from scipy.interpolate import RBFInterpolator

    predicted = RBFInterpolator((X - 4) / 2, Y, kernel="cubic", degree=1)((X_test - 4) / 2)
    return np.linalg.norm(predicted - Y_test) / np.linalg.norm(Y_test - Y.mean(axis=0))


@pytest.fixture(scope="module")
def ridge_fit():
    data = samples(ridges)
    return fit(*data[:2], INPUTS, OUTPUTS, effort=0.25), data


@pytest.fixture(scope="module")
def bump_fit():
    data = samples(rotated_bumps)
    return fit(*data[:2], INPUTS, OUTPUTS, effort=0.25), data


@pytest.mark.full
def test_ridges_are_learnt_by_ridges(ridge_fit):
    found, (X, Y, X_test, Y_test) = ridge_fit
    assert found.form in {"rank-1", "rank-2"}  # ridges in one direction each, or in two
    assert relative(found, X_test, Y_test, Y) < 0.2 * cubic_error(X, Y, X_test, Y_test)


@pytest.mark.full
def test_rotated_bumps_are_not(bump_fit):
    found, (X, Y, X_test, Y_test) = bump_fit
    assert found.form in {"rotated", "rank-2"}
    assert relative(found, X_test, Y_test, Y) < 0.5 * cubic_error(X, Y, X_test, Y_test)


@pytest.mark.full
@pytest.mark.parametrize("which", ["ridge_fit", "bump_fit"])
def test_heldout_error_tells_the_test_error_roughly(which, request):
    found, (_, Y, X_test, Y_test) = request.getfixturevalue(which)
    assert 1 / 4 < relative(found, X_test, Y_test, Y) / found.heldout < 4


@pytest.mark.full
def test_seed_decides_everything():
    X, Y, _, _ = samples(ridges, count=80)
    one, two = (fit(X, Y, INPUTS, OUTPUTS, effort=0.05, seed=3, workers=w) for w in (1, 2))
    assert [(t.name, t.error) for t in one.trials] == [(t.name, t.error) for t in two.trials]
    for name in ("factors", "shifts", "weights", "tail"):
        np.testing.assert_array_equal(getattr(one.network, name), getattr(two.network, name))
    other = fit(X, Y, INPUTS, OUTPUTS, effort=0.05, seed=4)
    assert [t.error for t in other.trials] != [t.error for t in one.trials]


@pytest.mark.full
def test_noise_is_not_learnt():
    X, _, X_test, _ = samples(ridges)
    noise = np.random.default_rng(5).normal(size=(len(X), 4))
    with pytest.warns(FitWarning, match="no better than the outputs' mean"):
        found = fit(X, noise, INPUTS, OUTPUTS, effort=0.1)
    assert found.heldout > 0.8
    assert np.sqrt((found.network.predict(X_test) ** 2).mean()) < 0.6


@pytest.mark.full
def test_constant_outputs():
    X, Y, X_test, _ = samples(ridges, count=30)
    Y[:, 2] = 0.1
    found = fit(X, Y, INPUTS, OUTPUTS, effort=0.07)
    np.testing.assert_allclose(found.predict(X_test)[:, 2], 0.1)
    assert found.deviation(X_test)[:, 2].max() < 1e-9
    with pytest.raises(UsageError, match="same outputs"):
        fit(X, np.full((30, 4), 0.1), INPUTS, OUTPUTS)


def test_affine_outputs_need_no_units():
    X, _, X_test, _ = samples(ridges, count=60)
    slopes = np.random.default_rng(0).normal(size=(3, 4))
    found = fit(X, X @ slopes + 3, INPUTS, OUTPUTS, effort=0.07)
    assert found.units == 0
    np.testing.assert_allclose(found.network.predict(X_test), X_test @ slopes + 3, rtol=1e-9)


@pytest.mark.full
def test_many_outputs_of_few_modes_go_through_a_basis(ridge_fit):
    X, Y, X_test, Y_test = ridge_fit[1]
    many = np.random.default_rng(0).normal(size=(4, 200))
    outputs = tuple(Quantity(f"u{i}", "m") for i in range(200))
    found = fit(X, Y @ many, INPUTS, outputs, effort=0.1)
    assert found.network.basis.shape == (200, 4)
    miss = found.network.predict(X_test) - Y_test @ many
    assert np.linalg.norm(miss) < 0.1 * np.linalg.norm((Y_test - Y.mean(axis=0)) @ many)


@pytest.mark.parametrize(
    ("X", "Y"),
    [
        (np.zeros((10, 3)), np.zeros((10, 4))),
        (np.zeros((30, 2)), np.zeros((30, 4))),
        (np.zeros((30, 3)), np.full((30, 4), np.nan)),
    ],
    ids=["few", "shape", "nan"],
)
def test_what_is_no_sample_is_refused(X, Y):
    with pytest.raises(UsageError):
        fit(X, Y, INPUTS, OUTPUTS)


@pytest.mark.parametrize("name", RADIAL_FUNCTIONS)
def test_likelihood_has_its_gradient(name):
    rng = np.random.default_rng(0)
    X, Y = rng.uniform(-1, 1, (25, 2)), rng.normal(size=(25, 3))
    logs = np.array([0.2, -0.3, -2.0])
    gradient = negative_likelihood(logs, name, X, Y)[1]
    for i, step in enumerate(1e-6 * np.eye(3)):
        difference = (
            negative_likelihood(logs + step, name, X, Y)[0] - negative_likelihood(logs - step, name, X, Y)[0]
        )
        np.testing.assert_allclose(gradient[i], difference / 2e-6, rtol=1e-5, atol=1e-8)


def test_likelihood_sees_the_input_that_matters():
    X = np.random.default_rng(0).uniform(-1, 1, (150, 2))
    scales = likely_metric("gaussian", X, np.sin(4 * X[:, :1])).scales
    assert scales[0] > 20 * scales[1]


def test_kernel_layer_interpolates_and_its_units_are_itself():
    rng = np.random.default_rng(0)
    X, Y = rng.uniform(-1, 1, (40, 3)), rng.normal(size=(40, 2))
    layer = KernelLayer.fit(Metric("matern-5/2", np.array([1.0, 2.0, 0.5]), 1e-12), X, Y)
    np.testing.assert_allclose(layer.predict(X), Y, atol=1e-6)
    A, b = layer.units()
    points = rng.uniform(-1, 1, (5, 3))
    from palpate.network.radial import radial

    v = np.einsum("kri,ni->nkr", A, points) - b
    phi = radial("matern-5/2", (v * v).sum(axis=2))[0]
    np.testing.assert_allclose(
        np.c_[np.ones(5), points] @ layer.tail + phi @ layer.weights, layer.predict(points)
    )


@pytest.mark.parametrize("name", ["rank-1", "rank-2", "rotated", "axis-aligned"])
def test_carried_units_stand_where_they_stood_as_wide_at_half_height(name):
    X = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    f = unit_form(name, 3)
    theta = start_units(f, X, np.array([0.5, 1.0, 2.0]), 7, seed=0)
    before = Candidate(Regressors(f, "inverse-multiquadric"), theta, "random")
    after = carry(before, "gaussian")
    (A, b), (A2, b2) = f.factors(before.theta), f.factors(after.theta)
    np.testing.assert_allclose(A2, 0.48 * A, rtol=1e-12)
    np.testing.assert_allclose(b2, 0.48 * b, rtol=1e-12)
    # (1 + q)^-1/2 and exp(-(0.48)² q) are both a half at q = 3
    assert np.exp(-(0.48**2) * 3) == pytest.approx(0.5, abs=2e-3)


def test_an_ensemble_is_the_mean_of_its_members_and_errs_no_more_than_they_on_average():
    X, Y, X_test, Y_test = samples(rotated_bumps, count=120)
    xs, xt, ys, yt = (X - 4) / 2, (X_test - 4) / 2, Y - 7, Y_test - 7
    members = []
    for k in range(3):
        split = HeldOut.of(xs, ys, share=0.2, seed=0, fold=k)
        assert len(split.X) + len(split.unseen[0]) == 120
        found = split.evaluate(split.enter("rotated", 90, np.ones(3), k), 20)
        members.append(refit_weights(found.network, xs, ys, 1e-10))
    mean = Ensemble(tuple(members))
    (A, b), (weights, tail) = mean.regressors.form.factors(mean.theta), mean.weights_and_tail
    v = np.einsum("kri,ni->nkr", A, xt) - b
    together = 1 / np.sqrt(1 + (v * v).sum(axis=2)) @ weights + np.c_[np.ones(len(xt)), xt] @ tail
    np.testing.assert_allclose(together, np.mean([m.predict(xt) for m in members], axis=0), rtol=1e-9)
    squares = np.mean([((m.predict(xt) - yt) ** 2).mean() for m in members])
    assert ((together - yt) ** 2).mean() <= squares


@pytest.mark.full
def test_what_is_handed_over_is_about_as_good_as_the_best_that_was_tried():
    """A mean must not be spoilt by members that were caught in another minimum."""
    X = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    names = [Range(c, -1.0, 1.0) for c in "ab"], [Quantity(c) for c in "uv"]
    found = fit(X, np.sin(X), *names, effort=0.15)
    Z = np.random.default_rng(1).uniform(-1, 1, (500, 2))
    error = np.sqrt(((found.network.predict(Z) - np.sin(Z)) ** 2).mean()) / np.sin(Z).std()
    assert error < 5.0 * min(trial.error for trial in found.trials)


class Offset:
    """A network whose every answer is off by so much."""

    def __init__(self, off: float) -> None:
        self.off = off

    def predict(self, X: np.ndarray) -> np.ndarray:
        return np.full((len(X), 1), self.off)


def crossed(offsets: list[float], samples: int = 50) -> Crossed:
    """Two rounds of five folds over outputs that are zero; round k's networks are off by the k-th half of these."""
    X = np.random.default_rng(0).uniform(-1, 1, (samples, 2))
    masks = np.concatenate([fold_masks(np.arange(samples), 5, seed=k) for k in (0, 1)])
    networks = tuple(map(Offset, offsets))
    return Crossed(networks, masks, np.repeat([0, 1], 5), X, np.zeros((samples, 1)))


def test_the_error_of_a_mean_is_measured_where_its_networks_had_not_learnt():
    """Networks off by 3 and −1: pairs miss 1, half their squared distance is 8, a mean of ten misses less of it."""
    both = crossed([3.0] * 5 + [-1.0] * 5)
    assert both.tested.all()
    np.testing.assert_allclose(both.missed, -1.0)
    # 1 − (½ − 1/10) 8 is below one half of the pairs' square: no more than that is believed
    assert both.error == pytest.approx(np.sqrt(0.5))
    near = crossed([1.1] * 5 + [0.9] * 5)
    assert near.error == pytest.approx(np.sqrt(1.0 - 0.4 * 0.5 * 0.2**2))


def test_a_network_that_was_caught_elsewhere_is_left_out():
    offsets = [0.01, -0.01, 0.0, 0.02, -0.02, 0.01, -0.01, 5.0, 0.01, 0.0]
    whole = crossed(offsets)
    kept = whole.without_strays()
    assert [network.off for network in kept.networks] == [o for o in offsets if o < 1]
    assert kept.tested.all()
    assert kept.error < 0.1 * whole.error


def test_layers_are_judged_where_neither_they_nor_their_metric_had_learnt():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (60, 2))
    Y = np.sin(3 * X[:, :1]) + 0.1 * rng.normal(size=(60, 1))
    masks = fold_masks(np.arange(60), 5)
    metric = likely_metric("gaussian", X, Y)
    layers = CrossedLayers.of(metric, X, Y, masks)
    for mask in masks:
        alone = KernelLayer.fit(metric, X[~mask], Y[~mask])
        np.testing.assert_allclose(layers.missed[mask], Y[mask] - alone.predict(X[mask]), atol=1e-12)
    own = CrossedLayers.of(metric, X, Y, masks, steps=30)
    for (layer, mask), climbed in zip(own.folds, masks, strict=True):
        best = likely_metric("gaussian", X[~climbed], Y[~climbed])
        values = [
            negative_likelihood(np.log(np.r_[m.scales, m.ridge]), "gaussian", X[~mask], Y[~mask])[0]
            for m in (layer.metric, best)
        ]
        assert values[0] < values[1] + 1e-3
    assert own.error > 0.95 * layers.error


def test_less_by_luck_is_not_clearly_less():
    rng = np.random.default_rng(1)
    other = rng.normal(size=(200, 2))
    assert not clearly_less(other * rng.choice([0.99, 1.01], size=(200, 1)), other)
    assert clearly_less(0.8 * other, other)
    assert not clearly_less(other, 0.8 * other)


@pytest.mark.parametrize("inputs", [1, 3])
def test_near_copies_are_one_place(inputs):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (60, inputs)) if inputs > 1 else np.linspace(-1, 1, 60)[:, None]
    star = np.concatenate([X + 1e-4 * e for e in np.vstack([np.zeros(inputs), np.eye(inputs)])])
    places = near_places(star).reshape(-1, 60)
    assert (places == places[0]).all()
    assert len(np.unique(places)) == len(np.unique(near_places(X)))
    assert len(np.unique(near_places(X))) >= 57  # scattered places and grids are no copies


def test_wild_samples_are_named_by_their_rows_or_lines():
    said = wild_note([17], 150)
    assert said.startswith(
        "1 of 150 samples is far from what the others say: row 17, counted from 0. A wrong number"
    )
    assert said.endswith("check it, or leave it out.")
    said = wild_note([17, 20], 150, range(5, 155))
    assert said.startswith(
        "2 of 150 samples are far from what the others say: lines 22, 25. A wrong number there"
    )
    assert said.endswith("check them, or leave them out.")
    with pytest.raises(UsageError, match="99 lines do not number 100 samples"):
        fit(np.arange(100.0), np.arange(100.0), lines=range(99))


def test_wild_samples_are_told_and_corners_are_not():
    missed = np.random.default_rng(0).normal(size=(200, 1)) * 0.05
    assert not len(wild_rows(missed))
    missed[17] = 3.0
    assert wild_rows(missed).tolist() == [17]
    assert not len(wild_rows(1e-3 * missed))  # far beyond the others, but small beside the outputs
