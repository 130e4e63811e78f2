"""A free port on this machine."""

from __future__ import annotations

import errno
import os
import socket

from palpate.errors import PortInUseError, UsageError

__all__ = ["LOOPBACK", "TRIES", "free_port", "listen"]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
TRIES = 50  # a machine with that many servers side by side wants to be told


def listen(port: int, host: str = "127.0.0.1", *, strict: bool = False) -> socket.socket:
    """A socket that listens on this machine only.

    Parameters
    ----------
    port : int
        The port wanted; 0 takes any free one.
    host : str
        One of `LOOPBACK`.
    strict : bool
        Whether a busy port is an error; otherwise the next free one of `TRIES` is taken.

    Raises
    ------
    PortInUseError
        If no port of those tried is free.
    UsageError
        If the host or port is not one that a server of this machine may have.
    """
    if host not in LOOPBACK:
        raise UsageError(
            f"The viewer doesn't listen on {host!r}.",
            why="Whoever reaches the page can pull on the body; it is served to this machine alone.",
            fix=f"Leave host at 127.0.0.1 and forward the port: ssh -L {port}:127.0.0.1:{port} …",
        )
    if not 0 <= port <= 65535:
        raise UsageError(f"There is no port {port}.", fix="Choose one from 1024 to 65535, or 0 for any.")
    last = port if strict or port == 0 else min(port + TRIES - 1, 65535)
    for candidate in range(port, last + 1):
        if server := _try(host, candidate):
            return server
    raise PortInUseError(
        f"Port {port} is in use." if last == port else f"Ports {port} to {last} are in use.",
        why="Another server listens there.",
        fix="End it, or choose another port with --port; 0 takes any free one.",
    )


def free_port(preferred: int, host: str = "127.0.0.1", *, strict: bool = False) -> int:
    """The port that `listen` would take now."""
    with listen(preferred, host, strict=strict) as server:
        return int(server.getsockname()[1])


def _try(host: str, port: int) -> socket.socket | None:
    server = socket.socket(socket.AF_INET6 if host == "::1" else socket.AF_INET)
    if os.name == "posix":  # elsewhere it would let two servers share a port
        server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        server.bind((host, port))
        server.listen(64)
    except OSError as error:
        server.close()
        if error.errno in {errno.EADDRINUSE, errno.EACCES}:
            return None
        raise
    return server
