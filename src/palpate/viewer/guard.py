"""Access to a page's server: who is let in, and what every answer says.

A server on 127.0.0.1 is within reach of every web page that the user's browser has open, and of every user of the
machine. Three checks keep those out:

- *Host* must name this machine (a foreign name that was made to resolve to 127.0.0.1 is DNS rebinding); else 403.
- A websocket's *Origin* must be the page that this server served; else 403.
- Each request shows the server's *token*, a secret that is new at each start; else 401 (403 for a websocket). It
  stands in the address that is printed and opened; the first answer turns it into a cookie that no script reads and
  that no other site's page makes the browser send, and takes it out of the browser's address bar.

The content security policy keeps the page itself from fetching or running anything from elsewhere.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from palpate.viewer.traffic import Bucket

__all__ = ["LOOPBACK", "Guard", "Token", "refusal"]

logger = logging.getLogger("palpate.viewer")

LOOPBACK = ("127.0.0.1", "localhost", "::1")
POLICY = "content-security-policy"
HEADERS = {
    POLICY: "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cache-control": "no-cache",  # a page of yesterday's version would speak yesterday's protocol
}
EMPTY = '<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><title>palpate</title>'
NO_TOKEN = f"""{EMPTY}
<h1>This page is locked.</h1>
<p>Whoever opens it can pull on the body, so it asks for the token of this start of palpate.</p>
<p>Open the whole address that palpate printed in its terminal.</p>
"""
MOST_REQUESTS = 64  # requests answered at a time; a browser has six connections to a server
REQUESTS, BURST = 100.0, 300.0  # requests per second in the long run, and at once; a page needs about ten
WARNINGS = 20.0  # lines of the log about refusals at once, and one per second in the long run
REASONS = 64  # reasons of refusals that are remembered, so that each is written down once
OLD_PAGE = "a page of an earlier start that is still open in a browser; open the address that is printed here"


class Token:
    """The secret that whoever may see the page has to show: 144 random bits as 24 letters, new for each object.

    Cookies of one host are shared by its ports, so the cookie's `name` differs from port to port.
    """

    def __init__(self, name: str = "palpate") -> None:
        self.name, self.secret = name, secrets.token_urlsafe(18)

    def equals(self, text: str) -> bool:
        """Tell whether a text is the secret, in a time that does not depend on where they differ."""
        return secrets.compare_digest(text.encode(), self.secret.encode())

    def is_in_cookies(self, headers: Headers) -> bool:
        """Tell whether one of a request's cookies is the secret."""
        pairs = (
            cookie.strip().partition("=") for line in headers.getlist("cookie") for cookie in line.split(";")
        )
        return any(self.equals(value) for name, _, value in pairs if name == self.name)

    def is_outdated_in_cookies(self, headers: Headers) -> bool:
        """Tell whether a request that is refused shows a cookie of this name: of an earlier start at this port."""
        cookies = ";".join(headers.getlist("cookie")).split(";")
        return any(cookie.partition("=")[0].strip() == self.name for cookie in cookies)

    def is_in_query(self, scope: Scope) -> bool:
        """Tell whether the address that is asked for carries the secret."""
        values = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        return any(self.equals(value) for value in values)

    def welcome(self, scope: Scope) -> Response:
        """Return the answer to an address with the secret: the cookie, and the way to the page without the secret."""
        # a plain redirect would still count as a request of whoever linked here, and come without the cookie
        answer = HTMLResponse(EMPTY, headers={"refresh": "0; url=" + _path(scope)})
        answer.set_cookie(self.name, self.secret, httponly=True, samesite="strict")
        return answer


def _path(scope: Scope) -> str:
    """Return the path of a request, on this server whatever it holds: ``//elsewhere`` would be another one."""
    raw = bytes(scope.get("raw_path") or scope["path"].encode()).decode("latin-1")
    return "/" + raw.lstrip("/\\")


def refusal(kind: str, headers: Headers) -> str:
    """Return why a request ("http" or "websocket") is refused whatever it shows, or "" where it is not."""
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
    """ASGI middleware: refuses strangers, paces requests, and puts `HEADERS` on every answer; a token is optional."""

    def __init__(self, app: ASGIApp, token: Token | None = None) -> None:
        self._app, self._token = app, token
        self._pace, self._warnings = Bucket(REQUESTS, BURST), Bucket(1.0, WARNINGS)
        self._requests = 0
        self._reasons: set[str] = set()  # that were written down

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one connection."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                own = {POLICY: headers[POLICY]} if POLICY in headers else {}  # a report has one of its own
                headers.update(HEADERS | own)
            await send(message)

        if (answer := self._answer_at_the_door(scope)) is None:
            await self._pass(scope, receive, with_headers)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})  # before accepting: 403
        else:
            await answer(scope, receive, with_headers)

    def _answer_at_the_door(self, scope: Scope) -> Response | None:
        """Return what whoever is not let through gets; None for whoever is."""
        kind, headers = scope["type"], Headers(scope=scope)
        # a stranger's connection does not stay
        if reason := refusal(kind, headers):
            self._warn(reason)
            return PlainTextResponse(f"Refused: {reason}.\n", 403, {"connection": "close"})
        if self._token is None:
            return None
        if kind == "http" and self._token.is_in_query(scope):
            return self._token.welcome(scope)
        if self._token.is_in_cookies(headers):
            return None
        self._warn(OLD_PAGE if self._token.is_outdated_in_cookies(headers) else "a request without the token")
        return HTMLResponse(NO_TOKEN, 401, {"connection": "close"})

    async def _pass(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
            return
        if self._requests >= MOST_REQUESTS:
            await PlainTextResponse("Too many requests at once.\n", 503)(scope, receive, send)
            return
        self._requests += 1
        try:
            await asyncio.sleep(self._pace.take())
            await self._app(scope, receive, send)
        finally:
            self._requests -= 1

    def _warn(self, reason: str) -> None:
        """Write a reason down once: an old page asks again every few seconds, and a flood must not fill the log."""
        if reason in self._reasons or not self._warnings.try_take():
            return
        if len(self._reasons) < REASONS:
            self._reasons.add(reason)
        logger.warning("refused: %s", reason)
