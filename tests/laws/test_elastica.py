"""The beam against the inextensible elastica (Euler 1744), solved here by other means."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from palpate.physics import Cantilever, Circle, LinearElastic, Rectangle, TipLoad, preset

NYLON = preset("beam-nylon").body
BENDING = NYLON.material.young * NYLON.section.second_moment


def slender(material=None):
    """A beam so thin that it neither stretches nor shears: the elastica's own assumptions."""
    return Cantilever(1.0, Circle(1e-3), material or LinearElastic(2e9, 0.43), elements=40)


def elastica_tip(load):
    """Tip deflection w/L and shortening of the elastica under a transverse load P L²/EI (Bisshopp & Drucker 1945).

    With p² = (1 + sin θ_L)/2: √α = K(p) - F(φ₁, p), sin φ₁ = 1/(p √2).
    """

    def phase(p):
        return np.arcsin(1 / (p * np.sqrt(2)))

    def missing(p):
        return ellipk(p**2) - ellipkinc(phase(p), p**2) - np.sqrt(load)

    p = brentq(missing, np.sqrt(0.5) + 1e-12, 1 - 1e-13, xtol=1e-15)
    deflection = 1 - 2 / np.sqrt(load) * (ellipe(p**2) - ellipeinc(phase(p), p**2))
    projection = np.sqrt(2 * (2 * p**2 - 1) / load)
    return deflection, 1 - projection


@pytest.mark.parametrize(("load", "published"), [(1, 0.3017), (5, 0.7138), (10, 0.8106)])
def test_the_oracle_itself_gives_the_published_figures(load, published):
    assert elastica_tip(load)[0] == pytest.approx(published, abs=6e-5)


@pytest.mark.parametrize(("load", "published"), [(1, 0.3017), (5, 0.7138), (10, 0.8106)])
def test_the_nylon_preset_follows_the_elastica(load, published):
    solution = NYLON.problem(TipLoad(0, 10)).solve(load * BENDING)
    assert solution.converged, solution.message
    assert -solution.displacement[-1, 1] == pytest.approx(published, abs=1e-3)


@pytest.mark.parametrize("load", [0.1, 1.0, 3.0, 10.0, 25.0])
def test_a_slender_beam_is_the_elastica(load):
    body = slender()
    bending = body.material.young * body.section.second_moment
    solution = body.problem(TipLoad(0, 1)).solve(load * bending)
    deflection, shortening = elastica_tip(load)
    assert -solution.displacement[-1, 1] == pytest.approx(deflection, rel=2e-5)
    assert -solution.displacement[-1, 0] == pytest.approx(shortening, rel=5e-5)


@pytest.mark.parametrize("load", [1.0, 10.0])
def test_the_deformed_shape_is_the_elasticas(load):
    body = slender()
    solution = body.problem(TipLoad(0, 1)).solve(load * body.material.young * body.section.second_moment)
    rest = body.problem(TipLoad(0, 1)).rest

    def shoot(curvature, at=None):
        # EI θ'' = P cos θ with the load down, θ counter-clockwise
        return solve_ivp(
            lambda _, y: (y[1], load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])),
            (0, 1),
            (0, curvature, 0, 0),
            rtol=1e-11,
            atol=1e-12,
            t_eval=at,
        ).y

    root = brentq(lambda curvature: shoot(curvature)[1, -1], -1.2 * np.sqrt(2 * load), 0, xtol=1e-13)
    angle, _, x, y = shoot(root, rest[:, 0])
    np.testing.assert_allclose(rest[:, 0] + solution.displacement[:, 0], x, atol=3e-5)
    np.testing.assert_allclose(solution.displacement[:, 1], y, atol=3e-5)
    np.testing.assert_allclose(solution.displacement[:, 2], angle, atol=3e-5)


def test_euler_buckling_load_and_the_post_buckled_tip():
    """Below π²EI/4L² an axial push leaves the beam straight, above it a small nudge bends it (Euler 1744)."""
    body = slender()
    bending = body.material.young * body.section.second_moment
    critical = np.pi**2 * bending / 4
    loads = (TipLoad(0, 1, direction=(-1, 0), name="push"), TipLoad(0, 1, direction=(0, 1), name="nudge"))
    nudge = 1e-6 * critical
    below = body.problem(loads).solve((0.98 * critical, nudge))
    above = body.problem(loads).solve((1.05 * critical, nudge))
    assert below.converged
    assert above.converged
    assert abs(below.displacement[-1, 1]) < 1e-3
    # P/P_cr = (2 K(p)/π)², w/L = 2p/√α with α = P L²/EI and p = sin(θ_L/2)
    p = brentq(lambda p: (2 / np.pi * ellipk(p**2)) ** 2 - 1.05, 1e-6, 0.99)
    assert above.displacement[-1, 1] == pytest.approx(2 * p / np.sqrt(1.05 * np.pi**2 / 4), rel=1e-3)


@pytest.mark.parametrize("p_x", [-1.5, 1.5])
@pytest.mark.parametrize("p_y", [0.3, 1.0, 2.5, 5.0])
def test_the_plane_preset_has_one_equilibrium_only(p_x, p_y):
    """Shooting from the tip, every equilibrium is a tip angle whose curve ends at the clamp with θ = 0."""
    loads = np.array([p_x, p_y]) / BENDING
    tip_angles = np.linspace(-2 * np.pi, 2 * np.pi, 801)

    # EI θ'' = -(P_y cos θ - P_x sin θ), integrated from the free end (θ' = 0) back to the clamp by Runge-Kutta
    def slope(y):
        return np.array([y[1], -(loads[1] * np.cos(y[0]) - loads[0] * np.sin(y[0]))])

    y, h = np.array([tip_angles, np.zeros_like(tip_angles)]), -1 / 200
    for _ in range(200):
        a = slope(y)
        b = slope(y + h / 2 * a)
        c = slope(y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + slope(y + h * c))
    assert np.count_nonzero(np.diff(np.sign(y[0])) != 0) == 1


@pytest.mark.parametrize("section", [Circle(0.005), Rectangle(0.02, 0.004)])
@pytest.mark.parametrize("slenderness", [5, 20, 100])
def test_small_loads_give_timoshenkos_deflection(section, slenderness):
    """w = P L³/3EI + P L/kGA (Timoshenko 1921)."""
    length = slenderness * section.half_height * 2
    body = Cantilever(length, section, LinearElastic(2e9, 0.43))
    bending = 2e9 * section.second_moment
    shear = section.shear_factor(0.43) * body.material.shear_modulus * section.area
    load = 1e-4 * bending / length**2
    solution = body.problem(TipLoad(0, 2 * load)).solve(load)
    expected = load * length**3 / (3 * bending) + load * length / shear
    assert -solution.displacement[-1, 1] == pytest.approx(expected, rel=1e-5)
