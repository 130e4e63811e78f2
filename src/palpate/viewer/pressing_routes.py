"""What a page of a pressed body asks for once, beside its websocket: itself, the skin, the modes of each field."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from palpate.viewer.pressing import PressedExhibit
from palpate.viewer.running import STATIC

__all__ = ["pressing_routes"]

_BINARY = "application/octet-stream"


def pressing_routes(exhibit: PressedExhibit) -> list[BaseRoute]:
    """``/``, ``/skin`` and ``/fields/N``."""

    async def page(_: Request) -> Response:
        return FileResponse(STATIC / "pressed.html")

    async def skin(_: Request) -> Response:
        return Response(exhibit.skin.pack(), media_type=_BINARY)

    async def modes(request: Request) -> Response:
        index = request.path_params["index"]
        if index >= len(exhibit.fields):
            raise HTTPException(404)
        return Response(exhibit.modes(index).pack(), media_type=_BINARY)

    return [Route("/", page), Route("/skin", skin), Route("/fields/{index:int}", modes)]
