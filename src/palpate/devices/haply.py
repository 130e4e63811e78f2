"""Haply Inverse3, Inverse3x and Minverse through the Haply Inverse Service 3.x, over its websocket.

The service answers each message with exactly one frame and never sends one unasked (Haply, *Inverse SDK 3.5*,
"Simulation Channel"). So the driver works in lock-step: `write` sends one command, the next `read` takes its answer.
Frames are counted: while an answer is outstanding nothing is sent, except a zero force; after 10 ms of silence the
answer counts as lost and the latest force is sent; of several frames the newest counts. A position is therefore one
tick old, and its time is that of the command it answers.

Two spellings of a force are in use, ``vector`` and ``values``. The service is silent about one that it doesn't know.
The driver proves itself by the echoed force: an echo that stays zero for 50 commands makes it try the other spelling,
once. A service that echoes nothing is asked of its user. What the frames say is read in `haply_frames`.

A grip tells how it is turned; none of these devices renders a torque.

Only the thread that calls `read` and `write` is used; no call waits for longer than `HaplySettings.wait`.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from palpate.devices import haply_frames
from palpate.devices.device import ASSUMED_DAMPING, UNPUBLISHED, Driver, Sample, Traits, free_buttons
from palpate.devices.device_options import DeviceOptions, number, word
from palpate.devices.profiles import PROFILES, DeviceProfile
from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError

__all__ = ["AXES", "HaplyDevice", "HaplySettings"]

# Haply: x right, y away from the user, z up. Here: x right, y up, z towards the user.
AXES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))

SPELLINGS = ("vector", "values")
_PRESET = "arm_front_centered"  # the origin in the middle of the reach
_GOODBYE = 0.05  # s for each of the two answers that may be outstanding at the end
_LOST = 0.010  # s after which an answer counts as lost
_PROOF, _PROVING_FORCE = 50, 0.05  # commands of more than that many N until an echo is missed
_FIRST = 50  # samples at the start that are checked and thrown away
_REACH, _IMPOSSIBLE = 0.5, 3  # m from the centre that no arm reaches; samples in a row until that is an error
_BUTTONS = 4  # of the grip that has the most
_NEEDED = ("power_supply", "calibrated", "ready")
_STOPS = frozenset(
    ("device-disconnected", "device-busy", "ebrake_triggered", "stall_detected", "stability_ceiling")
)


@dataclass(frozen=True)
class HaplySettings(DeviceOptions):
    """Settings of the connection."""

    driver = "haply"
    url: str = "ws://localhost:10001"  # address of the simulation channel
    device: str = ""  # four-digit id of the device; empty takes the only one
    # port of the service's HTTP interface; 0 tries that of the channel, as of version 3.5, then 10000
    http: float = number(0.0, 0.0, 65535.0, whole=True)
    # port of the event channel, as of version 3.5; 0 does without the service's safety events
    events: float = number(10020.0, 0.0, 65535.0, whole=True)
    # of a force: vector, values, or auto, which finds it out by the echoed force
    spelling: str = word("auto", *SPELLINGS)
    # refuse or compensate: answer to a service that scales forces by a factor other than 1
    scale: str = word("refuse", "compensate")
    # factor of a service that doesn't tell it, as before version 3.5; 0 refuses such a service. What the service tells
    # goes before
    force_scale: float = number(0.0, 0.1, 10.0, also=0.0)
    grip: str = ""  # id of the grip whose buttons count; empty: those of all
    # button that is the hand, such as a of a wireless grip or button of a wired one: it holds the body only while the
    # button is pressed. Empty: it always holds. Of the others the first is the dead-man button where one is asked for
    hold: str = ""
    wait: float = number(0.0002, 0.0, 1.0)  # s, longest wait for an outstanding answer
    search: float = number(2.0, 0.0, 60.0)  # s to look for a device


class HaplyDevice(Driver):
    """One Inverse3, Inverse3x or Minverse behind the service.

    Its traits are those of the profile of its type, with as many buttons as its grips have. `note` says in sentences
    what was taken on trust when it was opened; empty for nothing. `spelling` is that of forces in use, and `proven`
    says whether an echoed force has shown that the service takes it. `lost` counts answers that never came, `surplus`
    frames that nobody asked for; `wait` is the longest wait of `read` for an outstanding answer, s.
    """

    settings_kind = HaplySettings
    called = "Haply device"
    traits = Traits(
        PROFILES["inverse3"].radius,
        PROFILES["inverse3"].max_force,
        ASSUMED_DAMPING,
        f"before it is opened: the Inverse3's; {PROFILES['inverse3'].source}; {UNPUBLISHED}",
        axes=AXES,
        buttons=_BUTTONS,
    )

    def __init__(self, settings: HaplySettings) -> None:
        self._settings = settings
        self.sample = Sample()
        self.spelling = SPELLINGS[0] if settings.spelling == "auto" else settings.spelling
        self.proven = settings.spelling != "auto"
        self.lost = self.surplus = 0
        self.wait = settings.wait
        self._force = np.zeros(3)
        self._outstanding, self._switched = 0, False
        self._now, self._asked, self._sent = -math.inf, -math.inf, 0.0
        self._unproven, self._impossible, self.note = 0, 0, ""
        self._stop, self._stopped_by, self._stop_kind = "", "", DeviceError
        self._scale = 1.0 / self._ask_scale()
        self._channel = WebsocketChannel(settings.url, "Haply Inverse Service")
        self._events: WebsocketChannel | None = None
        try:
            self._watch_events()
            self._identify(self._find())
            self._configure()
        except BaseException:
            self._release()
            raise

    def read(self, now: float) -> Sample:
        """Return the hand as of the last command that was answered."""
        self.check_open()
        self._now = now
        self._heed_events()
        frames = self._channel.receive(self.wait if self._outstanding else 0.0)
        if frames:
            self.surplus += max(0, len(frames) - self._outstanding)
            self._outstanding = max(0, self._outstanding - len(frames))
            self._take(self._entry(haply_frames.decode_frame(frames[-1])))
        if self._stop:
            raise self._stop_kind(self._stop, fix="Free the device, then start again.")
        if math.isinf(self._asked):
            self.sample.time = now  # nothing has been asked of it since it was opened
        return self.sample

    def write(self, force: np.ndarray) -> None:
        """Send a force (3,), N, unless an answer is outstanding; a zero force is sent in any case."""
        *_, norm = self.components(force)
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
        if self.closed:
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
        self.closed = True
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
        place = haply_frames.read_vector(state, "cursor_position", math.nan)
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
        if "current_cursor_force" not in state:
            self._stop = (
                "The Haply service echoes no force, as before version 3.5: nothing shows how a force must be spelt. "
                "Give spelling=values, and see that the hand is pushed; if not, spelling=vector."
            )
            return
        echo = np.array(haply_frames.read_vector(state, "current_cursor_force", 0.0)) / self._scale
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
        """Take orientation and buttons of the grips, in the order of their names; one that holds is the driver's own.

        Of several grips the last one's orientation counts: `grip` names one.
        """
        sample, own = self.sample, self._settings.hold
        sample.holding, sample.buttons = not own, 0
        for grip in haply_frames.grips_in(frame, self._settings.grip):
            pressed = haply_frames.read_buttons(grip)
            mask = sum(down << place for place, down in enumerate(pressed.values()))
            haply_frames.read_orientation(grip, sample.orientation)
            sample.holding = sample.holding or pressed.get(own, False)
            sample.buttons |= free_buttons(mask, list(pressed).index(own) if own in pressed else -1)

    def _ask_scale(self) -> float:
        """Ask the service how it scales forces, which it does in silence; return the factor."""
        settings = self._settings
        address = urlsplit(settings.url)
        host, port = address.hostname or "localhost", address.port or 10001
        ports = (int(settings.http),) if settings.http else (port, haply_frames.OLD_HTTP_PORT)
        scale, reasons = haply_frames.ask_scale(host, ports)
        if scale is None:
            scale = settings.force_scale
            if scale == 0.0:
                raise DeviceError(
                    f"The Haply Inverse Service at {host} does not say how it scales forces.",
                    why=reasons,
                    fix="Start the service (or `palpate devices simulate haply`), or give http=PORT. A service before "
                    "3.5 may not tell: if its scale is 1 in the Haply Hub, give force_scale=1.",
                )
            self._trust(
                f"forces are taken to be scaled by {scale:g}, as force_scale says, since the Haply service doesn't "
                f"tell ({reasons})"
            )
        if scale == 1.0 or (settings.scale == "compensate" and 0.1 <= scale <= 10.0):
            return scale
        raise DeviceError(
            f"The Haply Inverse Service multiplies every force by {scale:g}.",
            why="A body would feel softer or stiffer than it is.",
            fix="Set its devices/force_scale to 1, or give scale=compensate, which takes 0.1 … 10.",
        )

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
                    fix="Give its port with events=PORT; events=0 goes without these warnings, as before version 3.5, "
                    "which has no such channel.",
                ) from error

    def _heed_events(self) -> None:
        for text in self._events.receive(0.0) if self._events else ():
            event = haply_frames.decode_frame(text)
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

    def _find(self) -> Mapping[str, Any]:
        """Look for the device until it is there; return the inventory that has it."""
        end = time.monotonic() + self._settings.search
        frame = haply_frames.decode_frame(self._next())
        while not frame.get("inverse3") and time.monotonic() < end:
            time.sleep(0.01)
            self._channel.send('{"session":{"force_render_full_state":{}}}')
            frame = haply_frames.decode_frame(self._next())
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
        return frame

    def _identify(self, frame: Mapping[str, Any]) -> None:
        """Find out from an inventory which device it is, what it may do, and which buttons there are."""
        entry = self._entry(frame)
        if (entry.get("status") or {}).get("in_use"):
            raise DeviceError(
                f"Haply device {self.device_id} is in use by another program.", fix="Close that program."
            )
        types = haply_frames.device_types(entry)
        self.profile: DeviceProfile = haply_frames.choose_profile(types)
        self.name = f"Haply {' and '.join(types) or 'device'} {self.device_id}"
        if self.profile.name == "unknown":
            self.name += ", unknown type"
            self._trust(f"{self.name}: the least of each limit that this driver knows holds")
        self.traits = self.limited_traits(
            self.profile,
            f"{self.profile.source}; {UNPUBLISHED}",
            stamped=True,  # a sample is as old as the question to it
            buttons=self._count_buttons(frame),
            orients=any(haply_frames.grips_in(frame, self._settings.grip)),
        )

    def _count_buttons(self, frame: Mapping[str, Any]) -> int:
        """Return how many buttons are left to the loop, and refuse a button to hold that no grip has."""
        own, names = self._settings.hold, dict[str, None]()
        most = 0
        for grip in haply_frames.grips_in(frame, self._settings.grip):
            buttons = haply_frames.read_buttons(grip)
            if not buttons:
                self._trust(f"Haply grip {grip.get('device_id')} tells of no button in a form that is known")
            names |= dict.fromkeys(buttons)
            most = max(most, len(buttons.keys() - {own}))
        if own and own not in names:
            raise DeviceError(
                f"No grip of the Haply service has a button {own!r}.",
                why=f"Its buttons: {', '.join(names)}." if names else "There is no grip that is awake.",
                fix="Connect the grip and wake it, or name another button with hold=NAME.",
            )
        return most

    def _trust(self, sentence: str) -> None:
        self.note += f"{'; ' if self.note else ''}{sentence}"

    def _configure(self) -> None:
        """Move the origin to the middle of the reach, and throw the first samples away once they look right."""
        command = {"set_cursor_force": {self.spelling: {"x": 0, "y": 0, "z": 0}}}
        configured: dict[str, Any] = {
            "device_id": self.device_id,
            "configure": {"preset": {"preset": _PRESET}},
            "commands": command,
        }
        session: dict[str, Any] = {"configure": {"profile": {"name": "palpate"}}}
        message = {"session": session, "inverse3": [configured]}
        for sample in range(_FIRST):
            self._channel.send(json.dumps(message))
            message = {"inverse3": [{"device_id": self.device_id, "commands": command}]}
            if sample == _FIRST - 2:  # the last answer has the configuration
                message["session"] = {"force_render_full_state": {}}
            entry = self._entry(haply_frames.decode_frame(self._next()))
            if sample > _FIRST // 2:  # several drivers deliver garbage at first
                state = entry.get("state") or {}
                place = haply_frames.read_vector(state, "cursor_position", math.nan)
                speed = haply_frames.read_vector(state, "cursor_velocity", 0.0)
                fix = "Calibrate it in the Haply Hub, and hold it still while it is opened."
                self.check_start(math.hypot(*place), math.hypot(*speed), _REACH, fix)
                self._take(entry)
        preset = (entry.get("config") or {}).get("preset", "")
        if preset not in {"", _PRESET}:
            raise DeviceError(
                f"Haply device {self.device_id} keeps the preset {preset!r}.",
                why=f"A body lies where it should only with {_PRESET!r}, whose origin is the middle of the reach.",
                fix="Close other programs that configure the device, or update the service to 3.5.",
            )
        if not preset:
            self._trust(
                "the service doesn't tell whether its origin is the middle of the reach: try where a body lies"
            )
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
