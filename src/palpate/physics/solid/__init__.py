"""Solid bodies in three dimensions, at small and large strain.

solid_body      shape, materials, supports and constant loads   solid_checks    their checks
solid_problem   a body and what varies: what a sweep asks       body_symmetry   isometries of a body
body_family     bodies that differ in a few numbers             solid_solution  an equilibrium, or why there is none
solid_solver    many solves, each from the nearest one before   solid_path      equilibria along a line of inputs
solid_newton    one equilibrium                                 solid_model     the equations as functions of the inputs
solid_system    energy, residual, tangent and response          solid_field     the unknowns: displacement, and pressure
lump_problem    presses, and lumps looked up in each            lump_solver     lumps in the state of a press
solid_energy    the materials' energy and internal variables    solid_measures  strains and stresses
"""

from palpate.physics.solid.body_family import BodyFamily, FamilyProblem, Varied
from palpate.physics.solid.lump_problem import LumpProblem
from palpate.physics.solid.solid_body import Body
from palpate.physics.solid.solid_problem import SolidProblem
from palpate.physics.solid.solid_solution import SolidSolution

__all__ = ["Body", "BodyFamily", "FamilyProblem", "LumpProblem", "SolidProblem", "SolidSolution", "Varied"]
