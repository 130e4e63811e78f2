"""Keys of a terminal, read without waiting for a line: Esc or space stops the force, r lets it come back."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from collections.abc import Iterator

__all__ = ["RESUME", "STOP", "Keys", "terminal_keys"]

STOP, RESUME = "stop", "resume"
_MEANINGS = {0x1B: STOP, 0x20: STOP, ord("r"): RESUME, ord("R"): RESUME}


class Keys:
    """The keys pressed since the last look at a terminal in which each key arrives by itself.

    Its file descriptor is -1 where there is none.
    """

    def __init__(self, descriptor: int = -1) -> None:
        self._descriptor = descriptor

    @property
    def heard(self) -> bool:
        """True where keys can be read."""
        return self._descriptor >= 0

    def wish(self) -> str:
        """Return what was asked for since the last look: `STOP`, `RESUME` or nothing; of both, the stop."""
        if not self.heard or not select.select([self._descriptor], [], [], 0.0)[0]:
            return ""
        wishes = {_MEANINGS.get(key, "") for key in os.read(self._descriptor, 256)}
        return STOP if STOP in wishes else RESUME if RESUME in wishes else ""


@contextlib.contextmanager
def terminal_keys(descriptor: int | None = None) -> Iterator[Keys]:
    """Read single keys of a terminal while the context lasts; none where there is no terminal that can do so.

    The file descriptor is by default that of standard input.
    """
    if descriptor is None:
        try:
            descriptor = sys.stdin.fileno()
        except (AttributeError, OSError, ValueError):  # no standard input, or one that is no file
            descriptor = -1
    if sys.platform == "win32" or descriptor < 0 or not os.isatty(descriptor) or _in_background(descriptor):
        yield Keys()
        return
    import termios
    import tty

    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)  # Ctrl-C still interrupts
        yield Keys(descriptor)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _in_background(descriptor: int) -> bool:
    """Return whether a shell runs this program in the background: the system stops one that touches its terminal."""
    try:
        return os.tcgetpgrp(descriptor) != os.getpgrp()
    except OSError:  # a terminal of another session, which nobody guards
        return False
