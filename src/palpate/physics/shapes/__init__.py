"""Shapes of bodies, and their meshes.

block       Block, LayeredBlock        cylinder    Cylinder, Tube
dome        Dome, Inclusion            organ       Organ
solid_file  a body from a CAD file or a closed surface; cad_file reads solids, detail_size bounds their details;
            surface_file reads surfaces, stl_text those of STL, polygon_faces cuts polygons of OBJ; filled_surface
            checks, names and fills them, surface_repair mends small faults of exports, surface_checks refuses what
            bounds no body, surface_simplify makes large ones smaller,
            surface_wrap lays a closed one around what cuts itself
mesh_file   a body from a volume mesh; mesh_source reads it, abaqus_file, gmsh_file, vtk_file some forms; mesh_groups
            has its cells and their names, mesh_cells splits them into tetrahedra
labelled_mesh a body of several tissues from a segmented scan; scan_file reads its labels, label_surface makes the
            surfaces between them
packed_file files as they lie on the disk: packed, of any case, and whether their heads can be true
body_file   files of bodies: unit, content, names for parts of their surface
shape       what every shape offers, and its rotations and reflections
mesh        the mesh as plain arrays, from and to NGSolve; its quality, and where its surfaces are
meshing     tetrahedra for solids of the CAD kernel, fine where they are asked to be
naming      names of surfaces and regions, and groups of them
"""

from palpate.physics.shapes.block import Block, LayeredBlock
from palpate.physics.shapes.body_file import SurfacePatch
from palpate.physics.shapes.cylinder import Cylinder, Tube
from palpate.physics.shapes.dome import Dome, Inclusion
from palpate.physics.shapes.labelled_mesh import ImportedScan
from palpate.physics.shapes.mesh import BodyMesh, Face, MeshQuality, body_mesh, to_ngsolve
from palpate.physics.shapes.mesh_file import ImportedMesh
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.shapes.organ import Organ
from palpate.physics.shapes.shape import Geometry
from palpate.physics.shapes.solid_file import ImportedSolid

__all__ = [
    "Block",
    "BodyMesh",
    "Cylinder",
    "Dome",
    "Face",
    "FineMesh",
    "Geometry",
    "ImportedMesh",
    "ImportedScan",
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
