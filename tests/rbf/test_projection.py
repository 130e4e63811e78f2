"""Rows, the projected residual's derivatives, and leaving one out: against finite differences and plain refits."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.rbf.forms import unit_form
from palpate.rbf.output_modes import every_mode
from palpate.rbf.refinement.leave_one_out import errors_without_each_unit, leave_one_out_errors
from palpate.rbf.refinement.projection import gauss_newton, leverage_of_units, project
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors

FORMS = ("isotropic", "axis-aligned", "rotated", "rank-1")
RADIALS = ("gaussian", "inverse-multiquadric", "matern-5/2")


def some_rows(name="rotated", radial="gaussian", *, slopes=False, N=40, h=3, m=4, seed=0):
    """Random samples, weights, and slopes for half of the samples."""
    rng = np.random.default_rng(seed)
    r = Regressors(unit_form(name, 2), radial, "affine")
    X, Y = rng.uniform(-1, 1, (N, 2)), rng.normal(size=(N, m))
    theta = np.array([r.form.unit(x, 0.8, seed=i) for i, x in enumerate(X[:h])])
    theta += rng.normal(0, 0.1, theta.shape)
    known = {"slopes": rng.normal(size=(N, m, 2)), "slope_weight": rng.uniform(0, 1, N)} if slopes else {}
    if slopes:
        known["slope_weight"][::2] = 0.0
        known["slopes"][::2] = np.nan
    rows = Rows.of(r, X, Y, weights=rng.uniform(0.2, 3.0, N), **known)
    return rows, theta


def lifted(rows, theta, penalty):
    """The augmented residual, by the plainest least squares."""
    F = rows.matrix(theta)
    size = F.shape[1]
    p_t = size - len(theta)
    penalties = np.diag(np.sqrt(np.r_[np.full(p_t, 1e-24), np.full(len(theta), penalty)]))
    A, b = np.vstack([F, penalties]), np.vstack([rows.targets, np.zeros((size, rows.targets.shape[1]))])
    return b - A @ np.linalg.lstsq(A, b, rcond=None)[0]


def dense(G):
    return np.tril(G) + np.tril(G, -1).T


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("radial", RADIALS)
def test_derivatives_of_the_rows_are_those_of_the_regressors(name, radial):
    rows, theta = some_rows(name, radial, slopes=True)
    r = rows.regressors
    D = rows.derivatives(theta).reshape(-1, *theta.shape)
    N = len(rows.X)
    np.testing.assert_allclose(
        D[:N], r.by_theta(rows.X, theta)[1] * rows.scale[:, None, None], rtol=1e-12, atol=1e-14
    )
    step = 1e-6
    for k, j in np.ndindex(theta.shape):
        up, down = theta.copy(), theta.copy()
        up[k, j] += step
        down[k, j] -= step
        numeric = (rows.matrix(up) - rows.matrix(down)) / (2 * step)
        np.testing.assert_allclose(D[:, k, j], numeric[:, r.tail_size + k], atol=2e-8)


@pytest.mark.parametrize("slopes", [False, True])
@pytest.mark.parametrize("penalty", [1e-12, 0.3])
@pytest.mark.parametrize("name", FORMS)
def test_full_gauss_newton_is_the_exact_derivative_of_the_projected_residual(name, penalty, slopes):
    rows, theta = some_rows(name, slopes=slopes)
    step, columns = 1e-5, []
    for k, j in np.ndindex(theta.shape):
        up, down = theta.copy(), theta.copy()
        up[k, j] += step
        down[k, j] -= step
        columns.append(((lifted(rows, up, penalty) - lifted(rows, down, penalty)) / (2 * step)).ravel())
    J = np.array(columns).T
    fit = project(rows, theta, penalty)
    full, descent = gauss_newton(rows, theta, fit, "full")
    scale = np.abs(J.T @ J).max()
    np.testing.assert_allclose(dense(full), J.T @ J, atol=1e-7 * scale)
    np.testing.assert_allclose(descent, -J.T @ lifted(rows, theta, penalty).ravel(), atol=1e-6 * scale)


def test_kaufmans_gradient_is_exact_and_his_matrix_lacks_one_positive_term():
    rows, theta = some_rows(slopes=True)
    fit = project(rows, theta, 0.1)
    full, descent = gauss_newton(rows, theta, fit, "full")
    kaufman, same = gauss_newton(rows, theta, fit, "kaufman")
    np.testing.assert_array_equal(descent, same)
    assert np.linalg.eigvalsh(dense(full) - dense(kaufman)).min() > -1e-10 * np.abs(full).max()
    step = 1e-6
    for k, j in np.ndindex(theta.shape):
        up, down = theta.copy(), theta.copy()
        up[k, j] += step
        down[k, j] -= step
        slope = (project(rows, up, 0.1).cost - project(rows, down, 0.1).cost) / (2 * step)
        assert slope == pytest.approx(-2 * descent.reshape(theta.shape)[k, j], rel=1e-6, abs=1e-7)


def test_single_precision_matrix_differs_by_rounding_only():
    rows, theta = some_rows(N=80, h=6)
    fit = project(rows, theta, 1e-6)
    double, right = gauss_newton(rows, theta, fit)
    single, same = gauss_newton(rows, theta, fit, single=True)
    assert single.dtype == np.float32
    np.testing.assert_array_equal(right, same)
    np.testing.assert_allclose(single, double, atol=1e-5 * np.abs(double).max())


def test_projection_is_the_least_squares_solution():
    rows, theta = some_rows(slopes=True)
    fit = project(rows, theta, 0.2)
    F = rows.matrix(theta)
    ridge = np.r_[np.zeros(3), np.full(3, 0.2)]
    np.testing.assert_allclose(
        fit.coefficients, np.linalg.solve(F.T @ F + np.diag(ridge), F.T @ rows.targets), atol=1e-11
    )
    np.testing.assert_allclose(fit.inverse, np.linalg.inv(F.T @ F + np.diag(ridge)), rtol=1e-9)


@pytest.mark.parametrize("shape", [(200, 3000), (300, 5), (50, 60), (4, 9)])
def test_modes_lose_nothing(shape):
    rng = np.random.default_rng(4)
    Y = (
        rng.normal(size=(shape[0], 4)) @ rng.normal(size=(4, shape[1]))
        if shape[1] != 60
        else rng.normal(size=shape)
    )
    latent, basis = every_mode(Y)
    assert latent.shape[1] == np.linalg.matrix_rank(Y)
    np.testing.assert_allclose(latent @ basis, Y, atol=1e-12 * np.linalg.norm(Y))
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-12)


@pytest.mark.parametrize("slopes", [False, True])
def test_leaving_one_out_in_closed_form_equals_fitting_without_it(slopes):
    rows, theta = some_rows(slopes=slopes, N=15)
    penalty, N = 0.05, len(rows.X)
    found = leave_one_out_errors(rows, project(rows, theta, penalty))
    F = rows.matrix(theta)
    ridge = np.diag(np.r_[np.zeros(3), np.full(3, penalty)])
    own = np.r_[np.arange(N), np.repeat(rows.sloped, 2)]
    for i in range(N):
        A, b = F[own != i], rows.targets[own != i]
        C = np.linalg.solve(A.T @ A + ridge, A.T @ b)
        expected = (rows.targets[i] - F[i] @ C) / rows.scale[i]
        np.testing.assert_allclose(found[i], expected, rtol=1e-8, atol=1e-10)


def test_leave_one_out_error_without_each_unit_equals_removing_it():
    rows, theta = some_rows(h=5, N=30)
    penalty = 0.05
    found = errors_without_each_unit(rows, project(rows, theta, penalty), 5)
    for k in range(5):
        fewer = np.delete(theta, k, axis=0)
        missed = leave_one_out_errors(rows, project(rows, fewer, penalty)) * rows.scale[:, None]
        assert found[k] == pytest.approx((missed**2).sum(), rel=1e-8)


def test_what_is_not_a_sample_is_refused():
    r = Regressors(unit_form("isotropic", 2))
    X, Y = np.zeros((5, 2)), np.zeros((5, 3))
    for bad in (
        {"weights": -np.ones(5)},
        {"weights": np.zeros(5)},
        {"weights": np.ones(4)},
        {"slopes": np.zeros((5, 2, 3))},
        {"slopes": np.full((5, 3, 2), np.nan)},
    ):
        with pytest.raises(UsageError):
            Rows.of(r, X, Y, **bad)
    with pytest.raises(UsageError):
        Rows.of(r, X * np.nan, Y)
    with pytest.raises(UsageError):
        Rows.of(r, X[:, :1], Y)


@pytest.mark.parametrize("slopes", [False, True])
def test_leverage_of_units_is_the_diagonal_of_their_hat_matrix(slopes):
    rows, theta = some_rows(slopes=slopes)
    fit = project(rows, theta, 1e-12)
    F, D, W = rows.matrix(theta), rows.derivatives(theta), fit.coefficients[-len(theta) :]
    D -= F @ np.linalg.lstsq(F, D, rcond=None)[0]
    # rows of the Jacobian mode by mode: w_kj P ∂φ_k/∂θ_k
    J = np.vstack([D * np.repeat(w, theta.shape[1]) for w in W.T])
    hat = np.diag(J @ np.linalg.pinv(J)).reshape(W.shape[1], -1)
    found = leverage_of_units(rows, theta, fit)
    np.testing.assert_allclose(found, hat.T, atol=1e-6)
    assert found.sum() == pytest.approx(theta.size, rel=1e-5)
    even = leverage_of_units(rows, theta, fit, work=0.0)
    np.testing.assert_allclose(even.sum(axis=0), found.sum(axis=0), rtol=1e-5)
    assert np.ptp(even, axis=0).max() == 0.0
