"""What every elastic law must hold: moduli, invariance, one expression for arrays and elements, plain data, pickles."""

from __future__ import annotations

import json
import math
import pickle

import numpy as np
import pytest
from laws_of_matter import FIBRES, IDS, LAWS, MATRIX
from netgen.csg import unit_cube

from palpate.errors import UsageError
from palpate.physics.materials import (
    FibreFamily,
    FibreReinforced,
    LinearElastic,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    StVenantKirchhoff,
    Yeoh,
)
from palpate.physics.materials.tensors import gradient, second_gradient

I = np.eye(3)  # noqa: E741
F = I + 0.15 * np.random.default_rng(5).normal(size=(6, 3, 3))


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("law", [law for law in LAWS if not isinstance(law, FibreReinforced)], ids=str)
def test_small_strains_see_hookes_law(law):
    lame = law.bulk_modulus - 2 / 3 * law.shear_modulus
    hooke = lame * np.einsum("ij,kl->ijkl", I, I) + law.shear_modulus * (
        np.einsum("ik,jl->ijkl", I, I) + np.einsum("il,jk->ijkl", I, I)
    )
    np.testing.assert_allclose(second_gradient(law.energy, I), hooke, atol=1e-9 * law.bulk_modulus)
    np.testing.assert_allclose(gradient(law.energy, I), 0, atol=1e-12 * law.young)
    assert law.energy(I) == pytest.approx(0, abs=1e-12 * law.young)
    assert law.young == pytest.approx(
        9 * law.bulk_modulus * law.shear_modulus / (3 * law.bulk_modulus + law.shear_modulus)
    )
    assert law.poisson == pytest.approx(law.young / (2 * law.shear_modulus) - 1)


@pytest.mark.parametrize("law", [law for law in LAWS if law.kinematics == "large"], ids=str)
def test_a_rotation_of_the_body_costs_nothing(law):
    np.testing.assert_allclose(law.energy(rotation(1) @ F), law.energy(F), rtol=1e-10)
    if not isinstance(law, FibreReinforced):  # isotropy: nor does one of the material
        np.testing.assert_allclose(law.energy(F @ rotation(2)), law.energy(F), rtol=1e-10)


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_distortion_and_volume_make_the_energy(law):
    part = law.volumetric
    if part is None:
        np.testing.assert_array_equal(law.energy(F), law.distortion(F))
        return
    assert part.modulus > 0
    np.testing.assert_allclose(law.energy(F), law.distortion(F) + 0.5 * part.modulus * part.measure(F) ** 2)
    # the measure grows with the volume at unit rate, whatever its form
    assert gradient(part.measure, I) == pytest.approx(I)


