"""Plane cantilevers: geometry, cross-sections, loads and the solve.

cantilever     the body                       cross_section   its cross-section
beam_loads     point loads and load histories beam_presets    the founding study's beams, and two with memory
beam_problem   body and loads, and a solution
beam_element   strains and shape functions    section_laws    section forces: elastic, plastic, viscous
beam_energy    the energy to be minimised     beam_newton     its minimum, and paths of minima
beam_solver    many loads of an elastic beam  history_solver  questions and histories of a beam with memory
history_march  steps that keep their error
"""

from palpate.physics.beam.beam_loads import LoadAndUnload, PointLoad, StepAndHold, TipLoad
from palpate.physics.beam.beam_presets import HISTORY_PRESETS, PRESETS, Preset, preset
from palpate.physics.beam.beam_problem import BeamProblem, Solution
from palpate.physics.beam.cantilever import Cantilever
from palpate.physics.beam.cross_section import Circle, Rectangle, Section

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
