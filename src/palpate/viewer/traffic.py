"""Fair shares of a server: rates, turns, and connections that never say what they want.

The pages of one body share one thread. A page that floods it, and a program that opens connections and leaves them
half-open, may take their own share and no more; the hand's messages are read before the next picture is made.

=====================  ====================================================================================
`Bucket`               so many permits a second, and so many at once
`Turns`                pictures are made one at a time, in the order of asking, in half of the thread's time
`Waiting`              connections without a whole request: so many, for so long, the oldest goes first
`PatientHttp`          the server's HTTP connections under `Waiting`'s rule
`PatientWebSocket`     its websockets, with a rate for what never reaches a page's own rate: pings, fragments
=====================  ====================================================================================
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any, Protocol

import h11
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

__all__ = ["Bucket", "Closable", "PatientHttp", "PatientWebSocket", "Turns", "Waiting", "tell_all"]

Clock = Callable[[], float]
PATIENCE = 1.0  # s that a page has to take news of all pages

SHARE = 0.5  # share of the thread's time for pictures; the rest is the hand's
HALF_OPEN = 64  # connections without a whole request, at most
HEADERS_WITHIN = 5.0  # s from the start of a connection, or of a request, to the end of its headers
CONTROLS, CONTROLS_AT_ONCE = 20.0, 100.0  # pings and fragments of a websocket, per second and at once


class Bucket:
    """A rate: permits per second in the long run, and a burst of them at once after a quiet time; clock in s."""

    def __init__(self, rate: float, burst: float, clock: Clock = time.monotonic) -> None:
        self._rate, self._burst, self._clock = rate, burst, clock
        self._level, self._at = burst, clock()

    def take(self) -> float:
        """Take a permit, in advance where there is none; return how long to wait until it is due, s."""
        self._fill()
        self._level -= 1.0
        return max(0.0, -self._level / self._rate)

    def try_take(self) -> bool:
        """Take a permit if there is one, and tell whether there was."""
        self._fill()
        if self._level < 1.0:
            return False
        self._level -= 1.0
        return True

    def _fill(self) -> None:
        at = self._clock()
        self._level = min(self._burst, self._level + (at - self._at) * self._rate)
        self._at = at


class Turns:
    """Turns at making pictures, for the pages of one server.

    One picture is made at a time, in the order in which pages asked, and between two of them the thread reads what has
    come: the hand's messages never wait for more than one picture. Together pictures take at most `SHARE` of the
    thread, each page the same part of it. Without a crowd, `shortest` is the time in s between two pictures for one
    page.
    """

    def __init__(self, shortest: float, clock: Clock = time.perf_counter) -> None:
        self._shortest, self._clock = shortest, clock
        self._turn = asyncio.Lock()
        self._cost = 0.0  # s of a picture, smoothed

    @contextlib.asynccontextmanager
    async def turn(self) -> AsyncIterator[None]:
        """Wait for a turn; a picture is made within."""
        async with self._turn:
            begun = self._clock()
            yield
            self._cost += 0.1 * (self._clock() - begun - self._cost)
            await asyncio.sleep(0)  # the thread looks for what has come
            await asyncio.sleep(0)  # and takes it

    def pause(self, pages: int) -> float:
        """Return how long a page waits until it asks again, where so many pages look, s."""
        return max(self._shortest, pages * self._cost / SHARE)


class Closable(Protocol):
    """A connection, as `Waiting` needs it."""

    def abort(self) -> None:
        """Close it at once."""


class Waiting:
    """Connections that have not sent a whole request yet, at most `most` of them, for `limit` seconds each.

    A newcomer takes the place of the one that has waited longest, so that whoever asks at once is answered however many
    others keep silent. `later` takes seconds, a function and a connection, and returns what has a method `cancel`; by
    default it is the running event loop's.
    """

    def __init__(
        self, most: int = HALF_OPEN, limit: float = HEADERS_WITHIN, later: Callable[..., Any] | None = None
    ) -> None:
        self._most, self._limit, self._later = most, limit, later
        self._timers: dict[Closable, Any] = {}  # in the order of arrival

    def __len__(self) -> int:
        return len(self._timers)

    def enter(self, connection: Closable) -> None:
        """Count a connection from now on; one that is counted already keeps its time."""
        if connection in self._timers:
            return
        while len(self._timers) >= self._most:
            self._close(next(iter(self._timers)))
        later = self._later or asyncio.get_running_loop().call_later
        self._timers[connection] = later(self._limit, self._close, connection)

    def leave(self, connection: Closable) -> None:
        """Count a connection no more: its request is whole, or it has ended."""
        if timer := self._timers.pop(connection, None):
            timer.cancel()

    def _close(self, connection: Closable) -> None:
        self.leave(connection)
        connection.abort()


class PatientHttp(H11Protocol):
    """An HTTP connection that is `Waiting`, shared by those of one server, while it has not sent a whole request."""

    def __init__(self, *, waiting: Waiting, **options: Any) -> None:
        super().__init__(**options)
        self._waiting = waiting

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._waiting.enter(transport)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request."""
        super().data_received(data)
        self._count()

    def on_response_complete(self) -> None:
        """Begin to wait for the next request."""
        super().on_response_complete()
        self._count()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._waiting.leave(self.transport)
        super().connection_lost(exc)

    def _count(self) -> None:
        if self.conn.their_state is h11.IDLE and not self.transport.is_closing():
            self._waiting.enter(self.transport)
        else:
            self._waiting.leave(self.transport)


class PatientWebSocket(WebSocketsSansIOProtocol):
    """A websocket that ends where pings or fragments of messages flood it: the server answers those by itself."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._controls = Bucket(CONTROLS, CONTROLS_AT_ONCE)

    def handle_ping(self) -> None:
        """Answer a ping."""
        if self._permitted():
            super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        """Take the answer to a ping."""
        if self._permitted():
            super().handle_pong(event)

    def handle_cont(self, event: Frame) -> None:
        """Take a further fragment of a message."""
        if self._permitted():
            super().handle_cont(event)

    def _permitted(self) -> bool:
        permitted = self._controls.try_take()
        if not permitted:
            self.transport.abort()
        return permitted


async def tell_all(sockets: Iterable[WebSocket], text: str) -> None:
    """Send a text to all pages at once."""

    async def tell(socket: WebSocket) -> None:
        # RuntimeError: just closed; TimeoutError: a page that doesn't read keeps it from nobody else
        with contextlib.suppress(WebSocketDisconnect, RuntimeError, TimeoutError):
            await asyncio.wait_for(socket.send_text(text), PATIENCE)

    await asyncio.gather(*map(tell, list(sockets)))
