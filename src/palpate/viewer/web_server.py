"""A web server for this machine alone: a free port, a thread of its own, and the page's address in the browser.

Who may talk to it stands in `guard`, how its pages share it in `traffic`.
"""

from __future__ import annotations

import atexit
import contextlib
import errno
import functools
import html
import os
import signal
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self, TypedDict, TypeVar, cast

import uvicorn
from starlette.applications import Starlette
from starlette.routing import BaseRoute, Mount
from starlette.staticfiles import StaticFiles

from palpate.errors import DeviceError, PortInUseError, UsageError
from palpate.processes import note_interrupt
from palpate.viewer.guard import LOOPBACK, Guard, Token
from palpate.viewer.traffic import PatientHttp, PatientWebSocket, Waiting

__all__ = [
    "STATIC",
    "TRIES",
    "LocalServer",
    "ServerOptions",
    "free_port",
    "in_notebook",
    "listen",
    "local_application",
    "skeleton",
    "wait_until_interrupted",
    "way_in",
]

TRIES = 50  # ports tried: a machine with that many servers side by side should hear of it
READ = 4096  # bytes that the system keeps of what a page sends and is not read yet; it may double them


def listen(port: int, host: str = "127.0.0.1", *, strict: bool = False) -> socket.socket:
    """Open a socket that listens on this machine only, at a host of `LOOPBACK`; port 0 takes any free one.

    A busy port is an error if `strict`; otherwise the next free one of `TRIES` is taken.
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
    # a connection inherits it: of a flood, little is parsed at once
    server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, READ)
    try:
        server.bind((host, port))
        server.listen(BACKLOG)
    except OSError as error:
        server.close()
        if error.errno in {errno.EADDRINUSE, errno.EACCES}:
            return None
        raise
    return server


STATIC = Path(__file__).parent / "static"
LARGEST_MESSAGE = 4096  # bytes from a page; a Hand with eight parameters has 79
START = 10.0  # s until the server must listen
_LOOK = 0.2  # s between two looks whether it has ended
BACKLOG = 32  # connections that are taken at once, between two looks at what pages sent


def skeleton(mode: str) -> str:
    """Return the document of all pages for one of them: touch, shown, part, answers or exam."""
    return (STATIC / "index.html").read_text("utf-8").replace('data-mode="touch"', f'data-mode="{mode}"')


def local_application(routes: Sequence[BaseRoute], **options: Any) -> Starlette:
    """Return a web application of these routes, which come before the files of the built pages."""
    files = Mount("/", StaticFiles(directory=STATIC, html=True))
    return Starlette(routes=[*routes, files], **options)


class ServerOptions(TypedDict, total=False):
    """Where a page is served."""

    port: int  # the port wanted; 0 takes any free one
    host: str  # 127.0.0.1, localhost or ::1: pages are served to this machine only
    strict_port: bool  # whether a busy port is an error; otherwise the next free one is taken
    token: bool  # whether the page opens only with the token that stands in `url`


class LocalServer(ABC):
    """A page at `url` while the context lasts; the base of what serves one, at `port` once started."""

    def __init__(
        self, port: int = 8080, host: str = "127.0.0.1", *, strict_port: bool = False, token: bool = True
    ) -> None:
        self.host, self.port = host, port
        self._token = Token() if token else None
        self._wanted = (port, host, strict_port)
        self._closing = contextlib.ExitStack()
        self._thread: threading.Thread | None = None
        self._ended = threading.Event()

    @property
    def address(self) -> str:
        """The server's address, without the token: ``http://127.0.0.1:8080/``."""
        return f"http://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}/"

    @property
    def url(self) -> str:
        """The page's address, with the token that opens it."""
        return self.address if self._token is None else f"{self.address}?token={self._token.secret}"

    @property
    def cookies(self) -> dict[str, str]:
        """The cookie that a browser shows after it has opened `url`, for programs in the page's place."""
        return {} if self._token is None else {self._token.name: self._token.secret}

    @property
    @abstractmethod
    def caption(self) -> str:
        """The name of what the page shows, and what a person does there, before "Ctrl-C ends it."."""

    @abstractmethod
    def _application(self) -> Starlette:
        """Return the web application; what it needs until the end enters `_closing`."""

    def start(self) -> Self:
        """Start the server and all that it needs; the page can be opened when this returns. Harmless when repeated."""
        if self._thread is not None:
            return self
        try:
            port, host, strict = self._wanted
            listener = self._closing.enter_context(listen(port, host, strict=strict))
            self.port = int(listener.getsockname()[1])
            if self._token is not None:
                self._token.name = f"palpate-{self.port}"
            self._serve(self._application(), listener)
        except BaseException:
            self.stop()
            raise
        return self

    def _serve(self, application: Starlette, listener: socket.socket) -> None:
        """Run the application in a thread of its own; return once it listens."""
        http = functools.partial(PatientHttp, waiting=Waiting())
        server = uvicorn.Server(
            uvicorn.Config(
                Guard(application, self._token),
                log_config=None,  # the program that embeds us decides on logging
                access_log=False,
                backlog=BACKLOG,
                http=cast(type[PatientHttp], http),
                ws=PatientWebSocket,
                ws_max_size=LARGEST_MESSAGE,
                ws_per_message_deflate=False,  # frames are small, and packing them would cost more than sending
                timeout_graceful_shutdown=1,
                server_header=False,
            )
        )
        self._ended.clear()

        def run() -> None:
            try:
                server.run([listener])
            finally:
                self._ended.set()

        thread = threading.Thread(target=run, name="palpate viewer", daemon=True)
        thread.start()
        self._thread = thread
        self._closing.callback(thread.join)
        self._closing.callback(setattr, server, "should_exit", True)
        until = time.monotonic() + START
        while not server.started:
            if not thread.is_alive() or time.monotonic() > until:
                raise DeviceError(
                    "The viewer's server did not start.",
                    why="Its thread ended or hangs; the log of 'uvicorn.error' says more.",
                    fix="Try another port, or see `palpate doctor`.",
                )
            time.sleep(0.01)

    def stop(self) -> None:
        """End the server and what it started. Harmless when repeated."""
        self._closing.close()
        self._thread = None

    def wait(self) -> None:
        """Return when the server has ended."""
        # in looks. Not by `join`: where Ctrl-C interrupts it, Python takes the thread for ended, and the listener would
        # be closed under it. Not by the event's own `wait`: interrupted, it may keep its lock, and the thread that sets
        # the event would wait for that without an end
        while not self._ended.is_set():
            time.sleep(_LOOK)

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()


