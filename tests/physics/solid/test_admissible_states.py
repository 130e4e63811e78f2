"""States that satisfy Newton's equations and are none: they are found, whatever way the solver came to them."""

from __future__ import annotations

from dataclasses import replace

import ngsolve
import numpy as np
import pytest
from solids import FOOT, PROBE, RADIUS, SIZE, above, pressed

from palpate.physics.interactions import SphereProbe
from palpate.physics.interactions.tool_contact import Contact
from palpate.physics.shapes.surface_checks import winding_number
from palpate.physics.stop import Stop


def test_a_corner_turned_over_between_the_quadrature_points_is_seen():
    """u_x = -a x²/(2 L) with a just above 1: det F = 1 - a x/L is negative at the face x = L only."""
    model = pressed(element=0.02).open()._model
    z = model.field.interpolate(ngsolve.CF((-1.002 * ngsolve.x**2 / (2 * SIZE[0]), 0, 0)))
    model.field.show(z)
    inside = np.linalg.det(model.measures._gradients(large=True))
    assert inside.min() > 0
    assert model.measures.least_volume_ratio() == pytest.approx(-0.002, rel=1e-6)
    assert model.judge(z, above(0.0)).stop is Stop.ELEMENT_INVERTED


@pytest.fixture(scope="module")
def field():
    return pressed().open()._model.field


def verdict(field, centre, displacement=(0, 0, 0), stop=None):
    field.show(field.interpolate(ngsolve.CF(displacement)))
    return Contact(field, field.rest, replace(PROBE, stop=stop)).inspect(np.asarray(centre))


def test_a_sphere_at_rest_on_the_surface_is_admissible(field):
    found = verdict(field, above(0.001), stop=0.004)
    assert found.stop is Stop.CONVERGED
    # between quadrature points the sphere's tip may lie a little lower than at them
    assert 0.0009 < found.figures["penetration"] <= 0.001 + 1e-9


def test_a_sphere_pressed_past_the_stop_is_not(field):
    assert verdict(field, above(0.00399), stop=0.004).stop is Stop.PAST_STOP
    assert verdict(field, above(0.0037), stop=0.004).stop is Stop.CONVERGED


@pytest.mark.parametrize("depth", [RADIUS + 0.001, 1.5 * RADIUS])
def test_a_sphere_whose_centre_is_inside_is_not(field, depth):
    assert verdict(field, above(depth)).stop is Stop.THROUGH_SURFACE


def test_what_counts_is_the_deformed_surface(field):
    lifted = (0, 0, 0.9 * RADIUS * ngsolve.z / SIZE[2])
    assert verdict(field, above(0.3 * RADIUS)).stop is Stop.CONVERGED
    assert verdict(field, above(0.3 * RADIUS), lifted).stop is Stop.THROUGH_SURFACE


def test_the_winding_number_tells_inside_from_outside(field):
    mesh = field.rest
    assert winding_number(mesh.points[mesh.triangles], np.array(SIZE) / 2) == pytest.approx(1)
    assert winding_number(mesh.points[mesh.triangles], np.array(SIZE) * 1.01) == pytest.approx(0, abs=1e-12)


@pytest.mark.full
@pytest.mark.filterwarnings("ignore:The pad of the probe takes")  # so soft on purpose
def test_a_pad_without_a_stop_swallows_the_sphere_and_the_solver_says_so():
    """A merely quadratic pad has a limit point: beyond it no state that pushes back is left."""
    deep = 0.013
    soft = SphereProbe(radius=RADIUS, pad=2e5, stop=None, depth=(0.0, deep))
    solver = pressed(probe=soft, element=0.009).open()
    found = [solver.solve(above(depth)) for depth in (0.004, 0.008, deep)]
    assert found[0].converged
    assert found[-1].stop is Stop.THROUGH_SURFACE
    # none of those accepted is false
    for one in found:
        if one.converged:
            assert one.response[2] > 0
            assert one.penetration < RADIUS


@pytest.mark.full
def test_the_pad_is_never_pressed_past_its_stop():
    """Forced deeper than the body yields, the pad takes what is left, and its stop holds."""
    soft = SphereProbe(radius=RADIUS, pad=1e5, stop=0.002)
    found = pressed(probe=soft, element=0.006).solve(above(0.004))
    assert found.converged, found.message
    assert 0.5 * 0.002 < found.penetration <= 0.98 * 0.002


@pytest.mark.full
def test_a_mesh_too_coarse_for_a_thin_pad_is_called_so():
    """Elements of 11 mm miss a sphere of 10 mm by h²/8R = 1.5 mm: no pad of 1 mm can make up for that."""
    thin = SphereProbe(radius=RADIUS, pad=2e4, stop=0.001)
    found = pressed(probe=thin).solve(above(0.004))
    assert found.stop is Stop.PAST_STOP
    assert "of 1 mm" in found.message


def test_the_touched_surface_is_found_from_outside_only(field):
    """The way to a centre begins where the sphere is clear of the surface, on the normal through its footprint."""
    approach = PROBE.attach(field).approach
    centre = above(0.006)
    np.testing.assert_allclose(approach(centre), above(0.0), atol=1e-12)
    aside = above(-0.002)
    np.testing.assert_allclose(approach(aside), aside)
    assert np.allclose(approach(centre)[:2], FOOT)
