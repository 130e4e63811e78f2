"""Solid bodies in three dimensions, at small and large strain.

body       shape, materials, supports and constant loads
parts      what a body is made of, checked
problem    a body and what varies: what a sweep asks
lengths    lengths against the body's own, which tell mistaken units
varied     properties of its materials that are inputs
family     bodies that differ in them, as one problem
solver     many solves, each from the nearest answer before
answers    what it returns, from where a path ended
solution   an equilibrium, or why there is none
opening    building the finite elements of a problem
field      the unknowns: displacement, and pressure in mixed form
density    the energy of the material
history    internal variables at the quadrature points
times      the steps of a march, checked
model      the equations as functions of the inputs
system     energy, residual and factorised tangent
newton     one equilibrium
path       equilibria along a line of inputs
response   forces and stiffness that an interaction feels
stability  whether a tangent can be trusted, and the equilibrium is stable
measures   strains and stresses
midsides   displacements in the middle of edges
"""

from palpate.physics.solid.body import Body
from palpate.physics.solid.family import BodyFamily, FamilyProblem
from palpate.physics.solid.problem import SolidProblem
from palpate.physics.solid.solution import SolidSolution
from palpate.physics.solid.varied import Varied

__all__ = ["Body", "BodyFamily", "FamilyProblem", "SolidProblem", "SolidSolution", "Varied"]
