"""Drucker's criterion where the limit of stability has a closed form."""

from __future__ import annotations

import json

import numpy as np
import pytest
from laws_of_matter import LAWS
from scipy.optimize import brentq

from palpate.errors import UsageError
from palpate.physics.materials import LinearElastic, MooneyRivlin, NeoHookean, Ogden, StVenantKirchhoff


def verdict(found, mode):
    return next(m for m in found.modes if m.mode == mode)


def spacing(strain):
    return (strain[1] - strain[0]) / 60


@pytest.mark.parametrize("law", [law for law in LAWS if law.poisson >= 0][:6], ids=str)
def test_at_rest_the_least_modulus_is_that_of_shear_or_volume(law):
    # Hooke's tensor has the eigenvalues 2μ and 3K; differences of a small range stay near them
    found = law.stability(strain=(-1e-4, 1e-4), volume=(-1e-4, 1e-4))
    assert found
    for mode in found.modes:
        assert mode.least_modulus == pytest.approx(min(2 * law.shear_modulus, 3 * law.bulk_modulus), rel=2e-3)
    assert "stable in uniaxial" in str(found)


def test_a_negative_c01_is_unstable_in_compression_and_says_so():
    c10, c01, strain = 8e3, -3e3, (-0.6, 1.0)
    law = MooneyRivlin.with_poisson(0.5, c10=c10, c01=c01)
    found = law.stability(strain)
    assert not found
    # along uniaxial log strains (e, −e/2, −e/2) the curvature is C10(4λ² + 2/λ) + C01(4/λ² + 2λ)
    push = brentq(lambda s: c10 * (4 * s**2 + 2 / s) + c01 * (4 / s**2 + 2 * s), 0.3, 0.9) - 1
    # and across a stretched bar, along (0, 1, −1), it is proportional to C10/λ + C01 λ
    pull = np.sqrt(-c10 / c01) - 1
    uniaxial = verdict(found, "uniaxial")
    assert uniaxial.stable[0] == pytest.approx(push, abs=spacing(strain))
    assert uniaxial.stable[1] == pytest.approx(pull, abs=spacing(strain))
    assert uniaxial.least_modulus < 0
    assert f"uniaxial compression beyond {uniaxial.stable[0]:+.3g}" in str(found)
    told = found.describe()
    assert json.loads(json.dumps(told)) == told
    assert told["stable"] is False
    assert MooneyRivlin.with_poisson(0.5, c10=c10, c01=3e3).stability(strain)


def test_st_venant_kirchhoff_fails_in_compression():
    # with ν = 0 the Kirchhoff stress ½E λ²(λ² − 1) has its minimum at λ = √½
    strain = (-0.5, 0.5)
    found = verdict(StVenantKirchhoff(9e3, 0.0).stability(strain), "uniaxial")
    assert not found
    assert found.stable == (pytest.approx(np.sqrt(0.5) - 1, abs=spacing(strain)), 0.5)


def test_the_quadratic_volume_fails_at_half_the_volume():
    # τ = K J(J − 1) has the slope K J(2J − 1) in ln J
    volume = (-0.7, 0.2)
    found = verdict(Ogden(1e3, 2.0, 1e5).stability(volume=volume), "volumetric")
    assert not found
    assert found.stable == (pytest.approx(-0.5, abs=2 * spacing(volume)), 0.2)
    assert "volumetric compression" in str(found)
    assert verdict(NeoHookean(9e3, 0.45).stability(volume=volume), "volumetric")


@pytest.mark.full
def test_convex_powers_are_stable_everywhere():
    # for μα > 0 in every term W is convex in the log strains (Ogden 1972)
    law = Ogden.with_poisson(0.49, mu=(630.0, 1.2, -10.0), alpha=(1.3, 5.0, -2.0))
    assert law.stability((-0.6, 2.0))
    assert NeoHookean(9e3, 0.45).stability((-0.6, 2.0))
    assert LinearElastic(9e3, 0.3).stability()
    # a term of the other sign takes over at large stretch
    assert not Ogden.with_poisson(0.49, mu=(3e3, -1.0), alpha=(2.0, 8.0)).stability((-0.5, 2.0))


def test_a_state_without_equilibrium_is_no_stable_one():
    found = NeoHookean(9e3, -0.3).stability()
    assert not found
    assert "no equilibrium" in str(found)


@pytest.mark.parametrize("strain", [(0.1, 0.5), (-1.0, 0.5), (0.0, 0.0), (0.2, -0.2)])
def test_impossible_ranges_are_refused(strain):
    with pytest.raises(UsageError, match="range"):
        NeoHookean(9e3, 0.3).stability(strain)
