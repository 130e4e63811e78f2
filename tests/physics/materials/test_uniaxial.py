"""Fibres against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.uniaxial import UniaxialPlastic, UniaxialViscoelastic

YOUNG = 110e9
LAWS = [
    LinearHardening(70e6),
    LinearHardening(70e6, 2e9),
    VoceHardening(70e6, 150e6, 18.0),
    VoceHardening(70e6, 150e6, 18.0, 0.4e9),
    VoceHardening(1e6, 5e9, 1e5, 0.0),  # saturates within the first thousandth of a per cent
]
NYLON = PronySeries(((0.3, 0.5), (0.2, 20.0)))


def path(law, strains, state=None):
    state = law.rest() if state is None else state
    answers = []
    for strain in strains:
        stress, tangent, energy, state = law.stress(np.asarray(strain), state)
        answers.append((float(stress), float(tangent), float(energy)))
    return np.array(answers), state


def test_linear_hardening_follows_its_cyclic_closed_form():
    """Isotropic hardening: stress = E_t on the yield branches, elastic range 2σ_y after each reversal."""
    plastic = UniaxialPlastic(YOUNG, LinearHardening(70e6, 2e9))
    tangent = YOUNG * 2e9 / (YOUNG + 2e9)
    first = 70e6 / YOUNG
    peak, turn = 0.01, -0.008
    up = 70e6 + tangent * (peak - first)
    down = -up + tangent * (turn - (peak - 2 * up / YOUNG))
    answers, state = path(plastic, [first, peak, peak - 2 * up / YOUNG, turn])
    np.testing.assert_allclose(answers[:, 0], [70e6, up, -up, down], rtol=1e-12)
    assert state.strain == pytest.approx(turn - down / YOUNG, rel=1e-12)
    assert state.accumulated == pytest.approx((-down - 70e6) / 2e9, rel=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_one_step_equals_many_while_the_load_does_not_turn(law):
    plastic = UniaxialPlastic(YOUNG, law)
    once, end = path(plastic, [0.05])
    often, same = path(plastic, np.linspace(0.001, 0.05, 37))
    np.testing.assert_allclose(once[-1], often[-1], rtol=1e-11)
    np.testing.assert_allclose(end, same, rtol=1e-11)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_flowing_fibres_stand_on_the_hardening_curve(law):
    plastic = UniaxialPlastic(YOUNG, law)
    strain = np.geomspace(1e-6, 0.3, 200) * np.where(np.arange(200) % 2, 1, -1)
    stress, _, _, state = plastic.stress(strain, plastic.rest(200))
    flowing = state.accumulated > 0
    assert 0 < flowing.sum() < 200
    limit = law.flow_stress(state.accumulated)
    np.testing.assert_allclose(np.abs(stress)[flowing], limit[flowing], rtol=1e-11)
    assert np.all(np.abs(stress)[~flowing] <= limit[~flowing])
    np.testing.assert_allclose(stress, YOUNG * (strain - state.strain), rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_stress_and_tangent_are_derivatives_of_the_energy(law):
    plastic = UniaxialPlastic(YOUNG, law)
    _, state = path(plastic, [0.004, -0.001])
    strain, step = np.array([-0.02, -0.0015, 0.0, 0.001, 0.02]), 1e-7
    many = type(state)(*(np.full(5, part) for part in state))
    stress, tangent, energy, _ = plastic.stress(strain, many)
    above, below = plastic.stress(strain + step, many), plastic.stress(strain - step, many)
    # rounding: an energy of size e is known to e·2⁻⁵² and divided by the step
    np.testing.assert_allclose(
        (above[2] - below[2]) / (2 * step), stress, rtol=1e-6, atol=energy.max() * 1e-15 / step
    )
    np.testing.assert_allclose((above[0] - below[0]) / (2 * step), tangent, rtol=1e-5, atol=1e2)


def test_energy_less_elastic_energy_is_the_plastic_work():
    law = VoceHardening(70e6, 150e6, 18.0, 0.4e9)
    alpha = np.linspace(0, 0.3, 4001)
    by_sum = np.sum((law.flow_stress(alpha)[1:] + law.flow_stress(alpha)[:-1]) / 2 * np.diff(alpha))
    assert law.work(alpha[-1]) == pytest.approx(by_sum, rel=1e-6)
    np.testing.assert_allclose(
        (law.flow_stress(alpha + 1e-6) - law.flow_stress(alpha - 1e-6)) / 2e-6, law.slope(alpha), rtol=1e-6
    )


@pytest.mark.parametrize(
    "bad", [{"yield_stress": 0.0}, {"yield_stress": -1.0}, {"yield_stress": 1e6, "modulus": -1.0}]
)
def test_hardening_without_strength_is_refused(bad):
    with pytest.raises(UsageError):
        LinearHardening(**bad)


def test_prony_shares_and_times_are_checked():
    with pytest.raises(UsageError, match="of_moduli"):
        PronySeries(((0.7, 1.0), (0.5, 2.0)))
    with pytest.raises(UsageError):
        PronySeries(((0.5, 0.0),))
    with pytest.raises(UsageError, match="pair"):
        PronySeries((0.5, 3.0))
    series = PronySeries.of_moduli(2.0, ((1.0, 3.0), (1.0, 5.0)))
    assert series == PronySeries(((0.25, 3.0), (0.25, 5.0)))
    assert series.equilibrium == 0.5


def test_held_strain_relaxes_as_the_series_whatever_the_steps():
    fibre = UniaxialViscoelastic(2e9, NYLON)
    *_, state = fibre.stress(np.array([0.01, -0.02]), fibre.rest(2), None)
    time = 0.0
    for dt in (1e-6, 0.3, 1e3 / 7, 0.01, 5.0):
        time += dt
        stress, *_, state = fibre.stress(np.array([0.01, -0.02]), state, dt)
        np.testing.assert_allclose(stress, 2e9 * NYLON.relaxation(time) * np.array([0.01, -0.02]), rtol=1e-12)
    assert fibre.stress(np.array([0.01]), fibre.rest(1), math.inf)[0] == pytest.approx(
        0.01 * fibre.equilibrium_young
    )


def test_ramp_is_exact_in_one_step():
    """σ(t) = E ε̇ ∫g ds = E ε̇ (γ_∞ t + Σ γ_i τ_i (1 − exp(−t/τ_i)))."""
    fibre, time, strain = UniaxialViscoelastic(2e9, NYLON), 3.0, 0.01
    integral = 0.5 * time + sum(g * tau * (1 - math.exp(-time / tau)) for g, tau in NYLON.terms)
    stress, *_ = fibre.stress(np.array(strain), fibre.rest(), time)
    assert stress == pytest.approx(2e9 * strain / time * integral, rel=1e-12)


@pytest.mark.full
def test_sinusoid_loses_the_energy_of_the_loss_modulus():
    """Loss per cycle π ε₀² E g''(ω); evenly growing strains stand for the sinusoid up to (ω Δ)²."""
    fibre, frequency, steps = UniaxialViscoelastic(2e9, NYLON), 2.0, 400
    dt = 2 * math.pi / frequency / steps
    strain = 0.01 * np.sin(frequency * dt * np.arange(1, 40 * steps + 1))
    stress, state = [], fibre.rest()
    for value in strain:
        answer, *_, state = fibre.stress(np.asarray(value), state, dt)
        stress.append(float(answer))
    last = slice(-steps - 1, None)
    sigma, eps = np.array(stress)[last], strain[last]
    loss = np.sum((sigma[1:] + sigma[:-1]) / 2 * np.diff(eps))
    assert loss == pytest.approx(math.pi * 1e-4 * 2e9 * NYLON.loss(frequency), rel=2 * (frequency * dt) ** 2)


def test_creep_of_a_standard_solid_follows_its_closed_form():
    """J(t) = 1/E_∞ − (1/E_∞ − 1/E_0) exp(−t γ_∞/τ), from Laplace's transform of the one-term series."""
    fibre = UniaxialViscoelastic(2e9, PronySeries(((0.4, 2.0),)))
    state, stress, strain, dt = fibre.rest(), 1e6, np.array(0.0), 0.004
    steps = 1000
    for i in range(steps + 1):
        step = None if i == 0 else dt
        force, tangent, _, _ = fibre.stress(strain, state, step)
        strain = strain + (stress - force) / tangent
        *_, state = fibre.stress(strain, state, step)
    slow, fast = 1 / fibre.equilibrium_young, 1 / 2e9
    wanted = stress * (slow - (slow - fast) * math.exp(-steps * dt * 0.6 / 2.0))
    assert float(strain) == pytest.approx(wanted, rel=(dt / 2.0) ** 2)


def test_potential_of_viscous_fibres_gives_stress_and_tangent():
    fibre = UniaxialViscoelastic(2e9, NYLON)
    *_, state = fibre.stress(np.array(0.01), fibre.rest(), 0.1)
    stress, tangent, _, _ = fibre.stress(np.array(-0.004), state, 0.7)
    energies = [fibre.stress(np.array(-0.004 + d), state, 0.7)[2] for d in (-1e-3, 0, 1e-3)]
    # a parabola: differences are exact
    assert (energies[2] - energies[0]) / 2e-3 == pytest.approx(float(stress), rel=1e-9)
    assert (energies[2] - 2 * energies[1] + energies[0]) / 1e-6 == pytest.approx(float(tangent), rel=1e-9)
