"""What can go wrong inside the loop. There nothing raises: a fault is a value, and the force is zero."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["Fault"]


class Fault(IntEnum):
    """Why the force is zero on this tick, or `NONE`.

    The numbers travel through the shared memory and the viewer's messages: append, never renumber.
    """

    NONE = 0
    INPUT_NOT_FINITE = 1
    OUTPUT_NOT_FINITE = 2
    INPUT_STALLED = 3
    CLOCK_JUMP = 4
    DEVICE_ERROR = 5
    EVALUATOR_ERROR = 6
    PARENT_GONE = 7

    @property
    def meaning(self) -> str:
        """One line for people."""
        return _MEANINGS[self]


_MEANINGS = {
    Fault.NONE: "no fault",
    Fault.INPUT_NOT_FINITE: "the device reported a position that is not a finite number",
    Fault.OUTPUT_NOT_FINITE: "the model answered with a number that is not finite",
    Fault.INPUT_STALLED: "the input is older than its device allows, or the page is hidden",
    Fault.CLOCK_JUMP: "the clock jumped, or the process was suspended",
    Fault.DEVICE_ERROR: "the device driver reported an error",
    Fault.EVALUATOR_ERROR: "the model could not be evaluated",
    Fault.PARENT_GONE: "the process that started the loop has ended",
}
