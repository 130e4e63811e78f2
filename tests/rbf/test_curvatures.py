"""Curvatures of the regressors, and what is learnt from them: against complex step, and batch ridge regression."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from palpate.network.radial import radial, third
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.leave_one_out import leave_one_out_row_errors
from palpate.rbf.refinement.projection import project, span_of_units
from palpate.rbf.refinement.refine import refine
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors, pairs

FORMS = ("isotropic", "axis-aligned", "rotated", "rank-1", "rank-2")
RADIALS = ("gaussian", "inverse-multiquadric", "matern-5/2")
STEP = 1e-30
every_radial = pytest.mark.parametrize("name", RADIALS)
every_kind = pytest.mark.parametrize(("kind", "name"), list(product(FORMS, RADIALS)))


def some_units(kind, name, *, tail="affine", h=4, n=3, N=7, seed=0):
    rng = np.random.default_rng(seed)
    r = Regressors(unit_form(kind, n), name, tail)
    X = rng.uniform(-1, 1, (N, n))
    theta = np.array([r.form.unit(x, 0.7, seed=i) for i, x in enumerate(X[:h])])
    return r, X, theta + rng.normal(0, 0.2, theta.shape)


@every_radial
def test_third_derivative_of_the_radial_function_equals_complex_step(name):
    q = np.linspace(1e-3, 20.0, 200)
    by_step = radial(name, q + 1j * STEP)[2].imag / STEP
    np.testing.assert_allclose(third(name, q), by_step, rtol=1e-12)


@pytest.mark.full
@every_kind
def test_curvatures_are_the_derivatives_of_the_slopes(kind, name):
    r, X, theta = some_units(kind, name)
    i, j = pairs(3)
    found = r.curvatures(X, theta)
    for axis in range(3):
        moved = X.astype(complex)
        moved[:, axis] += 1j * STEP
        by_step = r.slopes(moved, theta).imag / STEP  # (N, n, h)
        at = np.flatnonzero(j == axis)
        np.testing.assert_allclose(found[:, at], by_step[:, i[at]], rtol=1e-10, atol=1e-12)


@every_kind
def test_curvatures_by_theta_equal_central_differences(kind, name):
    r, X, theta = some_units(kind, name)
    same, found = r.curvatures_by_theta(X, theta)
    np.testing.assert_allclose(same, r.curvatures(X, theta), rtol=1e-12, atol=1e-13)
    step = 1e-5
    for q in range(theta.shape[1]):
        away = np.zeros_like(theta)
        away[:, q] = step
        numeric = (r.curvatures(X, theta + away) - r.curvatures(X, theta - away)) / (2 * step)
        np.testing.assert_allclose(found[..., q], numeric, atol=1e-8 * max(1.0, np.abs(numeric).max()))


def test_at_a_units_centre_all_is_finite():
    r, _, theta = some_units("rotated", "matern-5/2")
    centre = r.form.centres(theta)[:1]
    K, D = r.curvatures_by_theta(centre, theta)
    near, D_near = r.curvatures_by_theta(centre + 1e-9, theta)
    np.testing.assert_allclose(K, near, atol=1e-6 * np.abs(K).max())
    np.testing.assert_allclose(D, D_near, atol=1e-6 * np.abs(D).max())


def some_samples(r, X, seed=1):
    """Values, slopes and curvatures of one output, some without weight and not-a-number."""
    rng = np.random.default_rng(seed)
    N, n = X.shape
    known = {
        "weights": rng.uniform(0.5, 2.0, N),
        "slopes": rng.normal(size=(N, 1, n)),
        "slope_weight": rng.uniform(0.1, 1.0, (N, n)),
        "curvatures": rng.normal(size=(N, 1, n * (n + 1) // 2)),
        "curvature_weight": rng.uniform(0.1, 1.0, (N, n * (n + 1) // 2)),
    }
    known["slope_weight"][2], known["slope_weight"][3, 1] = 0.0, 0.0
    known["curvature_weight"][1], known["curvature_weight"][3, 2] = 0.0, 0.0
    for what in ("slope", "curvature"):
        known[f"{what}s"].transpose(0, 2, 1)[known[f"{what}_weight"] == 0] = np.nan
    return rng.normal(size=(N, 1)), known


@pytest.mark.parametrize("kind", FORMS)
def test_the_cost_is_the_weighted_sum_over_all_known_numbers(kind):
    """As documented, with the curvatures' squares those of the Frobenius norm: off the diagonal they count twice."""
    r, X, theta = some_units(kind, "inverse-multiquadric", N=12)
    Y, known = some_samples(r, X)
    rows = Rows.of(r, X, Y, **known)
    fit = project(rows, theta, 0.0)
    C = fit.coefficients @ rows.modes
    tail = 1 + 3
    value = np.hstack([r.tail_rows(X), r.phi(X, theta)]) @ C - Y
    slope = (r.slopes(X, theta) @ C[tail:])[..., 0] + C[1:tail, 0] - known["slopes"][:, 0]
    bend = (r.curvatures(X, theta) @ C[tail:])[..., 0] - known["curvatures"][:, 0]
    twice = np.where(np.equal(*pairs(3)), 1.0, 2.0)
    w = known["weights"]
    cost = (w * value[:, 0] ** 2).sum()
    cost += np.nansum(w[:, None] * known["slope_weight"] * slope**2)
    cost += np.nansum(w[:, None] * known["curvature_weight"] * twice * bend**2)
    assert fit.cost == pytest.approx(cost, rel=1e-10)
    assert len(rows.targets) == 12 + (36 - 3 - 1) + (72 - 6 - 1)


