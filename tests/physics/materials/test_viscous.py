"""Finite-strain viscoelasticity against closed forms, in NumPy."""

from __future__ import annotations

import itertools
import json
import math
import pickle

import numpy as np
import pytest

from laws.histories import march, rotation
from palpate.errors import UsageError
from palpate.physics.materials.fibres import FibreFamily, FibreReinforced
from palpate.physics.materials.hardening import LinearHardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.material import initial_state
from palpate.physics.materials.mooney_rivlin import MooneyRivlin
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.st_venant import StVenantKirchhoff
from palpate.physics.materials.tensors import gradient
from palpate.physics.materials.viscous import Scaled, Viscoelastic

TERMS = ((0.3, 0.5), (0.2, 20.0))
PRONY = PronySeries(TERMS)
BASES = [
    LinearElastic(9e3, 0.3),
    NeoHookean(9e3, 0.45),
    NeoHookean(9e3, 0.4999, form="isochoric"),
    MooneyRivlin(1.2e3, 0.3e3, bulk=1e6),
    FibreReinforced(NeoHookean(9e3, 0.45), (FibreFamily((1.0, 1.0, 0.0), k1=2e3, k2=1.5, dispersion=0.1),)),
    StVenantKirchhoff(9e3, 0.3),
]
MATERIALS = [Viscoelastic(base, TERMS) for base in BASES] + [Viscoelastic(BASES[1], TERMS, part="all")]
PULLED = np.array([[1.3, 0.2, 0.0], [-0.1, 0.9, 0.15], [0.05, 0.0, 0.92]])
TURNED = np.array([[0.85, 0.0, -0.2], [0.3, 1.1, 0.0], [0.0, 0.1, 1.05]])


def shear(size):
    F = np.broadcast_to(np.eye(3), (*np.shape(size), 3, 3)).copy()
    F[..., 0, 1] = size
    return F


def stress(material, F, state, dt):
    return gradient(lambda A: material.energy(A, state, dt), F)


def named(material):
    return f"{material.base.law}-{material.part}"


@pytest.mark.parametrize("material", MATERIALS, ids=named)
def test_a_sudden_deformation_meets_the_base_law(material):
    state = initial_state(material, PULLED)
    wanted = gradient(material.base.energy, PULLED)
    for given in (state, {}):
        np.testing.assert_allclose(stress(material, PULLED, given, None), wanted, rtol=1e-12)
    np.testing.assert_allclose(stress(material, PULLED, state, 1e-12), wanted, rtol=1e-10)
    assert (material.young, material.shear_modulus) == (material.base.young, material.base.shear_modulus)


@pytest.mark.parametrize("material", MATERIALS, ids=named)
def test_a_held_deformation_relaxes_as_the_series_whatever_the_steps(material):
    """P(t) = volumetric part + g(t) · the rest, exactly, at any strain."""
    whole = gradient(material.base.energy, PULLED)
    kept = np.zeros((3, 3)) if material.volumetric is None else gradient(material.volumetric.energy, PULLED)
    state, time = material.advance(PULLED, initial_state(material, PULLED), None), 0.0
    for dt in (1e-6, 0.3, 140.0, 0.01, 5.0):
        time += dt
        wanted = kept + PRONY.relaxation(time) * (whole - kept)
        np.testing.assert_allclose(stress(material, PULLED, state, dt), wanted, rtol=1e-11, atol=1e-9)
        state = material.advance(PULLED, state, dt)


@pytest.mark.parametrize("material", MATERIALS, ids=named)
def test_in_the_end_the_relaxed_law_is_left(material):
    state = material.advance(TURNED, initial_state(material, TURNED), None)
    relaxed = material.relaxed_law()
    wanted = gradient(relaxed.energy, PULLED)
    np.testing.assert_allclose(stress(material, PULLED, state, math.inf), wanted, rtol=1e-11, atol=1e-9)
    assert relaxed.shear_modulus == pytest.approx(0.5 * material.shear_modulus)
    if isinstance(material.base, FibreReinforced):
        return  # its moduli are the matrix's, by definition
    # moduli are those of the energy: a small stretch of volume and a small shear
    small = 1e-5
    bulk = np.trace(gradient(relaxed.energy, np.eye(3) * (1 + small / 3))) / 3 / small
    assert bulk == pytest.approx(relaxed.bulk_modulus, rel=1e-4)
    slope = gradient(relaxed.energy, shear(small))[0, 1] / small
    assert slope == pytest.approx(relaxed.shear_modulus, rel=1e-4)


