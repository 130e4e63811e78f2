"""Materials: energies and their constants.

    material       the contract; bases of laws; state variables; the volumetric part
    moduli         isotropic moduli from one another, checks on constants
    tensors        functions that read coefficient functions and arrays alike, and derivatives
    stretches      sums of powers of the principal stretches
    linear, st_venant, neo_hooke, mooney_rivlin, ogden, yeoh, fibres    elastic laws, one a file
    pre_stretched  a law in tension before anything touches it
    lumped         a law with a ball of another stiffness in it
    user           a law from one function
    viscous, prony     Prony viscoelasticity over an elastic law
    plastic, hardening J2 plasticity, and the flow stress of a metal
    uniaxial       laws of single fibres, for beams
    homogeneous    uniaxial, equibiaxial, planar, shear and volumetric tests
    material_stability  Drucker's criterion over a range of strains
    library        materials by name, with sources
tissues        moduli of soft tissues, their ranges and sources
    specimen_tests, law_forms, fit_law, material_fit   constants from tests, and what they tell
    fit_relaxation a Prony series from a response that fades

A law is one expression, a function of the deformation gradient, that NumPy and NGSolve both read.
"""

from palpate.physics.materials.fibres import FibreFamily, FibreReinforced
from palpate.physics.materials.fit_law import fit
from palpate.physics.materials.fit_relaxation import RelaxationFit, fit_relaxation
from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.library import MATERIALS, named_material
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.lumped import Lumped
from palpate.physics.materials.material import Elastic, Material, StateVariable
from palpate.physics.materials.material_fit import MaterialFit
from palpate.physics.materials.material_stability import ModeStability, Stability
from palpate.physics.materials.mooney_rivlin import MooneyRivlin
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.ogden import Ogden
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.pre_stretched import PreStretched
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.specimen_tests import IndentationTest, StretchTest
from palpate.physics.materials.st_venant import StVenantKirchhoff
from palpate.physics.materials.user import UserMaterial
from palpate.physics.materials.viscous import Viscoelastic
from palpate.physics.materials.yeoh import Yeoh

__all__ = [
    "MATERIALS",
    "Elastic",
    "FibreFamily",
    "FibreReinforced",
    "IndentationTest",
    "LinearElastic",
    "LinearHardening",
    "Lumped",
    "Material",
    "MaterialFit",
    "ModeStability",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden",
    "Plastic",
    "PreStretched",
    "PronySeries",
    "RelaxationFit",
    "StVenantKirchhoff",
    "Stability",
    "StateVariable",
    "StretchTest",
    "UserMaterial",
    "Viscoelastic",
    "VoceHardening",
    "Yeoh",
    "fit",
    "fit_relaxation",
    "named_material",
]
