"""Haply Inverse3 and Inverse3x through the Haply Inverse Service 3.x, over its websocket.

The service answers each message with exactly one frame and never sends one unasked (Haply, *Inverse SDK 3.5*,
"Simulation Channel"). So the driver works in lock-step: `write` sends one command, the next `read` takes its answer.
Frames are counted: while an answer is outstanding nothing is sent, except a zero force; after 10 ms of silence the
answer counts as lost and the latest force is sent; of several frames the newest counts. A position is therefore one
tick old, and its time is that of the command it answers.

Two spellings of a force are in use, ``vector`` and ``values``. The service is silent about one that it doesn't know.
The driver proves itself by the echoed force: an echo that stays zero for 50 commands makes it try the other spelling,
once.

Only the thread that calls `read` and `write` is used; no call waits for longer than `HaplySettings.wait`.
"""

from __future__ import annotations

import http.client
import json
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar
from urllib.parse import urlsplit

import numpy as np

from palpate.errors import DeviceError, DeviceLostError, DeviceStopError, UsageError
from palpate.runtime.devices.device import Sample, Traits, free_buttons, settings_from
from palpate.runtime.devices.websocket_channel import WebsocketChannel
from palpate.runtime.shared_state import Block

__all__ = ["AXES", "HaplyDevice", "HaplySettings"]

# Haply: x right, y away from the user, z up. Here: x right, y up, z towards the user.
AXES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))

SPELLINGS = ("vector", "values")
_PRESET = "arm_front_centered"  # the origin in the middle of the reach
_GOODBYE = 0.05  # s for each of the two answers that may be outstanding at the end
_LOST = 0.010  # s after which an answer counts as lost
_PROOF, _PROVING_FORCE = 50, 0.05  # commands of more than that many N until an echo is missed
_FIRST, _FASTEST = 50, 1.0  # samples that are checked and thrown away, m/s
_REACH, _IMPOSSIBLE = 0.5, 3  # m from the centre that no arm reaches; samples in a row until that is an error
_NEEDED = ("power_supply", "calibrated", "ready")
_STOPS = frozenset(
    ("device-disconnected", "device-busy", "ebrake_triggered", "stall_detected", "stability_ceiling")
)


@dataclass(frozen=True)
class HaplySettings:
    """Settings of the connection.

    Attributes
    ----------
    url : str
        Address of the simulation channel.
    device : str
        Four-digit id of the device; empty takes the only one.
    http : float
        Port of the service's HTTP interface; 0: that of the channel, as of version 3.5.
    events : float
        Port of the event channel; 0 does without the service's safety events.
    spelling : {"auto", "vector", "values"}
        How a force is written; "auto" finds it out by the echoed force.
    scale : {"refuse", "compensate"}
        Answer to a service that scales forces by a factor other than 1.
    hold : str
        Button of a grip, such as a, that is the hand: it holds the body only while the button is pressed. Empty: it
        always holds. Of the others the first is the dead-man button where one is asked for.
    wait : float
        Longest wait for an outstanding answer, s.
    search : float
        Time to look for a device, s.
    """

    url: str = "ws://localhost:10001"
    device: str = ""
    http: float = 0.0
    events: float = 10020.0
    spelling: str = "auto"
    scale: str = "refuse"
    hold: str = ""
    wait: float = 0.0002
    search: float = 2.0

    def __post_init__(self) -> None:
        if self.spelling not in {"auto", *SPELLINGS} or self.scale not in {"refuse", "compensate"}:
            raise UsageError(
                f"Haply has no spelling {self.spelling!r} or no way with a scale {self.scale!r}.",
                fix="Choose spelling=auto, vector or values, and scale=refuse or compensate.",
            )
        ports = all(port.is_integer() and 0.0 <= port <= 65535.0 for port in (self.http, self.events))
        if not (ports and 0.0 <= self.wait <= 1.0 and 0.0 <= self.search <= 60.0):
            raise UsageError(
                "A port, wait or search of haply is out of range.",
                fix="Ports are 0 … 65535, wait is 0 … 1 s, search is 0 … 60 s.",
            )


