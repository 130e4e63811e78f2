"""Events in a file that is only ever appended to: what was written before a crash stays, and can be read.

Each event is one line of JSON with its ``kind``, its time on the wall (``at``, UTC) and by the steady clock
(``elapsed``, s, in which interruptions don't count). A line that a kill has cut off is left out when the file is
read, and stays in it.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Self

from palpate.errors import FileFormatError, UsageError
from palpate.files import system_errors
from palpate.format import duration

__all__ = ["AppendRecord", "Clocks", "hold_file", "jump_in_words", "read_events"]

JUMP = (
    2.0  # s by which wall and steady clock may disagree between two events: more is a jump of the wall clock
)
_FAR = 2**30  # byte of the file that Windows locks: others must be able to read the events


@dataclass(frozen=True)
class Clocks:
    """The two clocks of a record, both in s: one that never jumps, and that of the wall (since 1970)."""

    steady: Callable[[], float] = time.monotonic
    wall: Callable[[], float] = time.time


class AppendRecord:
    """A file of events that one process at a time appends to; a context manager that lets go of it.

    `events` are those read and added. A missing file is made; what is there is kept. The time comes from `clocks`, by
    default the machine's. A record that another process holds is a UsageError, a file without events a
    FileFormatError, a full disk or a protected folder a ResourceError, also of `add`.
    """

    def __init__(self, path: str | os.PathLike[str], clocks: Clocks | None = None) -> None:
        self.path, self._clocks = Path(path), clocks or Clocks()
        with system_errors(f"The record {self.path} could not be opened."):
            self._file: BinaryIO = self.path.open("ab", buffering=0)
        if not hold_file(self._file):
            self._file.close()
            raise UsageError(
                f"{self.path.parent.name} is in use.",
                why="Another palpate holds its record.",
                fix="Go on there, or end that one first.",
            )
        self.events = read_events(self.path)
        self._before = float(self.events[-1]["elapsed"]) if self.events else 0.0
        self._began = self._clocks.steady()
        self._end_cut_line()
        jump = self._since_last_wall() if self.events else 0.0
        self._offset = self._clocks.wall() - self._began
        if jump < -JUMP:
            self.add("clock", seconds=jump)

    def _end_cut_line(self) -> None:
        """Begin a new line where a kill has cut off the last one."""
        with self.path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(size - 1, 0))
            if size and file.read(1) != b"\n":
                self._write(b"\n")

    def _since_last_wall(self) -> float:
        """Return the seconds that the wall clock has gone on since the last event."""
        return self._clocks.wall() - datetime.fromisoformat(self.events[-1]["at"]).timestamp()

    @property
    def seconds(self) -> float:
        """Time since the record was begun by the steady clock, without interruptions, s."""
        return self._before + self._clocks.steady() - self._began

    def add(self, kind: str, **facts: Any) -> dict[str, Any]:
        """Append an event and wait until it is on the disk; a jump of the wall clock goes before it as ``clock``."""
        if kind != "clock":
            self._note_jump()
        at = datetime.fromtimestamp(self._clocks.wall(), UTC).isoformat()
        event = {"kind": kind, "at": at, "elapsed": self.seconds} | facts
        self._write(json.dumps(event, allow_nan=False).encode() + b"\n")
        self.events.append(event)
        return event

    def _note_jump(self) -> None:
        offset = self._clocks.wall() - self._clocks.steady()
        jump = offset - self._offset
        if abs(jump) > JUMP:
            self._offset = offset
            self.add("clock", seconds=jump)

    def _write(self, line: bytes) -> None:
        with system_errors(f"The record {self.path} could not be written."):
            rest = memoryview(line)
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let go of the file; harmless when repeated."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def jump_in_words(seconds: float) -> str:
    """Return a sentence, without its end, on a jump of the machine's clock."""
    return f"The machine's clock went {'back' if seconds < 0 else 'forward'} by {duration(abs(seconds))}"


def read_events(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Return the whole events of a record in their order; lines that were cut off are left out.

    A file with text, but no event in it, is a FileFormatError.
    """
    path = Path(path)
    with system_errors(f"The record {path} could not be read."):
        lines = path.read_bytes().split(b"\n")
    events = []
    for line in lines:
        with contextlib.suppress(ValueError):
            event = json.loads(line)
            if isinstance(event, dict) and {"kind", "at", "elapsed"} <= event.keys():
                events.append(event)
    if not events and len(lines) > 1:
        raise FileFormatError(
            f"{path} is no record of palpate.",
            why="No line of it is an event.",
            fix="Name the folder of an examination or a study.",
        )
    return events


def hold_file(file: BinaryIO) -> bool:
    """Lock an open file until it is closed or its process ends; return False where another one has locked it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(file.fileno(), _FAR, os.SEEK_SET)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
