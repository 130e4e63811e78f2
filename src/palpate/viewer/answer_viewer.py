"""A page on which a surrogate without touch is asked: sliders for its inputs, its numbers, fields and curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Unpack

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from palpate.surrogates import Surrogate
from palpate.viewer.answer_page import AnswerPage
from palpate.viewer.web_server import LocalServer, ServerOptions, local_application, wait_until_interrupted

__all__ = ["AnswerViewer", "show_answers"]


class AnswerViewer(LocalServer):
    """The page of a surrogate that no hand feels, at `url`, while the context lasts.

    The page computes all answers by itself; the server sends it once. `name` is its title where the record has none.
    """

    def __init__(self, surrogate: Surrogate, *, name: str = "", **server: Unpack[ServerOptions]) -> None:
        super().__init__(**server)
        self.page = AnswerPage.of(surrogate, name)

    @property
    def caption(self) -> str:
        """The surrogate's name, and what a person does there."""
        return f"{self.page.name}: set its inputs."

    def _application(self) -> Starlette:
        text = self.page.served()

        async def page(_: Request) -> Response:
            return HTMLResponse(text)

        return local_application([Route("/", page)])


def show_answers(
    surrogate: Surrogate,
    *,
    name: str = "",
    open_browser: bool = False,
    on_ready: Callable[[AnswerViewer], object] | None = None,
    **server: Unpack[ServerOptions],
) -> AnswerViewer:
    """Serve the page of a surrogate without touch until Ctrl-C or SIGTERM; in a notebook, go on at once."""
    viewer = AnswerViewer(surrogate, name=name, **server)
    wait_until_interrupted(viewer, open_browser=open_browser, on_ready=on_ready)
    return viewer
