"""The record of one tick of the loop, as it is written into a recording and read from it.

A record holds all that a tick depends on (its time, what the device said, the parameters in force, whether the driver
failed) and what came of it.
"""

from __future__ import annotations

import numpy as np

__all__ = ["BITS", "FLAGS", "LEDGER", "MAX_INPUTS", "TICK"]

LEDGER = 6  # numbers that the passivity controller publishes
MAX_INPUTS = 8  # that a body may have besides those that the hand supplies

FLAGS = (
    "holding",  # the device says that a hand holds
    "clutched",  # its clutch is pressed
    "asleep",  # it says that nobody is there
    "read_failed",  # its driver raised an error instead of a sample
    "write_failed",  # its driver raised an error instead of pushing
    "grabbed",  # the loop takes it that a hand holds the body
    "stalled",  # the sample is older than its device allows
    "inside",  # within the trained range
    "clamped",  # the force limit acted
    "let_go",  # the body has let go of a probe that is too deep in it
    "waiting",  # no force until the hand is where the body holds no energy
    "stopped",  # no force until a person resumes
    "released",  # no force until the dead-man button is held
    "blending",  # another surrogate takes the place of the one in the hand
)
"""Bits of a tick's flags, the lowest first: append, never reorder."""

BITS = {name: 1 << k for k, name in enumerate(FLAGS)}

TICK = np.dtype(
    [
        ("tick", "i8"),
        ("time", "f8"),  # s, of the loop's clock, when the tick began
        ("sample_position", "f8", 3),  # m, device axes, as the driver gave it
        (
            "sample_orientation",
            "f8",
            4,
        ),  # quaternion w, x, y, z, device axes; zero of a device that tells none
        ("sample_time", "f8"),  # s
        ("patience", "f8"),  # s
        ("hand", "f8", 3),  # m, x right, y up, z towards the user
        ("position", "f8", 3),  # m, body: the hand there, or how far it has displaced what it holds
        ("contact", "f8", 3),  # m, body: where it is touched
        ("wanted", "f8", 3),  # N on the hand, body axes: before limits and controller
        ("force", "f8", 3),  # N on the hand, body axes, as sent
        ("sent", "f8", 3),  # N, device axes, as the driver was given it
        ("torque", "f8", 3),  # N m on the hand, body axes, as sent
        ("sent_torque", "f8", 3),  # N m, device axes, as the driver was given it
        ("ledger", "f8", LEDGER),  # energy, its lowest, added damping, what that took, leak: J, N·s/m, m²
        ("parameters", "f8", MAX_INPUTS),  # the inputs that the hand doesn't supply, in force
        ("lateness", "f4"),  # s
        ("depth", "f4"),  # m
        ("stiffness", "f4"),  # N/m
        ("delay", "f4"),  # s, measured
        ("coupling", "f4"),  # N/m, of the spring in front of the body; inf: none
        ("flags", "u2"),  # bits of `FLAGS`
        ("fault", "u1"),
        ("spare", "u1"),
        ("checksum", "u4"),  # of all before it
    ]
)
