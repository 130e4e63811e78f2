"""Who may talk to the viewer: this machine's own page and nobody else.

A server on 127.0.0.1 is still within reach of every web page that the user's browser has open. Two checks
keep those out: the *Host* header must name this machine (a foreign name that was made to resolve to
127.0.0.1 is DNS rebinding), and a websocket's *Origin* must be the page that this server served. Both
answer 403. The content security policy keeps the page itself from fetching or running anything from
elsewhere.
"""

from __future__ import annotations

import logging

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from palpate.viewer.ports import LOOPBACK

__all__ = ["Guard", "refusal"]

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
    """Why a request is refused, or "" where it is not.

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
