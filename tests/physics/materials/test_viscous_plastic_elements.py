"""Materials with a history read by NGSolve: what it assembles is what NumPy computes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.material import initial_state
from palpate.physics.materials.mooney_rivlin import MooneyRivlin
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.prony import mean_decay
from palpate.physics.materials.tensors import gradient
from palpate.physics.materials.viscous import Viscoelastic

TERMS = ((0.3, 0.5), (0.2, 20.0))
METAL = LinearElastic(110e9, 0.35)
CASES = {
    "neo-Hookean": (Viscoelastic(NeoHookean(9e3, 0.45), TERMS), 0.15),
    "isochoric": (Viscoelastic(NeoHookean(9e3, 0.49, form="isochoric"), TERMS), 0.15),
    "Mooney-Rivlin, all": (Viscoelastic(MooneyRivlin(1.2e3, 0.3e3, bulk=5e4), TERMS, part="all"), 0.15),
    "linear": (Viscoelastic(METAL, TERMS), 0.004),
    "linear hardening": (Plastic(METAL, LinearHardening(70e6, 2e9)), 0.004),
    "Voce": (Plastic(METAL, VoceHardening(70e6, 150e6, 18.0, 0.4e9)), 0.004),
    "Voce, quick": (Plastic(METAL, VoceHardening(70e6, 5e9, 2e3)), 0.004),
}


class Cube:
    """A unit cube whose displacement is (F − I) X, so that every state is homogeneous."""

    def __init__(self, material):
        import ngsolve
        from netgen.csg import unit_cube
        from ngsolve.comp import IntegrationRuleSpace, MatrixValued

        ngsolve.SetNumThreads(1)
        self.ngsolve, self.material = ngsolve, material
        self.mesh = ngsolve.Mesh(unit_cube.GenerateMesh(maxh=2.0))
        self.space = ngsolve.VectorH1(self.mesh, order=1)
        points = IntegrationRuleSpace(self.mesh, order=1)
        self.measure = ngsolve.dx(intrules=points.GetIntegrationRules())
        tensors = MatrixValued(points, dim=3)
        self.state = {s.name: ngsolve.GridFunction(tensors if s.shape else points) for s in material.states}
        self.dt = ngsolve.Parameter(1.0)
        F = ngsolve.Id(3) + ngsolve.Grad(self.space.TrialFunction())
        self.form = ngsolve.BilinearForm(self.space, symmetric=True)
        self.form += ngsolve.Variation(material.energy(F, self.state, self.dt).Compile() * self.measure)
        self.displacement = ngsolve.GridFunction(self.space)
        here = ngsolve.Id(3) + ngsolve.Grad(self.displacement)
        self.after = {name: cf.Compile() for name, cf in material.advance(here, self.state, self.dt).items()}

    def affine(self, gradient_):
        """Nodal displacements of u = G X, as a vector."""
        ng = self.ngsolve
        field = ng.GridFunction(self.space)
        X = ng.CF((ng.x, ng.y, ng.z))
        field.Set(ng.CF(tuple(gradient_.ravel().tolist()), dims=(3, 3)) * X)
        return field.vec

    def commit(self, F, dt):
        """Keep the state after a step to F: every variable is evaluated before any is overwritten."""
        self.dt.Set(dt)
        self.displacement.vec.data = self.affine(F - np.eye(3))
        fresh = {}
        for name, value in self.after.items():
            copy = self.ngsolve.GridFunction(self.state[name].space)
            copy.Interpolate(value)
            fresh[name] = copy
        for name, copy in fresh.items():
            self.state[name].vec.data = copy.vec

    def values(self, name):
        shape = next(s.shape for s in self.material.states if s.name == name)
        flat = self.state[name].vec.FV().NumPy()
        return flat.reshape(math.prod(shape), -1).T.reshape(-1, *shape) if shape else flat

    def energy(self, F, dt):
        self.dt.Set(dt)
        return self.form.Energy(self.affine(F - np.eye(3)))

    def force(self, F, dt):
        self.dt.Set(dt)
        vector = self.affine(F - np.eye(3))
        out = vector.CreateVector()
        self.form.Apply(vector, out)
        return out

    def tangent(self, F, dt):
        self.dt.Set(dt)
        self.form.AssembleLinearization(self.affine(F - np.eye(3)))
        return self.form.mat


@pytest.fixture(scope="module", params=CASES, ids=str)
def case(request):
    material, size = CASES[request.param]
    rng = np.random.default_rng(7)
    path = np.eye(3) + size * rng.normal(size=(3, 3, 3))
    return material, Cube(material), path, size


@pytest.mark.full
@pytest.mark.grid
def test_elements_and_arrays_agree(case):
    """Energy, stress and tangent after two steps of history, and the history itself."""
    material, cube, (first, second, third), size = case
    state = initial_state(material, first)
    for F, dt in ((first, 0.3), (second, 4.0)):
        state = material.advance(F, state, dt)
        cube.commit(F, dt)
    for name, value in state.items():
        scale = np.max(np.abs(value))
        found = cube.values(name)
        np.testing.assert_allclose(found, np.broadcast_to(value, found.shape), rtol=0, atol=1e-9 * scale)
    energy = float(material.energy(third, state, 0.7))
    assert cube.energy(third, 0.7) == pytest.approx(energy, rel=1e-9)

    def stress(F):
        return gradient(lambda A: material.energy(A, state, 0.7), F)

    P, force, tangent = stress(third), cube.force(third, 0.7), cube.tangent(third, 0.7)
    rng = np.random.default_rng(11)
    for _ in range(3):
        one, two = rng.normal(size=(2, 3, 3))
        u, v = cube.affine(one), cube.affine(two)
        assert cube.ngsolve.InnerProduct(force, u) == pytest.approx(np.sum(P * one), rel=1e-8)
        step = 1e-4 * size * two
        rate = (stress(third + step) - stress(third - step)) / (2e-4 * size)
        product = v.CreateVector()
        product.data = tangent * v
        # central differences err by the square of the step over the strain, 1e-8
        scale = np.linalg.norm(rate) * np.linalg.norm(one)
        assert cube.ngsolve.InnerProduct(product, u) == pytest.approx(np.sum(rate * one), abs=1e-6 * scale)


@pytest.mark.parametrize("ratio", [0.0, 1e-9, 1e-3, 0.0099, 0.0101, 1.0, 50.0])
def test_the_mean_decay_of_a_parameter_is_that_of_a_number(ratio):
    import ngsolve
    from netgen.geom2d import unit_square

    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=1.0))
    value = mean_decay(ngsolve.Parameter(ratio))(mesh(0.3, 0.3))
    assert value == pytest.approx(mean_decay(ratio), rel=1e-12)
