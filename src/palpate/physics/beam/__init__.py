"""Plane cantilevers: geometry, cross-sections, loads and the solve.

cantilever  the body          section  its cross-section
loads       point loads       problem  body and loads, what a sweep asks
reissner    the strain energy on finite elements
solver      many loads, each from the last one's answer
solution    what a solve returns
presets     the founding study's beams
"""

from palpate.physics.beam.cantilever import Cantilever
from palpate.physics.beam.loads import PointLoad, TipLoad
from palpate.physics.beam.presets import PRESETS, Preset, preset
from palpate.physics.beam.problem import BeamProblem
from palpate.physics.beam.section import Circle, Rectangle, Section
from palpate.physics.beam.solution import Solution

__all__ = [
    "PRESETS",
    "BeamProblem",
    "Cantilever",
    "Circle",
    "PointLoad",
    "Preset",
    "Rectangle",
    "Section",
    "Solution",
    "TipLoad",
    "preset",
]
