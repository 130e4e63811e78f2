"""What a body is made of: energies and their constants.

    tensors        functions that read coefficient functions and arrays alike, and derivatives
    stretches      sums of powers of the principal stretches
    material       what a material is; state variables; the volumetric part
    moduli         isotropic moduli from one another, checks on constants
    linear, st_venant, neo_hooke, mooney_rivlin, ogden, yeoh, fibres    elastic laws, one a file
    isochoric      what the laws of constant volume share
    pre_stretched  a law in tension before anything touches it
    user           one's own law, from one function
    viscous, prony, dashpots, scaled    Prony viscoelasticity over an elastic law
    plastic, hardening, metals          J2 plasticity, how a metal hardens, metals by name
    uniaxial       laws of single fibres, for beams
    homogeneous    uniaxial, equibiaxial, planar, shear and volumetric tests
    relaxing       the stress-free state of unloaded directions
    stability      Drucker's criterion over a range of strains
    library        materials by name, with sources

A law is one expression, a function of the deformation gradient, that NumPy and NGSolve both read.
"""

from palpate.physics.materials.fibres import FibreFamily, FibreReinforced
from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.library import MATERIALS, named_material
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.material import Elastic, Material, StateVariable, Volumetric
from palpate.physics.materials.mooney_rivlin import MooneyRivlin
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.ogden import Ogden
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.pre_stretched import PreStretched
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.st_venant import StVenantKirchhoff
from palpate.physics.materials.stability import ModeStability, Stability
from palpate.physics.materials.user import UserMaterial
from palpate.physics.materials.viscous import Viscoelastic
from palpate.physics.materials.yeoh import Yeoh

__all__ = [
    "MATERIALS",
    "Elastic",
    "FibreFamily",
    "FibreReinforced",
    "LinearElastic",
    "LinearHardening",
    "Material",
    "ModeStability",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden",
    "Plastic",
    "PreStretched",
    "PronySeries",
    "StVenantKirchhoff",
    "Stability",
    "StateVariable",
    "UserMaterial",
    "Viscoelastic",
    "VoceHardening",
    "Volumetric",
    "Yeoh",
    "named_material",
]
