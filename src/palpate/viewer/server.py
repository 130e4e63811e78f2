"""The viewer's server: one page, one websocket, one real-time process.

`Viewer` is a context manager that starts all three and stops them; `serve` keeps one open until interrupted.
The server runs in a thread with an event loop of its own, so both work in a script, in a notebook and on
standard input. What page and server say to each other stands in `messages`, who may talk at all in `guard`,
and credits and heartbeats in `session`.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import os
import sys
import tempfile
import webbrowser
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.routing import BaseRoute, Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles

from palpate.runtime import LoopProcess
from palpate.runtime.touchable import Learnt, load_touchable, touchable
from palpate.viewer.guard import Guard
from palpate.viewer.ports import listen
from palpate.viewer.pressing import PressedExhibit
from palpate.viewer.pressing_routes import pressing_routes
from palpate.viewer.running import STATIC, Running, address, termination_interrupts
from palpate.viewer.session import Session

__all__ = ["Viewer", "application", "serve"]


def application(session: Session) -> Starlette:
    """The web application of a session: the built page, and its websocket at ``/touch``."""
    more: list[BaseRoute] = []
    if isinstance(session.exhibit, PressedExhibit):
        more = pressing_routes(session.exhibit)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        watcher = asyncio.create_task(session.watch())
        yield
        watcher.cancel()
        await asyncio.gather(watcher, return_exceptions=True)

    return Starlette(
        routes=[
            WebSocketRoute("/touch", session.talk),
            *more,
            Mount("/", StaticFiles(directory=STATIC, html=True)),
        ],
        middleware=[Middleware(Guard)],
        lifespan=lifespan,
    )


class Viewer:
    """A body to look at and touch, at `url`, while the context lasts.

    Parameters
    ----------
    model : learnt body or path
    port : int
        The port wanted; 0 takes any free one.
    host : str
        ``127.0.0.1``, ``localhost`` or ``::1``: the viewer serves this machine only.
    device : str
        The real-time process's device: ``page`` is the page's own hand.
    rate : float
        Of the real-time process, Hz.
    max_force : float, optional
        Force limit, N; the device's own by default.
    strict_port : bool
        Whether a busy port is an error; otherwise the next free one is taken.

    Attributes
    ----------
    model : Touchable
    loop : LoopProcess
        The real-time process, once started.
    port : int
        The port taken, once started.

    Raises
    ------
    FileFormatError
        If the file holds nothing that can be touched.
    """

    def __init__(
        self,
        model: Learnt | str | os.PathLike[str],
        *,
        port: int = 8080,
        host: str = "127.0.0.1",
        device: str = "page",
        rate: float = 1000.0,
        max_force: float | None = None,
        strict_port: bool = False,
    ) -> None:
        self._source = model
        if isinstance(model, str | os.PathLike):
            self.model = load_touchable(model)
        else:
            self.model = touchable(model)
        self.host, self.port = host, port
        self._wanted = (port, host, strict_port)
        self._loop = functools.partial(LoopProcess, device=device, rate=rate, max_force=max_force)
        self._closing = contextlib.ExitStack()

    @property
    def url(self) -> str:
        """The page's address."""
        return address(self.host, self.port)

    def start(self) -> Self:
        """Start the real-time process and the server; the page can be opened when this returns.

        Raises
        ------
        PortInUseError
            If no port is free, or the one wanted isn't and `strict_port` is set.
        UsageError
            If the host, the port or the device can't be.
        DeviceError
            If the real-time process or the server doesn't start.
        """
        try:
            port, host, strict = self._wanted
            socket = self._closing.enter_context(listen(port, host, strict=strict))
            self.port = int(socket.getsockname()[1])
            path = self._written()
            self.loop = self._closing.enter_context(self._loop(path))
            page = application(Session(self.model, self.loop))
            self._running = self._closing.enter_context(Running(page, socket))
        except BaseException:
            self.stop()
            raise
        return self

    def stop(self) -> None:
        """End the server and the real-time process. Harmless when repeated."""
        self._closing.close()

    def wait(self) -> None:
        """Return when the server has ended."""
        self._running.wait()

    def _written(self) -> str | os.PathLike[str]:
        """A file of the model, which the real-time process can read."""
        if isinstance(self._source, str | os.PathLike):
            return self._source
        folder = self._closing.enter_context(tempfile.TemporaryDirectory(prefix="palpate-"))
        return self._source.save(Path(folder) / "model.palpate")

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def serve(
    model: Learnt | str | os.PathLike[str],
    *,
    port: int = 8080,
    host: str = "127.0.0.1",
    device: str = "page",
    rate: float = 1000.0,
    max_force: float | None = None,
    strict_port: bool = False,
    open_browser: bool = False,
    on_ready: Callable[[Viewer], object] | None = None,
) -> None:
    """Show a body in the browser until interrupted (Ctrl-C) or terminated.

    Parameters
    ----------
    open_browser : bool
        Whether to open the page in the user's browser.
    on_ready : callable, optional
        Called once with the running `Viewer`; by default its address is written to stderr, because a script
        that waits here must say where to look.

    The other parameters and the errors are those of `Viewer`.
    """
    viewer = Viewer(
        model, port=port, host=host, device=device, rate=rate, max_force=max_force, strict_port=strict_port
    )
    with termination_interrupts(), contextlib.suppress(KeyboardInterrupt), viewer:
        (on_ready or _announce)(viewer)
        if open_browser:
            webbrowser.open(viewer.url)
        viewer.wait()


def _announce(viewer: Viewer) -> None:
    how = "Press it" if not viewer.model.holds else "Pull the tip"
    sys.stderr.write(f"{viewer.url} shows {viewer.model.name}. {how}; Ctrl-C ends it.\n")
    sys.stderr.flush()
