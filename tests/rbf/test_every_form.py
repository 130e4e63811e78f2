"""What must hold of every form of unit and every radial function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laws.filters import FORMS, RADIAL, exact, frozen_shapes, populated
from palpate.errors import UsageError
from palpate.learning import Observation, freeze, observe, step
from palpate.network import Scaling
from palpate.rbf.filter.growth import add_unit, remove_unit
from palpate.rbf.filter.prediction import linearise, measurement, regressors_at, value
from palpate.rbf.forms import Centred, unit_form
from palpate.rbf.refinement.rows import Rows
from palpate.units import Quantity, Range

n, m = 3, 2
every_form = pytest.mark.parametrize("name", FORMS)
every_radial = pytest.mark.parametrize("radial", RADIAL)


def written_out(state, z, x, settings):
    """f(x) and ∂f/∂x once more, plainly and for complex numbers, from the definitions."""
    tail_size = state.tail.shape[1]
    tail = z[: m * tail_size].reshape(m, tail_size)
    units = z[m * tail_size :].reshape(state.units, -1)
    rows = np.concatenate([[1.0], x])
    y = tail @ rows[:tail_size]
    for unit in units:
        A, b = factor(unit[m:], settings)
        q = ((A @ x - b) ** 2).sum()
        y = y + unit[:m] * profile(q, settings.radial)
    return y


def factor(theta, settings):
    if settings.form.startswith("rank-"):
        r = int(settings.form[5:])
        return theta[: r * n].reshape(r, n), theta[r * n :]
    count = 1 if settings.form == "isotropic" else n
    s = theta[n : n + count] * np.ones(n)
    A = np.diag(np.exp(-s) if settings.widths == "log" else 1 / s)
    A[np.tril_indices(n, -1)] = theta[n + count :] if settings.form == "rotated" else 0.0
    return A, A @ theta[:n]


def profile(q, radial):
    if radial == "gaussian":
        return np.exp(-q)
    if radial == "inverse-multiquadric":
        return (1 + q) ** -0.5
    s = np.sqrt(5 * q)
    return (1 + s + 5 * q / 3) * np.exp(-s)


def by_complex_step(function, z):
    """Derivatives by every entry of z, exact to round-off (Squire & Trapp 1998)."""
    columns = []
    for j in range(z.size):
        moved = z.astype(complex)
        moved[j] += 1e-30j
        columns.append(function(moved).imag / 1e-30)
    return np.stack(columns, axis=-1)


@pytest.mark.grid
@every_form
@every_radial
@pytest.mark.parametrize("widths", ["log", "plain"])
@pytest.mark.parametrize("tail", ["affine", "constant", "none"])
def test_jacobian_equals_complex_step(name, radial, widths, tail):
    settings = exact(form=name, radial=radial, widths=widths, tail=tail)
    state = populated(n, m, 4, settings)
    x = np.array([0.3, -0.2, 0.7])
    f, H = linearise(state, Observation(x, np.zeros(m)), settings)
    np.testing.assert_allclose(f, written_out(state, state.vector(), x, settings), rtol=1e-12)
    numeric = by_complex_step(lambda z: written_out(state, z, x, settings), state.vector())
    np.testing.assert_allclose(H, numeric, rtol=1e-10, atol=1e-12)


@every_form
@every_radial
def test_slopes_are_the_derivatives_of_the_value(name, radial):
    settings = exact(form=name, radial=radial)
    state = populated(n, m, 4, settings)
    x = np.array([0.3, -0.2, 0.7])
    found = measurement(state, Observation(x, np.zeros(m), slopes=np.zeros((m, n))), settings)[m:].reshape(
        m, n
    )
    numeric = by_complex_step(lambda p: written_out(state, state.vector(), p, settings), x)
    np.testing.assert_allclose(found, numeric, rtol=1e-10, atol=1e-12)


@every_form
@every_radial
def test_derivatives_of_the_slopes_by_every_parameter(name, radial):
    """Against central differences of the slopes, which the last test holds to the complex step."""
    settings = exact(form=name, radial=radial)
    state = populated(n, m, 3, settings)
    seen = Observation(np.array([0.3, -0.2, 0.7]), np.zeros(m), slopes=np.zeros((m, n)))
    f, H = linearise(state, seen, settings)
    np.testing.assert_allclose(f, measurement(state, seen, settings), rtol=1e-13, atol=1e-15)
    z, e = state.vector(), 1e-5
    for j in range(z.size):
        d = np.zeros_like(z)
        d[j] = e
        sides = [measurement(state.with_parameters(z + s * d), seen, settings) for s in (1, -1)]
        np.testing.assert_allclose(H[:, j], (sides[0] - sides[1]) / (2 * e), atol=2e-8)


@pytest.mark.parametrize("widths", ["log", "plain"])
def test_a_rotated_unit_that_is_not_rotated_is_the_axis_aligned_one(widths):
    rng = np.random.default_rng(2)
    centres, sigma = rng.uniform(-1, 1, (5, n)), rng.uniform(0.4, 1.5, (5, n))
    rotated, aligned = unit_form("rotated", n, widths), unit_form("axis-aligned", n, widths)
    assert isinstance(rotated, Centred)
    assert isinstance(aligned, Centred)
    for one, other in zip(
        rotated.factors(rotated.of(centres, sigma)), aligned.factors(aligned.of(centres, sigma)), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-15)


@every_form
def test_metric_is_positive_semidefinite_of_the_forms_rank(name):
    settings = exact(form=name)
    state = populated(n, m, 6, settings)
    A, _ = settings.regressors(n).form.factors(state.theta)
    for a in A:
        eigenvalues = np.linalg.eigvalsh(a.T @ a)
        assert (eigenvalues > -1e-12).all()
        assert (eigenvalues > 1e-9).sum() == settings.regressors(n).form.rank


@every_form
def test_a_new_unit_peaks_where_it_was_added(name):
    shape = unit_form(name, n)
    x = np.array([0.2, -0.7, 0.4])
    A, b = shape.factors(shape.unit(x, 0.6, seed=3)[None])
    np.testing.assert_allclose(A[0] @ x, b[0], atol=1e-14)
    widths = np.linalg.svd(A[0], compute_uv=False)
    np.testing.assert_allclose(1 / widths, 0.6, rtol=1e-12)


@every_form
@pytest.mark.parametrize("update", ["full", "shared"])
@pytest.mark.parametrize("order", [0, 1])
def test_with_resting_shapes_the_filter_is_batch_ridge_regression_in_any_order(name, update, order):
    settings = exact(form=name, update=update, noise=0.04)
    state = frozen_shapes(populated(n, m, 4, settings, seed=1))
    start = np.zeros_like(state.coefficients)
    state = replace(state, coefficients=start)
    rng = np.random.default_rng(7)
    X, Y = rng.uniform(-1, 1, (60, n)), rng.normal(size=(60, m))
    F = regressors_at(state, X, settings)
    for i in np.random.default_rng(order).permutation(len(X)):
        state, _ = step(state, X[i], Y[i], settings)
    ridge = np.linalg.solve(F.T @ F + settings.noise * np.eye(F.shape[1]), F.T @ Y)
    np.testing.assert_allclose(state.coefficients, ridge, rtol=1e-10, atol=1e-10 * np.abs(ridge).max())


@every_form
@every_radial
def test_a_unit_of_zero_weight_changes_no_prediction_when_added_or_removed(name, radial):
    settings = exact(form=name, radial=radial)
    state = populated(n, m, 4, settings)
    X = np.random.default_rng(1).uniform(-1, 1, (50, n))
    scaling = Scaling(np.zeros(n), np.ones(n), np.zeros(m), np.ones(m))
    inputs, outputs = [Range(c, -1, 1) for c in "abc"], [Quantity(c) for c in "xy"]

    def predictions(s):
        return freeze(s, settings, inputs, outputs, scaling).predict(X)

    more = add_unit(state, np.array([0.1, 0.2, 0.3]), np.zeros(m), settings)
    fewer = remove_unit(more, 4)
    np.testing.assert_array_equal(predictions(more), predictions(state))
    np.testing.assert_array_equal(predictions(fewer), predictions(state))
    np.testing.assert_allclose(value(more, X, settings), predictions(state), rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(fewer.covariance.matrix, state.covariance.matrix)


@every_form
def test_slopes_teach_what_values_do(name):
    """With resting shapes, values and slopes together are one weighted ridge regression."""
    settings = exact(form=name, noise=0.04)
    state = frozen_shapes(populated(n, m, 3, settings, seed=1))
    state = replace(state, coefficients=np.zeros_like(state.coefficients))
    rng = np.random.default_rng(8)
    X, Y, S = rng.uniform(-1, 1, (20, n)), rng.normal(size=(20, m)), rng.normal(size=(20, m, n))
    weight, slope_weight = rng.uniform(0.5, 3, 20), 0.3
    of = settings.regressors(n)
    values = regressors_at(state, X, settings)
    slopes = np.concatenate([of.tail_slopes(20), of.slopes(X, state.theta)], axis=2)
    both = np.sqrt(weight * slope_weight)[:, None, None]
    F = np.vstack([values * np.sqrt(weight)[:, None], *(slopes * both)])
    T = np.vstack([Y * np.sqrt(weight)[:, None], *(S.swapaxes(1, 2) * both)])
    ridge = np.linalg.solve(F.T @ F + settings.noise * np.eye(F.shape[1]), F.T @ T)
    for i in range(20):
        seen = Observation(X[i], Y[i], weight=weight[i], slopes=S[i], slope_weight=slope_weight)
        state, _ = observe(state, seen, settings)
    np.testing.assert_allclose(state.coefficients, ridge, rtol=1e-9, atol=1e-10 * np.abs(ridge).max())


@pytest.mark.parametrize("name", ["rank-0", "rank-4", "oval", "rank-x"])
def test_an_unknown_form_is_refused_by_name(name):
    with pytest.raises(UsageError, match=name):
        unit_form(name, n)


def known_of(state, count, seed=8):
    """Random observations with slopes and curvatures, each with a weight of its own, one slope of none."""
    rng, six = np.random.default_rng(seed), n * (n + 1) // 2
    for _ in range(count):
        slopes, curvatures = rng.normal(size=(m, n)), rng.normal(size=(m, six))
        s, c = rng.uniform(0.1, 1.0, n), rng.uniform(0.01, 0.1, six)
        s[1], c[4], slopes[:, 1], curvatures[:, 4] = 0.0, 0.0, np.nan, np.nan
        x, y = rng.uniform(-1, 1, n), rng.normal(size=m)
        yield Observation(x, y, float(rng.uniform(0.5, 3)), slopes, s, curvatures, c)


@pytest.mark.grid
@every_form
@every_radial
@pytest.mark.parametrize("update", ["full", "decoupled"])
def test_values_slopes_and_curvatures_together_are_one_ridge_regression(name, radial, update):
    """With resting shapes: what the filter learns one by one equals the refinement's rows solved at once."""
    settings = exact(form=name, radial=radial, noise=0.04, update=update)
    units = 1 if update == "decoupled" else 3
    if update == "decoupled":
        settings = replace(settings, tail="none")
    state = frozen_shapes(populated(n, m, units, settings, seed=1))
    state = replace(state, coefficients=np.zeros_like(state.coefficients))
    seen = list(known_of(state, 20))
    rows = Rows.of(
        settings.regressors(n),
        np.array([o.x for o in seen]),
        np.array([o.y for o in seen]),
        weights=np.array([o.weight for o in seen]),
        slopes=np.array([o.slopes for o in seen]),
        slope_weight=np.array([o.slope_weight for o in seen]),
        curvatures=np.array([o.curvatures for o in seen]),
        curvature_weight=np.array([o.curvature_weight for o in seen]),
    )
    F, T = rows.matrix(state.theta), rows.targets @ rows.modes
    ridge = np.linalg.solve(F.T @ F + settings.noise * np.eye(F.shape[1]), F.T @ T)
    for one in seen:
        state, event = observe(state, one, settings)
        assert event.updated
    np.testing.assert_allclose(state.coefficients, ridge, rtol=1e-10, atol=1e-10 * np.abs(ridge).max())


