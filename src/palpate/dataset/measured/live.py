"""Measurements from a live sensor: lines of text from a pipe or from a TCP connection (`sensor_port`).

The protocol has one measurement a line::

    palpate 1 length=mm force=N time=s                 first: units, always named
    # anything after a hash is skipped
    0.010 50.0 50.0 59.5 0.001 -0.002 0.013            t x y z Fx Fy Fz
    end                                                or close the stream

``columns=x,y,z,fz`` in the greeting says that other columns come, as `columns` knows them (no pressed depths). The
greeting is answered by ``ok`` and the columns. A line that can't be taken is answered by ``error line N: …`` and
skipped; before a greeting that is every line. Good lines are not answered.

Lines are read in a thread of their own, so that silence can be noticed wherever they come from; a silent or broken
stream ends. A line that is too long is cut at its limit and the rest of it dropped: what is left of it is malformed,
and answered as such. A last line without its end is dropped.
"""

from __future__ import annotations

import contextlib
import queue
import select
import socket
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import BinaryIO

from palpate.dataset.measured.measured_columns import Columns, Measurements
from palpate.errors import UsageError

__all__ = ["VERSION", "Connection", "greeting", "lines_of", "measurements"]

VERSION = "1"
_DEFAULT = "t,x,y,z,fx,fy,fz"
_LENGTHS, _FORCES = ("x", "y", "z"), ("fx", "fy", "fz")
_EXAMPLE = f"palpate {VERSION} length=mm force=N time=s"

_LONGEST = 1000  # bytes of a line, at most
_WAITING = 10_000  # lines read and not yet taken; the sender then waits
_ANSWERS = 1.0  # s that an answer may take; who does not read them gets none any more


def lines_of(stream: BinaryIO, stall: float, log: Callable[[str], None] = lambda why: None) -> Iterator[str]:
    """Yield lines of a stream of bytes until it ends, breaks, or is silent.

    Parameters
    ----------
    stream : binary file
        Source of the lines, in UTF-8.
    stall : float
        Seconds of silence that end the stream.
    log : function of a text
        Called with the reason where the stream did not end by itself.
    """
    read: queue.Queue[bytes | str] = queue.Queue(_WAITING)  # lines as bytes, at last the reason of the end
    threading.Thread(target=_read, args=(stream, read), daemon=True, name="lines").start()
    while True:
        try:
            line = read.get(timeout=stall)
        except queue.Empty:
            log(f"nothing came for {stall:g} s")
            return
        if isinstance(line, str):
            if line:
                log(line)
            return
        yield line.decode("utf-8", errors="replace").rstrip("\r\n")


def _read(stream: BinaryIO, read: queue.Queue[bytes | str]) -> None:
    """Put lines as bytes, and at last the reason why there are no more, "" where all came."""
    inside_long_line, why = False, ""
    try:
        while line := stream.readline(_LONGEST):
            ended = line.endswith(b"\n")
            if not ended and len(line) < _LONGEST:
                why = "the last line was cut off"  # what stands there may be half a number
                break
            if not inside_long_line:
                read.put(line)
            inside_long_line = not ended
    except (OSError, ValueError):  # closed from the other side, or from this one
        why = "the connection broke"
    read.put(why)


class Connection:
    """A TCP connection to a sensor: its lines, and answers to them."""

    def __init__(self, other: socket.socket) -> None:
        self._socket, self._file = other, other.makefile("rb")
        self._deaf = False

    def lines(self, stall: float, log: Callable[[str], None] = lambda why: None) -> Iterator[str]:
        """Yield its lines as `lines_of` does."""
        return lines_of(self._file, stall, log)

    def answer(self, text: str) -> None:
        """Send one line; a sender that does not read is not waited for twice."""
        if self._deaf:
            return
        try:
            # a time limit of the socket would hold for the reading thread too
            self._deaf = not select.select([], [self._socket], [], _ANSWERS)[1]
            if not self._deaf:
                self._socket.sendall(text.encode() + b"\n")
        except (OSError, ValueError):
            self._deaf = True

    def close(self) -> None:
        """End both directions; the thread that reads ends with them."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


def measurements(lines: Iterable[str], answer: Callable[[str], None]) -> Iterator[Measurements]:
    """Yield one measurement for each good line, until the lines end or say so.

    Parameters
    ----------
    lines : iterable of str
        Lines of the protocol above.
    answer : function of a text
        Takes the answers to the sender.
    """
    columns: Columns | None = None
    refused_data = False
    for i, line in enumerate(lines, 1):
        text = line.split("#", 1)[0]
        cells = (text.replace(",", " ") if columns else text).split()
        if not cells:
            continue
        if cells == ["end"]:
            return
        try:
            if columns is None:
                columns = greeting(cells)
                answer(f"ok {' '.join(columns.names)}")
                continue
            row = columns.values(cells)
        except UsageError as error:
            if columns is None and cells[0] != "palpate":  # of data without a greeting one line tells enough
                if refused_data:
                    continue
                refused_data = True
            answer(f"error line {i}: {error.what} {error.fix}".rstrip())
            continue
        yield Measurements.of([row])


def greeting(words: list[str]) -> Columns:
    """Read the columns that a greeting announces, and refuse one of another version or without a unit."""
    if words[:2] != ["palpate", VERSION]:
        raise UsageError("Units come first.", fix=f"Begin with: {_EXAMPLE}")
    pairs = [word.partition("=")[::2] for word in words[2:]]
    settings = dict(pairs)
    if len(settings) != len(pairs) or not settings.keys() <= {"length", "force", "time", "columns"}:
        raise UsageError(
            "A greeting names length, force, time and columns, once.", fix=f"Such as: {_EXAMPLE}"
        )
    names = settings.get("columns", _DEFAULT).split(",")
    if "depth" in names:
        raise UsageError("Pressed depths come in files only.", fix="Send positions: x, y, z.")
    units = {n: settings.get("length", "") for n in _LENGTHS} | {
        n: settings.get("force", "") for n in _FORCES
    }
    return Columns.of(names, units | {"t": settings.get("time", "")})
