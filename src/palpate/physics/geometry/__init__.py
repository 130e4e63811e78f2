"""Shapes of bodies, and their meshes.

block, cylinder, tube, layers, dome, organ   one shape each
solid_file     a body from a STEP or STL file      step_file, stl_file  how each is read
mesh_file      a body from a volume mesh           files                their place, content and unit
shape          what every shape offers
mesh           the mesh as plain arrays, from and to NGSolve
faces          where the named surfaces are
quality        how well shaped its elements are
refinement     where it shall be fine
meshing        tetrahedra for solids of the CAD kernel
sampling       points spread over a part of a surface
segments       parts of a surface between sharp edges, or named by a box
triangulation  closed surfaces and their faults
checks         arguments that all shapes check alike
groups         names that stand for several surfaces
"""

from palpate.physics.geometry.block import Block
from palpate.physics.geometry.cylinder import Cylinder
from palpate.physics.geometry.dome import Dome, Inclusion
from palpate.physics.geometry.faces import Face
from palpate.physics.geometry.layers import LayeredBlock
from palpate.physics.geometry.mesh import BodyMesh, body_mesh, to_ngsolve
from palpate.physics.geometry.mesh_file import ImportedMesh
from palpate.physics.geometry.organ import Organ
from palpate.physics.geometry.quality import MeshQuality
from palpate.physics.geometry.refinement import FineMesh
from palpate.physics.geometry.segments import SurfacePatch
from palpate.physics.geometry.shape import Geometry
from palpate.physics.geometry.solid_file import ImportedSolid
from palpate.physics.geometry.tube import Tube

__all__ = [
    "Block",
    "BodyMesh",
    "Cylinder",
    "Dome",
    "Face",
    "FineMesh",
    "Geometry",
    "ImportedMesh",
    "ImportedSolid",
    "Inclusion",
    "LayeredBlock",
    "MeshQuality",
    "Organ",
    "SurfacePatch",
    "Tube",
    "body_mesh",
    "to_ngsolve",
]
