"""A web server for this machine alone: a free port, who may talk to it, and a thread of its own.

A server on 127.0.0.1 is still within reach of every web page that the user's browser has open. Two checks keep those
out: the *Host* header must name this machine (a foreign name that was made to resolve to 127.0.0.1 is DNS rebinding),
and a websocket's *Origin* must be the page that this server served. Both answer 403. The content security policy keeps
the page itself from fetching or running anything from elsewhere.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import signal
import socket
import sys
import threading
import time
import webbrowser
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware import Middleware
from starlette.responses import PlainTextResponse
from starlette.routing import BaseRoute, Mount
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from palpate.errors import DeviceError, PortInUseError, UsageError

__all__ = [
    "LOOPBACK",
    "STATIC",
    "TRIES",
    "Guard",
    "LocalServer",
    "free_port",
    "listen",
    "local_application",
    "refusal",
    "wait_until_interrupted",
]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
TRIES = 50  # a machine with that many servers side by side wants to be told


def listen(port: int, host: str = "127.0.0.1", *, strict: bool = False) -> socket.socket:
    """Open a socket that listens on this machine only.

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
    """Return the port that `listen` would take now."""
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


logger = logging.getLogger("palpate.viewer")

HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cache-control": "no-cache",  # a page of yesterday's version would speak yesterday's protocol
}


def refusal(kind: str, headers: Headers) -> str:
    """Return why a request is refused, or "" where it is not.

    Parameters
    ----------
    kind : str
        ``"http"`` or ``"websocket"``.
    headers : Headers
        Of the request.
    """
    hosts = headers.getlist("host")
    if len(hosts) != 1 or _hostname(hosts[0]) not in LOOPBACK:
        return f"the host {', '.join(hosts) or 'not given'} is not this machine"
    origins = headers.getlist("origin")
    # a program can say what it likes, so a missing Origin gains it nothing; a browser always sends one
    if kind == "websocket" and origins != [f"http://{hosts[0]}"]:
        return f"the origin {', '.join(origins) or 'not given'} is not the viewer's own page"
    return ""


def _hostname(host: str) -> str:
    """``localhost`` of ``localhost:8080``, ``::1`` of ``[::1]:8080``."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0].lower()


class Guard:
    """ASGI middleware: refuses strangers with 403 and puts `HEADERS` on every answer."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one connection."""
        kind = scope["type"]
        if kind not in {"http", "websocket"}:
            await self.app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        if reason := refusal(kind, Headers(scope=scope)):
            logger.warning("refused: %s", reason)
            await _refuse(kind, reason, scope, receive, with_headers)
        else:
            await self.app(scope, receive, with_headers)


async def _refuse(kind: str, reason: str, scope: Scope, receive: Receive, send: Send) -> None:
    if kind == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})  # before accepting: 403
    else:
        await PlainTextResponse(f"Refused: {reason}.\n", 403)(scope, receive, send)


STATIC = Path(__file__).parent / "static"
LARGEST_MESSAGE = 4096  # bytes from a page; a Hand with eight parameters has 79
START = 10.0  # s until the server must listen


def local_application(routes: Sequence[BaseRoute], **options: Any) -> Starlette:
    """Return a web application of these routes and the built pages, behind the `Guard`.

    Parameters
    ----------
    routes : sequence of routes
        They come before the files of the built pages.
    **options
        Of `Starlette`.
    """
    files = Mount("/", StaticFiles(directory=STATIC, html=True))
    return Starlette(routes=[*routes, files], middleware=[Middleware(Guard)], **options)


class LocalServer(ABC):
    """A page at `url` while the context lasts; the base of what serves one.

    Parameters
    ----------
    port : int
        The port wanted; 0 takes any free one.
    host : str
        ``127.0.0.1``, ``localhost`` or ``::1``: it serves this machine only.
    strict_port : bool
        Whether a busy port is an error; otherwise the next free one is taken.

    Attributes
    ----------
    port : int
        The port taken, once started.
    """

    def __init__(self, port: int, host: str, *, strict_port: bool) -> None:
        self.host, self.port = host, port
        self._wanted = (port, host, strict_port)
        self._closing = contextlib.ExitStack()

    @property
    def url(self) -> str:
        """The page's address."""
        return f"http://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}/"

    @property
    @abstractmethod
    def caption(self) -> str:
        """The name of what the page shows, and what a person does there, before "Ctrl-C ends it."."""

    @abstractmethod
    def _application(self) -> Starlette:
        """Return the web application; what it needs until the end enters `_closing`."""

    def start(self) -> Self:
        """Start the server and all that it needs; the page can be opened when this returns.

        Raises
        ------
        PortInUseError
            If no port is free, or the one wanted isn't and `strict_port` is set.
        UsageError
            If the host, the port or a device can't be.
        DeviceError
            If the server, or the real-time process behind it, doesn't start.
        """
        try:
            port, host, strict = self._wanted
            listener = self._closing.enter_context(listen(port, host, strict=strict))
            self.port = int(listener.getsockname()[1])
            self._serve(self._application(), listener)
        except BaseException:
            self.stop()
            raise
        return self

    def _serve(self, application: Starlette, listener: socket.socket) -> None:
        """Run the application in a thread of its own; return once it listens."""
        server = uvicorn.Server(
            uvicorn.Config(
                application,
                log_config=None,  # the program that embeds us decides on logging
                access_log=False,
                ws="websockets-sansio",
                ws_max_size=LARGEST_MESSAGE,
                ws_per_message_deflate=False,  # frames are small, and packing them would cost more than sending
                timeout_graceful_shutdown=1,
                server_header=False,
            )
        )
        self._thread = threading.Thread(
            target=server.run, args=([listener],), name="palpate viewer", daemon=True
        )
        self._thread.start()
        self._closing.callback(self._thread.join)
        self._closing.callback(setattr, server, "should_exit", True)
        until = time.monotonic() + START
        while not server.started:
            if not self._thread.is_alive() or time.monotonic() > until:
                raise DeviceError(
                    "The viewer's server did not start.",
                    why="Its thread ended or hangs; the log of 'uvicorn.error' says more.",
                    fix="Try another port, or see `palpate doctor`.",
                )
            time.sleep(0.01)

    def stop(self) -> None:
        """End the server and what it started. Harmless when repeated."""
        self._closing.close()

    def wait(self) -> None:
        """Return when the server has ended."""
        while self._thread.is_alive():
            self._thread.join(0.5)  # in steps: a join without end can't be interrupted on every system

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


ServerT = TypeVar("ServerT", bound=LocalServer)


def wait_until_interrupted(
    server: ServerT, *, open_browser: bool, on_ready: Callable[[ServerT], object] | None
) -> None:
    """Start a server and keep it until Ctrl-C or SIGTERM.

    Parameters
    ----------
    server : LocalServer
        Not started yet.
    open_browser : bool
        Whether to open the page in the user's browser.
    on_ready : callable, optional
        Called once with the running server; by default its address is written to stderr, because a script that waits
        here must say where to look.
    """
    with _termination_interrupts(), contextlib.suppress(KeyboardInterrupt), server:
        if on_ready is None:
            sys.stderr.write(f"{server.url} shows {server.caption} Ctrl-C ends it.\n")
            sys.stderr.flush()
        else:
            on_ready(server)
        if open_browser:
            webbrowser.open(server.url)
        server.wait()


@contextlib.contextmanager
def _termination_interrupts() -> Iterator[None]:
    """SIGTERM ends like Ctrl-C: in good order, with the real-time process stopped and its memory freed."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set signal handlers
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
