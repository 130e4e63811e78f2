"""Bodies that relax, creep and lose energy, against closed forms (Ferry 1980, Viscoelastic Properties of Polymers).

With one Prony term the shear modulus is G (γ_∞ + γ e^(-t/τ)). In an incompressible body nothing else is stiff, so by
the correspondence principle any small-strain stiffness is that of the elastic body times the same function of time,
or of frequency, g' + i g''.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmark_bodies import Boxes

from palpate.physics.interactions import PrescribedDisplacement, SurfaceTraction, roller
from palpate.physics.materials import LinearElastic, NeoHookean, Viscoelastic
from palpate.physics.solid import Body

SIDE, YOUNG = 0.02, 9e3
SHARE, TIME = 0.4, 2.0
LEFT = 1 - SHARE
SLIDING = (roller("left", "x"), roller("front", "y"), roller("bottom", "z"))


def scaled(points):
    return SIDE * points


def shaken(points):
    """Nodes moved within the cube, so that nothing is regular."""
    shift = np.random.default_rng(5).uniform(-0.1, 0.1, points.shape)
    return SIDE * (points + shift * ((points > 0) & (points < 1)))


def viscous(law):
    return Viscoelastic(law, ((SHARE, TIME),))


def relaxation(t):
    return LEFT + SHARE * np.exp(-t / TIME)


PULL = PrescribedDisplacement("top", "z", (-SIDE, SIDE), sliding=True)


@pytest.mark.full
def test_a_stretched_bar_relaxes_as_the_series_at_any_strain():
    """Incompressible neo-Hookean bar, stretched by half at once and held: exact in steps of any length."""
    law = NeoHookean(YOUNG, 0.5, form="isochoric")
    solver = Body(Boxes((2, 2, 2), shaken), viscous(law), fixed=(), held=SLIDING).problem(PULL).open()
    # the first step is so short that nothing relaxes in it
    times = np.array([1e-9, 0.1, 0.7, 2.0, 5.0, 20.0])
    found = solver.march(times, np.full((6, 1), SIDE / 2), fields=True)
    assert found[-1].converged, found[-1].message
    force = -np.array([one.response.item() for one in found])
    stretch = 1.5
    assert force[0] == pytest.approx(YOUNG / 3 * (stretch - stretch**-2) * SIDE**2, rel=1e-6)
    np.testing.assert_allclose(force / force[0], relaxation(times), rtol=1e-7)
    # the stress at each node is that which the steps had, whatever the internal variables are now
    for one, pull in zip(found, force, strict=True):
        np.testing.assert_allclose(one.stress[:, 2, 2], pull / SIDE**2 * stretch, rtol=1e-6)
        np.testing.assert_allclose(one.von_mises, pull / SIDE**2 * stretch, rtol=1e-6)


def creep(steps, span=4.0):
    """Largest error of a bar's creep under a dead traction, over its elongation at once."""
    law = LinearElastic(YOUNG, 0.5)
    body = Body(Boxes((1, 1, 1), scaled), viscous(law), fixed=(), held=SLIDING)
    solver = body.problem(SurfaceTraction("top", "z", (0.0, 200.0))).open()
    times = np.concatenate([[1e-9], np.linspace(0, span, steps + 1)[1:]])
    found = solver.march(times, np.full((steps + 1, 1), 90.0))
    assert found[-1].converged, found[-1].message
    # the response is the integral of the displacement over the loaded face
    strain = np.array([one.response.item() for one in found]) / SIDE**3
    compliance = (1 - SHARE * np.exp(-LEFT * times / TIME)) / (LEFT * YOUNG)
    return np.abs(strain / 90.0 - compliance).max() * YOUNG


def test_a_loaded_bar_creeps_as_the_closed_form_with_second_order():
    coarse, fine = creep(8), creep(16)
    assert fine < 2e-3
    assert math.log2(coarse / fine) == pytest.approx(2, abs=0.1)


def loss(steps, frequency, amplitude=1e-4, cycles=3):
    """Energy that a bonded block loses in the last cycle of its top's sway, over the closed form."""
    law = LinearElastic(YOUNG, 0.5)
    sway = PrescribedDisplacement("top", "x", (-1e-3, 1e-3))
    shape = Boxes((2, 2, 2), shaken)
    stiffness = -Body(shape, law).problem(sway).solve(amplitude).response_gradient.item()
    times = np.arange(1, cycles * steps + 1) * (2 * math.pi / frequency / steps)
    moved = amplitude * np.sin(frequency * times)
    found = Body(shape, viscous(law)).problem(sway).open().march(times, moved[:, None])
    assert found[-1].converged, found[-1].message
    force = -np.array([one.response.item() for one in found[-steps:]])
    # ∮F dq with dq = q₀ ω cos ωt dt, exact for what the samples tell of the first harmonic
    work = 2 * math.pi * amplitude * np.mean(force * np.cos(frequency * times[-steps:]))
    return work / (math.pi * amplitude**2 * stiffness * viscous(law).prony.loss(frequency))


def discrete_loss(steps, frequency):
    """g'' of the series when the stress S₀ = e^(iωt) grows evenly within each step: H ← e H + γ a ΔS₀."""
    ratio = 2 * math.pi / frequency / steps / TIME
    back, decay = np.exp(-2j * math.pi / steps), math.exp(-ratio)
    return SHARE * (1 - decay) / ratio * ((1 - back) / (1 - decay * back)).imag


@pytest.mark.full
@pytest.mark.parametrize("frequency", [1 / TIME, pytest.param(0.3 / TIME, marks=pytest.mark.full)])
def test_a_swaying_block_loses_what_the_loss_modulus_says(frequency):
    """π q₀² k g'' in a cycle, with the elastic stiffness k of the same mesh, but for what the step's length costs."""
    wanted = viscous(LinearElastic(YOUNG, 0.5)).prony.loss(frequency)
    # of the first cycles e^(-4π/ωτ) is left
    assert loss(24, frequency) * wanted == pytest.approx(discrete_loss(24, frequency), rel=1e-5)
    coarse, fine = (1 - discrete_loss(steps, frequency) / wanted for steps in (24, 48))
    assert fine < 2e-3
    assert math.log2(coarse / fine) == pytest.approx(2, abs=0.1)
