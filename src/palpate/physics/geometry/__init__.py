"""Shapes of bodies, and their meshes.

shape       what every shape offers
block       a box
mesh        the mesh as plain arrays, from and to NGSolve
sampling    points spread over a part of a surface
quality     how well shaped its elements are
refinement  where it shall be fine
meshing     tetrahedra for solids of the CAD kernel
checks      arguments that all shapes check alike
"""

from palpate.physics.geometry.block import Block
from palpate.physics.geometry.mesh import BodyMesh, body_mesh, to_ngsolve
from palpate.physics.geometry.quality import MeshQuality
from palpate.physics.geometry.refinement import Refinement
from palpate.physics.geometry.shape import Geometry

__all__ = ["Block", "BodyMesh", "Geometry", "MeshQuality", "Refinement", "body_mesh", "to_ngsolve"]
