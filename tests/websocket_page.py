"""A page without a browser: a program's way into the viewer's websocket and files."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
from websockets.sync.client import ClientConnection, connect

from palpate.viewer import BodyViewer, Viewer
from palpate.viewer.messages import Credit, Frame, Hand, Hello


class Client:
    """What a page can say and hear."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.told: list[dict[str, Any]] = []  # all that is no frame
        self.hello = Hello.from_json(str(socket.recv(timeout=5)))

    def grant(self, frames: int) -> None:
        self.socket.send(Credit(frames).pack())

    def frame(self, timeout: float = 5.0) -> Frame:
        """The next frame; TimeoutError where none comes."""
        while isinstance(data := self.socket.recv(timeout=timeout), str):
            self.told.append(json.loads(data))
        return Frame.unpack(data)

    def next_frame(self) -> Frame:
        """The next frame, asked for."""
        self.grant(1)
        return self.frame()

    def hand(self, x: float = 0.0, y: float = 0.0, *, grabbed: bool = True, hidden: bool = False) -> None:
        """Hold the tip at an offset of x, y body metres."""
        target = (x / self.hello.scale, y / self.hello.scale, 0.0)
        self.socket.send(Hand(0.0, 0.1, target, grabbed, hidden, np.zeros(0, "f4")).pack())


@contextlib.contextmanager
def client_of(viewer: Viewer) -> Iterator[Client]:
    """A connected client."""
    with socket_of(viewer) as socket:
        yield Client(socket)


def socket_of(viewer: Viewer, path: str = "touch", **options: Any) -> ClientConnection:
    """A websocket to the page's place, with the cookie of the page."""
    cookies = "; ".join(f"{name}={value}" for name, value in viewer.cookies.items())
    options = {"origin": viewer.address.rstrip("/"), "additional_headers": {"Cookie": cookies}} | options
    return connect(f"{viewer.address.replace('http', 'ws', 1)}{path}", **options)


def get(viewer: Viewer | BodyViewer, path: str = "", **headers: str) -> httpx.Response:
    """The answer that the page gets for a path."""
    with httpx.Client(cookies=viewer.cookies) as page:
        return page.get(viewer.address + path, headers=headers)