class HaplyDevice:
    """One Inverse3 behind the service.

    Attributes
    ----------
    spelling : str
        The spelling of forces in use.
    proven : bool
        Whether an echoed force has shown that the service takes it.
    lost, surplus : int
        Answers that never came, and frames that nobody asked for.
    wait : float
        Longest wait of `read` for an outstanding answer, s.
    """

    traits: ClassVar[Traits] = Traits(
        0.10,
        10.0,
        0.5,
        "radius: the vendor's tutorials; force: the Inverse3's peak; damping: none is published, 0.5 N·s/m is assumed",
        axes=AXES,
        buttons=3,
    )

    def __init__(self, settings: HaplySettings) -> None:
        self._settings = settings
        self.sample = Sample()
        self.spelling = SPELLINGS[0] if settings.spelling == "auto" else settings.spelling
        self.proven = settings.spelling != "auto"
        self.lost = self.surplus = 0
        self.wait = settings.wait
        self._force = np.zeros(3)
        self._outstanding, self._closed, self._switched = 0, False, False
        self._now, self._asked, self._sent = -math.inf, -math.inf, 0.0
        self._unproven, self._impossible = 0, 0
        self._stop, self._stopped_by, self._stop_kind = "", "", DeviceError
        self._scale = 1.0 / _force_scale(settings)
        self._channel = WebsocketChannel(settings.url, "Haply Inverse Service")
        self._events: WebsocketChannel | None = None
        try:
            self._watch_events()
            self.device_id = self._find()
            self._configure()
        except BaseException:
            self._release()
            raise

    @classmethod
    def open(cls, commands: Block, options: Mapping[str, str]) -> HaplyDevice:
        """Open from texts such as ``{"ws://localhost:10001": "", "hold": "a"}``; the address needs no key."""
        urls = [key for key in options if key.startswith("ws:")]
        texts = {key: text for key, text in options.items() if key not in urls}
        return cls(settings_from(HaplySettings, texts | ({"url": urls[0]} if urls else {})))

    def read(self, now: float) -> Sample:
        """Return the hand as of the last command that was answered."""
        self._now = now
        self._heed_events()
        frames = self._channel.receive(self.wait if self._outstanding else 0.0)
        if frames:
            self.surplus += max(0, len(frames) - self._outstanding)
            self._outstanding = max(0, self._outstanding - len(frames))
            self._take(self._entry(_decoded(frames[-1])))
        if self._stop:
            raise self._stop_kind(self._stop, fix="Free the device, then start again.")
        if math.isinf(self._asked):
            self.sample.time = now  # nothing has been asked of it since it was opened
        return self.sample

    def write(self, force: np.ndarray) -> None:
        """Send a force (3,), N, unless an answer is outstanding; a zero force is sent in any case."""
        if self._closed:
            raise DeviceError("The Haply device is closed.", fix="Open it again.")
        x, y, z = force.tolist()
        norm = math.hypot(x, y, z)
        if not math.isfinite(norm):
            raise DeviceError("A force that is not a finite number was kept from the Haply device.")
        if self._outstanding:
            silent = self._now - self._asked > _LOST
            if not silent and (norm > 0.0 or self._sent == 0.0):
                return
            if silent:
                self.lost += self._outstanding
                self._outstanding = 0
        self._force[:] = force
        self._send(norm)

    def close(self) -> None:
        """Send zero force, wait at most 0.1 s for its answer, and let go."""
        if self._closed:
            return
        self._force[:] = 0.0
        try:
            self._send(0.0)
            for _ in range(self._outstanding):
                self._channel.receive(_GOODBYE)
        except DeviceError:
            pass  # the service is gone, and with it the force
        finally:
            self._release()

    def _release(self) -> None:
        self._closed = True
        for channel in (self._channel, self._events):
            if channel is not None:
                channel.close()

    def _send(self, norm: float) -> None:
        x, y, z = (self._scale * self._force).tolist()
        self._channel.send(
            f'{{"inverse3":[{{"device_id":"{self.device_id}","commands":{{"set_cursor_force":'
            f'{{"{self.spelling}":{{"x":{x:.6g},"y":{y:.6g},"z":{z:.6g}}}}}}}}}]}}'
        )
        self._outstanding += 1
        self._asked, self._sent = self._now, norm

    def _take(self, entry: Mapping[str, Any]) -> None:
        state, sample = entry.get("state") or {}, self.sample
        for name in _NEEDED:
            if (entry.get("status") or {}).get(name, True) is False:
                raise DeviceStopError(
                    f"Haply device {self.device_id} reports that it is not {name.replace('_', ' ')}.",
                    fix="Check its power supply and calibrate it in the Haply Hub.",
                )
        self._prove(state)
        place = _vector(state, "cursor_position", math.nan)
        if math.hypot(*place) > _REACH:
            self._impossible += 1
            if self._impossible >= _IMPOSSIBLE:
                raise DeviceError(
                    f"Haply device {self.device_id} reports a place {_REACH:g} m or more from its centre.",
                    why="No arm reaches that far: it is not calibrated, or damaged.",
                    fix="Calibrate it in the Haply Hub.",
                )
            return  # the sample stays as old as it is
        self._impossible = 0
        sample.position[:] = place
        sample.time = self._asked

    def _prove(self, state: Mapping[str, Any]) -> None:
        """Compare the echoed force with the one sent: direction and order of magnitude only."""
        if self.proven or self._sent <= _PROVING_FORCE:
            return
        echo = np.array(_vector(state, "current_cursor_force", 0.0)) / self._scale
        along = float(echo @ self._force) / self._sent**2
        if 0.1 < along < 10.0:
            self.proven = True
            return
        self._unproven += 1
        if self._unproven < _PROOF:
            return
        tried, self._unproven = self.spelling, 0
        unchecked = "spelling=vector or spelling=values goes without this check"
        if math.hypot(*echo.tolist()) > _PROVING_FORCE:
            sent, echoed = np.round(self._force, 3).tolist(), np.round(echo, 3).tolist()
            self._stop = (
                f"The Haply service echoes a force of {echoed} N where {sent} N was sent; {unchecked}."
            )
            return
        if self._switched:
            self._stop = f"The Haply service took no force, neither as 'vector' nor as 'values'; {unchecked}."
            return
        self._switched, self.spelling = True, SPELLINGS[1 - SPELLINGS.index(tried)]
        # one tick of zero force: what the hand feels next must grow from nothing
        raise DeviceError(f"The Haply service ignores forces spelt {tried!r}: now trying {self.spelling!r}.")

    def _entry(self, frame: Mapping[str, Any]) -> Mapping[str, Any]:
        entries = frame.get("inverse3")
        if isinstance(entries, Mapping):
            raise DeviceError(
                "The address speaks the legacy format of version 3.0.",
                fix="Use the simulation channel, ws://localhost:10001.",
            )
        self._press(frame)
        for entry in entries or ():
            if entry.get("device_id") == self.device_id:
                return entry  # type: ignore[no-any-return]
        self.sample.holding = False
        raise DeviceLostError(
            f"Haply device {self.device_id} is no longer there.", fix="Connect it, then start again."
        )

    def _press(self, frame: Mapping[str, Any]) -> None:
        """Take the buttons of the grips, in the order of their names; the one that holds is the driver's own."""
        sample, own = self.sample, self._settings.hold
        sample.holding, sample.buttons = not own, 0
        for family in ("verse_grip", "wireless_verse_grip"):
            for grip in frame.get(family) or ():
                buttons = (grip.get("state") or {}).get("buttons") or {}
                names = sorted(buttons)
                mask = sum(1 << k for k, name in enumerate(names) if buttons[name])
                sample.holding = sample.holding or bool(buttons.get(own))
                sample.buttons |= free_buttons(mask, names.index(own) if own in names else -1)

    def _watch_events(self) -> None:
        if self._settings.events:
            host = urlsplit(self._settings.url).hostname
            address = f"ws://{host}:{self._settings.events:.0f}"
            try:
                self._events = WebsocketChannel(address, "events of the Haply Inverse Service")
            except DeviceError as error:
                raise DeviceError(
                    error.what,
                    why="Brakes, stalls and disconnections are reported there.",
                    fix="Give its port with events=PORT; events=0 goes without these warnings.",
                ) from error

    def _heed_events(self) -> None:
        for text in self._events.receive(0.0) if self._events else ():
            event = _decoded(text)
            data = event.get("data") or {}
            name = data.get("safety_type") or event.get("name", "")
            if data.get("device_id", self.device_id) != self.device_id:
                continue
            if name == "ebrake_released" and self._stopped_by == "ebrake_triggered":
                self._stop = self._stopped_by = ""
            elif name in _STOPS or event.get("level") in {"critical", "panic"}:
                self._stopped_by = name
                self._stop_kind = DeviceLostError if name == "device-disconnected" else DeviceStopError
                self._stop = f"The Haply service reports {name}: {event.get('message') or 'no message'}"

    def _find(self) -> str:
        end = time.monotonic() + self._settings.search
        frame = _decoded(self._next())
        while not frame.get("inverse3") and time.monotonic() < end:
            time.sleep(0.01)
            self._channel.send('{"session":{"force_render_full_state":{}}}')
            frame = _decoded(self._next())
        entries = frame.get("inverse3") or []
        wanted = self._settings.device
        names = [e["device_id"] for e in entries] if isinstance(entries, list) else list(entries)
        if not names or (wanted and wanted not in names) or (len(names) > 1 and not wanted):
            raise DeviceError(
                f"The Haply service has {len(names)} devices: {', '.join(names) or 'none'}.",
                why=f"{wanted or 'One'} is wanted.",
                fix="Connect and switch on the device, or name it with device=ID.",
            )
        self.device_id = wanted or names[0]
        entry = self._entry(frame)
        kind = str(((entry.get("config") or {}).get("device_info") or {}).get("device_type", ""))
        if "minverse" in kind.lower():
            raise DeviceError(
                f"Haply device {self.device_id} is a Minverse.",
                why="Its workspace is smaller, and its largest force is not known here.",
                fix="Use an Inverse3 or Inverse3x.",
            )
        if (entry.get("status") or {}).get("in_use"):
            raise DeviceError(
                f"Haply device {self.device_id} is in use by another program.", fix="Close that program."
            )
        return self.device_id

    def _configure(self) -> None:
        """Move the origin to the middle of the reach, and throw the first samples away once they look right."""
        command = {"set_cursor_force": {self.spelling: {"x": 0, "y": 0, "z": 0}}}
        configured: dict[str, Any] = {
            "device_id": self.device_id,
            "configure": {"preset": {"preset": _PRESET}},
            "commands": command,
        }
        message = {"session": {"configure": {"profile": {"name": "palpate"}}}, "inverse3": [configured]}
        for sample in range(_FIRST):
            self._channel.send(json.dumps(message))
            message = {"inverse3": [{"device_id": self.device_id, "commands": command}]}
            entry = self._entry(_decoded(self._next()))
            if sample > _FIRST // 2:  # several drivers deliver garbage at first
                state = entry.get("state") or {}
                place = _vector(state, "cursor_position", math.nan)
                speed = _vector(state, "cursor_velocity", 0.0)
                if not (math.hypot(*place) <= _REACH and math.hypot(*speed) <= _FASTEST):
                    raise DeviceError(
                        f"Haply device {self.device_id} starts at {place} m with {speed} m/s.",
                        why=f"A start is within {_REACH:g} m of the centre and slower than {_FASTEST:g} m/s.",
                        fix="Calibrate it in the Haply Hub, and hold it still while it is opened.",
                    )
                self._take(entry)
        self._impossible, self.sample.holding = 0, False  # until the loop's first command is answered

    def _next(self) -> str:
        """Wait for one frame, at most a second; only while opening."""
        frames = self._channel.receive(1.0)
        if not frames:
            raise DeviceError(
                "The Haply service answers nothing within a second.",
                fix="Check that the address is that of its simulation channel, and restart the service.",
            )
        return frames[-1]


