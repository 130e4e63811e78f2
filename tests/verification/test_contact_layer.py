"""A ball on a layer that is bonded to a rigid ground, and on a body so deep that the ground is not felt."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from bonded_layer import FARTHEST, dimitriadis, exact, garcia, ground, hertz
from scipy.integrate import quad

from palpate.physics.interactions import Fixed, PrescribedDisplacement, SphereProbe
from palpate.physics.materials import LinearElastic
from palpate.physics.shapes import Block, FineMesh
from palpate.physics.solid import Body

# a ball much larger than the body is meant: it is Hertz's paraboloid
pytestmark = pytest.mark.filterwarnings("ignore:The Corner has a radius:palpate.physics.advice.ModelWarning")

YOUNG = 9e3
RADIUS = 0.5  # m, a hundred times the contact's: what theory leaves out is of the order of their ratio
CONTACT = 0.005  # m, √(Rδ)
DEPTH = CONTACT**2 / RADIUS
ACROSS = 5  # elements across the contact's radius
STIFF = 300.0  # the pad's k over E/((1 - ν²) √(Rδ))
FAR = 10.0


@dataclass(frozen=True)
class Corner(SphereProbe):
    """A probe above the block's upright edge at the origin, whose mesh is fine under the contact only."""

    def refinements(self, geometry):
        height, end = geometry.size[2], 1.3 * CONTACT
        return (FineMesh(self.touches, CONTACT / ACROSS, (0.0, 0.0, height), (end, end, height)),)


def mirror(axis):
    """The face at 0 of an axis is a plane of symmetry."""
    upper = [FAR, FAR, FAR]
    upper["xyz".index(axis)] = 0.0
    box = ((-FAR, -FAR, -FAR), tuple(upper))
    return Fixed(PrescribedDisplacement("side", axis, (-FAR, FAR), sliding=True, within=box), (0.0,))


def quarter(poisson, chi, width):
    """A quarter of the layer, `width` times as wide as it is thick, and the ball's centre."""
    thickness = CONTACT / chi
    block = Block((width * thickness, width * thickness, thickness), element=thickness / 3)
    body = Body(block, LinearElastic(YOUNG, poisson), held=(mirror("x"), mirror("y")))
    pad = STIFF * YOUNG / (1 - poisson**2) / CONTACT
    probe = Corner(RADIUS, pad=pad, depth=(0.0, 2 * DEPTH), over=((0.0, 0.0), (1e-6, 1e-6)))
    return body.problem(probe), (0.0, 0.0, thickness + RADIUS - DEPTH)


def pressed(poisson, chi, width=3.0):
    """Force on the whole ball over Hertz's."""
    problem, centre = quarter(poisson, chi, width)
    found = problem.solve(centre)
    assert found.converged, found.message
    assert found.largest_strain < 0.01
    # the pad's share of the energy, d ln U/d ln k; its shares of force and stiffness are less
    assert 0 < 1 - found.strain_energy / found.potential_energy < 0.003
    # the quarter's forces across are those of its planes of symmetry
    return 4 * found.response[2] / hertz(YOUNG, poisson, RADIUS, DEPTH)


def test_the_integral_equation_and_the_published_series_agree_where_the_ground_is_far():
    """The series' first coefficient is 2/π ∫ m, its fit over ν good to 0.6 % from 0.3 on."""
    for poisson in (0.3, 0.45, 0.4999):
        felt = quad(lambda x, nu=poisson: float(ground(np.array(x), nu)), 0, FARTHEST)[0]
        assert (dimitriadis(poisson, 1e-6) - 1) * 1e6 == pytest.approx(2 / math.pi * felt, rel=6e-3)
        assert (exact(poisson, 1e-3) - 1) * 1e3 == pytest.approx(2 / math.pi * felt, rel=3e-3)
        assert exact(poisson, 0.1) == pytest.approx(dimitriadis(poisson, 0.1), rel=2e-3)
        assert exact(poisson, 0.2) == pytest.approx(dimitriadis(poisson, 0.2), rel=0.012)
        assert exact(poisson, 0.3, 24) == pytest.approx(exact(poisson, 0.3, 48), rel=1e-6)


def test_the_integral_equation_agrees_with_a_later_series_closer_to_the_ground():
    for chi in (0.1, 0.2, 0.3, 0.4):
        assert exact(0.5, chi) == pytest.approx(garcia(chi), rel=3e-3)


@pytest.mark.full
def test_on_a_compressible_layer_the_ground_adds_what_theory_says():
    force = pressed(0.3, 0.2)
    assert force == pytest.approx(dimitriadis(0.3, 0.2), rel=0.02)
    assert force == pytest.approx(exact(0.3, 0.2), rel=0.005)


@pytest.mark.full
def test_on_a_nearly_incompressible_layer_the_ground_adds_what_theory_says():
    problem, _ = quarter(0.4999, 0.2, 3.0)
    assert problem.body.mixed_regions == ("body",)
    force = pressed(0.4999, 0.2)
    assert force == pytest.approx(dimitriadis(0.4999, 0.2), rel=0.02)
    assert force == pytest.approx(exact(0.4999, 0.2), rel=0.005)


@pytest.mark.full
def test_on_a_deep_body_hertz_is_right():
    force = pressed(0.3, 0.02, width=2.0)
    assert force == pytest.approx(1, rel=0.025)
    assert force == pytest.approx(dimitriadis(0.3, 0.02), rel=0.005)


def test_there_are_enough_elements_across_the_contact():
    problem, centre = quarter(0.3, 0.2, 2.0)
    mesh = problem.mesh
    corners = mesh.points[mesh.triangles_of("top")]
    touched = (np.linalg.norm(corners.mean(axis=1)[:, :2], axis=1) < CONTACT).sum()
    # a quarter disc of N elements across its diameter has about π/4 (N/2)² · 4/√3 equilateral triangles
    assert touched > math.pi / 4 * 3**2 * 4 / math.sqrt(3)
    assert centre[2] > problem.body.geometry.size[2]
