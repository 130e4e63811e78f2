"""A TCP port for one sensor: whoever connects shows a token as its first line, and is then read like a pipe.

Every user and every program of a machine reaches its 127.0.0.1. What comes through this port changes a model that later
pushes a hand, so it is taken from the one program that was given the token, and from the first that shows it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import select
import socket
import time
from collections.abc import Callable, Iterator

from palpate.dataset.measured.live import Connection
from palpate.errors import DeviceError, PortInUseError, UsageError

__all__ = ["listening"]

_STRANGERS = 16  # connections whose first line is awaited; the oldest goes first
_FIRST_LINE = 5.0  # s that the first line may take


@contextlib.contextmanager
def listening(
    port: int, wait: float, announce: Callable[[int, str], None], *, token: bool = True
) -> Iterator[Connection]:
    """Wait for the first connection that shows the token, and yield it; a context manager.

    Parameters
    ----------
    port : int
        Port on 127.0.0.1; 0 takes any free one.
    wait : float
        Seconds until someone must have connected.
    announce : function of the port and the token
        Called once it listens; the token is "" where none is asked for.
    token : bool
        Whether a connection must begin with the token, a new one each time, as its first line. Without, the first
        connection of whichever user of this machine is taken.

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
    secret = secrets.token_urlsafe(18) if token else ""
    with socket.socket() as server:
        if os.name == "posix":  # elsewhere it would let two servers share a port
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _bind(server, port)
        taken = int(server.getsockname()[1])
        announce(taken, secret)
        other, refused = _Door(server, secret.encode(), time.monotonic() + wait).first()
    if other is None:
        raise DeviceError(
            f"Nobody connected to port {taken} within {wait:g} s{' and showed the token' if refused else ''}.",
            why=f"{refused} connection{'s' if refused > 1 else ''} began otherwise." if refused else "",
            fix="Start the sensor's script meanwhile, or wait longer."
            + (" Its first line must be the token that was printed here." if refused else ""),
        )
    connection = Connection(other)
    try:
        yield connection
    finally:
        connection.close()


class _Door:
    """Connections whose first line is read, byte by byte and side by side: none makes another one wait."""

    def __init__(self, server: socket.socket, secret: bytes, until: float) -> None:
        self._server, self._secret, self._until = server, secret, until
        self._lines: dict[socket.socket, tuple[bytes, float]] = {}  # as far as they came, and until when
        self._refused = 0

    def first(self) -> tuple[socket.socket | None, int]:
        """Return the first connection that shows the secret, or None; and the number of those that did not."""
        try:
            while (now := time.monotonic()) < self._until:
                for line, (_, limit) in list(self._lines.items()):
                    if now > limit:
                        self._refuse(line)
                patience = min([self._until, *(limit for _, limit in self._lines.values())]) - now
                readable, _, _ = select.select([self._server, *self._lines], [], [], max(0.0, patience))
                for line in readable:
                    other = self._accept() if line is self._server else self._read(line)
                    if other is not None:
                        other.settimeout(None)
                        return other, self._refused
            return None, self._refused
        finally:
            for line in self._lines:
                line.close()

    def _accept(self) -> socket.socket | None:
        other, _ = self._server.accept()
        if not self._secret:
            return other
        if len(self._lines) >= _STRANGERS:
            self._refuse(next(iter(self._lines)))
        other.setblocking(False)
        self._lines[other] = b"", time.monotonic() + _FIRST_LINE
        return None

    def _read(self, line: socket.socket) -> socket.socket | None:
        """Read no further than the end of the first line; return the connection if that is the secret."""
        if line not in self._lines:  # refused a moment ago, for a newcomer
            return None
        text, limit = self._lines[line]
        missing = len(self._secret) + 1 - len(text)
        try:
            more = line.recv(max(1, missing))
        except BlockingIOError:
            return None
        except OSError:
            more = b""
        text += more
        self._lines[line] = text, limit
        ended = b"\n" in text or not more
        if not ended and len(text) < len(self._secret) + 1 + text.endswith(b"\r"):
            return None
        if secrets.compare_digest(text.rstrip(b"\r\n"), self._secret) and ended and more:
            del self._lines[line]
            return line
        self._refuse(line)
        return None

    def _refuse(self, line: socket.socket) -> None:
        del self._lines[line]
        self._refused += 1
        with contextlib.suppress(OSError):
            line.send(b"error line 1: The token comes first.\n")
        line.close()


def _bind(server: socket.socket, port: int) -> None:
    try:
        server.bind(("127.0.0.1", port))
        server.listen(_STRANGERS)
    except OSError as error:
        if error.errno in {errno.EADDRINUSE, errno.EACCES}:
            raise PortInUseError(
                f"Port {port} is in use.", why=str(error), fix="Choose another one; 0 takes any that is free."
            ) from error
        raise
