"""Tools of seven shapes beside laws of contact: the benchmark's own solves, held to what it wants."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmarks.tools_against_laws import MODULUS, TOOLS, A, half_width_error, law_force, tool_error


def test_the_law_of_a_profile_is_hertz_boussinesq_and_sneddon():
    """A paraboloid, a flat end with a sharp edge, and a cone: the closed forms of 1882, 1885 and 1965."""
    radius, depth = 0.01, 1e-4
    force, contact = law_force(lambda r: r / radius, depth)
    assert force == pytest.approx(4 / 3 * MODULUS * math.sqrt(radius * depth**3), rel=1e-6)
    assert contact == pytest.approx(math.sqrt(radius * depth), rel=1e-6)
    _, slope, depth_of_punch, _ = TOOLS["punch, edge a/100"]
    force, _ = law_force(slope, depth_of_punch)
    # a punch with a sharp edge lies within it, and another one around it
    assert 2 * MODULUS * 0.99 * A * depth_of_punch < force < 2 * MODULUS * A * depth_of_punch
    force, _ = law_force(lambda r: np.full_like(r, 0.1), depth)
    assert force == pytest.approx(2 / math.pi * MODULUS * depth**2 / 0.1, rel=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("name", TOOLS)
def test_the_force_of_a_tool_is_that_of_the_law_of_its_profile(name):
    assert abs(tool_error(name)) < TOOLS[name][3]


@pytest.mark.full
def test_the_half_width_of_a_cylinder_that_lies_down_is_that_of_hertz():
    assert abs(half_width_error()) < 0.03
