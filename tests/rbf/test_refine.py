"""Refinement against networks that are known, weights against repetition, slopes, limits and rank deficiency."""

from __future__ import annotations

import functools
import itertools
import time

import numpy as np
import pytest

from laws.beams import INPUT, stiffening
from palpate.errors import UsageError
from palpate.learning import refine
from palpate.network import Scaling
from palpate.rbf.forms import unit_form
from palpate.rbf.regressors import Regressors

LINE = Regressors(unit_form("axis-aligned", 1))
NONE = np.zeros((0, 2))


def line_units(centres, widths):
    return np.column_stack([centres, np.log(widths)])


def two_gaussians(X):
    phi = LINE.phi(X, line_units([-0.4, 0.5], [0.5, 0.8]))
    return phi @ np.array([[1.0, -0.5], [0.3, 2.0]]) + np.hstack([np.ones_like(X), X]) @ np.array(
        [[0.1, 0.2], [0.5, -1]]
    )


def known_network(name, radial="gaussian", *, n=2, h=3, m=3, seed=0):
    """Regressors, θ and coefficients of a random network, and a start near it."""
    rng = np.random.default_rng(seed)
    r = Regressors(unit_form(name, n), radial)
    theta = np.array([r.form.unit(x, 0.9, seed=i) for i, x in enumerate(rng.uniform(-0.7, 0.7, (h, n)))])
    C = rng.normal(size=(r.tail_size + h, m))
    return r, theta, C, theta + rng.normal(0, 0.05, theta.shape)


def slopes_of(r, theta, C, X):
    """∂f/∂x (N, m, n)."""
    both = np.concatenate([r.tail_slopes(len(X)), r.slopes(X, theta)], axis=2)
    return (both @ C).transpose(0, 2, 1)


def curved():
    """Scaled samples of a smooth map with three outputs, and a start of three units."""
    X, Y = stiffening(26)
    s = Scaling.of(INPUT, Y)
    return s.scale_inputs(X), s.scale_outputs(Y), line_units(np.linspace(-1, 1, 3), np.full(3, 0.8))


def test_a_network_of_the_same_form_is_found_again():
    X = np.linspace(-1, 1, 40)[:, None]
    found = refine(X, two_gaussians(X), line_units([-0.7, 0.7], [0.6, 0.6]), LINE, iterations=500)
    order = np.argsort(found.theta[:, 0])
    np.testing.assert_allclose(found.theta[order, 0], [-0.4, 0.5], atol=1e-4)
    np.testing.assert_allclose(np.exp(found.theta[order, 1]), [0.5, 0.8], atol=1e-4)
    assert found.rms < 1e-7
    assert found.converged


@pytest.mark.grid
@pytest.mark.parametrize("solver", ["kaufman", "full"])
@pytest.mark.parametrize("name", ["isotropic", "axis-aligned", "rotated", "rank-1"])
@pytest.mark.parametrize("radial", ["gaussian", "inverse-multiquadric", "matern-5/2"])
def test_values_and_slopes_of_a_network_lead_back_to_it(name, radial, solver):
    r, theta, C, start = known_network(name, radial)
    X = np.random.default_rng(1).uniform(-1, 1, (12, 2))
    Y = np.hstack([r.tail_rows(X), r.phi(X, theta)]) @ C
    found = refine(X, Y, start, r, slopes=slopes_of(r, theta, C, X), ridge=0.0, solver=solver)
    unseen = np.random.default_rng(2).uniform(-1, 1, (50, 2))
    truth = np.hstack([r.tail_rows(unseen), r.phi(unseen, theta)]) @ C
    np.testing.assert_allclose(found.predict(unseen), truth, atol=2e-5)
    np.testing.assert_allclose(found.theta, theta, atol=2e-3)


def test_without_units_it_is_least_squares():
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(30, 2)), rng.normal(size=(30, 3))
    found = refine(X, Y, np.zeros((0, 5)), Regressors(unit_form("rotated", 2)))
    A = np.hstack([np.ones((30, 1)), X])
    np.testing.assert_allclose(found.tail, np.linalg.lstsq(A, Y, rcond=None)[0], rtol=1e-9)


@pytest.mark.parametrize("tail", ["affine", "constant", "none"])
def test_leave_one_out_in_closed_form_equals_leaving_one_out(tail):
    rng = np.random.default_rng(1)
    X, Y = rng.normal(size=(15, 1)), rng.normal(size=(15, 2))
    r = Regressors(unit_form("axis-aligned", 1), tail=tail)
    found = refine(X, Y, NONE, r)
    errors = []
    for i in range(15):
        rest = np.arange(15) != i
        A = r.tail_rows(X)
        errors.append(Y[i] - A[i] @ np.linalg.lstsq(A[rest], Y[rest], rcond=None)[0])
    assert found.loo == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-9)


