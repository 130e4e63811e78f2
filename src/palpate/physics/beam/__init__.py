"""Plane cantilevers: geometry, cross-sections, loads and the solve.

cantilever  the body          section    its cross-section
loads       point loads       histories  loads that run through a history
problem     body and loads, what a sweep asks
reissner    the strain energy of an elastic beam on finite elements
solver      many loads, each from the last one's answer
solution    what a solve returns
presets     the founding study's beams, and two that remember

Beams that remember:

resultants       what a section answers to its strains   sections  which law: decided by the material
plastic_section  fibres that yield                       viscous_section  a Prony series
strains          strain measures and their derivatives   line_elements    shape functions and bands
history_beam     the incremental energy of one step      marching         steps that keep their error
marching_beam    one step of a beam
history_solver   single questions and whole histories
"""

from palpate.physics.beam.cantilever import Cantilever
from palpate.physics.beam.histories import LoadAndUnload, StepAndHold
from palpate.physics.beam.loads import PointLoad, TipLoad
from palpate.physics.beam.presets import HISTORY_PRESETS, PRESETS, Preset, preset
from palpate.physics.beam.problem import BeamProblem
from palpate.physics.beam.section import Circle, Rectangle, Section
from palpate.physics.beam.solution import Solution

__all__ = [
    "HISTORY_PRESETS",
    "PRESETS",
    "BeamProblem",
    "Cantilever",
    "Circle",
    "LoadAndUnload",
    "PointLoad",
    "Preset",
    "Rectangle",
    "Section",
    "Solution",
    "StepAndHold",
    "TipLoad",
    "preset",
]