ServerT = TypeVar("ServerT", bound=LocalServer)


def wait_until_interrupted(
    server: ServerT, *, open_browser: bool, on_ready: Callable[[ServerT], object] | None
) -> None:
    """Start a server and keep it until Ctrl-C or SIGTERM; in a notebook, leave it running and return at once.

    `on_ready` is called once with the running server; by default its address is written to stderr, because a script
    that waits here must say where to look.
    """
    if in_notebook():
        server.start()
        atexit.register(server.stop)
        _announce(server, on_ready, "Its stop() ends it.")
        return
    with _termination_interrupts(), contextlib.suppress(KeyboardInterrupt), server:
        _announce(server, on_ready, "Ctrl-C ends it.")
        with way_in(server) if open_browser else contextlib.nullcontext(server.url) as way:
            if open_browser:
                webbrowser.open(way)
            server.wait()


def _announce(server: ServerT, on_ready: Callable[[ServerT], object] | None, end: str) -> None:
    """Say where the page is and how it ends, or call the function that does."""
    if on_ready is not None:
        on_ready(server)
        return
    sys.stderr.write(f"{server.url} shows {server.caption} {end}\n")
    if not server.cookies:
        sys.stderr.write(
            "Warning: this page asks for no token; every user and program of this machine can open it.\n"
        )
    sys.stderr.flush()


def in_notebook() -> bool:
    """Return whether this is a notebook, whose cells must come back: an interactive Python with a kernel."""
    ask = getattr(sys.modules.get("IPython"), "get_ipython", None)
    return hasattr(ask() if ask else None, "kernel")


@contextlib.contextmanager
def way_in(server: LocalServer) -> Iterator[str]:
    """Yield the address of a file that leads to the page and that only this user can read.

    A browser is started with its address on a command line, which every user of the machine can see, the token in it
    too.
    """
    # browsers that come as a snap see neither the temporary folder nor hidden ones
    home = Path.home() if Path("/snap/bin").is_dir() else None
    with tempfile.TemporaryDirectory(prefix="palpate-", dir=home) as folder:
        file = Path(folder) / "open.html"
        target = html.escape(server.url, quote=True)
        file.write_text(
            '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
            f'<meta http-equiv="refresh" content="0; url={target}"><title>palpate</title>',
            encoding="utf-8",
        )
        yield file.as_uri()


@contextlib.contextmanager
def _termination_interrupts() -> Iterator[None]:
    """SIGTERM ends like Ctrl-C: in good order, with the real-time process stopped and its memory freed."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set signal handlers
        return
    before = signal.signal(signal.SIGTERM, note_interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
