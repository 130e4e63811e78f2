"""Homogeneous states against the published closed forms (Holzapfel 2000, section 6.5; Ogden 1972; Yeoh 1993)."""

from __future__ import annotations

import numpy as np
import pytest
from laws_of_matter import IDS, LAWS
from scipy.optimize import brentq
from scipy.special import lambertw

from palpate.errors import UsageError
from palpate.physics.materials import (
    FibreFamily,
    FibreReinforced,
    LinearElastic,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    StVenantKirchhoff,
    Viscoelastic,
    Yeoh,
)
from palpate.physics.materials.homogeneous import equibiaxial, planar, simple_shear, uniaxial, volumetric

STRETCH = np.array([0.5, 0.7, 0.9, 0.99, 1.01, 1.1, 1.5, 2.0])
SHEAR = np.array([-1.0, -0.2, 0.01, 0.5, 2.0])
MU, ALPHA = (630.0, 1.2, -10.0), (1.3, 5.0, -2.0)
C10, C01, C20, C30 = 2e3, 1e3, -100.0, 30.0


def polynomial(w1, w2):
    """Nominal stresses of an incompressible law from ∂W/∂I₁ and ∂W/∂I₂, functions of I₁."""
    return (
        lambda s: 2 * (s - s**-2) * (w1(s**2 + 2 / s) + w2 / s),
        lambda s: 2 * (s - s**-5) * (w1(2 * s**2 + s**-4) + w2 * s**2),
        lambda s: 2 * (s - s**-3) * (w1(s**2 + 1 + s**-2) + w2),
        lambda g: 2 * g * (w1(3 + g**2) + w2),
    )


def ogden(sum_over):
    def shear(g):
        s = g / 2 + np.sqrt(1 + g**2 / 4)
        return sum_over(lambda a: (s**a - s**-a) / (s + 1 / s))

    return (
        lambda s: sum_over(lambda a: s ** (a - 1) - s ** (-a / 2 - 1)),
        lambda s: sum_over(lambda a: s ** (a - 1) - s ** (-2 * a - 1)),
        lambda s: sum_over(lambda a: s ** (a - 1) - s ** (-a - 1)),
        shear,
    )


INCOMPRESSIBLE = {
    "neo-Hookean": (NeoHookean(9e3, 0.5, form="isochoric"), polynomial(lambda _: 1.5e3, 0.0)),
    "coupled": (NeoHookean(9e3, 0.5), polynomial(lambda _: 1.5e3, 0.0)),
    "Mooney–Rivlin": (MooneyRivlin(C10, C01, np.inf), polynomial(lambda _: C10, C01)),
    "Yeoh": (
        Yeoh(C10, C20, C30, np.inf),
        polynomial(lambda i: C10 + 2 * C20 * (i - 3) + 3 * C30 * (i - 3) ** 2, 0.0),
    ),
    "Ogden": (
        Ogden(MU, ALPHA, np.inf),
        ogden(lambda f: sum(m * f(a) for m, a in zip(MU, ALPHA, strict=True))),
    ),
}
TESTS = (uniaxial, equibiaxial, planar, simple_shear)


@pytest.mark.parametrize("kind", range(4), ids=[t.__name__ for t in TESTS])
@pytest.mark.parametrize("name", INCOMPRESSIBLE)
def test_incompressible_laws(name, kind):
    law, forms = INCOMPRESSIBLE[name]
    amounts = SHEAR if kind == 3 else STRETCH
    found = TESTS[kind](law, amounts)
    assert found.converged.all()
    np.testing.assert_allclose(found.stress, forms[kind](amounts), rtol=1e-8)
    np.testing.assert_allclose(np.linalg.det(found.deformation), 1, rtol=1e-12)


