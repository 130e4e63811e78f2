"""A thick tube in plane strain up to its plastic limit, by the solver: J2 flow, mixed and displacement form.

Perfectly plastic and incompressible (Hill 1950, The Mathematical Theory of Plasticity, ch. V), the pressure is
k (2 ln(c/a) + 1 - c²/b²) with the front at c, at most 2k ln(b/a), k = σ_y/√3. Elastic compressibility moves the
front a little, the limit not at all. Small strain: areas are those at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from benchmark_bodies import Boxes, Moved

from laws.histories import tube_limit_pressure
from palpate.physics.interactions import SurfaceTraction, roller
from palpate.physics.materials import LinearElastic, LinearHardening, Plastic
from palpate.physics.solid import Body

INNER, OUTER, ANGLE = 0.01, 0.02, math.pi / 2
YIELD = 240e6
LIMIT = tube_limit_pressure(INNER, OUTER, YIELD)


@dataclass(frozen=True)
class Quarter:
    """From the unit cube to a quarter of a ring: radius, angle, height."""

    height: float

    def __call__(self, points):
        r, t, z = points.T
        radius = INNER * (OUTER / INNER) ** r
        return np.stack([radius * np.cos(t * ANGLE), radius * np.sin(t * ANGLE), z * self.height], axis=1)


def metal(poisson, hardening=0.0):
    return Plastic(LinearElastic(200e9, poisson), LinearHardening(YIELD, hardening))


def tube(material, load, form, n=4):
    held = (roller("front", "y"), roller("back", "x"), roller("bottom", "z"), roller("top", "z"))
    shape = Boxes((n, 2 * n, 1), Quarter(OUTER / n / 2))
    return Body(shape, material, fixed=(), held=held, formulation=form).problem(load)


def radial(x, y, z):
    import ngsolve as ng

    r = ng.sqrt(x**2 + y**2)
    return x / r, y / r, 0


def pressures(material, bores, form, n=4):
    """Pressure in Pa while the bore is widened to given displacements."""
    problem = tube(material, Moved(radial, surfaces=("left",)), form, n)
    # the bore's own nodes lie on chords: their length, as the load's, is that of the mesh
    area = problem.mesh.areas["left"]
    found = problem.open().march(np.arange(1.0, len(bores) + 1), np.array(bores)[:, None])
    assert found[-1].converged, found[-1].message
    return np.array([-one.response.item() / area for one in found])


def bore(material, front):
    """Displacement in m of an incompressible tube's bore when the front is at a radius in units of the bore."""
    return YIELD / math.sqrt(3) * (front * INNER) ** 2 / (2 * material.shear_modulus * INNER)


def hill(front):
    """Pressure over the limit with the front at a radius in units of the bore."""
    ratio = OUTER / INNER
    if front < 1:
        return front**2 * (1 - ratio**-2) / (2 * math.log(ratio))
    if front > ratio:
        return 1.0
    return (2 * math.log(front) + 1 - (front / ratio) ** 2) / (2 * math.log(ratio))


def pressed(poisson, fronts, form, n, hardening=0.0):
    """Pressures over the limit."""
    material = metal(poisson, hardening)
    return pressures(material, [bore(material, front) for front in fronts], form, n) / LIMIT


@pytest.mark.full
def test_the_pressure_follows_the_front_up_to_the_limit():
    """Straight elements have chords for circles: the limit comes with the second power of their size."""
    fronts = (0.9, 1.2, 1.6, 2.6)
    coarse, fine = (pressed(0.4999, fronts, "mixed", n) for n in (2, 4))
    np.testing.assert_allclose(fine, [hill(front) for front in fronts], rtol=2.5e-3)
    assert math.log2((1 - coarse[-1]) / (1 - fine[-1])) == pytest.approx(2, abs=0.3)


@pytest.mark.full
def test_the_limit_of_a_compressible_metal_is_the_same():
    fronts = (1.0, 1.6, 2.6, 6.0, 12.0)
    last = [pressed(poisson, fronts, "mixed", 2)[-1] for poisson in (0.3, 0.4999)]
    assert last[0] == pytest.approx(last[1], rel=1e-4)


@pytest.mark.full
def test_displacements_alone_never_reach_a_limit():
    """Plastic flow keeps the volume, so the displacement form of an incompressible metal hardens without end."""
    fronts = (1.0, 1.6, 2.6, 6.0, 10.0)
    mixed, stiff = (pressed(0.4999, fronts, form, 2) for form in ("mixed", "displacement"))
    assert mixed[-1] - mixed[-2] < 1e-5
    assert stiff[-1] - stiff[-2] > 0.05
    assert stiff[-1] > 1.1
    # at ν = 0.3 elements of second order bear it: less than 0.2 % in the same stretch
    mild = pressed(0.3, fronts, "displacement", 2)
    assert 1e-4 < mild[-1] - mild[-2] < 2e-3


@pytest.mark.full
def test_all_of_a_tube_at_its_limit_is_at_yield():
    """von Mises' stress at the nodes, through the whole wall."""
    material = metal(0.4999)
    solver = tube(material, Moved(radial, surfaces=("left",)), "mixed", 3).open()
    found = solver.march([1.0, 2.0, 3.0], [[bore(material, front)] for front in (0.9, 1.6, 4.0)], fields=True)
    assert found[-1].converged
    np.testing.assert_allclose(found[-1].von_mises, YIELD, rtol=1e-3)
    assert found[0].von_mises.max() < YIELD


@pytest.mark.full
def test_hardening_fades_linearly():
    """What a plastic modulus h adds to the limit is proportional to it."""
    fronts = (1.0, 1.6, 2.6)
    limit, *harder = (pressed(0.4999, fronts, "mixed", 2, h)[-1] for h in (0.0, 2e7, 2e8))
    gains = np.array(harder) - limit
    assert gains[0] > 0
    assert gains[1] / gains[0] == pytest.approx(10, rel=0.1)


@pytest.mark.full
def test_a_dead_pressure_beyond_the_limit_is_refused():
    problem = tube(metal(0.4999), SurfaceTraction("left", "normal", (-1e9, 0.0)), "mixed", 3)
    assert problem.solve([-0.99 * LIMIT], dt=1.0).converged
    beyond = problem.solve([-1.01 * LIMIT], dt=1.0)
    assert not beyond.converged
    assert beyond.reached[0] == pytest.approx(-LIMIT, rel=0.02)
