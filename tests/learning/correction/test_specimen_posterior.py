"""The filter against least squares."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.learning.correction import SpecimenPosterior


def measurements(k, q, seed=0):
    rng = np.random.default_rng(seed)
    H = rng.normal(size=(k, 3, q))
    return H, np.einsum("kij,j->ki", H, rng.normal(size=q)) + rng.normal(size=(k, 3))


def filtered(posterior, H, y):
    for rows, measured in zip(H, y, strict=True):
        posterior = posterior.update(rows, measured - rows @ posterior.mean)
    return posterior


@pytest.mark.parametrize(("k", "q"), [(1, 7), (5, 7), (60, 7), (40, 30)])
def test_linear_rows_one_after_the_other_are_weighted_least_squares(k, q):
    H, y = measurements(k, q)
    rng = np.random.default_rng(1)
    root = rng.normal(size=(q, q))
    prior = SpecimenPosterior(rng.normal(size=q), root)
    found = filtered(prior, H, y)
    information = np.linalg.inv(root @ root.T)
    A = H.reshape(-1, q)
    P = np.linalg.inv(information + A.T @ A)
    mean = P @ (information @ prior.mean + A.T @ y.ravel())
    np.testing.assert_allclose(found.covariance, P, atol=1e-9 * np.abs(P).max() * np.linalg.cond(root) ** 2)
    np.testing.assert_allclose(found.mean, mean, rtol=1e-7, atol=1e-8)
    together = prior.update(A, y.ravel() - A @ prior.mean)
    np.testing.assert_allclose(
        together.covariance, P, atol=1e-9 * np.abs(P).max() * np.linalg.cond(root) ** 2
    )


def test_the_order_of_linear_rows_does_not_matter():
    H, y = measurements(50, 12)
    turned = np.random.default_rng(2).permutation(50)
    one, other = (filtered(SpecimenPosterior.standard(12), H[i], y[i]) for i in (np.arange(50), turned))
    np.testing.assert_allclose(one.mean, other.mean, atol=1e-11)
    np.testing.assert_allclose(one.covariance, other.covariance, atol=1e-12)


def test_the_covariance_stays_positive_where_subtraction_would_lose_it():
    """Rows of 1e9 prior deviations: P − K H P has eigenvalues of rounding's sign, a root squared has none below 0."""
    H, y = measurements(200, 8)
    found = filtered(SpecimenPosterior.standard(8), 1e9 * H, 1e9 * y)
    P = found.covariance
    assert (P == P.T).all()
    exact = np.linalg.inv(1e18 * np.einsum("kij,kil->jl", H, H))
    np.testing.assert_allclose(np.linalg.eigvalsh(P), np.linalg.eigvalsh(exact), rtol=1e-3)


def test_what_is_forgotten_never_exceeds_the_prior():
    H, y = measurements(20, 6)
    posterior = filtered(SpecimenPosterior.standard(6), H, y)
    sizes = [np.linalg.eigvalsh(posterior.covariance)]
    for _ in range(200):
        posterior = posterior.forget(0.05)
        sizes.append(np.linalg.eigvalsh(posterior.covariance))
    assert (np.diff(sizes, axis=0) > 0).all()
    np.testing.assert_allclose(sizes[-1], 1.0, atol=0.95**200)
    assert (sizes[-1] <= 1.0).all()
