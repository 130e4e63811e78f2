"""A 3Dconnexion puck through spacenavd, the free driver of such pucks: it moves the hand, and nothing pushes back.

The puck springs back by itself and moves by a millimetre, so its deflection is the hand's velocity; as a place it would
have to be held (S. Zhai, 1995, Human performance in six degree of freedom input control). Its three rotations are not
used. The zone around rest is a sphere, so that it keeps directions.

The driver speaks to the daemon's socket itself, in the protocol that the headers of spacenavd and libspnav state:
packets of eight 32-bit integers, the first of which tells the kind. libspnav would add a library and no function: it
hides a daemon that has ended behind "no event", and has one connection for a whole process.

A puck at rest, or held still, sends nothing. So the daemon is asked for a setting ten times a second: its answer is the
sign of life, and a daemon that hangs is a stall. Versions before 1.0 take no questions: with them silence is no stall,
and an unplugged puck isn't noticed; one that has ended is, by its socket.

References: *spacenavd*, proto.h and proto_unix.c; *libspnav manual*; libspnav, `spnav_posrot_moveobj`, for the axes.
"""

from __future__ import annotations

import math
import os
import select
import socket
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.devices.device import Driver, Sample, Traits, free_buttons, time_left
from palpate.devices.device_options import DeviceOptions, number, word
from palpate.devices.steering import DeadZone, SteeredHand
from palpate.errors import DeviceError, DeviceLostError

__all__ = [
    "CONFIGURATION",
    "INSTALL",
    "SOCKET",
    "VARIABLE",
    "SpaceMouseDevice",
    "SpaceMouseSettings",
    "sockets",
]

VARIABLE, CONFIGURATION, SOCKET = "SPNAV_SOCKET", "/etc/spnavrc", "/var/run/spnav.sock"
INSTALL = (
    "Install and start the puck's driver: on Debian and Ubuntu `apt install spacenavd`. A socket elsewhere is named in "
    f"the environment variable {VARIABLE}, or with --device spacemouse:socket=FILE."
)
_PACKET, _WORD = struct.Struct("=8i"), struct.Struct("=i")
_MOTION, _PRESS, _RELEASE, _DEVICE = 0, 1, 2, 3  # first integers of events
_ADDED, _REMOVED = 0, 1  # second integers of _DEVICE
_TAG = 0x7FAA0000  # in the first integer of requests and answers
_SENSITIVITY, _NAME, _BUTTONS, _PROTOCOL = 0x1002, 0x2000, 0x2003, 0x5500
_TEXT = 24  # bytes of a name in one packet
# s to wait for an answer, between two questions that show whether the daemon lives, and of silence until it is a fault
_ANSWER, _ASKED, _PATIENCE = 0.3, 0.1, 0.35
_CHUNK, _MOST_CHUNKS = 8192, 4  # bytes; in one tick: more than a daemon sends
_FEWEST_BUTTONS = 2  # that any puck has


