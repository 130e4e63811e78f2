"""Fields are sent compressed to those who ask for that, and are the same bytes for all."""

from __future__ import annotations

import asyncio
import gzip

import httpx
import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from palpate.viewer.compression import BinaryAnswers, accepts_gzip

NUMBERS = bytes(range(256)) * 40


@pytest.mark.parametrize(
    ("header", "accepted"),
    [
        ("gzip", True),
        ("br, GZIP;q=0.8", True),
        ("deflate, gzip;q=1.0, *;q=0.5", True),
        ("", False),
        ("br", False),
        ("gzip;q=0", False),
        ("gzip; q=0.000, br", False),
        ("x-gzip", False),
    ],
)
def test_the_header_decides(header: str, accepted: bool):
    assert accepts_gzip(header) is accepted


@pytest.mark.parametrize(("keep", "times"), [(True, 2), (False, 4)])  # kept: once plain, once compressed
def test_compressed_or_not_the_bytes_are_the_same(keep: bool, times: int):
    answers, made = BinaryAnswers(keep=keep), []

    def make() -> bytes:
        made.append(1)
        return NUMBERS

    async def field(request: Request) -> Response:
        return await answers.answer(request, request.url.path, make)

    async def ask(coding: str) -> tuple[httpx.Headers, bytes]:
        transport = httpx.ASGITransport(Starlette(routes=[Route("/field", field)]))
        headers = {"accept-encoding": coding}
        async with (
            httpx.AsyncClient(transport=transport, base_url="http://page") as client,
            client.stream("GET", "/field", headers=headers) as answer,
        ):
            return answer.headers, b"".join([part async for part in answer.aiter_raw()])

    for _ in range(2):
        plain, whole = asyncio.run(ask("identity"))
        assert whole == NUMBERS
        assert "content-encoding" not in plain
        packed, raw = asyncio.run(ask("gzip"))
        assert packed["content-encoding"] == "gzip"
        assert packed["vary"] == plain["vary"] == "accept-encoding"
        assert len(raw) < len(NUMBERS) / 4
        assert gzip.decompress(raw) == NUMBERS
    assert len(made) == times