@pytest.mark.parametrize("material", MATERIALS, ids=named)
def test_stress_of_the_energy_is_the_overstresses_sum(material):
    """S from the potential = volumetric + γ_∞ S_0 + ΣH_i of the advanced state."""
    state = material.advance(TURNED, initial_state(material, TURNED), 0.4)
    after = material.advance(PULLED, state, 0.7)
    inner = 0.5 * after["stress"] + after["overstress_1"] + after["overstress_2"]
    if material.kinematics == "large":
        inner = PULLED @ inner
    if material.volumetric is not None:
        inner = inner + gradient(material.volumetric.energy, PULLED)
    np.testing.assert_allclose(stress(material, PULLED, state, 0.7), inner, rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("material", MATERIALS, ids=named)
def test_a_prepared_state_serves_as_the_state(material):
    state = material.advance(TURNED, initial_state(material, TURNED), 0.4)
    prepared = material.prepare(state, 0.7)
    assert float(material.energy(PULLED, prepared, 0.7)) == pytest.approx(
        float(material.energy(PULLED, state, 0.7))
    )
    np.testing.assert_allclose(stress(material, PULLED, prepared, 0.7), stress(material, PULLED, state, 0.7))


@pytest.mark.parametrize("material", MATERIALS[1:], ids=named)
def test_a_superposed_rotation_changes_nothing(material):
    Q = rotation([0.3, -1.1, 0.7])
    state = material.advance(TURNED, initial_state(material, TURNED), 0.4)
    turned = material.advance(Q @ TURNED, initial_state(material, TURNED), 0.4)
    for name, value in state.items():
        np.testing.assert_allclose(turned[name], value, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(
        material.energy(Q @ PULLED, state, 0.7), material.energy(PULLED, state, 0.7), rtol=1e-11
    )
    wanted = Q @ stress(material, PULLED, state, 0.7)
    np.testing.assert_allclose(stress(material, Q @ PULLED, state, 0.7), wanted, rtol=1e-10, atol=1e-8)


def test_many_points_at_once_equal_one_by_one():
    material, many = MATERIALS[1], np.stack([PULLED, TURNED])
    state = material.advance(many[::-1], initial_state(material, many), 0.4)
    together = material.energy(many, state, 0.7)
    for i in range(2):
        alone = {name: value[i] for name, value in state.items()}
        assert together[i] == pytest.approx(float(material.energy(many[i], alone, 0.7)), rel=1e-13)


@pytest.mark.full
def test_cycles_of_shear_lose_the_loss_modulus():
    """π γ² G'' per cycle at small strain;"""
    material, frequency, steps, size = Viscoelastic(BASES[1], TERMS[:1]), 2.0, 160, 1e-3
    dt = 2 * math.pi / frequency / steps
    strains = size * np.sin(frequency * dt * np.arange(3 * steps + 1))
    _, stresses, losses, _ = march(material, shear(strains), dt)
    last = slice(-steps - 1, None)
    shear_stress, strain = stresses[last, 0, 1], strains[last]
    work = np.sum((shear_stress[1:] + shear_stress[:-1]) / 2 * np.diff(strain))
    wanted = math.pi * size**2 * material.loss_modulus(frequency)
    assert work == pytest.approx(wanted, rel=(frequency * dt) ** 2)
    assert np.sum(losses[-steps:]) == pytest.approx(wanted, rel=(frequency * dt) ** 2)


@pytest.mark.full
@pytest.mark.parametrize(("base", "size"), [(BASES[0], 0.01), (BASES[-1], 0.2)], ids=["small", "large"])
def test_work_is_stored_or_lost_where_stress_is_linear_in_strain(base, size):
    """Energy balance over a random history, at any strain, to the trapezoid's (Δ/τ)² and steps of strain."""
    material, rng = Viscoelastic(base, TERMS), np.random.default_rng(1)
    corners = size * rng.normal(size=(4, 3, 3))
    weights = np.linspace(0, 1, 150, endpoint=False)
    legs = [a + weights[:, None, None] * (b - a) for a, b in itertools.pairwise(corners)]
    F = np.eye(3) + np.concatenate(legs) - corners[0]
    states, stresses, losses, _ = march(material, F, 0.007)
    work = np.sum((stresses[1:] + stresses[:-1]) / 2 * np.diff(F, axis=0))
    end = {name: value[-1] for name, value in states.items()}
    # Δ/τ = 0.014 and a step is 1/150 of a leg
    assert work == pytest.approx(float(material.stored_energy(F[-1], end)) + np.sum(losses), rel=0.014**2)
    assert np.all(losses >= 0)


def test_heat_of_a_step_is_that_of_many_short_ones():
    material = MATERIALS[0]
    state = material.advance(TURNED, initial_state(material, TURNED), 0.4)
    parts = TURNED + np.linspace(0, 1, 65)[1:, None, None] * (PULLED - TURNED)
    total, now = 0.0, state
    for F in parts:
        total += float(material.dissipated_energy(F, now, 0.9 / 64))
        now = material.advance(F, now, 0.9 / 64)
    assert total == pytest.approx(float(material.dissipated_energy(PULLED, state, 0.9)), rel=1e-11)
    np.testing.assert_allclose(
        now["overstress_2"], material.advance(PULLED, state, 0.9)["overstress_2"], rtol=1e-11
    )


def test_creep_in_simple_shear():
    """A dead shear stress on a one-term solid: strain to the closed form of the standard solid at small strain."""
    material, dt, steps, load = Viscoelastic(BASES[1], ((0.4, 2.0),)), 0.02, 200, 0.3
    state, strain = initial_state(material, PULLED), 0.0
    for i in range(steps + 1):
        step = None if i == 0 else dt
        for _ in range(3):
            slope = material.shear_modulus * (0.6 + 0.4 * float(material.prony.gain(step)[0]))
            strain += (load - stress(material, shear(strain), state, step)[0, 1]) / slope
        state = material.advance(shear(strain), state, step)
    G = material.shear_modulus
    wanted = load / G * (1 / 0.6 - (1 / 0.6 - 1) * math.exp(-steps * dt * 0.6 / 2.0))
    assert strain == pytest.approx(wanted, rel=3 * (dt / 2.0) ** 2)


@pytest.mark.full
def test_large_cycles_of_tissue_lose_energy():
    """No theorem at large strain; over these cycles of 60 % shear and stretch the loop's work is positive."""
    material = MATERIALS[1]
    for frequency in (0.1, 5.0):
        phase = np.linspace(0, 4 * math.pi, 161)
        F = shear(0.6 * np.sin(phase))
        F[:, 0, 0] = np.exp(0.4 * np.sin(2 * phase))
        _, stresses, _, _ = march(material, F, (phase[1] - phase[0]) / frequency)
        work = np.sum((stresses[-80:] + stresses[-81:-1]) / 2 * np.diff(F[-81:], axis=0))
        assert work > 0


def test_from_the_relaxed_law():
    law = NeoHookean(3e3, 0.45)
    material = Viscoelastic.from_relaxed(law, TERMS)
    assert material.shear_modulus == pytest.approx(2 * law.shear_modulus)
    F = PULLED
    np.testing.assert_allclose(
        gradient(material.relaxed_law().energy, F), gradient(law.energy, F), rtol=1e-12, atol=1e-10
    )
    with pytest.raises(UsageError, match="relaxes to nothing"):
        Viscoelastic.from_relaxed(law, ((1.0, 2.0),))


def test_values_travel_and_describe_themselves():
    material = Viscoelastic(BASES[1], PRONY, name="fat")
    assert pickle.loads(pickle.dumps(material)) == material
    assert hash(material) == hash(Viscoelastic(BASES[1], TERMS, name="fat"))
    told = json.loads(json.dumps(material.describe()))
    assert told["terms"] == [[0.3, 0.5], [0.2, 20.0]]
    assert told["base"]["law"] == "NeoHookean"
    assert "fat" in str(material)
    assert "neo-Hookean" in str(Scaled(BASES[1], 0.5))


def test_a_base_with_a_history_is_refused():
    with pytest.raises(UsageError, match="history"):
        Viscoelastic(Plastic(LinearElastic(1e9, 0.3), LinearHardening(1e6)), TERMS)