@pytest.fixture(scope="module")
def element():
    """A mesh of a unit cube, its linear space, and the nine fields u = e_i x_j."""
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
@pytest.mark.grid
@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_a_finite_element_and_an_array_agree_on_energy_stress_and_tangent(law, element):
    import ngsolve as ng

    space, modes = element
    form = ng.BilinearForm(space, symmetric=True)
    form += ng.Variation(law.energy(ng.Id(3) + ng.Grad(space.TrialFunction())).Compile() * ng.dx)
    state = ng.GridFunction(space).vec
    out, along = state.CreateVector(), state.CreateVector()
    # unloaded fibres are at a kink, where rounding chooses the tangent
    for at in F[:3] if isinstance(law, FibreReinforced) else (I, *F[:3]):
        state.FV().NumPy()[:] = (at - I).ravel() @ modes
        assert form.Energy(state) == pytest.approx(law.energy(at), rel=1e-10, abs=1e-12 * law.young)
        form.Apply(state, out)
        stress = gradient(law.energy, at).ravel()
        np.testing.assert_allclose(modes @ out.FV().NumPy(), stress, rtol=0, atol=1e-10 * law.bulk_modulus)
        form.AssembleLinearization(state)
        tangent = np.empty((9, 9))
        for k, mode in enumerate(modes):
            along.FV().NumPy()[:] = mode
            out.data = form.mat * along
            tangent[k] = modes @ out.FV().NumPy()
        exact = second_gradient(law.energy, at).reshape(9, 9)
        np.testing.assert_allclose(tangent, exact, rtol=0, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_the_tangent_is_the_slope_of_the_stress(law):
    direction = np.random.default_rng(6).normal(size=(3, 3))
    h = 1e-4
    slope = (gradient(law.energy, F + h * direction) - gradient(law.energy, F - h * direction)) / (2 * h)
    tangent = np.einsum("nijkl,kl->nij", second_gradient(law.energy, F), direction)
    # the difference's remainder is h² times a fourth derivative
    np.testing.assert_allclose(slope, tangent, rtol=0, atol=1e-5 * np.abs(tangent).max())


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_a_material_is_a_value_and_plain_data(law):
    assert pickle.loads(pickle.dumps(law)) == law
    assert hash(law) == hash(pickle.loads(pickle.dumps(law)))
    told = law.describe()
    assert json.loads(json.dumps(told)) == told
    assert told["law"] == type(law).__name__
    assert law.law in str(law)
    assert "Pa" in str(law)
    assert law.states == ()
    assert law.advance(F, {}, 0.1) == {}


def test_constructors_from_other_constants():
    law = NeoHookean.from_c10(4e3, poisson=0.4)
    assert law.shear_modulus == pytest.approx(8e3)
    assert law.poisson == 0.4
    assert NeoHookean.from_shear(8e3, bulk=law.bulk_modulus).young == pytest.approx(law.young)
    assert NeoHookean.from_shear(8e3, bulk=math.inf).poisson == 0.5
    for made in (
        MooneyRivlin.with_poisson(0.48, c10=1e3, c01=2e3),
        Yeoh.with_poisson(0.48, c10=3e3, c20=0.0, c30=0.0),
        Ogden.with_poisson(0.48, mu=6e3, alpha=2.0),
    ):
        assert made.poisson == pytest.approx(0.48)
        assert made.shear_modulus == pytest.approx(6e3)


def test_special_cases_coincide():
    gauss = NeoHookean.from_shear(6e3, bulk=1e5, form="isochoric")
    for other in (
        MooneyRivlin(3e3, 0.0, 1e5),
        Yeoh(3e3, 0.0, 0.0, 1e5),
        Ogden(6e3, 2.0, 1e5),
        Ogden((2e3, 4e3), (2.0, 2.0), 1e5),
    ):
        np.testing.assert_allclose(other.energy(F), gauss.energy(F), rtol=1e-10)
    # with α = −2 a term is one of Ī₂ (Ogden 1972)
    np.testing.assert_allclose(
        Ogden((6e3, -2e3), (2.0, -2.0), 1e5).energy(F), MooneyRivlin(3e3, 1e3, 1e5).energy(F), rtol=1e-8
    )


def test_what_is_incompressible_has_a_distortion_only():
    for law in (LinearElastic(9e3, 0.5), NeoHookean(9e3, 0.5), Ogden(1e3, 3.0, math.inf)):
        assert np.isfinite(law.distortion(F)).all()
        assert law.volumetric.modulus == math.inf
        assert law.poisson == 0.5
        with pytest.raises(UsageError, match="incompressible") as caught:
            law.energy(F)
        assert "mixed" in caught.value.fix


@pytest.mark.parametrize(
    "make",
    [
        lambda: NeoHookean(-1.0, 0.3),
        lambda: NeoHookean(9e3, 0.51),
        lambda: NeoHookean(9e3, 0.3, density=-1.0),
        lambda: NeoHookean(9e3, 0.3, form="other"),
        lambda: NeoHookean("9 kPa", 0.3),
        lambda: NeoHookean.from_shear(1e3),
        lambda: NeoHookean.from_shear(1e3, bulk=1e4, poisson=0.3),
        lambda: NeoHookean.from_c10(-1.0, poisson=0.3),
        lambda: StVenantKirchhoff(0.0, 0.3),
        lambda: MooneyRivlin(1e3, -1e3, 1e5),
        lambda: MooneyRivlin(1e3, math.nan, 1e5),
        lambda: MooneyRivlin(1e3, 0.0, -1.0),
        lambda: MooneyRivlin.with_poisson(0.6, c10=1e3, c01=0.0),
        lambda: Yeoh(-1.0, 1.0, 1.0, 1e5),
        lambda: Ogden(1e3, 0.0, 1e5),
        lambda: Ogden((1e3, 1e2), 2.0, 1e5),
        lambda: Ogden((), (), 1e5),
        lambda: Ogden(1e3, -2.0, 1e5),
        lambda: FibreFamily((0, 0, 0), 1e3, 1.0),
        lambda: FibreFamily((1, 0), 1e3, 1.0),
        lambda: FibreFamily((1, 0, 0), -1e3, 1.0),
        lambda: FibreFamily((1, 0, 0), 1e3, 0.0),
        lambda: FibreFamily((1, 0, 0), 1e3, 1.0, 0.4),
        lambda: FibreReinforced(MATRIX, ()),
        lambda: FibreReinforced(LinearElastic(1e3, 0.3), FIBRES),
    ],
)
def test_constants_of_no_material_are_refused_with_reason_and_remedy(make):
    with pytest.raises(UsageError) as caught:
        make()
    assert caught.value.why
    assert caught.value.fix
