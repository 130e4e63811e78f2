"""A page on which a solved body is looked at: turned, coloured, stepped through."""

from __future__ import annotations

import contextlib
import sys
import webbrowser
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from palpate.viewer.bodies import ShownBody, body_of
from palpate.viewer.guard import Guard
from palpate.viewer.ports import listen
from palpate.viewer.running import STATIC, Running, address, termination_interrupts

__all__ = ["BodyViewer", "body_application", "show"]

BINARY = "application/octet-stream"


def body_application(body: ShownBody) -> Starlette:
    """The web application of a body: the built page, ``/shown``, ``/surface`` and ``/steps/N``."""
    parts = body.split()
    shown, surface = body.shown(parts).to_json(), body.surface(parts).pack()

    async def page(_: Request) -> Response:
        return FileResponse(STATIC / "body.html")

    async def what(_: Request) -> Response:
        return Response(shown, media_type="application/json")

    async def skin(_: Request) -> Response:
        return Response(surface, media_type=BINARY)

    async def step(request: Request) -> Response:
        index = request.path_params["index"]
        if index >= len(body.steps):
            raise HTTPException(404)
        return Response(body.step(index, parts).pack(), media_type=BINARY)

    return Starlette(
        routes=[
            Route("/", page),
            Route("/shown", what),
            Route("/surface", skin),
            Route("/steps/{index:int}", step),
            Mount("/", StaticFiles(directory=STATIC, html=True)),
        ],
        middleware=[Middleware(Guard)],
    )


class BodyViewer:
    """A solved body to look at, at `url`, while the context lasts.

    Parameters
    ----------
    source : solution, sequence of solutions, Dataset, or path of a .vtu, .pvd or .zarr
    name : str
        Title of the page.
    port : int
        The port wanted; 0 takes any free one.
    host : str
        ``127.0.0.1``, ``localhost`` or ``::1``: the viewer serves this machine only.
    strict_port : bool
        Whether a busy port is an error; otherwise the next free one is taken.

    Attributes
    ----------
    body : ShownBody
    port : int
        The port taken, once started.

    Raises
    ------
    UsageError
        If there is nothing to show.
    FileFormatError
        If the file can't be read.
    """

    def __init__(
        self,
        source: Any,
        *,
        name: str = "",
        port: int = 8080,
        host: str = "127.0.0.1",
        strict_port: bool = False,
    ) -> None:
        self.body = body_of(source, name)
        self.host, self.port = host, port
        self._wanted = (port, host, strict_port)
        self._closing = contextlib.ExitStack()

    @property
    def url(self) -> str:
        """The page's address."""
        return address(self.host, self.port)

    def start(self) -> Self:
        """Start the server; the page can be opened when this returns.

        Raises
        ------
        PortInUseError
            If no port is free, or the one wanted isn't and `strict_port` is set.
        UsageError
            If the host or the port can't be.
        DeviceError
            If the server doesn't start.
        """
        port, host, strict = self._wanted
        try:
            socket = self._closing.enter_context(listen(port, host, strict=strict))
            self.port = int(socket.getsockname()[1])
            self._running = self._closing.enter_context(Running(body_application(self.body), socket))
        except BaseException:
            self.stop()
            raise
        return self

    def stop(self) -> None:
        """End the server. Harmless when repeated."""
        self._closing.close()

    def wait(self) -> None:
        """Return when the server has ended."""
        self._running.wait()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def show(
    source: Any,
    *,
    name: str = "",
    port: int = 8080,
    host: str = "127.0.0.1",
    strict_port: bool = False,
    open_browser: bool = False,
    on_ready: Callable[[BodyViewer], object] | None = None,
) -> None:
    """Show solved bodies in the browser until interrupted (Ctrl-C) or terminated.

    Parameters
    ----------
    open_browser : bool
        Whether to open the page in the user's browser.
    on_ready : callable, optional
        Called once with the running `BodyViewer`; by default its address is written to stderr, because a script
        that waits here must say where to look.

    The other parameters and the errors are those of `BodyViewer`, which does the same without waiting.
    """
    viewer = BodyViewer(source, name=name, port=port, host=host, strict_port=strict_port)
    with termination_interrupts(), contextlib.suppress(KeyboardInterrupt), viewer:
        (on_ready or _announce)(viewer)
        if open_browser:
            webbrowser.open(viewer.url)
        viewer.wait()


def _announce(viewer: BodyViewer) -> None:
    sys.stderr.write(f"{viewer.url} shows {viewer.body.name}. Ctrl-C ends it.\n")
    sys.stderr.flush()
