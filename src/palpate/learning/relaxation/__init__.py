"""Shares and times of what relaxes, from records of held forces; and motions of a probe to try them with."""

from palpate.learning.relaxation.force_record import Record
from palpate.learning.relaxation.identify import identify, identify_behind_pad
from palpate.learning.relaxation.probe_motions import Drive, ramp, random_drive, sinusoid, step_hold

__all__ = [
    "Drive",
    "Record",
    "identify",
    "identify_behind_pad",
    "ramp",
    "random_drive",
    "sinusoid",
    "step_hold",
]
