"""Fields over a body's surface, learnt from solves.

modes        proper orthogonal decomposition in the mean over the surface
dimples      the part that travels with the probe
kernel       the modes' coefficients by a unit at every solve
search       the same by a few units that move; which of both is decided by solves left out
learn_field  all of it
"""

from palpate.learning.fields.learn_field import LearntField, learn_displacement, learn_field
from palpate.learning.fields.modes import SurfaceModes, lumped_mass

__all__ = ["LearntField", "SurfaceModes", "learn_displacement", "learn_field", "lumped_mass"]
