"""The participant's page of a live sitting and the control page, each with an address and a token of its own."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.responses import HTMLResponse
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from palpate.viewer.web_server import LocalServer

__all__ = ["SittingPage"]

_PAGES = Path(__file__).parent / "pages"
_FRAME = 1.0 / 30.0  # s between two views

View = Callable[[], dict[str, Any]]
Hear = Callable[[Mapping[str, Any]], None]


class SittingPage(LocalServer):
    """One page, "participant" or "control", that shows a view thirty times a second and sends what a person does."""

    def __init__(self, name: str, view: View, hear: Hear, port: int, *, token: bool = True) -> None:
        super().__init__(port, token=token)
        self.name, self._view, self._hear = name, view, hear

    @property
    def caption(self) -> str:
        """The name of the page."""
        return f"the {self.name}'s page of a sitting."

    def _application(self) -> Starlette:
        document = (_PAGES / f"{self.name}.html").read_text("utf-8")

        async def show(_: Any) -> HTMLResponse:
            return HTMLResponse(document)

        routes: list[BaseRoute] = [
            Route("/", show),
            WebSocketRoute("/sitting", self._talk),
            Mount("/pages", StaticFiles(directory=_PAGES)),
        ]
        return Starlette(routes=routes)

    async def _talk(self, socket: WebSocket) -> None:
        """Send views and take messages until the page leaves; what is no message is left out."""
        await socket.accept()

        async def show() -> None:
            while True:
                await socket.send_text(json.dumps(self._view()))
                await asyncio.sleep(_FRAME)

        sender = asyncio.create_task(show())
        try:
            with contextlib.suppress(WebSocketDisconnect):
                while True:
                    message = _message(await socket.receive_text())
                    if message is not None:
                        await asyncio.to_thread(self._hear, message)
        finally:
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)


def _message(text: str) -> dict[str, Any] | None:
    try:
        content = json.loads(text)
    except ValueError:
        return None
    return content if isinstance(content, dict) else None
