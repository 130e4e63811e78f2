"""A web application in a thread of its own, from the moment it listens until it is told to end."""

from __future__ import annotations

import contextlib
import signal
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

import uvicorn
from starlette.applications import Starlette

from palpate.errors import DeviceError

__all__ = ["STATIC", "Running", "address", "termination_interrupts"]

STATIC = Path(__file__).parent / "static"
LARGEST_MESSAGE = 4096  # bytes from a page; a Hand with eight parameters has 79
START = 10.0  # s until the server must listen


def address(host: str, port: int) -> str:
    """The address of a page."""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


class Running:
    """A server that runs while the context lasts.

    Parameters
    ----------
    page : Starlette
    listener : socket.socket
        Listening already.

    Raises
    ------
    DeviceError
        On entering, if the server doesn't start.
    """

    def __init__(self, page: Starlette, listener: socket.socket) -> None:
        self._server = _server(page)
        self._thread = threading.Thread(
            target=self._server.run, args=([listener],), name="palpate viewer", daemon=True
        )

    def wait(self) -> None:
        """Return when the server has ended."""
        while self._thread.is_alive():
            self._thread.join(0.5)  # in steps: a join without end can't be interrupted on every system

    def __enter__(self) -> Self:
        self._thread.start()
        try:
            self._await()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.should_exit = True
        self._thread.join()

    def _await(self) -> None:
        deadline = threading.Event()
        for _ in range(int(START / 0.01)):
            if self._server.started:
                return
            if not self._thread.is_alive():
                break
            deadline.wait(0.01)
        raise DeviceError(
            "The viewer's server did not start.",
            why="Its thread ended or hangs; the log of 'uvicorn.error' says more.",
            fix="Try another port, or see `palpate doctor`.",
        )


@contextlib.contextmanager
def termination_interrupts() -> Iterator[None]:
    """SIGTERM ends like Ctrl-C: in good order, with the real-time process stopped and its memory freed."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set signal handlers
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _server(page: Starlette) -> uvicorn.Server:
    return uvicorn.Server(
        uvicorn.Config(
            page,
            log_config=None,  # the program that embeds us decides on logging
            access_log=False,
            ws="websockets-sansio",
            ws_max_size=LARGEST_MESSAGE,
            ws_per_message_deflate=False,  # frames are small, and packing them would cost more than sending
            timeout_graceful_shutdown=1,
            server_header=False,
        )
    )
