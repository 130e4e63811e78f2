"""Bodies that relax: viscoelastic branches on any elastic energy, their identification, and motions to try them."""

from palpate.surrogates.relaxation.branches import Branches
from palpate.surrogates.relaxation.drives import Drive, ramp, random_drive, sinusoid, step_hold
from palpate.surrogates.relaxation.identify import Identified, identify, identify_behind_pad
from palpate.surrogates.relaxation.memory import Course, Memory, course
from palpate.surrogates.relaxation.patches import Patches
from palpate.surrogates.relaxation.record import Record

__all__ = [
    "Branches",
    "Course",
    "Drive",
    "Identified",
    "Memory",
    "Patches",
    "Record",
    "course",
    "identify",
    "identify_behind_pad",
    "ramp",
    "random_drive",
    "sinusoid",
    "step_hold",
]
