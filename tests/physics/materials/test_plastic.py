"""J2 plasticity against closed forms, in NumPy."""

from __future__ import annotations

import json
import math
import pickle

import numpy as np
import pytest
from scipy.optimize import least_squares

from laws.histories import march, tube_first_yield_pressure, tube_limit_pressure, tube_plastic_front
from palpate.errors import UsageError
from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.library import MATERIALS
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.material import initial_state
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.tensors import gradient
from palpate.physics.materials.uniaxial import UniaxialPlastic

ELASTIC = LinearElastic(110e9, 0.35)
LAWS = [LinearHardening(70e6), LinearHardening(70e6, 2e9), VoceHardening(70e6, 150e6, 18.0, 0.4e9)]
UNIT = np.eye(3)


def stress(material, F, state):
    return gradient(lambda A: material.energy(A, state, None), F)


def strained(seed, size=0.005):
    return UNIT + size * np.random.default_rng(seed).normal(size=(3, 3))


def flowed(material, seed=5):
    F = strained(seed)
    state = material.advance(F, initial_state(material, F), None)
    assert state["accumulated"] > 1e-3
    return state


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_bar_pulled_and_pushed_is_a_fibre(law):
    """Uniaxial stress: plastic strain along the bar, minus half of it across, no stress across."""
    material, fibre = Plastic(ELASTIC, law), UniaxialPlastic(110e9, law)
    state, own = initial_state(material, UNIT), fibre.rest()
    for strain in (0.0004, 0.01, 0.009, -0.008, 0.02):
        sigma, _, energy, own = fibre.stress(np.asarray(strain), own)
        across = -0.35 * sigma / 110e9 - own.strain / 2
        F = np.diag([1 + strain, 1 + across, 1 + across])
        np.testing.assert_allclose(
            stress(material, F, state), np.diag([sigma, 0, 0]), atol=2e-11 * 110e9 * 0.02
        )
        assert float(material.energy(F, state)) == pytest.approx(float(energy), rel=1e-11)
        state = material.advance(F, state)
        plastic = own.strain * np.array([1, -0.5, -0.5])
        np.testing.assert_allclose(state["plastic_strain"], np.diag(plastic), atol=1e-13)
        assert state["accumulated"] == pytest.approx(float(own.accumulated), rel=1e-9)


