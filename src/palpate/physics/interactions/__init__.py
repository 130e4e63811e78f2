"""What acts on a body, each an energy with inputs.

interaction  what an interaction offers, and what it hands over when it is attached
sphere       a rigid sphere that presses a surface
contact      its contact energy, and whether a state is admissible
columns      in which order its positions are solved
patch        a touched surface as triangles
"""

from palpate.physics.interactions.interaction import Attached, Energy, Field, Held, Interaction, Planned
from palpate.physics.interactions.sphere import SphereProbe

__all__ = ["Attached", "Energy", "Field", "Held", "Interaction", "Planned", "SphereProbe"]
