"""Power sums of stretches against the spectral formulas, also where stretches coincide."""

from __future__ import annotations

import numpy as np
import pytest
from netgen.csg import unit_cube

from palpate.physics.materials.stretches import stretch_sums

STATES = [
    (1.0, 1.0, 1.0),
    (1 + 1e-9, 1.0, 1.0),
    (1.001, 1.0, 1.0),
    (1.01, 1.0, 0.99),
    (1.03, 1.0, 1.0),
    (1.05, 1.02, 1.0),
    (1.06, 1.0, 0.97),
    *((s, s**-0.5, s**-0.5) for s in (0.4, 0.8, 0.95, 1.05, 1.5, 3.0)),
    *((s, s, s**-2.0) for s in (0.4, 0.8, 0.95, 1.05, 1.5, 3.0)),
    *((s, 1.0, 1 / s) for s in (0.4, 0.95, 3.0)),
    *((s, s, s) for s in (0.4, 3.0)),
    *((2.0, 0.7, 0.7 * (1 + gap)) for gap in (1e-12, 1e-7, 1e-3, 0.03, 0.06, 0.065, 0.2)),
]
EXPONENTS = (2.52, -2.0, 0.5, -4.7, 25.0)


def spectral(F, a):
    """Value, gradient (3, 3) and second derivative (9, 9) in F of Σ λ^a (Hill's divided differences)."""
    _, stretches, vt = np.linalg.svd(F)
    c, Q, s = stretches**2, vt.T, a / 2
    near = np.abs(c[:, None] - c) <= 1e-5 * c
    middle = (c[:, None] + c) / 2
    # the divided difference of s c^(s-1); at a gap of 1e-5 its midpoint value is good to 1e-10
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = s * (c[:, None] ** (s - 1) - c ** (s - 1)) / (c[:, None] - c)
    slope = np.where(near, s * (s - 1) * middle ** (s - 2), slope)
    G = (Q * (s * c ** (s - 1))) @ Q.T
    H = np.zeros((9, 9))
    for k, E in enumerate(np.eye(9).reshape(9, 3, 3)):
        dC = E.T @ F + F.T @ E
        H[:, k] = (2 * F @ Q @ (slope * (Q.T @ dC @ Q)) @ Q.T + 2 * E @ G).ravel()
    return (c**s).sum(), 2 * F @ G, H


@pytest.fixture(scope="module")
def cube():
    """Energies of one homogeneous state, from a finite element."""
    import ngsolve as ng

    ng.SetNumThreads(1)
    mesh = ng.Mesh(unit_cube.GenerateMesh(maxh=3))
    space = ng.VectorH1(mesh, order=1)
    field = ng.GridFunction(space)
    modes = []
    for i in range(3):
        for x in (ng.x, ng.y, ng.z):
            field.Set(tuple(x if k == i else 0 for k in range(3)))
            modes.append(field.vec.FV().NumPy().copy())
    return space, np.array(modes)


@pytest.mark.full
@pytest.mark.parametrize("a", EXPONENTS)
def test_energy_gradient_and_second_derivative_in_a_finite_element(a, cube):
    import ngsolve as ng

    space, modes = cube
    F = ng.Id(3) + ng.Grad(space.TrialFunction())
    form = ng.BilinearForm(space, symmetric=True)
    form += ng.Variation(stretch_sums(F.trans * F, [a])[0].Compile() * ng.dx)
    state = ng.GridFunction(space).vec
    out = state.CreateVector()
    rng = np.random.default_rng(1)
    for stretches in STATES:
        P, Q = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
        at = (P * np.array(stretches)) @ Q.T
        state.FV().NumPy()[:] = (at - np.eye(3)).ravel() @ modes
        value, gradient, second = spectral(at, a)
        assert form.Energy(state) == pytest.approx(value, rel=1e-9)
        form.Apply(state, out)
        found = modes @ out.FV().NumPy()
        np.testing.assert_allclose(found, gradient.ravel(), rtol=0, atol=1e-8 * np.abs(gradient).max())
        form.AssembleLinearization(state)
        rows, cols, entries = form.mat.COO()
        tangent = np.zeros((space.ndof, space.ndof))
        tangent[rows, cols] = entries
        tangent = np.where(tangent, tangent, tangent.T)  # a symmetric form keeps one triangle
        np.testing.assert_allclose(
            modes @ tangent @ modes.T,
            second,
            rtol=0,
            atol=1e-8 * np.abs(second).max(),
            err_msg=str(stretches),
        )


def test_arrays_of_any_shape_and_complex_steps():
    rng = np.random.default_rng(2)
    F = np.eye(3) + 0.4 * rng.normal(size=(5, 2, 3, 3))
    C = np.swapaxes(F, -1, -2) @ F
    one, two = stretch_sums(C, (3.0, -1.0))
    eigenvalues = np.linalg.eigvalsh(C)
    np.testing.assert_allclose(one, (eigenvalues**1.5).sum(-1), rtol=1e-11)
    np.testing.assert_allclose(two, (eigenvalues**-0.5).sum(-1), rtol=1e-9)
    np.testing.assert_allclose(stretch_sums(C, (2.0,))[0], np.trace(C, axis1=-2, axis2=-1), rtol=1e-13)