@pytest.mark.parametrize(("N", "finite"), [(1, False), (5, False), (6, True)])
def test_as_many_unknowns_as_data_judge_nothing(N, finite):
    """Two of the tail and three of a unit."""
    rng = np.random.default_rng(0)
    X, Y = rng.uniform(-1, 1, (N, 1)), rng.normal(size=(N, 1))
    assert np.isfinite(refine(X, Y, line_units([0.0], [0.5]), LINE).loo) == finite


def test_unknowns_are_counted_against_slopes_and_modes():
    """Five samples: two coefficients per mode for tail, one and the units' shared numbers for a unit."""
    rng = np.random.default_rng(0)
    X, Y, unit = rng.uniform(-1, 1, (5, 1)), rng.normal(size=(5, 2)), line_units([0.0], [0.5])
    fit = functools.partial(refine, regressors=LINE, iterations=3)
    assert np.isfinite(fit(X, Y, unit).loo)  # 2 + 1 + 2/2 of 5
    assert np.isinf(fit(X, Y[:, :1], unit).loo)  # 2 + 1 + 2 of 5
    assert np.isinf(fit(X, Y[:, [0, 0, 0, 0]], unit).loo)  # copies of an output say nothing more
    assert np.isinf(fit(X, Y[:, :1], unit, weights=[1, 1, 1, 1, 0]).loo)
    slopes = rng.normal(size=(5, 1, 1))
    assert np.isfinite(fit(X, Y[:, :1], unit, slopes=slopes).loo)
    assert np.isinf(fit(X, Y[:, :1], unit, slopes=slopes, slope_weight=0.0).loo)


def test_cost_never_rises_with_iterations():
    x, y, start = curved()
    errors = [refine(x, y, start, LINE, iterations=k).rms for k in (0, 1, 3, 10, 40)]
    assert all(b <= a for a, b in itertools.pairwise(errors))
    assert errors[-1] < 0.2 * errors[0]


def test_a_weight_of_three_is_the_sample_three_times():
    x, y, start = curved()
    rng = np.random.default_rng(5)
    y = y + rng.normal(0, 0.01, y.shape)
    w = rng.integers(0, 4, len(x))
    slopes = rng.normal(0, 0.1, (*y.shape, 1))
    weighted = refine(x, y, start, LINE, weights=w, slopes=slopes, slope_weight=0.1, iterations=30)
    again = np.repeat(np.arange(len(x)), w)
    repeated = refine(x[again], y[again], start, LINE, slopes=slopes[again], slope_weight=0.1, iterations=30)
    np.testing.assert_allclose(weighted.theta, repeated.theta, rtol=1e-6)
    np.testing.assert_allclose(weighted.predict(x), repeated.predict(x), atol=1e-8)
    assert weighted.rms == pytest.approx(repeated.rms, rel=1e-8)


def test_slopes_at_few_points_teach_what_values_leave_open():
    few = np.linspace(-1, 1, 7)[:, None]
    unseen = np.linspace(-1, 1, 101)[:, None]
    f, df = (lambda x: np.sin(5 * x)), (lambda x: 5 * np.cos(5 * x))
    start = line_units(np.linspace(-0.8, 0.8, 4), np.full(4, 0.4))
    plain = refine(few, f(few), start, LINE, ridge=1e-8)
    informed = refine(few, f(few), start, LINE, ridge=1e-8, slopes=df(few)[:, :, None], slope_weight=0.05)
    assert (
        np.abs(informed.predict(unseen) - f(unseen)).max()
        < 0.1 * np.abs(plain.predict(unseen) - f(unseen)).max()
    )


def test_unknown_slopes_have_no_weight_and_may_be_missing():
    r, theta, C, start = known_network("rotated")
    X = np.random.default_rng(1).uniform(-1, 1, (40, 2))
    Y = np.hstack([r.tail_rows(X), r.phi(X, theta)]) @ C
    slopes = slopes_of(r, theta, C, X)
    slopes[10:] = np.nan
    known = np.where(np.arange(40) < 10, 1.0, 0.0)
    found = refine(X, Y, start, r, slopes=slopes, slope_weight=known, ridge=0.0)
    np.testing.assert_allclose(found.predict(X), Y, atol=1e-5)


def test_outputs_of_few_modes_are_refined_as_few():
    """Thousands of outputs, the same answer as their modes."""
    x, y, start = curved()
    V = np.linalg.qr(np.random.default_rng(0).normal(size=(3000, 3)))[0].T
    wide, narrow = refine(x, y @ V, start, LINE, iterations=5), refine(x, y, start, LINE, iterations=5)
    np.testing.assert_allclose(wide.theta, narrow.theta, rtol=1e-6)
    np.testing.assert_allclose(wide.coefficients, narrow.coefficients @ V, atol=1e-8)


