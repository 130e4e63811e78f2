"""Lines from a pipe or from one TCP connection of this machine; a silent or broken stream ends.

Lines are read in a thread of their own, so that silence can be noticed wherever they come from. A line that is too
long is cut at its limit and the rest of it dropped: what is left of it is malformed, and answered as such. A last line
without its end is dropped.
"""

from __future__ import annotations

import contextlib
import errno
import os
import queue
import select
import socket
import threading
from collections.abc import Callable, Iterator
from typing import BinaryIO

from palpate.errors import DeviceError, PortInUseError, UsageError

__all__ = ["Connection", "lines_of", "listening"]

LONGEST = 1000  # bytes of a line
_WAITING = 10_000  # lines read and not yet taken; the sender then waits
_ANSWERS = 1.0  # s that an answer may take; who does not read them gets none any more


def lines_of(stream: BinaryIO, stall: float, say: Callable[[str], None] = lambda why: None) -> Iterator[str]:
    """Lines of a stream of bytes until it ends, breaks, or says nothing for `stall` seconds.

    `say` is told why, where it did not end by itself.
    """
    found: queue.Queue[bytes | str] = queue.Queue(_WAITING)
    threading.Thread(target=_read, args=(stream, found), daemon=True, name="lines").start()
    while True:
        try:
            line = found.get(timeout=stall)
        except queue.Empty:
            say(f"nothing came for {stall:g} s")
            return
        if isinstance(line, str):
            if line:
                say(line)
            return
        yield line.decode("utf-8", errors="replace").rstrip("\r\n")


def _read(stream: BinaryIO, found: queue.Queue[bytes | str]) -> None:
    """Put lines as bytes, and at last why there are no more, "" where all came."""
    inside, why = False, ""  # inside a line that was too long
    try:
        while line := stream.readline(LONGEST):
            ended = line.endswith(b"\n")
            if not ended and len(line) < LONGEST:
                why = "the last line was cut off"  # what stands there may be half a number
                break
            if not inside:
                found.put(line)
            inside = not ended
    except (OSError, ValueError):  # closed from the other side, or from this one
        why = "the connection broke"
    found.put(why)


class Connection:
    """One connection: its lines, and answers to them."""

    def __init__(self, other: socket.socket) -> None:
        self._socket, self._file = other, other.makefile("rb")
        self._deaf = False

    def lines(self, stall: float, say: Callable[[str], None] = lambda why: None) -> Iterator[str]:
        """As `lines_of`."""
        return lines_of(self._file, stall, say)

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


@contextlib.contextmanager
def listening(port: int, wait: float, say: Callable[[int], None]) -> Iterator[Connection]:
    """The first connection to a port of this machine (127.0.0.1 only; 0 takes any free one).

    Parameters
    ----------
    port : int
    wait : float
        Seconds until someone must have connected.
    say : function of the port
        Called once it listens.

    Raises
    ------
    PortInUseError
        If another program listens there.
    DeviceError
        If nobody connects in time.
    UsageError
        If there is no such port.
    """
    if not 0 <= port <= 65535:
        raise UsageError(f"There is no port {port}.", fix="Choose one from 1024 to 65535, or 0 for any.")
    with socket.socket() as server:
        if os.name == "posix":  # elsewhere it would let two servers share a port
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _bind(server, port)
        server.settimeout(wait)
        say(int(server.getsockname()[1]))
        try:
            other, _ = server.accept()
        except TimeoutError:
            raise DeviceError(
                f"Nobody connected to port {server.getsockname()[1]} within {wait:g} s.",
                fix="Start the sensor's script meanwhile, or wait longer.",
            ) from None
    other.settimeout(None)
    connection = Connection(other)
    try:
        yield connection
    finally:
        connection.close()


def _bind(server: socket.socket, port: int) -> None:
    try:
        server.bind(("127.0.0.1", port))
        server.listen(1)
    except OSError as error:
        if error.errno in {errno.EADDRINUSE, errno.EACCES}:
            raise PortInUseError(
                f"Port {port} is in use.", why=str(error), fix="Choose another one; 0 takes any that is free."
            ) from error
        raise
