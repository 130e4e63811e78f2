"""Fields learnt from solves: over the surface that a probe touches, and of any physics at nodes, cells or an axis.

::

    learn_modes      a field of any physics: mean, modes, and what palpate.fit makes of their coefficients
    learn_field      of a touched surface: all of it, of solves on one mesh; learn_snapshots of those on several
    snapshots        fields, each on the mesh that it was solved on
    decompose_field  growth with depth, local mode, modes: what misses least of solves left out
    fit_local_mode   the part that moves with the probe
    kernel           the modes' coefficients by a unit at every solve
    search           the same by a few units that move; which of both is decided by solves left out
"""

from palpate.learning.fields.decompose_field import lumped_mass
from palpate.learning.fields.learn_field import LearntField, learn_displacement, learn_field, learn_snapshots
from palpate.learning.fields.learn_modes import LearntModes, learn_modes
from palpate.learning.fields.snapshots import Snapshots

__all__ = [
    "LearntField",
    "LearntModes",
    "Snapshots",
    "learn_displacement",
    "learn_field",
    "learn_modes",
    "learn_snapshots",
    "lumped_mass",
]
