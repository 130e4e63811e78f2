"""Patch test on distorted tetrahedra, and tangents against differences, for every law in both forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmark_bodies import BOX, Boxes, Moved

from palpate.physics.interactions import GluedPad, Pressure, SphereProbe
from palpate.physics.materials import (
    FibreFamily,
    FibreReinforced,
    LinearElastic,
    LinearHardening,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    Plastic,
    StVenantKirchhoff,
    Viscoelastic,
    VoceHardening,
    Yeoh,
)
from palpate.physics.materials.tensors import gradient, isochoric_first, log
from palpate.physics.materials.user import material
from palpate.physics.solid import Body

SIDE = 0.03
MATRIX = np.array(((-0.08, 0.15, 0.05), (0.02, 0.12, -0.1), (0.1, 0.0, -0.15)))
SOFT = NeoHookean.from_shear(3e3, poisson=0.45, form="isochoric")
FIBRES = tuple(
    FibreFamily((math.cos(a), math.sin(a), 0.1), k1=2e3, k2=0.8, dispersion=0.1) for a in (0.6, -0.9)
)


@material(bulk=3e4)
def gent(F, mu=3e3, limit=20.0):
    """Chains of limited length (Gent 1996, Rubber Chem. Technol. 69, 59-61)."""
    return -mu * limit / 2 * log(1 - (isochoric_first(F) - 3) / limit)


LAWS = {
    "linear": LinearElastic(9e3, 0.45),
    "St. Venant": StVenantKirchhoff(9e3, 0.3),
    "neo-Hooke": NeoHookean(9e3, 0.45),
    "isochoric neo-Hooke": SOFT,
    "Mooney-Rivlin": MooneyRivlin.with_poisson(0.45, c10=1e3, c01=0.5e3),
    "Yeoh": Yeoh.with_poisson(0.45, c10=1.5e3, c20=200.0, c30=60.0),
    "Ogden": Ogden.with_poisson(0.45, mu=(2e3,), alpha=(2.5,)),
    "fibres": FibreReinforced(SOFT, FIBRES),
    "a user's": gent,
}
HISTORIES = {
    "viscous": Viscoelastic(NeoHookean(9e3, 0.45), ((0.3, 1.0), (0.2, 10.0))),
    "viscous fibres": Viscoelastic(FibreReinforced(SOFT, FIBRES), ((0.5, 0.4),)),
    "plastic": Plastic(LinearElastic(9e3, 0.3), LinearHardening(200.0, 900.0)),
    "plastic Voce": Plastic(LinearElastic(9e3, 0.3), VoceHardening(200.0, 150.0, 20.0, 300.0)),
}
FORMS = ("displacement", "mixed")


def shaken(points):
    """The cube, its nodes moved by up to a fifth of an element, those on the surface within the surface."""
    shift = np.random.default_rng(3).uniform(-0.1, 0.1, points.shape)
    return SIDE * (points + shift * ((points > 0) & (points < 1)))


def cube(law, form, n=2):
    return Body(Boxes((n, n, n), shaken), law, fixed=(), formulation=form)


def stretch(x, y, z):
    return tuple(row[0] * x + row[1] * y + row[2] * z for row in MATRIX.tolist())


@pytest.mark.grid
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("law", LAWS)
def test_the_patch_test_is_exact(law, form):
    """A linear displacement on the boundary is met inside by every unknown, energy and force."""
    known = LAWS[law]
    solver = cube(known, form).problem(Moved(stretch)).open(tolerance=1e-12)
    found = solver.solve(0.7)
    assert found.converged, found.message
    F, volume = np.eye(3) + 0.7 * MATRIX, SIDE**3
    import ngsolve as ng

    field = solver._model.field
    exact = field.interpolate(ng.CF(stretch(ng.x, ng.y, ng.z)))[field.moving] * 0.7
    np.testing.assert_allclose(found.state[field.moving], exact, atol=1e-10 * np.abs(exact).max())
    if form == "mixed":
        pressure = known.volumetric.modulus * known.volumetric.measure(F)
        np.testing.assert_allclose(found.state[~field.moving], pressure, rtol=1e-8)
    assert found.potential_energy == pytest.approx(volume * known.energy(F), rel=1e-10)
    slope = volume * np.sum(gradient(known.energy, F) * MATRIX)
    np.testing.assert_allclose(-found.response, slope, rtol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_the_stress_is_that_of_the_homogeneous_state(form):
    F = np.eye(3) + 0.7 * MATRIX
    found = cube(SOFT, form).problem(Moved(stretch)).solve(0.7, fields=True)
    cauchy = gradient(SOFT.energy, F) @ F.T / np.linalg.det(F)
    np.testing.assert_allclose(found.stress, np.tile(cauchy, (27, 1, 1)), atol=1e-6 * np.abs(cauchy).max())


def differences(system, z):
    """Relative errors of gradient and tangent along a random direction at unknowns z (dof,).

    With steps of 1e-8 m both round-off and the third derivative leave 1e-10 or less of them.
    """
    rng = np.random.default_rng(1)
    scale = np.where(system.field.moving, 1e-3, 1e3 if system.field.pressure else 0.0)
    direction = rng.standard_normal(z.size) * scale * system.free
    h = 1e-5
    slope = (system.potential(z + h * direction) - system.potential(z - h * direction)) / (2 * h)
    bend = (system.residual(z + h * direction) - system.residual(z - h * direction)) / (2 * h)
    system.factorise(z)
    first = system.residual(z) @ direction
    second = system.multiply(direction) * system.free
    size = np.abs(system.residual(z) * direction).sum()
    return abs(slope - first) / size, np.linalg.norm(bend - second) / np.linalg.norm(second)


def shaken_state(field, seed=2):
    """Unknowns near the stretched state, none of them special."""
    import ngsolve as ng

    z = 0.7 * field.interpolate(ng.CF(stretch(ng.x, ng.y, ng.z)))
    rng = np.random.default_rng(seed)
    z[field.moving] += 2e-5 * rng.standard_normal(field.motion_size)
    z[~field.moving] = 500.0 * rng.standard_normal(field.size - field.motion_size)
    return z


@pytest.mark.grid
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("law", LAWS)
def test_residual_and_tangent_are_derivatives(law, form):
    model = cube(LAWS[law], form).problem(Moved(stretch, surfaces=("bottom",))).open()._model
    first, second = differences(model.system, shaken_state(model.field))
    assert first < 1e-9
    assert second < 1e-9


@pytest.mark.grid
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("law", HISTORIES)
def test_tangents_of_materials_with_a_history_are_derivatives(law, form):
    """After two steps of 0.3 s, so that the internal variables are those of no special state."""
    model = cube(HISTORIES[law], form).problem(Moved(stretch, surfaces=("bottom",))).open()._model
    model.duration = 0.3
    for share in (0.4, 0.8):
        model.begin(1.0)
        model.commit(share * shaken_state(model.field, seed=5))
    model.begin(1.0)
    z = shaken_state(model.field)
    first, second = differences(model.system, z)
    assert first < 1e-9
    assert second < 1e-9


@pytest.mark.full
@pytest.mark.parametrize("form", FORMS)
def test_the_tangent_with_contact_is_a_derivative(form):
    probe = SphereProbe(radius=0.01, depth=(0.0, 0.005), over=((0.014, 0.014), (0.016, 0.016)))
    body = Body(Boxes((3, 3, 3), shaken), LAWS["neo-Hooke"], formulation=form)
    solver = body.problem(probe).open()
    found = solver.solve((0.0151, 0.0148, SIDE + 0.01 - 0.003))
    assert found.converged, found.message
    model = solver._model
    model.set(found.inputs)
    rng = np.random.default_rng(4)
    z = found.state + 1e-5 * rng.standard_normal(found.state.size) * model.system.free * model.field.moving
    first, second = differences(model.system, z)
    assert first < 1e-8
    assert second < 1e-8


LOADS = {
    "pressure": (Pressure("top", (0.0, 1e3), symmetry=(0, 0, 0)), [500.0]),
    "pad": (GluedPad("top", pad=1e6, displacement=(0.0, 0.0, (-0.005, 0.005))), [-0.003]),
}


@pytest.mark.parametrize("load", LOADS)
def test_tangents_of_other_energies_are_derivatives(load):
    interaction, inputs = LOADS[load]
    model = Body(Boxes((2, 2, 2), shaken), SOFT).problem(interaction).open()._model
    model.set(np.array(inputs))
    first, second = differences(model.system, shaken_state(model.field))
    assert first < 1e-9
    assert second < 1e-9


def test_the_mesh_is_distorted():
    mesh = cube(SOFT, "mixed").geometry.plain()
    assert mesh.volume == pytest.approx(SIDE**3)
    assert np.ptp(mesh.volumes) > 0.3 * mesh.volumes.mean()
    assert set(mesh.surfaces) == set(BOX)