@dataclass(frozen=True)
class SpaceMouseSettings(DeviceOptions):
    """Settings of the puck."""

    driver = "spacemouse"
    socket: str = ""  # the daemon's; empty looks for it
    mapping: str = word("speed", "position")  # speed or position: what the puck's deflection sets of the hand
    # m/s of the hand at full deflection, where the mapping is speed
    speed: float = number(0.08, 0.0, 1.0, above=True)
    full: float = number(350.0, 10.0, 32768.0)  # counts that the daemon reports at full deflection
    dead: float = number(0.1, 0.0, 0.5)  # dead zone, as a share of the full deflection
    # number of the button that brings the hand back to the centre, from 1; 0 for none
    centre: float = number(2.0, 0.0, 32.0, whole=True)
    # number of the button that holds the body while pressed, from 1; 0: the hand always holds it
    hold: float = number(0.0, 0.0, 32.0, whole=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.hold and self.hold == self.centre:
            raise self.refusal(f"hold={self.hold:g}", "It is another button than centre.")


def sockets(environment: Mapping[str, str], configuration: str) -> tuple[str, ...]:
    """Return where the daemon's socket may be: by the variable, its configuration's text, and by default."""
    lines = (line.partition("=") for line in configuration.splitlines())
    named = [value.strip() for key, _, value in lines if key.strip() == "socket"]
    return tuple(path for path in (environment.get(VARIABLE, ""), *named, SOCKET) if path)


class SpaceMouseDevice(Driver):
    """One puck, or all pucks of the daemon as one; `protocol` is the daemon's version, 0 before spacenavd 1.0."""

    settings_kind = SpaceMouseSettings
    called = "puck"
    traits = Traits(
        0.075, 10.0, None, "no motor; the limit on the force that is drawn", buttons=_FEWEST_BUTTONS - 1
    )

    def __init__(self, settings: SpaceMouseSettings | None = None) -> None:
        s = self._settings = settings or SpaceMouseSettings()
        self.name, self.protocol = "3Dconnexion puck", 0
        self.sample = Sample(_PATIENCE)
        self._zone = DeadZone(-s.full, s.full, 0.0, s.dead)
        self._hand = SteeredHand(
            self.sample.position, self.traits.radius, s.speed if s.mapping == "speed" else 0.0
        )
        self._bytes, self._answers = b"", list[tuple[int, ...]]()
        self._push, self._pressed = (0, 0, 0), 0
        self._gone, self._asked_at = False, -math.inf
        self._socket = _connected(s.socket)
        try:
            self._agree()
            if self.protocol:
                self._know()
        except BaseException:
            self._socket.close()
            raise

    @classmethod
    def traits_of(cls, options: Mapping[str, str]) -> Traits:
        """Return the traits: the buttons that a puck of two has left."""
        own = sum(
            options.get(name, given) not in {"0", ""} for name, given in (("centre", "2"), ("hold", "0"))
        )
        return replace(cls.traits, buttons=_FEWEST_BUTTONS - own)

    def read(self, now: float) -> Sample:
        """Return the hand that the puck has moved until `now`, s."""
        self.check_open()
        sample, s = self.sample, self._settings
        if self._receive() or not self.protocol or math.isinf(sample.time):
            sample.time = now
        self._take_packets()
        self._answers.clear()
        if self.protocol and not 0.0 <= now - self._asked_at < _ASKED:
            self._ask(_SENSITIVITY)
            self._asked_at = now
        if self._gone:
            raise DeviceLostError(f"{self.name} is no longer plugged in.", fix="Plug it in again.")
        x, y, away = (push / s.full for push in self._push)
        size = math.sqrt(x * x + y * y + away * away)
        stretch = self._zone.outside(min(size, 1.0)) / size if size > 0.0 else 0.0
        centre, hold = int(s.centre) - 1, int(s.hold) - 1
        self._hand.move(stretch * x, stretch * y, -stretch * away, now, centred=self._is_pressed(centre))
        sample.holding = hold < 0 or self._is_pressed(hold)
        first, last = sorted((centre, hold))
        sample.buttons = free_buttons(free_buttons(self._pressed, last), first)
        return sample

    def write(self, force: np.ndarray) -> None:
        """Do nothing: nothing pushes."""
        self.components(force)

    def close(self) -> None:
        """Let go."""
        self.closed = True
        self._socket.close()

    def _is_pressed(self, button: int) -> bool:
        return button >= 0 and bool(self._pressed >> button & 1)

    def _agree(self) -> None:
        """Agree on the newest protocol that both know; old daemons take the wish for a sensitivity."""
        wish = _TAG | _PROTOCOL | 1
        self._send(_WORD.pack(wish))
        for _ in self._until(_ANSWER):
            while len(self._bytes) >= _WORD.size:
                (word,) = _WORD.unpack_from(self._bytes)
                if word & ~0xFF == wish & ~0xFF:
                    self.protocol = word & 0xFF
                    self._bytes = self._bytes[_WORD.size :]
                    return
                if len(self._bytes) < _PACKET.size:
                    break
                self._bytes = self._bytes[_PACKET.size :]  # an event that came first
        self._send(struct.pack("=f", 1.0))

    def _know(self) -> None:
        """Learn which puck is plugged in, and how many buttons it has."""
        self._ask(_NAME)
        self._ask(_BUTTONS)
        name, status = b"", 0
        for _ in self._until(_ANSWER):
            self._take_packets()
            if not self._answers or self._answers[-1][0] != _TAG | _BUTTONS:
                continue
            for _, *words, status in self._answers[:-1]:
                name += struct.pack("=6i", *words)[: max(0, status) & 0xFFFF]
            break
        else:
            raise DeviceError("The puck's driver spacenavd does not answer.", fix="Start it again.")
        _, count, *_, missing = self._answers[-1]
        if missing < 0 or status < 0:
            raise DeviceError(
                "The puck's driver spacenavd runs, and has no puck.",
                fix="Plug it in; `journalctl -u spacenavd` or /var/log/spnavd.log says what the driver found.",
            )
        self.name = name.partition(b"\0")[0].decode("utf-8", "replace") or self.name
        own = sum(0 < number <= count for number in (self._settings.centre, self._settings.hold))
        self.traits = replace(type(self).traits, buttons=max(0, count - own), name=self.name)

    def _until(self, seconds: float) -> Iterator[None]:
        """Receive while opening, for at most `seconds`; the caller leaves when it has what it waits for."""
        for left in time_left(seconds):
            select.select([self._socket], (), (), left)
            if self._receive():
                yield

    def _receive(self) -> bool:
        """Take the bytes that have arrived; return whether there are any."""
        came = False
        for _ in range(_MOST_CHUNKS):
            try:
                data = self._socket.recv(_CHUNK)
            except BlockingIOError:
                break
            except OSError as error:
                raise self._lost(str(error)) from error
            if not data:
                raise self._lost("its socket was closed")
            self._bytes += data
            came = True
        return came

    def _take_packets(self) -> None:
        """Take all complete packets: the newest push, each button, each puck that comes or goes."""
        whole = len(self._bytes) - len(self._bytes) % _PACKET.size
        for words in _PACKET.iter_unpack(self._bytes[:whole]):
            kind, number = words[0], words[1]
            if kind == _MOTION:
                self._push = words[1:4]
            elif kind in {_PRESS, _RELEASE} and 0 <= number < 32:
                bit = 1 << number
                self._pressed = self._pressed | bit if kind == _PRESS else self._pressed & ~bit
            elif kind == _DEVICE:
                self._push, self._pressed, self._gone = (0, 0, 0), 0, number == _REMOVED
                if self._gone:
                    self._ask(_BUTTONS)  # of another puck, if there is one
            elif kind & ~0xFFFF == _TAG:
                self._answers.append(words)
                if kind == _TAG | _BUTTONS and words[7] >= 0:
                    self._gone = False
        self._bytes = self._bytes[whole:]

    def _ask(self, request: int) -> None:
        self._send(_PACKET.pack(_TAG | request, 0, 0, 0, 0, 0, 0, 0))

    def _send(self, data: bytes) -> None:
        try:
            self._socket.send(data)
        except BlockingIOError:
            pass  # a daemon that hangs: its silence tells
        except OSError as error:
            raise self._lost(str(error)) from error

    def _lost(self, why: str) -> DeviceLostError:
        return DeviceLostError(
            "The puck's driver spacenavd has ended.", why=why, fix="Start it, and then palpate, again."
        )


def _connected(path: str) -> socket.socket:
    """Return a connection to the daemon, at a path or where its socket is looked for."""
    try:
        configuration = Path(CONFIGURATION).read_text(encoding="utf-8", errors="replace")
    except OSError:
        configuration = ""
    refusals, absent = [], True
    for place in (path,) if path else sockets(os.environ, configuration):
        try:
            connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        except (AttributeError, OSError) as error:
            raise DeviceError(
                "A puck needs the driver spacenavd, which this system can't have.",
                why=f"It has no Unix sockets: {error}.",
                fix="Touch with the page, palpate view, or on Linux.",
            ) from error
        try:
            connection.connect(place)
        except OSError as error:
            connection.close()
            absent = absent and isinstance(error, FileNotFoundError)
            refusals.append(place if isinstance(error, FileNotFoundError) else f"{place}: {error.strerror}")
        else:
            connection.setblocking(False)
            return connection
    looked = "" if path else f" (named by ${VARIABLE}, by `socket =` in {CONFIGURATION}, or by default)"
    raise DeviceError(
        f"The driver of 3Dconnexion pucks, spacenavd, {'is not running' if absent else 'does not answer'}.",
        why=f"{'There is no' if absent else 'Tried the'} socket {'; '.join(refusals)}{looked}.",
        fix=INSTALL,
    )
