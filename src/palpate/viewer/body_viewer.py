"""A page on which a solved body is looked at: turned, coloured, stepped through."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Unpack

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from palpate.viewer.compression import BinaryAnswers
from palpate.viewer.shown_body import ShownBody, body_of
from palpate.viewer.web_server import (
    LocalServer,
    ServerOptions,
    local_application,
    skeleton,
    wait_until_interrupted,
)

__all__ = ["BodyViewer", "body_application", "show"]


def body_application(body: ShownBody) -> Starlette:
    """Return the web application of a body: the built page, ``/shown``, ``/surface`` and ``/steps/N``."""
    parts = body.split()
    once, each = BinaryAnswers(keep=True), BinaryAnswers(keep=False)
    facts, mesh = body.shown(parts).to_json(), body.surface(parts).pack()

    html = skeleton("shown")

    async def page(_: Request) -> Response:
        return HTMLResponse(html)

    async def shown(_: Request) -> Response:
        return Response(facts, media_type="application/json")

    async def surface(request: Request) -> Response:
        return await once.answer(request, "surface", lambda: mesh)

    async def step(request: Request) -> Response:
        index = request.path_params["index"]
        if index >= len(body.steps):
            raise HTTPException(404)
        return await each.answer(request, f"step {index}", lambda: body.step(index, parts).pack())

    return local_application(
        [
            Route("/", page),
            Route("/shown", shown),
            Route("/surface", surface),
            Route("/steps/{index:int}", step),
        ]
    )


class BodyViewer(LocalServer):
    """A solved body to look at, at `url`, while the context lasts.

    Parameters
    ----------
    source : solution, sequence of solutions, Dataset, or path of a .vtu, .pvd or .zarr
        All that `palpate.viewer.shown_body.body_of` takes.
    name : str
        Title of the page.
    port : int
        The port wanted; 0 takes any free one.
    host : str
        ``127.0.0.1``, ``localhost`` or ``::1``: the viewer serves this machine only.
    strict_port : bool
        Whether a busy port is an error; otherwise the next free one is taken.
    token : bool
        Whether the page opens only with the token that stands in `url`; without, to every user of this machine.

    Attributes
    ----------
    body : ShownBody
        What the page shows.
    port : int
        The port taken, once started.

    Raises
    ------
    UsageError
        If there is nothing to show.
    FileFormatError
        If the file can't be read.
    """

    def __init__(self, source: Any, *, name: str = "", **server: Unpack[ServerOptions]) -> None:
        super().__init__(**server)
        self.body = body_of(source, name)

    @property
    def caption(self) -> str:
        """The body's name."""
        return f"{self.body.name}."

    def _application(self) -> Starlette:
        return body_application(self.body)


def show(
    source: Any,
    *,
    name: str = "",
    open_browser: bool = False,
    on_ready: Callable[[BodyViewer], object] | None = None,
    **server: Unpack[ServerOptions],
) -> BodyViewer:
    """Show solved bodies in the browser until interrupted (Ctrl-C) or terminated; in a notebook, go on at once.

    Parameters
    ----------
    open_browser : bool
        Whether to open the page in the user's browser.
    on_ready : callable, optional
        Called once with the running `BodyViewer`; by default its address is written to stderr, because a script
        that waits here must say where to look.

    Returns
    -------
    BodyViewer
        In a notebook it runs on until its `stop` or the notebook's end; elsewhere it has ended.

    Notes
    -----
    The other parameters and the errors are those of `BodyViewer`, which does the same without waiting.
    """
    viewer = BodyViewer(source, name=name, **server)
    wait_until_interrupted(viewer, open_browser=open_browser, on_ready=on_ready)
    return viewer