@pytest.mark.parametrize("solver", ["kaufman", "full"])
def test_units_that_coincide_are_survived(solver):
    x, y, _ = curved()
    start = line_units(np.zeros(4), np.ones(4))
    found = refine(x, y, start, LINE, solver=solver)
    assert np.isfinite(found.coefficients).all()
    alone = refine(x, y, start[:1], LINE, iterations=0)
    assert found.rms <= alone.rms * (1 + 1e-6)


def test_outputs_that_are_zero_leave_no_weight_and_no_error():
    x, _, start = curved()
    found = refine(x, np.zeros((len(x), 2)), start, LINE)
    assert not found.predict(x).any()
    assert found.loo == 0.0


def test_units_that_see_no_sample_stop_nobody():
    x, y, start = curved()
    far = np.vstack([start, line_units([40.0], [0.1])])
    assert refine(x, y, far, LINE).rms < 1.1 * refine(x, y, start, LINE).rms


def test_duplicate_samples_are_no_trouble():
    x, y, start = curved()
    found = refine(np.vstack([x, x]), np.vstack([y, y]), start, LINE)
    assert np.isfinite(found.loo)
    assert found.rms < 1e-2


def test_time_limit_is_kept_to_within_an_iteration(monkeypatch):
    """On a clock that goes on by a second whenever it is read: once or twice an iteration."""
    rng = np.random.default_rng(0)
    r = Regressors(unit_form("rotated", 3), "inverse-multiquadric")
    X, Y = rng.uniform(-1, 1, (200, 3)), rng.normal(size=(200, 5))
    start = np.array([r.form.unit(x, 0.7) for x in X[:20]])
    clock = itertools.count()
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    found = refine(X, Y, start, r, iterations=10_000, seconds=20.0)
    assert 20 <= next(clock) <= 23
    assert not found.converged
    assert 1 < found.iterations <= 20


def test_held_out_samples_stop_it_where_they_are_known_best():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (60, 1))
    Y = np.sin(3 * X) + 0.2 * rng.normal(size=(60, 1))
    start = line_units(X[:9, 0], np.full(9, 0.3))
    unseen = np.linspace(-1, 1, 200)[:, None]
    kept = refine(X, Y, start, LINE, heldout=(unseen, np.sin(3 * unseen)), iterations=100)
    whole = refine(X, Y, start, LINE, iterations=100)
    error = lambda r: np.sqrt(((r.predict(unseen) - np.sin(3 * unseen)) ** 2).mean())  # noqa: E731
    assert kept.heldout == pytest.approx(error(kept), rel=1e-9)
    assert error(kept) < error(whole)
    assert np.isnan(whole.heldout)


def test_same_input_same_bits():
    r, theta, C, start = known_network("rank-1", "matern-5/2")
    X = np.random.default_rng(1).uniform(-1, 1, (60, 2))
    Y = np.hstack([r.tail_rows(X), r.phi(X, theta)]) @ C
    a, b = (refine(X, Y, start, r, iterations=20) for _ in range(2))
    np.testing.assert_array_equal(a.theta, b.theta)
    np.testing.assert_array_equal(a.coefficients, b.coefficients)


def test_units_of_another_form_are_refused():
    x, y, start = curved()
    with pytest.raises(UsageError, match="2 numbers each"):
        refine(x, y, np.zeros((3, 5)), LINE)
    with pytest.raises(UsageError):
        refine(x, y, start * np.nan, LINE)


@pytest.mark.parametrize(
    "bad",
    [
        {"solver": "bogus"},
        {"ridge": -1.0},
        {"ridge": float("nan")},
        {"iterations": -1},
        {"tolerance": float("nan")},
        {"patience": -1},
        {"seconds": -1.0},
        {"heldout": (np.zeros((4, 1)), np.zeros((4, 2)))},
        {"heldout": (np.zeros((4, 2)), np.zeros((4, 3)))},
        {"heldout": (np.zeros((4, 1)), np.zeros((5, 3)))},
        {"heldout": (np.zeros((4, 1)), np.full((4, 3), np.nan))},
        {"weights": -np.ones(26)},
        {"slopes": np.zeros((26, 1, 3))},
    ],
)
def test_options_that_are_none_are_refused(bad):
    x, y, start = curved()
    with pytest.raises(UsageError) as caught:
        refine(x, y, start, LINE, **bad)
    assert caught.value.why
    assert caught.value.fix


def test_lists_are_samples_too():
    x, y, start = curved()
    np.testing.assert_array_equal(
        refine(x.tolist(), y.tolist(), start.tolist(), LINE, iterations=2).theta,
        refine(x, y, start, LINE, iterations=2).theta,
    )


@pytest.mark.parametrize("bad", [{"tail": "bogus"}, {"radial": "bogus"}])
def test_regressors_are_those_there_are(bad):
    with pytest.raises(UsageError, match="bogus") as caught:
        Regressors(unit_form("rotated", 2), **bad)
    assert caught.value.fix
