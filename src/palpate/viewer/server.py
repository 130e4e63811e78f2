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
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path
from typing import Unpack

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from palpate.devices import hand_kind
from palpate.devices.hand_kind import HandKind
from palpate.files import TemporaryFolder
from palpate.runtime import LoopProcess
from palpate.runtime.touchable import load_touchable, touchable
from palpate.surrogates import Surrogate
from palpate.viewer.compression import BinaryAnswers
from palpate.viewer.page_model import PageModel
from palpate.viewer.session import Session
from palpate.viewer.web_server import LocalServer, ServerOptions, local_application, wait_until_interrupted
from palpate.viewer.wire import Binary

__all__ = ["Viewer", "ViewerOptions", "application", "body_routes", "serve"]


def application(session: Session, *, further: Sequence[BaseRoute] = ()) -> Starlette:
    """Return the web application of a session: the built page, its websocket, and the body's surface and fields.

    Further routes go before those of the body.
    """

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        watcher = asyncio.create_task(session.watch())
        yield
        watcher.cancel()
        await asyncio.gather(watcher, return_exceptions=True)

    return local_application([*further, *body_routes(lambda: session)], lifespan=lifespan)


def body_routes(session: Callable[[], Session | None]) -> list[BaseRoute]:
    """Return the routes of a touchable body: its websocket, surface, fields, and the map of trust.

    `session` returns the session of the body, or None as long as there is none.
    """
    answers = BinaryAnswers(keep=True)

    async def answer(request: Request, name: str, make: Callable[[PageModel], Binary | None]) -> Response:
        current = session()
        number = request.query_params.get("version", "")
        model = current and current.version(int(number) if number.isdecimal() else None)
        if not model:
            raise HTTPException(404)

        def made() -> bytes:
            if (content := make(model)) is None:
                raise HTTPException(404)
            return content.pack()

        return await answers.answer(request, f"{name} {model.version}", made)

    async def talk(socket: WebSocket) -> None:
        if (current := session()) is not None:
            await current.talk(socket)
        else:
            await socket.close(1013)

    async def surface(request: Request) -> Response:
        return await answer(request, "surface", lambda model: model.surface)

    async def trust(request: Request) -> Response:
        return await answer(request, "trust", lambda model: model.surface and model.trust_map())

    async def modes(request: Request) -> Response:
        index = request.path_params["index"]

        def make(model: PageModel) -> Binary | None:
            return model.modes(index) if index < model.field_count else None

        return await answer(request, f"field {index}", make)

    return [
        WebSocketRoute("/touch", talk),
        Route("/surface", surface),
        Route("/trust", trust),
        Route("/fields/{index:int}", modes),
    ]


class ViewerOptions(ServerOptions, total=False):
    """Where a body is served, and what moves the hand on it; as `Viewer` tells of them."""

    recordings: str | os.PathLike[str]
    replay: str | os.PathLike[str] | None
    device: str
    rate: float
    max_force: float | None
    max_torque: float | None
    unsoftened: bool
    controller: bool
    dead_man: bool
    friction: float | None


class Viewer(LocalServer):
    """A body to look at and touch, at `url`, while the context lasts.

    Parameters
    ----------
    model : learnt body or path
        Whatever `palpate.load` reads and gives a force, or its file.
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
    max_torque : float, optional
        Limit in N m of the torque on a device that renders one; the device's own by default.
    strict_port : bool
        Whether a busy port is an error; otherwise the next free one is taken.
    token : bool
        Whether the page opens only with the token that stands in `url`; without, to every user of this machine.
    recordings : path
        Folder for what is recorded by the page's button.
    replay : path, optional
        Recorded touch that is gone through, instead of a device.
    unsoftened : bool
        Whether a body that is too stiff for the device shall feel so all the same.
    controller : bool
        Whether the passivity controller may damp.
    dead_man : bool
        Whether the force acts only while the device's first button is held.
    friction : float, optional
        Coefficient of friction of the tool on the body, a pure number; by default that of the body's own.

    Attributes
    ----------
    model : Touchable
        The body as a hand finds it.
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
        model: Surrogate | str | os.PathLike[str],
        *,
        recordings: str | os.PathLike[str] = ".",
        replay: str | os.PathLike[str] | None = None,
        device: str = "page",
        rate: float = 1000.0,
        max_force: float | None = None,
        max_torque: float | None = None,
        unsoftened: bool = False,
        controller: bool = True,
        dead_man: bool = False,
        friction: float | None = None,
        **server: Unpack[ServerOptions],
    ) -> None:
        super().__init__(**server)
        self._source = model
        if isinstance(model, str | os.PathLike):
            self.model = load_touchable(model)
        else:
            self.model = touchable(model)
        if friction is not None:
            self.model = self.model.with_friction(friction)
        self._loop = functools.partial(
            LoopProcess,
            device=device,
            rate=rate,
            max_force=max_force,
            max_torque=max_torque,
            replay=replay,
            unsoftened=unsoftened,
            controller=controller,
            dead_man=dead_man,
            friction=friction,
        )
        self._hand = HandKind.RECORDING if replay is not None else hand_kind(device)
        self._device = device
        self._recordings = Path(recordings) if replay is None else None

    @property
    def caption(self) -> str:
        """The body's name, and what a hand does to it."""
        return f"{self.model.name}. {'Pull on it' if self.model.holds else 'Press it'};"

    def _application(self) -> Starlette:
        self.loop = self._closing.enter_context(self._loop(self._file()))
        return application(
            Session(PageModel(self.model), self.loop, self._hand, self._device, recordings=self._recordings)
        )

    def _file(self) -> str | os.PathLike[str]:
        """Return a file of the model, which the real-time process can read."""
        if isinstance(self._source, str | os.PathLike):
            return self._source
        folder = self._closing.enter_context(TemporaryFolder())
        return self._source.save(folder / "model.palpate")


def serve(
    model: Surrogate | str | os.PathLike[str],
    *,
    open_browser: bool = False,
    on_ready: Callable[[Viewer], object] | None = None,
    **options: Unpack[ViewerOptions],
) -> Viewer:
    """Show a body in the browser until interrupted (Ctrl-C) or terminated; in a notebook, go on at once.

    Parameters
    ----------
    open_browser : bool
        Whether to open the page in the user's browser.
    on_ready : callable, optional
        Called once with the running `Viewer`; by default its address is written to stderr, because a script
        that waits here must say where to look.

    Returns
    -------
    Viewer
        In a notebook it runs on until its `stop` or the notebook's end; elsewhere it has ended.

    Notes
    -----
    The other parameters and the errors are those of `Viewer`.
    """
    viewer = Viewer(model, **options)
    wait_until_interrupted(viewer, open_browser=open_browser, on_ready=on_ready)
    return viewer
