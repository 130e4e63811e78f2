"""Tensor functions: arrays, coefficient functions and the algebra agree."""

from __future__ import annotations

import numpy as np
import pytest
from netgen.csg import unit_cube

from palpate.physics.materials import tensors as t


@pytest.fixture(scope="module")
def point():
    import ngsolve

    ngsolve.SetNumThreads(1)
    mesh = ngsolve.Mesh(unit_cube.GenerateMesh(maxh=3))
    yield mesh(0.2, 0.3, 0.1)  # a point does not keep its mesh alive
    del mesh


def symbolic(array):
    import ngsolve

    return ngsolve.CF(tuple(array.ravel().tolist()), dims=array.shape)


def value(function, point, shape):
    return np.reshape(function(point), shape)


A = np.random.default_rng(3).normal(size=(4, 3, 3)) + 2 * np.eye(3)
B = np.random.default_rng(4).normal(size=(4, 3, 3))
V = np.array([0.3, -1.0, 2.0])

TENSORS = {
    "transpose": t.transpose,
    "cofactor": t.cofactor,
    "inverse": t.inverse,
    "sym": t.sym,
    "deviator": t.deviator,
    "identity": lambda a: t.identity(a) + 0 * a,
    "matmul": lambda a: t.matmul(a, t.constant(B[0], a)),
    "scale": lambda a: t.scale(t.trace(a), a),
    "outer": lambda a: t.outer(t.transform(a, t.constant(V, a)), t.constant(V, a)),
}
SCALARS = {
    "trace": t.trace,
    "determinant": t.determinant,
    "inner": lambda a: t.inner(a, t.constant(B[0], a)),
    "dot": lambda a: t.dot(t.transform(a, t.constant(V, a)), t.constant(V, a)),
    "log": lambda a: t.log(t.inner(a, a)),
    "exp": lambda a: t.exp(-t.trace(a)),
    "sqrt": lambda a: t.sqrt(t.inner(a, a)),
    "power": lambda a: t.power(t.inner(a, a), -0.7),
    "where": lambda a: t.where(t.trace(a) - 6, t.trace(a) ** 2, t.determinant(a)),
    "positive part": lambda a: t.positive_part(t.trace(a) - 6) ** 2,
}


@pytest.mark.grid
@pytest.mark.parametrize("name", TENSORS)
def test_tensors_are_the_same_in_both_worlds(name, point):
    function = TENSORS[name]
    for a in A:
        assert value(function(symbolic(a)), point, (3, 3)) == pytest.approx(function(a), rel=1e-13, abs=1e-13)
    np.testing.assert_allclose(function(A), [function(a) for a in A], rtol=1e-13)


@pytest.mark.parametrize("name", SCALARS)
def test_scalars_and_their_gradients_are_the_same_in_both_worlds(name, point):
    function = SCALARS[name]
    for a in A:
        assert function(symbolic(a))(point) == pytest.approx(function(a), rel=1e-13)
        there = value(t.gradient(function, symbolic(a)), point, (3, 3))
        np.testing.assert_allclose(t.gradient(function, a), there, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(function(A), [function(a) for a in A], rtol=1e-13)


def test_the_algebra():
    unit = np.broadcast_to(np.eye(3), A.shape)
    np.testing.assert_allclose(t.matmul(A, t.inverse(A)), unit, atol=1e-13)
    np.testing.assert_allclose(t.determinant(A), np.linalg.det(A))
    np.testing.assert_allclose(
        t.cofactor(A), t.scale(t.determinant(A), t.transpose(t.inverse(A))), rtol=1e-10
    )
    np.testing.assert_allclose(t.trace(t.deviator(A)), 0, atol=1e-14)
    singular = np.diag([1.0, 2.0, 0.0])
    np.testing.assert_allclose(t.cofactor(singular), np.diag([0.0, 0.0, 2.0]))


def test_derivatives_of_the_determinant():
    # ∂det A/∂A = cof A (Jacobi); its second derivative is the alternating product with A
    np.testing.assert_allclose(t.gradient(t.determinant, A), t.cofactor(A), rtol=1e-14, atol=1e-14)
    epsilon = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        epsilon[i, j, k], epsilon[j, i, k] = 1, -1
    exact = np.einsum("ikm,jln,pmn->pijkl", epsilon, epsilon, A)
    np.testing.assert_allclose(t.second_gradient(t.determinant, A), exact, atol=1e-10)


def test_logarithms_and_roots_of_the_impossible_are_nan():
    assert np.isnan(t.log(-1.0))
    assert np.isnan(t.sqrt(-1.0))
    assert np.isnan(t.power(-1.0, 0.5))
