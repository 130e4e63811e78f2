"""Actions on a body, each an energy with inputs.

interaction         the contract: an interaction, and its terms on an opened body
sphere              a rigid sphere that presses a surface
surface_tool        a rigid tool of any shape that presses one
pinch               two jaws that close on a body between them
glued               a pad that is glued to a surface and moved
prescribed          a surface, or a part of it, that is moved by given amounts; rollers
loads               a point force, a traction, a body force, a pressure that follows its surface

pressing            what both have in common: places, approach, contact energy
tool_contact        a tool's contact energy, and whether a state is admissible
sphere_design       places and order in which a sphere's positions are solved
surface_patch       a touched surface as triangles
bump                the weight under a glued pad or a point force
rigid_limit         the pad that stands for a rigid tool
pads                the pad's share of what a hand feels
interaction_checks  directions, ranges, and whether a body can float away
"""

from palpate.physics.interactions.glued import GluedPad
from palpate.physics.interactions.interaction import Attached, Energy, Field, Fixed, Interaction, Planned
from palpate.physics.interactions.interaction_checks import free_motions, require_support
from palpate.physics.interactions.loads import BodyForce, PointForce, Pressure, SurfaceTraction
from palpate.physics.interactions.pads import pad_share
from palpate.physics.interactions.pinch import Pinch
from palpate.physics.interactions.prescribed import PrescribedDisplacement, roller
from palpate.physics.interactions.sphere import SphereProbe
from palpate.physics.interactions.surface_tool import SurfaceTool

__all__ = [
    "Attached",
    "BodyForce",
    "Energy",
    "Field",
    "Fixed",
    "GluedPad",
    "Interaction",
    "Pinch",
    "Planned",
    "PointForce",
    "PrescribedDisplacement",
    "Pressure",
    "SphereProbe",
    "SurfaceTool",
    "SurfaceTraction",
    "free_motions",
    "pad_share",
    "require_support",
    "roller",
]