def test_linear_hardening_in_shear():
    """τ = τ_y + G h/(3G + h) (γ − γ_y), and elastic over 2τ after the load turns."""
    material, G, h = Plastic(ELASTIC, LAWS[1]), ELASTIC.shear_modulus, 2e9
    first = 70e6 / math.sqrt(3) / G
    slope = G * h / (3 * G + h)
    top = 70e6 / math.sqrt(3) + slope * (0.01 - first)
    turned = 0.01 - 2 * top / G
    state = initial_state(material, UNIT)
    for size, wanted in (
        (first, G * first),
        (0.01, top),
        (turned, -top),
        (turned - 0.003, -top - slope * 0.003),
    ):
        F = UNIT + size * np.outer(UNIT[0], UNIT[1])
        P = stress(material, F, state)
        np.testing.assert_allclose([P[0, 1], P[1, 0]], wanted, rtol=1e-10)
        state = material.advance(F, state)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_second_derivative_is_the_consistent_tangent(law):
    """C = K 1⊗1 + 2Gθ(𝕀 − ⅓ 1⊗1) − 2Gθ' n⊗n (Simo & Hughes 1998, box 3.2)."""
    material, F = Plastic(ELASTIC, law), strained(7)
    state, G, K = flowed(material), ELASTIC.shear_modulus, ELASTIC.bulk_modulus
    shape = (F + F.T) / 2 - UNIT
    shape = shape - np.trace(shape) / 3 * UNIT - state["plastic_strain"]
    trial = math.sqrt(6) * G * np.linalg.norm(shape)
    after = material.advance(F, state)["accumulated"]
    flow = after - state["accumulated"]
    assert flow > 1e-4
    theta = 1 - 3 * G * flow / trial
    second = 1 / (1 + law.slope(after) / (3 * G)) - (1 - theta)
    n = shape / np.linalg.norm(shape)
    sym4 = (np.einsum("ik,jl->ijkl", UNIT, UNIT) + np.einsum("il,jk->ijkl", UNIT, UNIT)) / 2
    ones = np.einsum("ij,kl->ijkl", UNIT, UNIT)
    tangent = K * ones + 2 * G * theta * (sym4 - ones / 3) - 2 * G * second * np.einsum("ij,kl->ijkl", n, n)
    for direction in np.random.default_rng(3).normal(size=(3, 3, 3)):
        step = 1e-7 * direction
        rate = (stress(material, F + step, state) - stress(material, F - step, state)) / 2e-7
        np.testing.assert_allclose(rate, np.einsum("ijkl,kl->ij", tangent, direction), atol=1e-7 * K)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_stress_is_elastic_in_what_is_not_plastic(law):
    material, F = Plastic(ELASTIC, law), strained(11)
    state = flowed(material)
    after = material.advance(F, state)
    strain = (F + F.T) / 2 - UNIT
    elastic = strain - after["plastic_strain"]
    shape = elastic - np.trace(elastic) / 3 * UNIT
    wanted = ELASTIC.bulk_modulus * np.trace(strain) * UNIT + 2 * ELASTIC.shear_modulus * shape
    found = stress(material, F, state)
    np.testing.assert_allclose(found, wanted, atol=1e-12 * ELASTIC.young)
    deviator = found - np.trace(found) / 3 * UNIT
    mises = math.sqrt(1.5) * np.linalg.norm(deviator)
    assert mises == pytest.approx(float(law.flow_stress(after["accumulated"])), rel=1e-10)
    assert abs(np.trace(after["plastic_strain"])) < 1e-16


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_energy_is_the_least_over_plastic_strains(law):
    material, F = Plastic(ELASTIC, law), strained(13)
    state = flowed(material)
    least = material.distortion(F, state)
    shape = (F + F.T) / 2 - UNIT
    shape = shape - np.trace(shape) / 3 * UNIT - state["plastic_strain"]
    best = material.advance(F, state)["plastic_strain"] - state["plastic_strain"]

    def candidate(change):
        rest = shape - change
        size = math.sqrt(2 / 3) * np.linalg.norm(change)
        return ELASTIC.shear_modulus * np.sum(rest * rest) + law.work(state["accumulated"] + size)

    assert candidate(best) == pytest.approx(float(least), rel=1e-12)
    for other in np.random.default_rng(1).normal(size=(50, 3, 3)):
        trial = best + 1e-4 * ((other + other.T) / 2 - np.trace(other) / 3 * UNIT)
        assert candidate(trial) > least


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_energy_goes_on_without_a_jump_when_the_state_is_kept(law):
    material, F = Plastic(ELASTIC, law), strained(17)
    state = flowed(material)
    after = material.advance(F, state)
    assert float(material.energy(F, after)) == pytest.approx(float(material.energy(F, state)), rel=1e-12)
    np.testing.assert_allclose(
        stress(material, F, after), stress(material, F, state), atol=1e-11 * ELASTIC.young
    )
    again = material.advance(F, after)
    assert again["accumulated"] == pytest.approx(float(after["accumulated"]), rel=1e-12)


def test_work_is_stored_or_lost():
    material, steps = Plastic(ELASTIC, LAWS[2]), 300
    path = np.concatenate([np.linspace(0, 1, steps), np.linspace(1, -1, 2 * steps)[1:]])
    F = UNIT + path[:, None, None] * (strained(19) - UNIT)
    _, stresses, losses, stored = march(material, F, 1.0)
    work = np.cumsum(np.sum((stresses[1:] + stresses[:-1]) / 2 * np.diff(F, axis=0), axis=(1, 2)))
    assert np.all(losses >= 0)
    # the trapezoid errs in a step in which the stress kinks, by up to half the step's elastic energy; there are three
    step = np.linalg.norm(F[1] - F[0])
    np.testing.assert_allclose(
        stored[1:] + np.cumsum(losses)[1:], work, atol=3 * ELASTIC.shear_modulus * step**2
    )