@pytest.mark.grid
@every_form
@every_radial
def test_jacobian_of_slopes_and_curvatures_equals_central_differences(name, radial):
    settings = exact(form=name, radial=radial)
    state = populated(n, m, 4, settings)
    one = next(known_of(state, 1))
    f, H = linearise(state, one, settings)
    np.testing.assert_allclose(f, measurement(state, one, settings), rtol=1e-12, atol=1e-13)
    assert f.shape == one.targets().shape == one.variances(1.0).shape == (m * (1 + n - 1 + 6 - 1),)
    z, step = state.vector(), 1e-5
    for j in range(z.size):
        away = step * np.eye(z.size)[j]
        up, down = (measurement(state.with_parameters(z + a), one, settings) for a in (away, -away))
        numeric = (up - down) / (2 * step)
        np.testing.assert_allclose(H[:, j], numeric, atol=1e-8 * max(1.0, np.abs(numeric).max()))


def test_an_observation_less_nothing_is_itself_and_less_itself_is_zero():
    one = next(known_of(None, 1))
    np.testing.assert_array_equal(one.minus(np.zeros(one.targets().size)).targets(), one.targets())
    np.testing.assert_array_equal(one.minus(one.targets()).targets(), 0.0)


def test_a_curvature_that_counts_must_be_finite():
    one = next(known_of(None, 1))
    assert not one.flaw
    assert replace(one, curvature_weight=1.0).flaw == "not finite"
    assert replace(one, curvature_weight=-1.0).flaw == "its weight is not positive and finite"
