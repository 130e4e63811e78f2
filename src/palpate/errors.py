"""The errors that palpate raises on purpose, and the exit codes that the command line gives them.

::

    PalpateError                 exit code
    ├── UsageError               2   a wrong argument, name, key, unit or range
    │   ├── StudyError           2   a study file that can't be read as one
    │   ├── FileFormatError      2   a dataset or network file that is corrupt, foreign or from the future
    │   └── PortInUseError       2   the address is taken by another server
    ├── SolverError              3   a finite-element solve, or too many of a sweep's, did not converge
    ├── AccuracyError            1   the network misses the accuracy that was asked of it
    ├── DeviceError              3   a haptic device or the real-time process failed to start or vanished
    │   ├── DeviceLostError      3   a haptic device is no longer there
    │   └── DeviceStopError      3   a haptic device's own safety has stopped it
    └── ResourceError            3   room on a disk, memory or a scheduler is missing, or a place is write-protected

Each says *what* happened, *why* (as far as known) and *what to do*. Inside the 1 kHz loop nothing raises:
there a failure is a value (a fault code) and a force of zero.
"""

from __future__ import annotations

from typing import ClassVar

__all__ = [
    "AccuracyError",
    "DataWarning",
    "DeviceError",
    "DeviceLostError",
    "DeviceStopError",
    "FileFormatError",
    "FitWarning",
    "PalpateError",
    "PortInUseError",
    "ResourceError",
    "SolverError",
    "StudyError",
    "UsageError",
]


class PalpateError(Exception):
    """Base of all errors raised on purpose.

    Parameters
    ----------
    what : str
        What happened, as one sentence.
    why : str
        The cause, as far as it is known.
    fix : str
        What the reader can do about it.
    """

    exit_code: ClassVar[int] = 3

    def __init__(self, what: str, *, why: str = "", fix: str = "") -> None:
        super().__init__(what, why, fix)
        self.what, self.why, self.fix = what, why, fix

    def __str__(self) -> str:
        return "\n".join(line for line in (self.what, self.why, self.fix) if line)

    def __reduce__(self) -> tuple[object, ...]:
        # keyword arguments would be lost on the way back from a worker process
        return _rebuild, (type(self), self.what, self.why, self.fix)


def _rebuild(kind: type[PalpateError], what: str, why: str, fix: str) -> PalpateError:
    return kind(what, why=why, fix=fix)


class UsageError(PalpateError):
    """A wrong argument, name, key, unit or range."""

    exit_code = 2
    refusals: tuple[UsageError, ...] = ()  # where several are told at once
    wrap: float = 0.0  # m, by which a refused surface may be wrapped instead; 0: that is no way


class StudyError(UsageError):
    """A study file that can't be read as one."""


class FileFormatError(UsageError):
    """A dataset or network file that is corrupt, truncated, foreign or from a later version."""


class PortInUseError(UsageError):
    """The address is taken by another server."""


class SolverError(PalpateError):
    """A finite-element solve did not converge, or too many of a sweep's did not."""

    exit_code = 3


class AccuracyError(PalpateError):
    """The network misses the accuracy that was asked of it."""

    exit_code = 1


class DeviceError(PalpateError):
    """A haptic device or the real-time process failed to start or vanished."""

    exit_code = 3


class DeviceLostError(DeviceError):
    """A haptic device is no longer there: unplugged, switched off, or its service has ended."""


class DeviceStopError(DeviceError):
    """A haptic device's own safety has stopped it: a brake, a stall, hot motors, its firmware's watchdog."""


class ResourceError(PalpateError):
    """The machine lacks what the work needs: room on a disk, the right to write, memory, a scheduler."""

    exit_code = 3


class DataWarning(UserWarning):
    """Data were read of which a part is lost: it says which, and what to do."""


class FitWarning(UserWarning):
    """A network was learnt, but its user must know something of it: the notes of what `palpate.fit` returned say it."""