def test_at_rest_there_is_no_stress_and_no_kink():
    material = Plastic(ELASTIC, LAWS[2])
    state = initial_state(material, UNIT)
    assert np.all(stress(material, UNIT, state) == 0)
    assert np.all(material.advance(UNIT, state)["plastic_strain"] == 0)
    # without a state: the virgin material
    assert float(material.energy(strained(5))) == float(material.energy(strained(5), state))


def test_flow_does_not_touch_the_volume_even_where_it_can_not_change():
    material = Plastic(LinearElastic(1e9, 0.5), LinearHardening(1e6))
    F = strained(5)
    swollen = F + 0.01 * UNIT
    state = initial_state(material, F)
    assert float(material.distortion(F, state)) == pytest.approx(
        float(material.distortion(swollen, state)), rel=1e-9
    )
    with pytest.raises(UsageError, match="mixed"):
        material.energy(F, state)


def test_copper_follows_the_published_flow_stress():
    law = MATERIALS["annealed copper"].hardening
    alpha = np.linspace(0, 0.2, 2001)[1:]
    published = 90e6 + 292e6 * alpha**0.31
    deviation = law.flow_stress(alpha) / published - 1
    assert np.max(np.abs(deviation[alpha >= 0.002])) < 0.03

    def misfit(p):
        return VoceHardening(*(p * scales)).flow_stress(alpha) / published - 1

    scales = np.array([1e8, 1e8, 10.0, 1e8])
    fitted = least_squares(misfit, [1.0, 0.8, 5.0, 2.0], bounds=(1e-3, np.inf)).x * scales
    given = [law.yield_stress, law.saturation, law.rate, law.modulus]
    # written down with three to four digits
    np.testing.assert_allclose(given, fitted, rtol=2e-3)


def test_values_travel_and_describe_themselves():
    copper = MATERIALS["annealed copper"]
    assert pickle.loads(pickle.dumps(copper)) == copper
    assert hash(copper) == hash(pickle.loads(pickle.dumps(copper)))
    told = json.loads(json.dumps(copper.describe()))
    assert told["hardening"]["law"] == "Voce hardening"
    assert told["elastic"]["young"] == 110e9
    assert "Johnson" in str(copper)
    assert [s.shape for s in copper.states] == [(3, 3), ()]


def test_only_a_linear_elastic_part_is_taken():
    with pytest.raises(UsageError, match="LinearElastic"):
        Plastic(NeoHookean(9e3, 0.45), LinearHardening(1e3))


def test_limit_of_a_tube_is_where_the_plastic_front_reaches_the_outside():
    limit, first = tube_limit_pressure(1.0, 2.0, 3.0), tube_first_yield_pressure(1.0, 2.0, 3.0)
    assert limit == pytest.approx(2 * math.sqrt(3) * math.log(2))
    assert tube_plastic_front(1.0, 2.0, 3.0, limit * (1 - 1e-12)) == pytest.approx(2.0, abs=1e-5)
    assert tube_plastic_front(1.0, 2.0, 3.0, first * (1 + 1e-12)) == pytest.approx(1.0, abs=1e-9)
    # equilibrium of the plastic ring: dσ_r/dr = 2k/r
    radius = np.linspace(1.0, 2.0, 20001)
    by_sum = np.sum(2 * 3.0 / math.sqrt(3) / ((radius[1:] + radius[:-1]) / 2) * np.diff(radius))
    assert limit == pytest.approx(by_sum, rel=1e-8)
