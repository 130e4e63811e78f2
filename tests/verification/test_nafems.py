"""NAFEMS LE1 and LE10: stresses at a point of bodies between two ellipses.

NAFEMS 1990, The Standard NAFEMS Benchmarks (rev. 3): LE1, the elliptic membrane, σ_yy = 92.7 MPa at D; LE10, the thick
plate under pressure, σ_yy = -5.38 MPa at D. Both are a quarter of the body between the ellipses with semi-axes (2, 1) m
and (3.25, 2.75) m, of steel (210 GPa, 0.3); D is the inner ellipse's end on x.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from benchmark_bodies import Drawn

from palpate.physics.interactions import Attached, Fixed, PrescribedDisplacement, SurfaceTraction, roller
from palpate.physics.materials import LinearElastic
from palpate.physics.solid import Body

STEEL = LinearElastic(210e9, 0.3)
NAMES = ("inside", "outside", "top", "bottom", "on x", "on y")
THICK, THIN = 0.6, 0.1


@dataclass(frozen=True)
class Plate:
    """A quarter of the body between the ellipses, cut at the heights given; fine around D."""

    heights: tuple[float, ...]
    fine: float

    def __call__(self):
        from netgen.occ import Box, Glue, Pnt, WorkPlane

        def ellipse(a, b):
            return WorkPlane().Ellipse(a, b).Face().Extrude(self.heights[-1])

        ring = ellipse(3.25, 2.75) - ellipse(2.0, 1.0)
        edges = (0.0, *self.heights)
        parts = [ring * Box(Pnt(0, 0, low), Pnt(4, 4, high)) for low, high in itertools.pairwise(edges)]
        solid = Glue(parts) if len(parts) > 1 else parts[0]
        for part in solid.solids:
            part.mat("body")
        for face in solid.faces:
            face.name = self.name_of(face)
        for edge in solid.edges:
            if abs(edge.center.z - self.heights[0]) < 1e-6 and edge.center.x > 1.5 and edge.center.y > 1.5:
                edge.name = "middle of the outside"
        for vertex in solid.vertices:
            if np.hypot(vertex.p.x - 2, vertex.p.y) < 1e-6:
                vertex.maxh = self.fine
        return solid

    def name_of(self, face):
        x, y, z = face.center
        if abs(x) < 1e-6 or abs(y) < 1e-6:
            return "on y" if abs(x) < 1e-6 else "on x"
        low, high = face.bounding_box
        if high[2] - low[2] < 1e-3:
            return "top" if abs(z - self.heights[-1]) < 1e-6 else "bottom" if abs(z) < 1e-6 else "between"
        return "outside" if high[0] > 3 else "inside"


@dataclass(frozen=True)
class HeldEdge:
    """An edge of the geometry that stays in its plane z."""

    edge: str

    def ranges(self, geometry):
        return ()

    def describe(self):
        return {"type": "HeldEdge"}

    def refinements(self, geometry):
        return ()

    def attach(self, field):
        space = field.displacement.space
        held = np.zeros(field.size, dtype=bool)
        upright = space.Range(2)
        held[upright.start : upright.stop] = True
        found = np.fromiter(
            field.space.GetDofs(field.mesh.BBoundaries(self.edge)), dtype=bool, count=field.size
        )
        return Attached((), constrained=held & found, lifts=np.zeros((0, field.size)))


def at_d(found, height, values=None):
    """Stress (3, 3) in Pa at D, at a height in m, or another field there."""
    node = np.argmin(np.linalg.norm(found.mesh.points - (2.0, 0.0, height), axis=1))
    np.testing.assert_allclose(found.mesh.points[node], (2.0, 0.0, height), atol=1e-9)
    return (found.stress if values is None else values)[node]


def membrane(element, fine):
    """LE1: half the thickness, plane stress, pulled outwards by 10 MPa on the outer edge."""
    shape = Drawn(Plate((THIN / 2,), fine), NAMES, element=element)
    held = (roller("on y", "x"), roller("on x", "y"), roller("bottom", "z"))
    body = Body(shape, STEEL, fixed=(), held=held)
    return body.problem(SurfaceTraction("outside", "normal", (0.0, 2e7))).solve(1e7, fields=True)


def plate(element, fine):
    """LE10: 1 MPa on the top; the outside can't move sideways, its middle line not upwards."""
    shape = Drawn(Plate((THICK / 2, THICK), fine), NAMES, element=element)
    edge = PrescribedDisplacement("outside", ("x", "y"), ((-1.0, 1.0), (-1.0, 1.0)), sliding=True)
    held = (
        roller("on y", "x"),
        roller("on x", "y"),
        Fixed(edge, (0.0, 0.0)),
        Fixed(HeldEdge("middle of the outside"), ()),
    )
    body = Body(shape, STEEL, fixed=(), held=held)
    return body.problem(SurfaceTraction("top", "z", (-2e6, 0.0))).solve(-1e6, fields=True)


@pytest.mark.full
def test_le1_elliptic_membrane():
    """Within 1 %, 0.05 % measured on the free face; the other components vanish as on any free edge."""
    found = membrane(element=0.3, fine=0.025)
    for height in (0.0, THIN / 2):
        stress = at_d(found, height)
        assert stress[1, 1] == pytest.approx(92.7e6, rel=0.01)
        assert np.abs(stress - np.diag(np.diag(stress) * (0, 1, 0))).max() < 0.02 * 92.7e6
        assert at_d(found, height, found.von_mises) == pytest.approx(92.7e6, rel=0.01)


@pytest.mark.full
def test_le10_thick_plate():
    """Within 2 %; the pressure on the face is met to 4 %."""
    stress = at_d(plate(element=0.3, fine=0.03), THICK)
    assert stress[1, 1] == pytest.approx(-5.38e6, rel=0.02)
    assert stress[2, 2] == pytest.approx(-1e6, rel=0.04)
    assert abs(stress[0, 0]) < 0.02 * 5.38e6


@pytest.mark.full
def test_le10_on_a_finer_mesh():
    stress = at_d(plate(element=0.15, fine=0.03), THICK)
    assert stress[1, 1] == pytest.approx(-5.38e6, rel=0.01)
