"""What the mesh prints on the force while a sphere slides, and what a pad without a stop does."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.physics.stop import Stop

SIZE, RADIUS = (0.10, 0.10, 0.05), 0.010
GEL = NeoHookean(9e3, 0.45)
PLACES = np.linspace(0.046, 0.054, 6)  # m along x: more than an element under the probe
ASIDE = 0.053  # m, off the plane of symmetry


def centre(x, y, depth):
    return (x, y, SIZE[2] + RADIUS - depth)


def slid(places, element=None):
    """Forces (place, 3) in N at a depth of 2 mm, on the mesh that the probe asks for or on a given one."""
    probe = SphereProbe(RADIUS, over=((0.046, ASIDE), (0.054, ASIDE + 1e-4)), depth=(0.0, 0.005))
    solver = Body(Block(SIZE, element=0.03), GEL).problem(probe, element=element).open()
    found = [solver.solve(centre(x, ASIDE, 0.002)) for x in places]
    assert all(one.converged for one in found)
    return np.array([one.response for one in found])


@pytest.fixture(scope="module")
def usual():
    """Along the slide on the mesh that the probe asks for: elements of 5 mm."""
    return slid(PLACES)


def ripple(values, degree):
    """Standard deviation about the polynomial of best fit: far from the sides a smooth force is a parabola."""
    x = (PLACES - PLACES.mean()) / np.ptp(PLACES)
    rest = values - np.polyval(np.polyfit(x, values, degree), x)
    return float(np.sqrt(rest @ rest / (len(x) - degree - 1)))


@pytest.mark.full
def test_a_sliding_sphere_hardly_feels_the_mesh(usual):
    normal = usual[:, 2].mean()
    assert normal > 0
    assert ripple(usual[:, 2], 2) < 0.002 * normal
    assert ripple(usual[:, 0], 3) < 0.002 * normal


@pytest.mark.full
def test_imprint_and_force_converge_with_the_elements(usual):
    """Displacements of second order: the force's error falls at least with the square of the element size."""
    coarse = slid(PLACES, 0.009)
    assert ripple(usual[:, 2], 2) < (5 / 9) ** 2 * ripple(coarse[:, 2], 2)
    middle = len(PLACES) // 2
    fine = slid(PLACES[[middle]], 0.004)[0, 2]
    errors = [force[middle, 2] - fine for force in (coarse, usual)]
    assert 0 < errors[1] < (5 / 9) ** 2 * errors[0]
    assert errors[1] < 0.02 * fine


@pytest.mark.full
def test_a_sphere_that_is_swallowed_is_never_an_answer():
    """A pad of 2e6 N/m³ without a stop lets the block close over the sphere at some depth of less than its diameter."""
    probe = SphereProbe(RADIUS, pad=2e6, stop=None, over=((0.049, 0.049), (0.051, 0.051)))
    solver = Body(Block(SIZE, element=0.03), GEL).problem(probe, element=0.009).open()
    found = [solver.solve(centre(0.05, 0.05, depth)) for depth in (0.004, 0.008, 0.011)]
    assert [one.converged for one in found] == [True, True, False]
    assert found[2].stop is Stop.THROUGH_SURFACE
    assert np.isnan(found[2].response).all()
    # the last good state is on the way, deeper than the last answer
    assert SIZE[2] + RADIUS - 0.011 < found[2].reached[2] < found[1].inputs[2]
    for one in found[:2]:
        assert one.response[2] > 0
        # no node is closer to the centre than the pad gives way, and the centre is outside
        assert np.linalg.norm(one.mesh.points + one.displacement - one.inputs, axis=1).min() > RADIUS / 2


@pytest.mark.full
def test_with_a_stop_the_same_depth_has_an_answer():
    probe = SphereProbe(RADIUS, pad=2e6, stop=0.004, over=((0.049, 0.049), (0.051, 0.051)))
    found = (
        Body(Block(SIZE, element=0.03), GEL).problem(probe, element=0.009).solve(centre(0.05, 0.05, 0.011))
    )
    assert found.converged, found.message
    assert found.penetration < 0.98 * 0.004