def test_compressible_neo_hooke_finds_its_lateral_stretch():
    law = NeoHookean(9e3, 0.3)
    mu, lame = law.shear_modulus, law.volumetric.modulus
    r = mu / lame
    # free sides: μ (x − 1) + λ ln J = 0 for their squared stretch x, solved by Lambert's W
    side = lambertw(r * np.exp(r) / STRETCH).real / r
    found = uniaxial(law, STRETCH)
    np.testing.assert_allclose(found.deformation[:, 1, 1] ** 2, side, rtol=1e-9)
    np.testing.assert_allclose(found.deformation[:, 2, 2] ** 2, side, rtol=1e-9)
    stress = mu * (STRETCH - 1 / STRETCH) + lame * np.log(STRETCH * side) / STRETCH
    np.testing.assert_allclose(found.stress, stress, rtol=1e-6)
    side = lambertw(2 * r * np.exp(2 * r) / STRETCH**4).real / (2 * r)
    found = equibiaxial(law, STRETCH)
    np.testing.assert_allclose(found.deformation[:, 2, 2] ** 2, side, rtol=1e-9)
    stress = mu * (STRETCH - 1 / STRETCH) + lame * np.log(STRETCH**2 * np.sqrt(side)) / STRETCH
    np.testing.assert_allclose(found.stress, stress, rtol=1e-6)
    np.testing.assert_allclose(simple_shear(law, SHEAR).stress, mu * SHEAR, rtol=1e-12)


def test_compressible_isochoric_laws_find_theirs():
    # of σ₁ − σ₂ = p̄(λ̄)/J in uniaxial tension, with λ̄ = (λ/λₜ)^(2/3), and mean stress K(J − 1) = σ₁/3
    law = Ogden(MU, ALPHA, 2e4)
    for stretch in (0.7, 1.3, 2.0):

        def mismatch(side, stretch=stretch):
            J, lone = stretch * side**2, (stretch / side) ** (2 / 3)
            difference = sum(m * (lone**a - lone ** (-a / 2)) for m, a in zip(MU, ALPHA, strict=True)) / J
            return difference / 3 - 2e4 * (J - 1)

        side = brentq(mismatch, 0.5, 1.5, xtol=1e-14)
        found = uniaxial(law, stretch)
        assert found.deformation[0, 1, 1] == pytest.approx(side, rel=1e-8)
        assert found.cauchy[0, 0, 0] == pytest.approx(3 * 2e4 * (stretch * side**2 - 1), rel=1e-6)


def test_st_venant_kirchhoff():
    E, nu = 9e3, 0.3
    law = StVenantKirchhoff(E, nu)
    stretch = STRETCH[STRETCH > 0.6]
    green = (stretch**2 - 1) / 2
    found = uniaxial(law, stretch[:-1])
    np.testing.assert_allclose(found.stress, (E * stretch * green)[:-1], rtol=1e-9)
    np.testing.assert_allclose(found.deformation[:, 1, 1], np.sqrt(1 - 2 * nu * green)[:-1], rtol=1e-9)
    found = equibiaxial(law, stretch[:-2])
    np.testing.assert_allclose(found.stress, (E / (1 - nu) * stretch * green)[:-2], rtol=1e-9)
    mu, lame = law.shear_modulus, law.volumetric.modulus
    np.testing.assert_allclose(simple_shear(law, SHEAR).stress, mu * (SHEAR + SHEAR**3) + lame / 2 * SHEAR**3)


def test_linear_elasticity():
    law = LinearElastic(9e3, 0.3)
    strain = STRETCH - 1
    np.testing.assert_allclose(uniaxial(law, STRETCH).stress, 9e3 * strain, rtol=1e-9)
    np.testing.assert_allclose(equibiaxial(law, STRETCH).stress, 9e3 / 0.7 * strain, rtol=1e-9)
    np.testing.assert_allclose(planar(law, STRETCH).stress, 9e3 / (1 - 0.3**2) * strain, rtol=1e-9)
    np.testing.assert_allclose(simple_shear(law, SHEAR).stress, law.shear_modulus * SHEAR, rtol=1e-9)
    np.testing.assert_allclose(volumetric(law, STRETCH).stress, law.bulk_modulus * strain, rtol=1e-9)


