"""Parts of all doubles of device services: a thread that serves, and a hand that moves by itself.

The hand is a mass on a spring whose other end moves up and down by a sine, with damping; its axes are the service's.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from palpate.devices.device_options import DeviceOptions, number
from palpate.errors import PortInUseError

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

__all__ = ["HandSettings", "MovedMass", "ServiceDouble", "ServiceFaults"]

_STEP = 1e-3  # s of the hand's integration


@dataclass(frozen=True)
class HandSettings(DeviceOptions):
    """Settings of the hand."""

    driver = "the simulated hand"

    amplitude: float = number(0.03, -0.1, 0.1)  # m, of the stroke, downwards first
    frequency: float = number(0.5)  # Hz
    mass: float = number(0.3, 0.0, above=True)  # kg
    damping: float = 5.0  # N·s/m
    stiffness: float = 300.0  # N/m
    silence: float = number(0.1, 0.0, above=True)  # s without a command after which the force on it lapses


@dataclass
class ServiceFaults:
    """Faults of a service, switched while it runs."""

    held: bool = False  # answers are kept back until `ServiceDouble.release`; then all are sent
    dropped: int = 0  # number of the next answers that are lost
    doubled: int = 0  # number of the next answers that are sent twice
    closing: bool = False  # the next message closes the connection


class MovedMass:
    """The mass on a moving spring, in axes with z up.

    Its `position` (3,), m, counts from the middle of the reach; `velocity` (3,), m/s. The `force` (3,), N, on the hand
    was set at the time `commanded`, s, and lapses after the silence of the settings.
    """

    def __init__(self, settings: HandSettings) -> None:
        self._settings = settings
        self.position, self.velocity, self.force = np.zeros(3), np.zeros(3), np.zeros(3)
        self.commanded = -math.inf
        self._began = self._time = math.nan

    def advance(self, now: float) -> None:
        """Move on to `now`, s, in steps of 1 ms at most; a pause of more than 0.1 s is cut to that."""
        s = self._settings
        if math.isnan(self._time):
            self._began = self._time = now
        self._time = max(self._time, now - 0.1)
        while (step := min(_STEP, now - self._time)) > 1e-9:
            self._time += step
            if self._time - self.commanded > s.silence:
                self.force[:] = 0.0
            pull = -s.stiffness * self.position - s.damping * self.velocity + self.force
            phase = 2.0 * math.pi * s.frequency * (self._time - self._began)
            pull[2] -= s.stiffness * s.amplitude * math.sin(phase)
            self.velocity += step / s.mass * pull
            self.position += step * self.velocity


class ServiceDouble:
    """A service on a thread of its own; a context manager. Its kinds open their ports in `_listen`.

    Its hand moves, and what it sends is stamped, by the time, s, that `clock` returns. Each of its clients hears the
    topics that it has asked for. `faults` may be changed at any time.
    """

    faults: ServiceFaults

    def __init__(self, name: str, clock: Callable[[], float]) -> None:
        self._name, self.clock = name, clock
        self._clients: dict[ServerConnection, set[str]] = {}
        self._kept: list[tuple[Callable[[str], Awaitable[None]], str]] = []
        self._loop = asyncio.new_event_loop()
        self._servers: list[Any] = []

    def start(self) -> Self:
        """Listen; a port that is taken raises PortInUseError."""
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        try:
            self._do(self._listen())
        except OSError as error:
            self.stop()
            raise PortInUseError(
                f"The simulated {self._name} can't listen at the ports asked for.",
                why=str(error),
                fix="Another service uses them: choose other ports.",
            ) from error
        return self

    def stop(self) -> None:
        """Close all connections and end; harmless when repeated."""
        if self._loop.is_closed():
            return
        self._do(self._end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def release(self) -> None:
        """Send the answers that were held, in their order."""
        self.faults.held = False
        self._do(self._send_kept())

    def restart(self) -> None:
        """Close all connections, as a restarted service does."""
        self._do(self._drop_clients())

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _do(self, work: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine on the service's thread and wait for it."""
        asyncio.run_coroutine_threadsafe(work, self._loop).result(10.0)

    async def _serve(self, handler: Any, host: str, port: int, **settings: Any) -> int:
        """Open a websocket server and return its port."""
        from websockets.asyncio.server import serve

        # answers must not wait for a compressor, nor the loop for a ping
        plain: dict[str, Any] = {"compression": None, "ping_interval": None, "close_timeout": 0.05}
        server = await serve(handler, host, port, **plain, **settings)
        self._servers.append(server)
        return int(next(iter(server.sockets)).getsockname()[1])

    @contextlib.contextmanager
    def _hears(self, client: ServerConnection, *topics: str) -> Iterator[set[str]]:
        """Have a client, which hears these topics, until it is gone: it takes nothing along."""
        from websockets.exceptions import ConnectionClosed

        heard = self._clients[client] = set(topics)
        try:
            with contextlib.suppress(ConnectionClosed):
                yield heard
        finally:
            self._clients.pop(client, None)

    async def _send(self, topic: str, text: str) -> None:
        """Send a text to all clients that hear a topic; an empty one is heard by all."""
        from websockets.exceptions import ConnectionClosed

        for client, topics in list(self._clients.items()):
            if not topic or topic in topics:
                try:
                    await client.send(text)
                except ConnectionClosed:
                    self._clients.pop(client, None)

    async def _answer(self, send: Callable[[str], Awaitable[None]], text: str) -> None:
        """Send an answer as the faults have it."""
        faults = self.faults
        if faults.held:
            self._kept.append((send, text))
        elif faults.dropped > 0:
            faults.dropped -= 1
        else:
            await send(text)
            if faults.doubled > 0:
                faults.doubled -= 1
                await send(text)

    async def _send_kept(self) -> None:
        kept, self._kept = self._kept, []
        for send, text in kept:
            await send(text)

    async def _drop_clients(self) -> None:
        for client in list(self._clients):
            await client.close()

    async def _listen(self) -> None:
        raise NotImplementedError

    async def _end(self) -> None:
        for server in self._servers:
            server.close()
        for server in self._servers:
            await server.wait_closed()
