"""Units with their images: symmetric by construction, and ordinary units once written out."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors, pairs
from palpate.rbf.symmetric_units import Images, SymmetricRegressors

FORMS = ("isotropic", "axis-aligned", "rotated", "rank-1", "rank-2")
every_form = pytest.mark.parametrize("kind", FORMS)


def square():
    """The symmetry of a square prism that stands off the origin."""
    turns = []
    for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        turns += [np.diag([sx, sy, 1.0]), np.diag([sx, sy, 1.0]) @ np.eye(3)[[1, 0, 2]]]
    turns, about = np.array(turns), np.array([0.2, -0.1, 0.0])
    return Images(turns, about - turns @ about)


def some_units(kind, N=6, h=3, seed=0):
    rng = np.random.default_rng(seed)
    r = SymmetricRegressors(unit_form(kind, 3), "inverse-multiquadric", "affine", square())
    X = rng.uniform(-1, 1, (N, 3))
    theta = np.array([r.form.unit(x, 0.7, seed=i) for i, x in enumerate(X[:h])])
    return r, X, theta + rng.normal(0, 0.2, theta.shape)


@every_form
def test_images_have_the_same_value(kind):
    r, X, theta = some_units(kind)
    for image in r.images.of(X):
        np.testing.assert_allclose(r.phi(image, theta), r.phi(X, theta), rtol=1e-12)
        np.testing.assert_allclose(r.tail_rows(image), r.tail_rows(X), atol=1e-12)


@every_form
def test_written_out_it_is_an_ordinary_network(kind):
    r, X, theta = some_units(kind)
    coefficients = np.random.default_rng(3).normal(size=(r.tail_size + len(theta), 2))
    factors, shifts, whole = r.expanded(theta, coefficients)
    v = np.einsum("kri,Ni->Nkr", factors, X) - shifts
    phi = 1 / np.sqrt(1 + (v**2).sum(axis=2))
    expected = np.hstack([np.ones((len(X), 1)), X, phi]) @ whole
    found = np.hstack([r.tail_rows(X), r.phi(X, theta)]) @ coefficients
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.grid
@every_form
def test_slopes_and_curvatures_equal_complex_step(kind):
    r, X, theta = some_units(kind)
    plain = Regressors(r.form, r.radial)
    i, j = pairs(3)
    slopes, bends = r.slopes(X, theta), r.curvatures(X, theta)
    for axis in range(3):
        moved = X + 1e-30j * np.eye(3)[axis]
        np.testing.assert_allclose(slopes[:, axis], r.phi(moved, theta).imag / 1e-30, rtol=1e-10, atol=1e-12)
        at = np.flatnonzero(j == axis)
        by_step = (r.slopes(moved, theta).imag / 1e-30)[:, i[at]]
        np.testing.assert_allclose(bends[:, at], by_step, rtol=1e-10, atol=1e-11)
    assert not np.allclose(slopes, plain.slopes(X, theta))


@every_form
def test_derivatives_by_the_units_numbers_equal_central_differences(kind):
    r, X, theta = some_units(kind)
    rows = Rows.blank(r, X, slope_weight=0.5, curvature_weight=0.1)
    D, step = rows.derivatives(theta).reshape(-1, *theta.shape), 1e-5
    np.testing.assert_allclose(r.by_theta(X, theta)[1], D[: len(X)], rtol=1e-10, atol=1e-12)
    for q in range(theta.shape[1]):
        away = np.zeros_like(theta)
        away[:, q] = step
        numeric = (rows.matrix(theta + away) - rows.matrix(theta - away)) / (2 * step)
        np.testing.assert_allclose(
            D[..., q], numeric[:, r.tail_size :], atol=1e-8 * max(1, np.abs(numeric).max())
        )


def test_the_tail_keeps_what_the_group_leaves_as_it_is():
    r, X, _ = some_units("rotated")
    assert r.tail_size == 2  # constant and height
    np.testing.assert_allclose(r.tail_slopes(4)[0, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.matrix_rank(np.hstack([r.tail_rows(X), np.ones((6, 1)), X[:, 2:]])), 2
    )


def test_maps_that_are_no_group_are_refused():
    turns = np.stack([np.eye(3), np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, 1.0])])
    with pytest.raises(UsageError, match="not a symmetry"):
        Images(turns, np.zeros((3, 3)))


def test_without_units_the_tail_alone_is_left():
    r, X, theta = some_units("rotated")
    rows = Rows.blank(r, X, slope_weight=1.0, curvature_weight=1.0)
    assert rows.matrix(theta[:0]).shape == (6 * 10, 2)