@pytest.mark.parametrize("kind", FORMS)
def test_derivatives_of_the_rows_equal_central_differences(kind):
    r, X, theta = some_units(kind, "gaussian", N=9)
    Y, known = some_samples(r, X)
    rows = Rows.of(r, X, Y, **known)
    D, step = rows.derivatives(theta).reshape(-1, *theta.shape), 1e-5
    for q in range(theta.shape[1]):
        away = np.zeros_like(theta)
        away[:, q] = step
        numeric = (rows.matrix(theta + away) - rows.matrix(theta - away)) / (2 * step)
        np.testing.assert_allclose(
            D[..., q], numeric[:, r.tail_size :], atol=1e-8 * max(1, np.abs(numeric).max())
        )


@pytest.mark.parametrize("groups", [None, [0, 0, 1, 2, 1, 3, 4, 5, 5, 6, 7, 0]])
def test_leaving_groups_of_samples_out_in_closed_form_equals_fitting_without_them(groups):
    r, X, theta = some_units("rotated", "gaussian", N=12)
    Y, known = some_samples(r, X)
    rows, penalty = Rows.of(r, X, Y, groups=groups, **known), 0.05
    found = leave_one_out_row_errors(rows, project(rows, theta, penalty))
    F = rows.matrix(theta)
    ridge = np.diag(np.r_[np.zeros(r.tail_size), np.full(len(theta), penalty)])
    of_row = np.arange(12)[rows.samples] if groups is None else np.array(groups)[rows.samples]
    for g in np.unique(of_row):
        out = of_row == g
        A, b = F[~out], rows.targets[~out]
        C = np.linalg.solve(A.T @ A + ridge, A.T @ b)
        np.testing.assert_allclose(found[out], rows.targets[out] - F[out] @ C, rtol=1e-8, atol=1e-10)


def test_the_leave_one_out_error_counts_all_that_is_known_of_a_sample():
    """Without units, refinement is the tail alone, whose left-out errors are exact."""
    r, X, _ = some_units("rotated", "gaussian", N=12)
    Y, known = some_samples(r, X)
    refined = refine(X, Y, np.zeros((0, r.form.size)), r, **known)
    rows = Rows.of(r, X, Y, **known)
    missed = leave_one_out_row_errors(rows, project(rows, refined.theta, 0.0))
    assert refined.loo == pytest.approx(np.sqrt((missed**2).sum() / known["weights"].sum()), rel=1e-8)
    assert refined.rows == len(rows.targets)


def test_units_numbers_count_as_leverage_in_whole_blocks():
    """Z Zᵀ is the units' part of the projection on the Jacobian's columns."""
    r, X, theta = some_units("axis-aligned", "gaussian", N=12, h=3)
    Y, known = some_samples(r, X)
    rows = Rows.of(r, X, Y, **known)
    fit = project(rows, theta, 1e-14)
    F, D = rows.matrix(theta), rows.derivatives(theta) * np.repeat(fit.coefficients[-3:, 0], theta.shape[1])
    whole = np.linalg.qr(np.hstack([F, D]))[0]
    Z = span_of_units(rows, theta, fit)
    np.testing.assert_allclose(fit.Q @ fit.Q.T + Z @ Z.T, whole @ whole.T, atol=1e-7)


def test_curvatures_lead_the_refinement_to_the_unit_they_came_from():
    r, X, theta = some_units("rotated", "gaussian", h=1, N=6)
    bend = r.curvatures(X, theta)[..., 0][:, None]
    Y = r.phi(X, theta)
    found = refine(X, Y, theta + 0.1, r, curvatures=bend, slopes=r.slopes(X, theta)[..., 0][:, None])
    assert found.rms < 1e-7
    np.testing.assert_allclose(found.theta, theta, atol=1e-4)