def test_one_aligned_family_of_fibres():
    kappa, k1, k2, mu = 0.1, 3e3, 0.9, 2e3
    fibres = FibreFamily((2, 0, 0), k1, k2, kappa)
    law = FibreReinforced(NeoHookean.from_shear(mu, poisson=0.5, form="isochoric"), fibres)
    s = STRETCH[STRETCH < 1.6]
    strain = np.maximum(kappa * (s**2 + 2 / s - 3) + (1 - 3 * kappa) * (s**2 - 1), 0)
    slope = kappa * (2 * s - 2 / s**2) + (1 - 3 * kappa) * 2 * s
    exact = mu * (s - s**-2) + k1 * strain * np.exp(k2 * strain**2) * slope
    np.testing.assert_allclose(uniaxial(law, s).stress, exact, rtol=1e-6)


def test_two_families_make_the_sides_differ():
    k1, k2, mu, angle = 3e3, 0.9, 2e3, np.radians(30)
    c, d = np.cos(angle) ** 2, np.sin(angle) ** 2
    families = tuple(FibreFamily((np.cos(a), np.sin(a), 0), k1, k2) for a in (angle, -angle))
    law = FibreReinforced(NeoHookean.from_shear(mu, poisson=0.5, form="isochoric"), families)

    def slopes(s, t):  # ∂W/∂λ₁, ∂W/∂λ₂ with λ₃ = 1/(λ₁ λ₂)
        strain = max(c * s**2 + d * t**2 - 1, 0.0)
        fibre = 2 * k1 * strain * np.exp(k2 * strain**2)
        third = mu / (s * t) ** 2
        return mu * s - third / s + 2 * fibre * c * s, mu * t - third / t + 2 * fibre * d * t

    for stretch in (0.8, 1.1, 1.4):
        side = brentq(lambda t, s=stretch: slopes(s, t)[1], 0.3, 2.0, xtol=1e-14)
        found = uniaxial(law, stretch)
        assert found.deformation[0, 1, 1] == pytest.approx(side, rel=1e-6)
        assert found.stress[0] == pytest.approx(slopes(stretch, side)[0], rel=1e-6)


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_free_sides_bear_nothing_and_the_energy_is_the_work(law):
    middle, h = np.array([0.85, 0.97, 1.2]), 1e-4
    found = uniaxial(law, middle)
    assert np.abs(found.nominal[:, 1:, 1:]).max() < 1e-8 * law.bulk_modulus
    assert np.abs(found.nominal[:, 0, 1:]).max() < 1e-8 * law.bulk_modulus
    up, down = (test.energy for test in (uniaxial(law, middle + h), uniaxial(law, middle - h)))
    np.testing.assert_allclose((up - down) / (2 * h), found.stress, atol=2e-6 * law.young, rtol=1e-6)


def test_volumes_of_the_forms():
    J = np.array([0.8, 1.0, 1.3])
    K = 1e5
    np.testing.assert_allclose(
        volumetric(MooneyRivlin(1e3, 1e3, K), J).stress, K * (J - 1) * J ** (2 / 3), atol=1e-7
    )


def test_small_strain_at_constant_volume():
    law = LinearElastic(9e3, 0.5)
    np.testing.assert_allclose(uniaxial(law, STRETCH).stress, 9e3 * (STRETCH - 1), rtol=1e-9)
    np.testing.assert_allclose(equibiaxial(law, STRETCH).stress, 18e3 * (STRETCH - 1), rtol=1e-9)


def test_a_material_with_a_history_starts_undeformed():
    base = NeoHookean(9e3, 0.49, form="isochoric")
    fat = Viscoelastic(base, ((0.4, 10.0),))
    np.testing.assert_allclose(uniaxial(fat, STRETCH).stress, uniaxial(base, STRETCH).stress, rtol=1e-8)
    # a step of one relaxation time at constant rate keeps γ∞ + γ(1 − 1/e) of the distortion's stiffness
    share = 0.6 + 0.4 * (1 - np.exp(-1))
    np.testing.assert_allclose(
        simple_shear(fat, SHEAR, dt=10.0).stress, share * base.shear_modulus * SHEAR, rtol=1e-9
    )
    assert fat.stability()


def test_impossible_amounts_are_refused():
    with pytest.raises(UsageError, match="incompressible"):
        volumetric(NeoHookean(9e3, 0.5), 1.1)
    with pytest.raises(UsageError, match="stretch"):
        uniaxial(LAWS[0], [0.0, 1.0])
    with pytest.raises(UsageError, match="shear"):
        simple_shear(LAWS[0], np.nan)
