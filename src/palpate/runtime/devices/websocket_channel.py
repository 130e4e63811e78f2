"""A websocket for the 1 kHz loop: no thread of its own, and no call that waits longer than it is told.

The protocol is that of the `websockets` package without its input and output; this file moves the bytes. The package is
imported when a channel is opened.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time
from collections.abc import Sequence
from urllib.parse import urlsplit

from palpate.errors import DeviceError, DeviceLostError, UsageError

__all__ = ["WebsocketChannel"]

_OPENING, _GOODBYE = 2.0, 0.2  # s
_CHUNK = 65536  # bytes
_MOST_CHUNKS = 16  # at a time: a service that sends without end is not waited for
_REMEDY = "Check that it runs, and start again."


class WebsocketChannel:
    """A client's end of a websocket that carries text.

    Parameters
    ----------
    url : str
        Address, such as ``ws://localhost:10001``.
    service : str
        Name of what answers there, for messages.

    Raises
    ------
    UsageError
        If the address is not one of a websocket.
    DeviceError
        If nothing answers there, or not as a websocket.
    """

    def __init__(self, url: str, service: str) -> None:
        from websockets.client import ClientProtocol
        from websockets.exceptions import WebSocketException
        from websockets.frames import Opcode
        from websockets.uri import parse_uri

        self._name = f"{service} at {url}"
        self._texts = (Opcode.TEXT, Opcode.CONT)
        try:
            address = urlsplit(url)
            host, port, uri = address.hostname, address.port or 80, parse_uri(url)
        except (ValueError, WebSocketException) as error:
            raise UsageError(
                f"{url} is no address of a websocket.", fix="For example ws://localhost:10001."
            ) from error
        if uri.secure or host is None:
            raise UsageError(
                f"{url} is encrypted, which no device service is.", fix="Write ws:// and not wss://."
            )
        self._protocol, self._part = ClientProtocol(uri), b""
        try:
            self._socket = socket.create_connection((host, port), _OPENING)
        except OSError as error:
            raise self._failure("does not answer", str(error)) from error
        try:
            self._shake_hands()
        except BaseException:
            self._socket.close()
            raise
        self._socket.setblocking(False)
        self._poll = [self._socket]

    def _shake_hands(self) -> None:
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self._protocol.send_request(self._protocol.connect())
            self._flush()
            self._early = self._protocol.events_received()
            while not self._early and not self._protocol.handshake_exc:
                data = self._socket.recv(_CHUNK)
                if not data:
                    break
                self._protocol.receive_data(data)
                self._early = self._protocol.events_received()
        except OSError as error:
            raise self._failure("does not answer as a websocket", str(error)) from error
        if self._protocol.handshake_exc or not self._early:
            raise self._failure("does not answer as a websocket", str(self._protocol.handshake_exc or ""))
        self._early = self._early[1:]  # frames that came along with the response

    def send(self, text: str) -> None:
        """Send one message now.

        Raises
        ------
        DeviceLostError
            If the connection is gone, or takes no more.
        """
        try:
            self._protocol.send_text(text.encode())
            self._flush()
        except Exception as error:
            raise self._lost("takes no message", f"{type(error).__name__}: {error}") from error

    def receive(self, wait: float) -> list[str]:
        """Return the messages that have arrived, waiting for the first at most `wait`, s.

        Raises
        ------
        DeviceLostError
            If the connection is gone and nothing is left to read.
        """
        messages = self._messages(self._early)
        self._early = []
        if wait > 0.0 and not messages:
            select.select(self._poll, (), (), wait)
        ended = False
        for _ in range(_MOST_CHUNKS):
            try:
                data = self._socket.recv(_CHUNK)
            except BlockingIOError:
                break
            except OSError as error:
                raise self._lost("is gone", str(error)) from error
            if data:
                self._protocol.receive_data(data)
            else:
                ended = True
                self._protocol.receive_eof()
            messages += self._messages(self._protocol.events_received())
            self._answer_pings()
            if ended:
                break
        closing = self._protocol.close_rcvd is not None or self._protocol.parser_exc is not None
        if (ended or closing) and not messages:
            raise self._lost("closed the connection")
        return messages

    def close(self) -> None:
        """Say goodbye, wait briefly until the other end has read all that was sent, and close; harmless when repeated.

        A socket that is closed with unread messages in it resets the connection, and what was sent last, a zero force,
        may be lost with it.
        """
        try:
            self._protocol.send_close()
            self._flush()
            self._socket.shutdown(socket.SHUT_WR)
            end = time.monotonic() + _GOODBYE
            while (left := end - time.monotonic()) > 0.0:
                if not select.select(self._poll, (), (), left)[0] or not self._socket.recv(_CHUNK):
                    break
        except Exception:  # noqa: BLE001 - whoever is gone needs no goodbye
            pass
        self._socket.close()

    def _messages(self, events: Sequence[object]) -> list[str]:
        messages = []
        for frame in events:
            if getattr(frame, "opcode", None) in self._texts:
                self._part += frame.data  # type: ignore[attr-defined]
                if frame.fin:  # type: ignore[attr-defined]
                    messages.append(bytes(self._part).decode("utf-8", "replace"))
                    self._part = b""
        return messages

    def _answer_pings(self) -> None:
        with contextlib.suppress(OSError):  # the next message tells
            self._flush()

    def _flush(self) -> None:
        for data in self._protocol.data_to_send():
            if data:
                self._socket.sendall(data)

    def _failure(self, what: str, why: str = "") -> DeviceError:
        return DeviceError(f"{self._name} {what}.", why=why, fix=_REMEDY)

    def _lost(self, what: str, why: str = "") -> DeviceLostError:
        return DeviceLostError(f"{self._name} {what}.", why=why, fix=_REMEDY)
