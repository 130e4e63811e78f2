"""What the body does under load: geometry, materials, loads and the solve.

A `Cantilever` and its loads make a `BeamProblem`, a plain value. `BeamProblem.open` builds the finite
elements and gives a solver. Its `solve` returns a `Solution`, a plain value also where there is no equilibrium.
"""

from palpate.physics.beam import Cantilever
from palpate.physics.loads import PointLoad, TipLoad
from palpate.physics.material import MATERIALS, LinearElastic, named_material
from palpate.physics.presets import PRESETS, Preset, preset
from palpate.physics.problem import BeamProblem
from palpate.physics.section import Circle, Rectangle, Section
from palpate.physics.solution import Solution, Stop

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