def _decoded(text: str) -> Mapping[str, Any]:
    try:
        frame = json.loads(text)
    except ValueError as error:
        raise DeviceError("The Haply service sent a frame that is not JSON.", why=text[:100]) from error
    return frame if isinstance(frame, Mapping) else {}


def _vector(state: Mapping[str, Any], name: str, missing: float) -> list[float]:
    value = state.get(name) or {}
    return [float(value.get(axis, missing)) for axis in "xyz"]


def _force_scale(settings: HaplySettings) -> float:
    """Ask the service how it scales forces: it does so in silence."""
    address = urlsplit(settings.url)
    host, port = address.hostname or "localhost", int(settings.http) or address.port or 10001
    connection = http.client.HTTPConnection(host, port, timeout=2.0)
    try:
        connection.request("GET", "/settings/devices/force_scale")
        answer = json.loads(connection.getresponse().read())
        data = answer["data"]
        if isinstance(data, Mapping):
            data = next(v for v in data.values() if isinstance(v, (int, float)))
        scale = float(data)
    except (OSError, http.client.HTTPException, ValueError, TypeError, LookupError, StopIteration) as error:
        raise DeviceError(
            f"The Haply Inverse Service at {host}:{port} does not say how it scales forces.",
            why=f"{type(error).__name__}: {error}",
            fix="Start the service (or `palpate devices simulate haply`), or give http=PORT; before 3.5 it is 10000.",
        ) from error
    finally:
        connection.close()
    if scale == 1.0 or (settings.scale == "compensate" and 0.1 <= scale <= 10.0):
        return scale
    raise DeviceError(
        f"The Haply Inverse Service multiplies every force by {scale:g}.",
        why="A body would feel softer or stiffer than it is.",
        fix="Set its devices/force_scale to 1, or give scale=compensate, which takes 0.1 … 10.",
    )
