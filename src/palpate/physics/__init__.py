"""What the body does under load: geometry, materials, loads and the solve.

    materials    what a body is made of, as energies
    beam         plane cantilevers
    equilibrium  finding a minimum of an energy, whatever body it belongs to

A body and its loads make a problem, a plain value. The problem's `open` builds the finite elements and gives a solver,
whose `solve` returns a solution, a plain value also where there is no equilibrium.
"""

from palpate.physics.beam import (
    PRESETS,
    BeamProblem,
    Cantilever,
    Circle,
    PointLoad,
    Preset,
    Rectangle,
    Section,
    Solution,
    TipLoad,
    preset,
)
from palpate.physics.equilibrium import Stop
from palpate.physics.materials import MATERIALS, LinearElastic, named_material

__all__ = [
    "MATERIALS",
    "PRESETS",
    "BeamProblem",
    "Cantilever",
    "Circle",
    "LinearElastic",
    "PointLoad",
    "Preset",
    "Rectangle",
    "Section",
    "Solution",
    "Stop",
    "TipLoad",
    "named_material",
    "preset",
]
