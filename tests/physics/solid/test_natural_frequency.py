"""The lowest natural frequency against a beam's, and how quickly a body may then be moved against one mode's answer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.physics import Body, SphereProbe
from palpate.physics.materials import LinearElastic
from palpate.physics.shapes import Block
from palpate.surrogates.motion import amplification, motion_sentence, quickest

PROBE = SphereProbe(0.003, pad="rigid", depth=(0.0, 0.001), over=((0.1, 0.004), (0.12, 0.006)))
YOUNG, DENSITY, LENGTH, THICK = 1e5, 1200.0, 0.2, 0.01


def bar(density):
    """A bar held at one end, without lateral contraction: a beam of Euler's and Bernoulli's."""
    block = Block((LENGTH, THICK, 0.8 * THICK), element=0.5 * THICK)
    return Body(block, LinearElastic(YOUNG, 0.0, density=density), fixed="x_min")


def test_a_slender_bar_vibrates_as_a_beam():
    """First root 1.8751 of cos x cosh x = −1; shear and rotary inertia take 0.3 % at this slenderness."""
    problem = bar(DENSITY).problem(PROBE)
    across = 0.8 * THICK
    wanted = 1.8751**2 / (2 * math.pi) * math.sqrt(YOUNG * across**2 / 12 / (DENSITY * LENGTH**4))
    assert problem.motion == {"frequency": pytest.approx(wanted, rel=0.01)}


def test_a_material_without_a_density_counts_as_water():
    motions = [bar(density).problem(PROBE).motion for density in (1000.0, 0.0)]
    assert motions[1] == {**motions[0], "density": 1000.0}
    assert "1000 kg/m³ assumed" in motion_sentence(motions[1], 0.001)


def test_the_quickest_motion_is_that_of_one_mode_that_errs_so_much():
    """An undamped oscillator driven at f, integrated step by step, has the amplitude that the formula says."""
    lowest = 7.0
    frequency = quickest(lowest, 0.05)
    assert amplification(frequency, lowest) == pytest.approx(1.05)
    w, w0, steps = 2 * math.pi * frequency, 2 * math.pi * lowest, 20_000
    dt = 2 * math.pi / w / steps
    x, v, largest = 0.0, w * 1.05, 0.0  # on the forced motion 1.05 sin(w t)
    for k in range(steps):
        v += 0.5 * dt * w0**2 * (math.sin(w * k * dt) - x)
        x += dt * v
        v += 0.5 * dt * w0**2 * (math.sin(w * (k + 1) * dt) - x)
        largest = max(largest, x)
    assert largest == pytest.approx(1.05, rel=1e-4)
    # a press of 5 mm in and out at that frequency moves at up to π f d
    assert f"{1e3 * math.pi * frequency * 0.005:.2g} mm/s" in motion_sentence({"frequency": lowest}, 0.005)
    assert np.isclose(amplification(0.0, lowest), 1.0)
