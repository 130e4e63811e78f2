"""Cross-sections that yield, against the closed forms of plastic bending."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from palpate.physics.beam import (
    Circle,
    Rectangle,
)
from palpate.physics.beam.section_laws import PlasticSection
from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.uniaxial import UniaxialPlastic

ELASTIC = LinearElastic(110e9, 0.35, 8700.0)
YIELD = 100e6
RECTANGLE = Rectangle(0.01, 0.01)
FIRST = YIELD / ELASTIC.young / RECTANGLE.half_height  # curvature at first yield, 1/m


def law(section=RECTANGLE, fibres=24, modulus=0.0):
    return PlasticSection(
        section, UniaxialPlastic(ELASTIC.young, LinearHardening(YIELD, modulus)), 1e6, fibres
    )


def bent(section, curvature, axial=0.0, internal=None):
    """Answer of one section to a curvature and an axial strain."""
    internal = section.rest((1,)) if internal is None else internal
    return section.answer(np.array([[axial, 0.0, curvature]]), internal, None)


def moment(section, curvature):
    return bent(section, curvature).force[0, 2]


def perfect_moment(curvature):
    """M = M_p (1 - (κ_y/κ)²/3) beyond first yield, of a rectangle without hardening."""
    plastic = 1.5 * ELASTIC.young * RECTANGLE.second_moment * FIRST
    return (
        plastic * (1 - (FIRST / curvature) ** 2 / 3)
        if curvature > FIRST
        else plastic * curvature / FIRST / 1.5
    )


@pytest.mark.parametrize("ratio", [1.3, 2.0, 5.0, 50.0])
def test_a_rectangles_moment_over_curvature(ratio):
    exact = perfect_moment(ratio * FIRST)
    errors = [abs(moment(law(fibres=n), ratio * FIRST) / exact - 1) for n in (24, 96, 384)]
    assert errors[0] < 3e-3
    # a kink within a fibre costs its square: a quarter of the size, a sixteenth of the error, as a bound
    assert errors[2] < 3e-3 / 16**2 * 2


def test_below_first_yield_a_section_is_elastic_to_the_digit():
    for section in (RECTANGLE, Circle(0.004)):
        answer = bent(law(section), 0.99 * YIELD / ELASTIC.young / section.half_height)
        assert answer.tangent[0, 0, 0] == pytest.approx(ELASTIC.young * section.area, rel=1e-14)
        assert answer.tangent[0, 2, 2] == pytest.approx(ELASTIC.young * section.second_moment, rel=1e-13)
        assert abs(answer.force[0, 0]) < 1e-12 * answer.tangent[0, 0, 0]


def test_the_plastic_moment_of_a_circle():
    """4r³σ_y/3."""
    exact = 4 * 0.004**3 * YIELD / 3
    assert law(Circle(0.004), fibres=400).plastic_moment == pytest.approx(exact, rel=1e-5)
    assert law(Circle(0.004)).plastic_moment == pytest.approx(exact, rel=2.5e-3)
    assert moment(law(Circle(0.004), fibres=400), 1e6) == pytest.approx(exact, rel=1e-5)


def test_a_circles_moment_over_curvature():
    section, curvature = Circle(0.004), 3 * YIELD / ELASTIC.young / 0.004

    def density(y):
        return min(ELASTIC.young * curvature * y, YIELD) * y * 4 * np.sqrt(0.004**2 - y**2)

    exact = quad(density, 0, 0.004, points=[0.004 / 3], epsrel=1e-12)[0]
    assert moment(law(section, fibres=400), curvature) == pytest.approx(exact, rel=2e-5)


def test_linear_hardening_adds_its_share_of_the_elastic_moment():
    """σ = (1 - E_t/E) σ_perfect + E_t ε, fibre by fibre."""
    slope = 5e9
    tangent = ELASTIC.young * slope / (ELASTIC.young + slope)
    share = tangent / ELASTIC.young
    curvature = 4 * FIRST
    expected = (1 - share) * moment(law(), curvature) + tangent * RECTANGLE.second_moment * curvature
    assert moment(law(modulus=slope), curvature) == pytest.approx(expected, rel=1e-13)


def test_residual_curvature():
    """κ - M/EI is left after unloading: the fibres go back elastically."""
    section, curvature = law(fibres=200), 4 * FIRST
    loaded = bent(section, curvature)
    back = brentq(lambda k: bent(section, k, internal=loaded.internal).force[0, 2], 0, curvature, xtol=1e-15)
    exact = curvature - perfect_moment(curvature) / (ELASTIC.young * RECTANGLE.second_moment)
    assert back == pytest.approx(exact, rel=1e-4)
    free = bent(section, back, internal=loaded.internal)
    np.testing.assert_array_equal(free.internal.strain, loaded.internal.strain)


def test_axial_force_weakens_a_rectangle():
    """With the neutral axis off the middle by e: N = 2e b σ_y, M = b σ_y (h²/4 - e²), to the force of one fibre."""
    offset, curvature, fibres = 0.002, 1e5 * FIRST, 400
    answer = bent(law(fibres=fibres), curvature, axial=curvature * offset)
    one = YIELD * RECTANGLE.fibres(fibres)[1].max()
    assert answer.force[0, 0] == pytest.approx(0.01 * YIELD * 2 * offset, abs=one)
    assert answer.force[0, 2] == pytest.approx(0.01 * YIELD * (0.01**2 / 4 - offset**2), abs=one * offset)


@pytest.mark.parametrize("hardening", [LinearHardening(YIELD, 2e9), VoceHardening(YIELD, 80e6, 300.0, 1e9)])
def test_forces_and_tangents_of_a_section_are_derivatives(hardening):
    """By central differences, from a section that has yielded before."""
    rng = np.random.default_rng(2)
    section = PlasticSection(Circle(0.004), UniaxialPlastic(ELASTIC.young, hardening), 1e6, 17)
    before = section.answer(rng.normal(size=(20, 3)) * (1e-3, 1e-3, 1.0), section.rest((20,)), None).internal
    strain, step = rng.normal(size=(20, 3)) * (1e-3, 1e-3, 1.0), 1e-7 * np.array([1.0, 1.0, 100.0])
    here = section.answer(strain, before, None)
    for i in range(3):
        change = step[i] * np.eye(3)[i]
        up, down = (section.answer(strain + sign * change, before, None) for sign in (1, -1))
        slope = (up.energy - down.energy) / (2 * step[i])
        np.testing.assert_allclose(slope, here.force[:, i], rtol=1e-5, atol=1e-5 * np.abs(slope).max())
        column = (up.force - down.force) / (2 * step[i])
        scale = np.sqrt(np.outer([6e6, 1e6, 25.0], [6e6, 1e6, 25.0]))[i]
        # a fibre may cross its yield limit within the step: that blurs its share of the tangent
        assert np.median(np.abs(column - here.tangent[:, :, i]) / scale) < 1e-7
        assert np.quantile(np.abs(column - here.tangent[:, :, i]) / scale, 0.8) < 1e-5


# beams
