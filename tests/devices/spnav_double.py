"""A double of spacenavd: a Unix socket that speaks its protocol by the example packets of tests/data/devices."""

from __future__ import annotations

import contextlib
import json
import socket
import struct
import tempfile
import threading
from pathlib import Path

FRAMES = json.loads((Path(__file__).parents[1] / "data/devices/spacenav.json").read_text(encoding="utf-8"))
_PACKET = struct.Struct("=8i")


def packet(words):
    return _PACKET.pack(*words)


class Daemon:
    """The daemon with one client, in protocol 1, or 0 as before version 1.0; a context manager."""

    def __init__(self, protocol=1, answers=("name", "buttons"), first=()):
        self.protocol, self.first = protocol, first  # events that are sent before anything is answered
        self.name, self.buttons = answers
        self.hanging = False
        self.sensitivity = 1.0
        self.asked = threading.Semaphore(0)
        self._folder = tempfile.TemporaryDirectory(
            prefix="spnav"
        )  # short: a socket's path has 107 characters
        self.path = str(Path(self._folder.name) / "spnav.sock")
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(self.path)
        self._listener.listen()
        self._client = None
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.end()
        self._folder.cleanup()

    def end(self):
        """End, as a daemon does that is stopped: its sockets close."""
        for end in (self._listener, self._client):
            if end is not None:
                with contextlib.suppress(OSError):  # the client was the first to go
                    end.shutdown(socket.SHUT_RDWR)
                end.close()
        self._thread.join()

    def send(self, *events):
        self._client.sendall(b"".join(packet(words) for words in events))

    def send_bytes(self, data):
        self._client.sendall(data)

    def _serve(self):
        try:
            self._client, _ = self._listener.accept()
            for words in self.first:
                self.send(words)
            self._agree()
            while data := self._client.recv(_PACKET.size, socket.MSG_WAITALL):
                if not self.hanging:
                    self._answer(_PACKET.unpack(data)[0] & 0xFFFF)
                self.asked.release()
        except (OSError, struct.error):
            pass  # ended

    def _agree(self):
        (wish,) = struct.unpack("=i", self._client.recv(4, socket.MSG_WAITALL))
        assert wish == FRAMES["wish"]
        if self.protocol:
            self._client.sendall(struct.pack("=i", FRAMES["agreed"]))
        else:
            (self.sensitivity,) = struct.unpack("=f", struct.pack("=i", wish))
            (self.sensitivity,) = struct.unpack("=f", self._client.recv(4, socket.MSG_WAITALL))
            self.asked.release()

    def _answer(self, request):
        known = {0x2000: self.name, 0x2003: self.buttons, 0x1002: "sensitivity"}
        self.send(*FRAMES["answers"][known[request]])
