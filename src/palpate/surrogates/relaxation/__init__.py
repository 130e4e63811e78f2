"""Bodies that relax: viscoelastic branches on any elastic energy, their identification, and motions to try them."""

from palpate.surrogates.relaxation.branches import Branches
from palpate.surrogates.relaxation.drives import Drive, ramp, random_drive, sinusoid, step_hold
from palpate.surrogates.relaxation.memory import Course, Memory, course
from palpate.surrogates.relaxation.patches import Patches

__all__ = [
    "Branches",
    "Course",
    "Drive",
    "Memory",
    "Patches",
    "course",
    "ramp",
    "random_drive",
    "sinusoid",
    "step_hold",
]
