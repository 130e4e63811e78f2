"""The body under load: shapes, materials, what acts on it, and the solve.

    shapes        shapes and their meshes, made or imported
    materials     what a body is made of, as energies
    interactions  what acts on it, as energies with inputs
    solid         solid bodies in three dimensions
    beam          plane cantilevers
    deformed      a solved body as it is shown: nodes, cells, fields, probe
    renderer      drawing it        vtu  files of it for ParaView
    stop          why a search for an equilibrium ended
    advice        warnings of models that are hardly meant

A body and what acts on it make a problem, a plain value. The problem's `open` builds the finite elements and gives a
solver, whose `solve` returns a solution, a plain value also where there is no equilibrium.
"""

from palpate.physics.advice import ModelWarning
from palpate.physics.beam import (
    HISTORY_PRESETS,
    PRESETS,
    BeamProblem,
    Cantilever,
    Circle,
    LoadAndUnload,
    PointLoad,
    Preset,
    Rectangle,
    Section,
    Solution,
    StepAndHold,
    TipLoad,
    preset,
)
from palpate.physics.interactions import (
    BodyForce,
    Fixed,
    GluedPad,
    Interaction,
    PointForce,
    PrescribedDisplacement,
    Pressure,
    SphereProbe,
    SurfaceTraction,
    pad_share,
    roller,
)
from palpate.physics.materials import (
    MATERIALS,
    FibreFamily,
    FibreReinforced,
    LinearElastic,
    LinearHardening,
    Material,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    Plastic,
    PreStretched,
    PronySeries,
    StVenantKirchhoff,
    UserMaterial,
    Viscoelastic,
    VoceHardening,
    Yeoh,
    named_material,
)
from palpate.physics.shapes import (
    Block,
    BodyMesh,
    Cylinder,
    Dome,
    FineMesh,
    Geometry,
    ImportedMesh,
    ImportedSolid,
    Inclusion,
    LayeredBlock,
    Organ,
    SurfacePatch,
    Tube,
)
from palpate.physics.solid import (
    Body,
    BodyFamily,
    FamilyProblem,
    SolidProblem,
    SolidSolution,
    Varied,
)
from palpate.physics.stop import Stop

__all__ = [
    "HISTORY_PRESETS",
    "MATERIALS",
    "PRESETS",
    "BeamProblem",
    "Block",
    "Body",
    "BodyFamily",
    "BodyForce",
    "BodyMesh",
    "Cantilever",
    "Circle",
    "Cylinder",
    "Dome",
    "FamilyProblem",
    "FibreFamily",
    "FibreReinforced",
    "FineMesh",
    "Fixed",
    "Geometry",
    "GluedPad",
    "ImportedMesh",
    "ImportedSolid",
    "Inclusion",
    "Interaction",
    "LayeredBlock",
    "LinearElastic",
    "LinearHardening",
    "LoadAndUnload",
    "Material",
    "ModelWarning",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden",
    "Organ",
    "Plastic",
    "PointForce",
    "PointLoad",
    "PreStretched",
    "PrescribedDisplacement",
    "Preset",
    "Pressure",
    "PronySeries",
    "Rectangle",
    "Section",
    "SolidProblem",
    "SolidSolution",
    "Solution",
    "SphereProbe",
    "StVenantKirchhoff",
    "StepAndHold",
    "Stop",
    "SurfacePatch",
    "SurfaceTraction",
    "TipLoad",
    "Tube",
    "UserMaterial",
    "Varied",
    "Viscoelastic",
    "VoceHardening",
    "Yeoh",
    "named_material",
    "pad_share",
    "preset",
    "roller",
]
