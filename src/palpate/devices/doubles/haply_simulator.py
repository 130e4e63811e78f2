"""A double of the Haply Inverse Service 3.x with a simulated hand behind it, for trials and tests without hardware.

It speaks as the service does (Haply, *Inverse SDK 3.5*, "Simulation Channel", "HTTP", "Events & Monitoring"): an
inventory on connecting, then exactly one frame per message, a force only in a spelling that it knows, a force that
lapses without commands. It has the service's faults too; see `SimulatorFaults`. Its devices and grips are those of an
inventory, whose form it keeps: one that the maker prints as an example can be given, and then every frame has the
fields of that version of the service and no others.

The hand is a mass on a spring whose other end moves up and down by a sine, with damping; all in the service's axes:
x right, y away from the user, z up.
"""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.devices.device_options import word
from palpate.devices.doubles.service_double import HandSettings, MovedMass, ServiceDouble, ServiceFaults

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

__all__ = ["EVENTS", "HaplySimulator", "SimulatorFaults", "SimulatorSettings"]

_BASE = np.array([0.0, -0.12, 0.15])  # m, the resting cursor as seen from the device's base
_LARGEST_FORCE = 1000.0  # N that is refused as a slip of units

EVENTS = {
    "device-connected": "info",
    "device-disconnected": "warning",
    "device-battery-low": "warning",
    "device-battery-critical": "critical",
    "device-sleep": "notice",
    "device-busy": "warning",
    "device-connection-loop": "error",
    "device-calibration-failed": "error",
    "device-safety-triggered": "error",
    "http-route-deprecated": "warning",
}


@dataclass(frozen=True)
class SimulatorSettings(HandSettings):
    """Settings of the service and its hand."""

    port: int = 10001  # of the simulation channel with HTTP; 0 takes a free one, here and below
    events: int = 10020  # port of the events
    legacy: int = 0  # port of the format of version 3.0
    host: str = "127.0.0.1"
    # of a force that are understood; any other is ignored in silence
    spellings: tuple[str, ...] = ("vector", "values")
    force_scale: float = 1.0  # factor on every force
    kind: str = "inverse3"  # type of the devices: inverse3, inverse3x, minverse, or one that nobody knows
    # those connected: wireless (buttons a, b and c), wired (one button, button), both or none
    grip: str = word("wireless", "wired", "both", "none")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not set(self.spellings) <= {"vector", "values"}:
            raise self.refusal(f"spelling={','.join(self.spellings)}", "Spellings are vector and values.")


@dataclass
class SimulatorFaults(ServiceFaults):
    """Faults of the service, switched while it runs."""

    absent: int = 0  # number of the next frames without any device; -1 for ever
    bare: bool = False  # frames without what is optional: status, velocity and echoed force
    echo: float = 1.0  # factor of the echoed force; the hand feels the force as it is
    in_use: bool = False  # status of the device, as the next two
    powered: bool = True
    calibrated: bool = True
    deaf: bool = False  # the preset stays as it is
    silent_http: bool = False  # HTTP knows no routes, as a service before version 3.5 none of the settings
    plain_http: bool = False  # HTTP answers with the value alone, without an envelope
    position: tuple[float, float, float] | None = None  # m, reported instead of the hand's; may be NaN


@dataclass
class _Device:
    entry: dict[str, Any]  # of the inventory
    hand: MovedMass
    centred: bool = False

    @property
    def device_id(self) -> str:
        """The id by which commands name it."""
        return str(self.entry["device_id"])


