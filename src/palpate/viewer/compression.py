"""Answers of numbers, compressed for whoever asks for that: the surface and the modes of a field are up to some MB."""

from __future__ import annotations

import gzip
from collections.abc import Callable

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

__all__ = ["BinaryAnswers", "accepts_gzip"]

LEVEL = 6  # modes of a field: 74 % of their size, at 40 MB/s; higher levels save nothing more
_BINARY = "application/octet-stream"


class BinaryAnswers:
    """Answers of bytes by their name, made and compressed beside the server's thread, where the hand is heard.

    With `keep` an answer is made once for all who ask; otherwise each time.
    """

    def __init__(self, *, keep: bool) -> None:
        self._keep = keep
        self._made: dict[tuple[str, bool], bytes] = {}

    async def answer(self, request: Request, name: str, make: Callable[[], bytes]) -> Response:
        """Return the bytes of that name, which `make` returns, compressed where the request accepts gzip."""
        zipped = accepts_gzip(request.headers.get("accept-encoding", ""))
        key = name, zipped
        content = self._made.get(key)
        if content is None:
            content = await run_in_threadpool(_made, make, zipped)
            if self._keep:
                self._made[key] = content
        headers = {"vary": "accept-encoding"}
        if zipped:
            headers["content-encoding"] = "gzip"
        return Response(content, media_type=_BINARY, headers=headers)


def accepts_gzip(header: str) -> bool:
    """Return whether an Accept-Encoding header allows gzip: named, and not with a weight of zero."""
    for part in header.lower().split(","):
        coding, *parameters = (p.strip() for p in part.split(";"))
        if coding == "gzip":
            return not any(p.startswith("q=") and not p[2:].strip("0.") for p in parameters)
    return False


def _made(make: Callable[[], bytes], zipped: bool) -> bytes:
    content = make()
    return gzip.compress(content, LEVEL, mtime=0) if zipped else content
