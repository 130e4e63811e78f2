"""Fields over a body's surface, learnt from solves.

modes        proper orthogonal decomposition in the mean over the surface
solves       fields, each on the mesh that it was solved on
dimples      the part that travels with the probe
varying      … and how it differs from place to place
parting      what travels, what modes are left for
kernel       the modes' coefficients by a unit at every solve
search       the same by a few units that move; which of both is decided by solves left out
learn_field  all of it, of solves on one mesh; learn_snapshots of those on several
"""

from palpate.learning.fields.learn_field import learn_displacement, learn_field
from palpate.learning.fields.learn_snapshots import LearntField, learn_snapshots
from palpate.learning.fields.modes import SurfaceModes, lumped_mass
from palpate.learning.fields.solves import Snapshots

__all__ = [
    "LearntField",
    "Snapshots",
    "SurfaceModes",
    "learn_displacement",
    "learn_field",
    "learn_snapshots",
    "lumped_mass",
]
