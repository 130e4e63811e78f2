"""Fields over a body's surface, learnt from solves.

::

    learn_field      all of it, of solves on one mesh; learn_snapshots of those on several
    snapshots        fields, each on the mesh that it was solved on
    decompose_field  growth with depth, local mode, modes: what misses least of solves left out
    fit_local_mode   the part that moves with the probe
    kernel           the modes' coefficients by a unit at every solve
    search           the same by a few units that move; which of both is decided by solves left out
"""

from palpate.learning.fields.decompose_field import lumped_mass
from palpate.learning.fields.learn_field import LearntField, learn_displacement, learn_field, learn_snapshots
from palpate.learning.fields.snapshots import Snapshots

__all__ = [
    "LearntField",
    "Snapshots",
    "learn_displacement",
    "learn_field",
    "learn_snapshots",
    "lumped_mass",
]
