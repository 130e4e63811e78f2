"""A thick hollow sphere under internal pressure: Lamé's solution, and the incompressible neo-Hookean one.

Small strain (Lamé 1852; Timoshenko & Goodier 1970, article 136), with radii a, b and pressure p inside:

    u(r) = p a³/(b³ - a³) ((1 - 2ν) r + (1 + ν) b³/(2 r²))/E,    σ_θ(a) = p (a³ + b³/2)/(b³ - a³).

Finite strain, incompressible neo-Hookean (Green & Zerna 1968, section 3.10; Ogden 1984, section 5.3.2): with the
stretches λ_a and λ_b of the surfaces, b³(λ_b³ - 1) = a³(λ_a³ - 1), and

    p = μ (2/λ_b + 1/(2 λ_b⁴) - 2/λ_a - 1/(2 λ_a⁴)).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmark_bodies import Drawn

from palpate.physics.interactions import Pressure, SurfaceTraction, roller
from palpate.physics.materials import LinearElastic, NeoHookean
from palpate.physics.solid import Body

A, B = 0.01, 0.02
PLANES = (("yz", "x"), ("zx", "y"), ("xy", "z"))
YOUNG = 9e3


def octant():
    """An eighth of the sphere."""
    from netgen.occ import Box, Pnt, Sphere

    centre = Pnt(0, 0, 0)
    solid = (Sphere(centre, B) - Sphere(centre, A)) * Box(centre, Pnt(B, B, B))
    solid.mat("body")
    for face in solid.faces:
        middle = [abs(value) < 1e-6 * B for value in face.center]
        plane = [name for (name, _), flat in zip(PLANES, middle, strict=True) if flat]
        far = np.linalg.norm(list(face.center)) > (A + B) / 2
        face.name = plane[0] if plane else "outside" if far else "inside"
    return solid


def sphere(material, load, halvings, **options):
    names = ("inside", "outside", *(name for name, _ in PLANES))
    shape = Drawn(octant, names, element=0.007, halvings=halvings)
    held = tuple(roller(*plane) for plane in PLANES)
    return Body(shape, material, fixed=(), held=held, **options).problem(load)


def lame(r, poisson, pressure):
    """Radial displacement in m."""
    share = pressure * A**3 / (B**3 - A**3) / YOUNG
    return share * ((1 - 2 * poisson) * r + (1 + poisson) * B**3 / (2 * r**2))


def linear(poisson, halvings, **options):
    """Mean radial displacement of the bore over Lamé's, less 1; and the solution."""
    load = SurfaceTraction("inside", "normal", (-1e3, 0.0))
    pressure = 100.0
    found = sphere(LinearElastic(YOUNG, poisson), load, halvings, **options).solve(-pressure)
    assert found.converged, found.message
    # the response is the integral of the displacement along the outward normal, here towards the centre
    mean = -found.response.item() / (math.pi / 2 * A**2)
    return mean / lame(A, poisson, pressure) - 1, found


def inflated(stretch):
    """Pressure in Pa at which the bore of an incompressible neo-Hookean sphere has this stretch."""
    outer = (1 + (A / B) ** 3 * (stretch**3 - 1)) ** (1 / 3)
    shear = YOUNG / 3
    return shear * (2 / outer + 1 / (2 * outer**4) - 2 / stretch - 1 / (2 * stretch**4))


def widened(poisson, halvings, stretch=1.3):
    """Volume in m³ by which an eighth of the bore grows under the pressure of an incompressible sphere's stretch."""
    law = NeoHookean.from_shear(YOUNG / 3, poisson=poisson, form="isochoric")
    load = Pressure("inside", (0.0, 2e3), symmetry=(0, 0, 0))
    found = sphere(law, load, halvings, formulation="mixed").solve(inflated(stretch))
    assert found.converged, found.message
    return found.response.item()


def growth(stretch):
    """Volume in m³ by which an eighth of the bore grows."""
    return math.pi / 6 * A**3 * (stretch**3 - 1)


def test_the_closed_forms_agree_at_small_strain():
    pressure = inflated(1 + 1e-6)
    assert lame(A, 0.5, pressure) == pytest.approx(1e-6 * A, rel=1e-5)


@pytest.mark.full
@pytest.mark.parametrize("poisson", [0.3, 0.4999])
def test_a_sphere_of_small_strain_is_that_of_lame(poisson):
    """To 1e-3 with some five elements in the wall, the error falling with the third power of their size or faster."""
    coarse, fine = (abs(linear(poisson, halvings)[0]) for halvings in (1, 2))
    assert fine < 1e-3
    assert math.log2(coarse / fine) > 3


@pytest.mark.full
def test_a_sphere_inflated_by_a_third_is_that_of_the_closed_form():
    coarse, fine = (abs(widened(0.5, halvings) / growth(1.3) - 1) for halvings in (1, 2))
    assert fine < 1e-3
    assert math.log2(coarse / fine) > 3


@pytest.mark.full
def test_the_incompressible_limit_is_approached_as_the_compressibility():
    """What a finite bulk modulus K adds to the growth falls as 1/K, and no locking comes instead."""
    limit = widened(0.5, 0)
    excess = [widened(poisson, 0) / limit - 1 for poisson in (0.499, 0.4999, 0.49999)]
    # K/μ = 2(1 + ν)/(3(1 - 2ν))
    moduli = [2 * (1 + poisson) / (3 * (1 - 2 * poisson)) for poisson in (0.499, 0.4999, 0.49999)]
    orders = -np.diff(np.log(excess)) / np.diff(np.log(moduli))
    np.testing.assert_allclose(orders, 1, atol=0.01)