class HaplySimulator(ServiceDouble):
    """The service with devices of the given ids; forces lapse by the time, s, that `clock` returns.

    An `inventory` is the first frame of a service, with its devices and grips, instead of those of the settings; it is
    copied. `faults` and `grips`, the inventory's entries by family, may be changed at any time. `received` counts
    messages on the simulation channel; `port`, `events_port` and `legacy_port` are in use once started.
    """

    faults: SimulatorFaults

    def __init__(
        self,
        settings: SimulatorSettings | None = None,
        clock: Callable[[], float] = time.monotonic,
        devices: tuple[str, ...] = ("04C2",),
        inventory: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__("Haply", clock)
        self.settings, self.faults = settings or SimulatorSettings(), SimulatorFaults()
        inventory = copy.deepcopy(dict(inventory or _inventory(self.settings, devices)))
        self.received, self.session = 0, int(inventory.pop("session_id", 1))
        self.port = self.events_port = self.legacy_port = 0
        self._devices = [_Device(entry, MovedMass(self.settings)) for entry in inventory.pop("inverse3")]
        self.grips: dict[str, list[dict[str, Any]]] = inventory

    def force(self, device: int = 0) -> np.ndarray:
        """Return the force (3,) on the hand, N, in the service's axes, after its scale; zero once it has lapsed."""
        lapsed = self.clock() > self.lapses_at(device)
        return np.zeros(3) if lapsed else self._devices[device].hand.force.copy()

    def lapses_at(self, device: int = 0) -> float:
        """Return when the force lapses unless another command comes, s of the clock."""
        return self._devices[device].hand.commanded + self.settings.silence

    def press(self, *names: str, down: bool = True) -> None:
        """Press or let go of buttons, wherever a grip has one of that name."""
        for grip in (grip for family in self.grips.values() for grip in family):
            for places in (grip["state"], grip["state"].get("buttons", {})):
                places |= {name: down for name in names if name in places}

    def turn(self, w: float, x: float, y: float, z: float) -> None:
        """Turn all grips, by a quaternion in the service's axes."""
        for grip in (grip for family in self.grips.values() for grip in family):
            grip["state"]["orientation"] = {"w": w, "x": x, "y": y, "z": z}

    def send_event(self, name: str, message: str = "", level: str = "", **data: Any) -> None:
        """Send an event to who watches, such as ``device-safety-triggered`` with ``safety_type="ebrake_triggered"``."""
        category = name.partition("-")[0]
        event = {"name": name, "category": category, "level": level or EVENTS.get(name, "notice")}
        self._do(self._send("events", json.dumps(event | {"data": data, "message": message})))

    def restart(self) -> None:
        """Close all connections, as a restarted service does: a new session, and devices in another order."""
        super().restart()
        self.session += 1
        self._devices.reverse()

    async def _listen(self) -> None:
        s, routes = self.settings, {"process_request": self._answer_http}
        self.port = await self._serve(self._simulate, s.host, s.port, **routes)
        self.events_port = await self._serve(self._watch, s.host, s.events, **routes)
        self.legacy_port = await self._serve(self._legacy, s.host, s.legacy, **routes)

    async def _watch(self, connection: ServerConnection) -> None:
        with self._hears(connection, "events"):
            await connection.wait_closed()

    async def _legacy(self, connection: ServerConnection) -> None:
        await connection.send(json.dumps(self._keyed()))
        async for _ in connection:
            await connection.send(json.dumps(self._keyed()))

    async def _simulate(self, connection: ServerConnection) -> None:
        with self._hears(connection, "simulation"):
            await connection.send(json.dumps(self._frame(full=True)))
            async for text in connection:
                if self.faults.closing:
                    self.faults.closing = False
                    break
                answer = json.dumps(self._obey(json.loads(text)))
                self.received += 1
                await self._answer(connection.send, answer)

    def _obey(self, message: dict[str, Any]) -> dict[str, Any]:
        """Carry out a message and return the frame that answers it."""
        now = self.clock()
        for device in self._devices:
            device.hand.advance(now)
        for entry in message.get("inverse3") or ():
            for device in self._devices:
                if device.device_id == entry.get("device_id"):
                    self._command(device, entry, now)
        return self._frame(full="force_render_full_state" in (message.get("session") or {}))

    def _command(self, device: _Device, entry: dict[str, Any], now: float) -> None:
        preset = ((entry.get("configure") or {}).get("preset") or {}).get("preset")
        if preset is not None and not self.faults.deaf:
            device.centred = preset == "arm_front_centered"
        command = (entry.get("commands") or {}).get("set_cursor_force") or {}
        for spelling in self.settings.spellings:
            value = command.get(spelling)
            if value is not None:
                force = self.settings.force_scale * np.array([float(value.get(axis, 0.0)) for axis in "xyz"])
                if np.linalg.norm(force) < _LARGEST_FORCE:  # a NaN fails this too
                    device.hand.force[:] = force
                    device.hand.commanded = now

    def _frame(self, *, full: bool) -> dict[str, Any]:
        if self.faults.absent:
            self.faults.absent -= self.faults.absent > 0
            devices = []
        else:
            devices = [self._entry(device, full=full) for device in self._devices]
        told = {"device_id", "state", "status"} | ({"config"} if full else set())
        grips = {
            family: [{key: grip[key] for key in grip.keys() & told} for grip in grips]
            for family, grips in self.grips.items()
        }
        return ({"session_id": self.session} if full else {}) | {"inverse3": devices} | grips

    def _entry(self, device: _Device, *, full: bool) -> dict[str, Any]:
        """Return the entry of a device as it is now, with the fields that it has in the inventory."""
        faults, hand, known = self.faults, device.hand, device.entry
        place = hand.position if device.centred else hand.position + _BASE
        now = {
            "cursor_position": _xyz(place if faults.position is None else np.array(faults.position)),
            "cursor_velocity": _xyz(hand.velocity),
            "current_cursor_force": _xyz(faults.echo * hand.force),
        }
        status = {"calibrated": faults.calibrated, "in_use": faults.in_use, "power_supply": faults.powered}
        state = known["state"] | {name: now[name] for name in now.keys() & known["state"].keys()}
        entry = known | {"state": state, "status": known.get("status", {}) | status}
        if "preset" in known["config"]:
            preset = "arm_front_centered" if device.centred else "defaults"
            entry["config"] = known["config"] | {"preset": preset}
        if faults.bare:
            del entry["status"]
            entry["state"] = {"cursor_position": now["cursor_position"]}
        if not full:
            del entry["config"]
        return entry

    def _keyed(self) -> dict[str, Any]:
        return {"inverse3": {d.device_id: self._entry(d, full=True) for d in self._devices}}

    def _answer_http(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer what is no websocket; None lets one begin."""
        if "Upgrade" in request.headers:
            return None
        path = request.path.partition("?")[0]
        routes: dict[str, Callable[[], Any]] = {
            "/version": lambda: {"project_version": "3.5.0", "git_tag": "simulated"},
            "/devices": lambda: self._frame(full=True),
            "/sessions": lambda: [{"session_id": self.session}],
            "/settings/devices/force_scale": lambda: self.settings.force_scale,
            "/force_scale": lambda: self.settings.force_scale,
        }
        if path not in routes or self.faults.silent_http:
            status, answer = HTTPStatus.NOT_FOUND, {"ok": False, "error": f"no route {path}"}
        else:
            data = routes[path]()
            status, answer = HTTPStatus.OK, data if self.faults.plain_http else {"ok": True, "data": data}
        return connection.respond(status, json.dumps(answer))


def _xyz(vector: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", vector.tolist(), strict=True))


def _inventory(settings: SimulatorSettings, devices: tuple[str, ...]) -> dict[str, Any]:
    """Return the inventory of a service 3.5, as far as a driver needs it, with the devices and grips asked for."""
    text = Path(__file__).with_name("haply_inventory.json").read_text(encoding="utf-8")
    inventory: dict[str, Any] = json.loads(text)
    (device,) = inventory["inverse3"]
    device["config"]["type"] = settings.kind
    inventory["inverse3"] = [copy.deepcopy(device) for _ in devices]
    for entry, name in zip(inventory["inverse3"], devices, strict=True):
        entry["device_id"] = entry["config"]["device_info"]["id"] = name
    for kind in ("wired", "wireless"):
        if settings.grip not in {kind, "both"}:
            inventory["wireless_verse_grip" if kind == "wireless" else "verse_grip"] = []
    return inventory
