"""A websocket for the 1 kHz loop: no thread of its own, and no call that waits longer than it is told.

The protocol is that of the `websockets` package without its input and output; this file moves the bytes. The package is
imported when a channel is opened.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time
from collections.abc import Callable, Sequence
from urllib.parse import urlsplit

from palpate.errors import DeviceError, DeviceLostError, UsageError

__all__ = ["WebsocketChannel"]

_OPENING, _GOODBYE = 2.0, 0.2  # s to wait for an opening connection, and for the other end to read all
_BUDGET = 2.5e-4  # s, a quarter of a tick, for what has come: the rest is left to the next call
_MOST_MESSAGES = 16  # to a call, for the same reason: their reader takes time for each
_CHUNK = 4096  # bytes
_SLICE = 256  # bytes that are read without a look at the clock: more than a hundred pings fit in
# bytes of a message: several times the longest of any device service; JSON of it takes half a tick
_LARGEST = 32768
_REMEDY = "Check that it runs, and start again."


class WebsocketChannel:
    """A client's end of a websocket that carries text, to an address such as ``ws://localhost:10001``.

    Messages call what answers there `service`; `receive` keeps to its budget by the time, s, that `clock` returns. A
    DeviceError says that nothing answers there, or not as a websocket.
    """

    def __init__(self, url: str, service: str, clock: Callable[[], float] = time.perf_counter) -> None:
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
        self._protocol, self._clock = ClientProtocol(uri, max_size=_LARGEST), clock
        self._part = self._unread = self._unsent = b""
        self._messages: list[str] = []
        self._ended = False
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
            early = self._protocol.events_received()
            while not early and not self._protocol.handshake_exc:
                data = self._socket.recv(_CHUNK)
                if not data:
                    break
                self._protocol.receive_data(data)
                early = self._protocol.events_received()
        except OSError as error:
            raise self._failure("does not answer as a websocket", str(error)) from error
        if self._protocol.handshake_exc or not early:
            raise self._failure("does not answer as a websocket", str(self._protocol.handshake_exc or ""))
        self._take(early[1:])  # frames that came along with the response

    def send(self, text: str) -> None:
        """Send one message now; DeviceLostError where the connection is gone, or takes no more."""
        try:
            self._protocol.send_text(text.encode())
            self._flush()
        except Exception as error:
            raise self._lost("takes no message", f"{type(error).__name__}: {error}") from error
        if self._unsent:
            raise self._lost("takes no message", "What was sent before is not read.")

    def receive(self, wait: float) -> list[str]:
        """Return messages that have arrived, waiting for the first at most `wait`, s.

        What takes longer than a quarter of a millisecond to read is left to the next call, so that a service which
        sends without end, pings or numbers, delays no tick. DeviceLostError says that the connection is gone and
        nothing is left to read, or that a message is larger than any of a device.
        """
        begin = self._clock()
        while len(self._messages) < _MOST_MESSAGES:
            spent = self._clock() - begin
            if spent > (_BUDGET if self._messages else max(wait, _BUDGET)):
                break
            if not self._unread and not self._fetch():
                if self._messages or self._ended or spent >= wait:
                    break
                select.select(self._poll, (), (), wait - spent)
                continue
            self._protocol.receive_data(self._unread[:_SLICE])
            self._unread = self._unread[_SLICE:]
            self._take(self._protocol.events_received())
        self._answer_pings()
        messages, self._messages = self._messages[:_MOST_MESSAGES], self._messages[_MOST_MESSAGES:]
        if not messages:
            fault = self._protocol.parser_exc
            if self._ended or self._protocol.close_rcvd is not None:
                raise self._lost("closed the connection")
            if fault is not None:
                raise self._lost("sends what is no message of a device", f"{type(fault).__name__}: {fault}")
        return messages

    def _fetch(self) -> bool:
        """Take bytes from the socket, and return whether there were any."""
        if self._ended:
            return False
        try:
            self._unread = self._socket.recv(_CHUNK)
        except BlockingIOError:
            return False
        except OSError as error:
            raise self._lost("is gone", str(error)) from error
        if not self._unread:
            self._ended = True
            self._protocol.receive_eof()
        return bool(self._unread)

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

    def _take(self, events: Sequence[object]) -> None:
        """Add the messages that end in these frames to those that wait to be received."""
        for frame in events:
            if getattr(frame, "opcode", None) in self._texts:
                self._part += frame.data  # type: ignore[attr-defined]
                if frame.fin:  # type: ignore[attr-defined]
                    self._messages.append(bytes(self._part).decode("utf-8", "replace"))
                    self._part = b""

    def _answer_pings(self) -> None:
        with contextlib.suppress(OSError):  # the next message tells
            self._flush()

    def _flush(self) -> None:
        """Send what is to be sent, as far as it is taken now; what is cut off goes first the next time."""
        data = self._unsent + b"".join(self._protocol.data_to_send())
        if data:
            self._unsent = data  # stays, should sending fail
            self._unsent = data[self._socket.send(data) :]

    def _failure(self, what: str, why: str = "") -> DeviceError:
        return DeviceError(f"{self._name} {what}.", why=why, fix=_REMEDY)

    def _lost(self, what: str, why: str = "") -> DeviceLostError:
        return DeviceLostError(f"{self._name} {what}.", why=why, fix=_REMEDY)
