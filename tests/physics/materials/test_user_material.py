"""A user's own law: moduli, stress, pickles, and words for what is no law."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle

import numpy as np
import pytest
from netgen.csg import unit_cube

from palpate.errors import UsageError
from palpate.physics.materials import LinearElastic, NeoHookean, StateVariable, UserMaterial
from palpate.physics.materials.homogeneous import uniaxial
from palpate.physics.materials.material import log_volume, small_volume
from palpate.physics.materials.tensors import (
    determinant,
    gradient,
    identity,
    inner,
    isochoric_first,
    log,
    matmul,
    second_gradient,
    sym,
    trace,
    transpose,
)
from palpate.physics.materials.user import material

MU, LAME = 3e3, 7e3


def blatz(F, mu=MU, lame=LAME):
    C = matmul(transpose(F), F)
    J = determinant(F)
    return mu / 2 * (trace(C) - 3) - mu * log(J) + lame / 2 * log(J) ** 2


@material(density=1100.0, bulk=1e6, source="Gent 1996, Rubber Chem. Technol. 69, 59-61")
def gent(F, mu=MU, limit=20.0):
    return -mu * limit / 2 * log(1 - (isochoric_first(F) - 3) / limit)


def hooke(F):
    strain = sym(F - identity(F))
    return MU * inner(strain, strain) + LAME / 2 * trace(strain) ** 2


def shape(F):
    return MU / 2 * (inner(F, F) - 3) - MU * log_volume(F)


def creeping(F, state, dt, rate=0.1):
    return MU / 2 * (isochoric_first(F) - 3) * (1 + 1 / (1 + rate * dt)) + 0 * state["strain"]


def creep(F, state, dt, rate=0.1):
    return {"strain": (state["strain"] + rate * dt) / (1 + rate * dt)}


F = np.eye(3) + 0.1 * np.random.default_rng(7).normal(size=(4, 3, 3))


def test_a_function_is_the_law_it_writes():
    young = MU * (3 * LAME + 2 * MU) / (LAME + MU)
    built_in = NeoHookean(young, LAME / (2 * (LAME + MU)))
    mine = UserMaterial(blatz)
    np.testing.assert_allclose(mine.energy(F), built_in.energy(F), rtol=1e-10)
    np.testing.assert_allclose(
        second_gradient(mine.energy, F), second_gradient(built_in.energy, F), atol=1e-5 * young
    )
    for name in ("young", "poisson", "shear_modulus", "bulk_modulus"):
        assert getattr(mine, name) == pytest.approx(getattr(built_in, name), rel=1e-9)
    assert mine.name == "blatz"


def test_a_volumetric_part_apart():
    mine = UserMaterial(shape, bulk=LAME, measure=log_volume)
    np.testing.assert_allclose(mine.energy(F), blatz(F), rtol=1e-12)
    assert mine.volumetric.modulus == LAME
    # λ is what is left of the volume's stiffness; the bulk modulus has the shape's share too
    assert mine.bulk_modulus == pytest.approx(LAME + 2 * MU / 3, rel=1e-9)
    assert UserMaterial(shape, bulk=math.inf, measure=log_volume).poisson == 0.5


def test_small_strain():
    mine = UserMaterial(hooke, kinematics="small")
    assert mine.shear_modulus == pytest.approx(MU)
    assert mine.bulk_modulus == pytest.approx(LAME + 2 * MU / 3)
    built_in = LinearElastic(mine.young, mine.poisson)
    np.testing.assert_allclose(mine.energy(F), built_in.energy(F), rtol=1e-8)
    assert UserMaterial(hooke, kinematics="small", bulk=1e4, measure=small_volume).volumetric.modulus == 1e4


def test_a_decorated_law_against_its_closed_form():
    stretch = np.array([0.6, 1.2, 2.5])
    stiff = dataclasses.replace(gent, bulk=math.inf)
    first = stretch**2 + 2 / stretch
    exact = MU * 20 / (20 - first + 3) * (stretch - stretch**-2)
    np.testing.assert_allclose(uniaxial(stiff, stretch).stress, exact, rtol=1e-8)
    assert gent.density == 1100.0
    assert gent.stability((-0.3, 0.5))
    assert "Gent 1996" in str(gent)


def test_constants_replace_the_functions_defaults():
    stiffer = dataclasses.replace(gent, constants={"mu": 2 * MU})
    np.testing.assert_allclose(stiffer.distortion(F), 2 * gent.distortion(F), rtol=1e-12)
    assert stiffer.describe()["constants"] == {"mu": 2 * MU}
    assert stiffer != gent


@pytest.mark.full
def test_a_finite_element_reads_the_same_function():
    import ngsolve as ng

    ng.SetNumThreads(1)
    mesh = ng.Mesh(unit_cube.GenerateMesh(maxh=3))
    for law in (gent, UserMaterial(blatz)):
        at = ng.CF(tuple(F[0].ravel().tolist()), dims=(3, 3))
        assert law.energy(at)(mesh(0.1, 0.2, 0.3)) == pytest.approx(law.energy(F[0]), rel=1e-12)
        stress = np.reshape(gradient(law.energy, at)(mesh(0.1, 0.2, 0.3)), (3, 3))
        np.testing.assert_allclose(stress, gradient(law.energy, F[0]), rtol=1e-10, atol=1e-8)


@pytest.mark.parametrize(
    "law", [UserMaterial(blatz), gent, UserMaterial(shape, bulk=9e3, measure=log_volume)], ids=str
)
def test_it_travels_by_name(law):
    again = pickle.loads(pickle.dumps(law))
    assert again == law
    assert hash(again) == hash(law)
    np.testing.assert_array_equal(again.energy(F), law.energy(F))
    told = law.describe()
    assert json.loads(json.dumps(told)) == told
    assert told["digest"]


def test_what_can_not_travel_says_so():
    def local(F):
        return blatz(F)

    for function in (local, lambda F: 2 * blatz(F)):
        with pytest.raises(UsageError, match="another process") as caught:
            pickle.dumps(UserMaterial(function))
        assert "top level" in caught.value.fix


def test_internal_variables():
    law = UserMaterial(
        creeping, bulk=1e5, states=(StateVariable("strain"),), evolution=creep, constants={"rate": 0.2}
    )
    state = {"strain": np.zeros(4)}
    assert law.shear_modulus == pytest.approx(2 * MU, rel=1e-6)  # instantaneous
    np.testing.assert_allclose(
        law.energy(F, state, 1e9) - law.volumetric.energy(F), MU / 2 * (isochoric_first(F) - 3)
    )
    np.testing.assert_allclose(law.advance(F, state, 5.0)["strain"], 0.5)
    assert pickle.loads(pickle.dumps(law)) == law
    with pytest.raises(UsageError, match="evolution"):
        UserMaterial(creeping, states=(StateVariable("strain"),))


@pytest.mark.parametrize(
    ("function", "word"),
    [
        (lambda F: math.log(F[0, 0]), "can't be evaluated"),
        (lambda F: F.nonsense, "can't be evaluated"),
        (trace, "stress"),
        (lambda F: -blatz(F), "μ = "),
        (lambda F: inner(F - identity(F), F - identity(F)), "rotation"),
        (3.0, "function"),
    ],
)
def test_what_is_no_energy_is_refused(function, word):
    with pytest.raises(UsageError, match=word) as caught:
        UserMaterial(function)
    assert caught.value.fix
