"""Bodies and a boundary condition that several tests of solids share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.physics.interactions import Attached, SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.units import Range

SIZE = (0.06, 0.06, 0.03)
RADIUS = 0.01
PROBE = SphereProbe(radius=RADIUS, depth=(0.0, 0.008))
FOOT = (0.031, 0.033)  # nothing is symmetric about it


def gel(poisson=0.45):
    return NeoHookean(young=9e3, poisson=poisson)


def pressed(poisson=0.45, probe=PROBE, element=0.011, **options):
    """The problem of a sphere on a small block."""
    return Body(Block(SIZE, element=0.03), gel(poisson), **options).problem(probe, element=element)


def above(depth, foot=FOOT):
    """Centre of a sphere whose tip is at a depth in m below the top at rest."""
    return np.array([*foot, SIZE[2] + RADIUS - depth])


@dataclass(frozen=True)
class Stretched:
    """Displacements q A X on the whole surface: the homogeneous state F = I + q A is the answer."""

    matrix: tuple

    def ranges(self, geometry):
        return (Range("q", 0.0, 1.0),)

    def describe(self):
        return {"type": "Stretched"}

    def refinements(self, geometry):
        return ()

    def attach(self, field):
        import ngsolve as ngs

        place = ngs.CF((ngs.x, ngs.y, ngs.z))
        rows = [ngs.CF(row) * place for row in self.matrix]
        held = np.any([field.surface_dofs(name) for name in field.rest.surfaces], axis=0)
        lift = field.interpolate(ngs.CF(tuple(rows))) * held
        return Attached((ngs.Parameter(0.0),), lifts=lift[None, :], constrained=held)
