"""What acts on a body, each an energy with inputs.

interaction  what an interaction offers, and what it hands over when it is attached
sphere       a rigid sphere that presses a surface
glued        a pad that is glued to a surface and moved
prescribed   a surface, or a part of it, that is moved by given amounts
support      rollers: planes of symmetry
loads        dead loads: a point force, a traction, a body force
pressure     a pressure that follows its surface

pad_law      the pad between a sphere and a surface
contact      a sphere's contact energy, and whether a state is admissible
columns      in which order a sphere's positions are solved
patch        a touched surface as triangles
footprint    the bump under a glued pad or a point force
estimate     the pad's share of the depth before anything is solved
pads         how much of what a hand feels is the pad
rigid        whether a body is held
arguments    directions and ranges, checked
"""

from palpate.physics.interactions.glued import GluedPad
from palpate.physics.interactions.interaction import Attached, Energy, Field, Held, Interaction, Planned
from palpate.physics.interactions.loads import BodyForce, PointForce, SurfaceTraction
from palpate.physics.interactions.pads import PadShare, pad_share
from palpate.physics.interactions.prescribed import PrescribedDisplacement
from palpate.physics.interactions.pressure import Pressure
from palpate.physics.interactions.rigid import free_motions, require_held
from palpate.physics.interactions.sphere import SphereProbe
from palpate.physics.interactions.support import roller

__all__ = [
    "Attached",
    "BodyForce",
    "Energy",
    "Field",
    "GluedPad",
    "Held",
    "Interaction",
    "PadShare",
    "Planned",
    "PointForce",
    "PrescribedDisplacement",
    "Pressure",
    "SphereProbe",
    "SurfaceTraction",
    "free_motions",
    "pad_share",
    "require_held",
    "roller",
]
