"""A double of the Haply Inverse Service 3.x with a simulated hand behind it, for trials and tests without hardware.

It speaks as the service does (Haply, *Inverse SDK 3.5*, "Simulation Channel", "HTTP", "Events & Monitoring"): an
inventory on connecting, then exactly one frame per message, a force only in a spelling that it knows, a force that
lapses without commands. It has the service's faults too; see `SimulatorFaults`.

The hand is a mass on a spring whose other end moves up and down by a sine, with damping; all in the service's axes:
x right, y away from the user, z up.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.runtime.devices.service_double import HandSettings, MovedMass, ServiceDouble

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
    """Settings of the service and its hand.

    Attributes
    ----------
    port, events, legacy : int
        Ports of the simulation channel with HTTP, of the events, and of the format of version 3.0; 0 takes a free one.
    host : str
        Address to listen at.
    spellings : tuple of str
        Spellings of a force that are understood; any other is ignored in silence.
    force_scale : float
        Factor on every force.
    """

    port: int = 10001
    events: int = 10020
    legacy: int = 0
    host: str = "127.0.0.1"
    spellings: tuple[str, ...] = ("vector", "values")
    force_scale: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if any(s not in {"vector", "values"} for s in self.spellings):
            raise UsageError(
                "The simulated Haply knows no such spelling.", fix="Spellings are vector and values."
            )


@dataclass
class SimulatorFaults:
    """Faults of the service, switched while it runs.

    Attributes
    ----------
    held : bool
        Answers are kept back until this is false again; then all are sent.
    dropped, doubled : int
        Number of the next answers that are lost, or sent twice.
    closing : bool
        The next message closes the connection.
    absent : int
        Number of the next frames without any device; -1 for ever.
    bare : bool
        Frames without what is optional: status, velocity and echoed force.
    echo : float
        Factor of the echoed force; the hand feels the force as it is.
    in_use, powered, calibrated : bool
        Status of the device.
    silent_http : bool
        HTTP knows no routes.
    position : three floats, optional
        Position that is reported instead of the hand's, m; may be NaN.
    device_type : str
        In the inventory.
    """

    held: bool = False
    dropped: int = 0
    doubled: int = 0
    closing: bool = False
    absent: int = 0
    bare: bool = False
    echo: float = 1.0
    in_use: bool = False
    powered: bool = True
    calibrated: bool = True
    silent_http: bool = False
    position: tuple[float, float, float] | None = None
    device_type: str = "inverse3"


@dataclass
class _Device:
    device_id: str
    hand: MovedMass
    centred: bool = False


class HaplySimulator(ServiceDouble):
    """The service.

    Parameters
    ----------
    settings : SimulatorSettings, optional
        Ports, spellings, hand.
    clock : callable
        Returns the time, s, by which the hand moves and forces lapse.
    devices : tuple of str
        Ids of the devices.

    Attributes
    ----------
    faults : SimulatorFaults
        What goes wrong; may be changed at any time.
    received : int
        Messages on the simulation channel.
    port, events_port, legacy_port : int
        Ports in use, once started.
    buttons : dict
        Buttons of the grip, by name.
    """

    def __init__(
        self,
        settings: SimulatorSettings | None = None,
        clock: Callable[[], float] = time.monotonic,
        devices: tuple[str, ...] = ("04C2",),
    ) -> None:
        super().__init__("Haply")
        self.settings, self._clock = settings or SimulatorSettings(), clock
        self.faults = SimulatorFaults()
        self.received, self.session = 0, 1
        self.port = self.events_port = self.legacy_port = 0
        self.buttons = {"a": False, "b": False, "c": False}
        self._devices = [_Device(name, MovedMass(self.settings)) for name in devices]
        self._watchers: set[ServerConnection] = set()
        self._clients: set[ServerConnection] = set()
        self._kept: list[tuple[ServerConnection, str]] = []

    def force(self, device: int = 0) -> np.ndarray:
        """Return the force (3,) on the hand, N, in the service's axes, after its scale; zero once it has lapsed."""
        lapsed = self._clock() > self.lapses_at(device)
        return np.zeros(3) if lapsed else self._devices[device].hand.force.copy()

    def lapses_at(self, device: int = 0) -> float:
        """Return when the force lapses unless another command comes, s of the clock."""
        return self._devices[device].hand.commanded + self.settings.silence

    def release(self) -> None:
        """Send the answers that were held, in their order."""
        self.faults.held = False
        self._do(self._send_kept())

    def send_event(self, name: str, message: str = "", level: str = "", **data: Any) -> None:
        """Send an event to who watches, such as ``device-safety-triggered`` with ``safety_type="ebrake_triggered"``."""
        category = name.partition("-")[0]
        event = {"name": name, "category": category, "level": level or EVENTS.get(name, "notice")}
        self._do(self._broadcast(json.dumps(event | {"data": data, "message": message})))

    def restart(self) -> None:
        """Close all connections, as a restarted service does: a new session, and devices in another order."""
        self._do(self._drop_clients())
        self.session += 1
        self._devices.reverse()

    async def _listen(self) -> None:
        s, routes = self.settings, {"process_request": self._answer_http}
        self.port = await self._serve(self._simulate, s.host, s.port, **routes)
        self.events_port = await self._serve(self._watch, s.host, s.events, **routes)
        self.legacy_port = await self._serve(self._legacy, s.host, s.legacy, **routes)

    async def _drop_clients(self) -> None:
        for client in [*self._clients, *self._watchers]:
            await client.close()

    async def _broadcast(self, text: str) -> None:
        for watcher in list(self._watchers):
            await watcher.send(text)

    async def _send_kept(self) -> None:
        kept, self._kept = self._kept, []
        for connection, text in kept:
            await connection.send(text)

    async def _watch(self, connection: ServerConnection) -> None:
        self._watchers.add(connection)
        try:
            await connection.wait_closed()
        finally:
            self._watchers.discard(connection)

    async def _legacy(self, connection: ServerConnection) -> None:
        await connection.send(json.dumps(self._keyed()))
        async for _ in connection:
            await connection.send(json.dumps(self._keyed()))

    async def _simulate(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        self._clients.add(connection)
        try:
            await connection.send(json.dumps(self._frame(full=True)))
            async for text in connection:
                self.received += 1
                if self.faults.closing:
                    self.faults.closing = False
                    break
                await self._reply(connection, json.dumps(self._obey(json.loads(text))))
        except ConnectionClosed:
            pass  # a client that is gone takes nothing along
        finally:
            self._clients.discard(connection)

    async def _reply(self, connection: ServerConnection, answer: str) -> None:
        faults = self.faults
        if faults.held:
            self._kept.append((connection, answer))
        elif faults.dropped > 0:
            faults.dropped -= 1
        else:
            await connection.send(answer)
            if faults.doubled > 0:
                faults.doubled -= 1
                await connection.send(answer)

    def _obey(self, message: dict[str, Any]) -> dict[str, Any]:
        """Carry out a message and return the frame that answers it."""
        now = self._clock()
        for device in self._devices:
            device.hand.advance(now)
        for entry in message.get("inverse3") or ():
            for device in self._devices:
                if device.device_id == entry.get("device_id"):
                    self._command(device, entry, now)
        return self._frame(full="force_render_full_state" in (message.get("session") or {}))

    def _command(self, device: _Device, entry: dict[str, Any], now: float) -> None:
        preset = ((entry.get("configure") or {}).get("preset") or {}).get("preset")
        if preset is not None:
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
        grip = {
            "device_id": "6F1A",
            "state": {"orientation": {"w": 1, "x": 0, "y": 0, "z": 0}, "buttons": self.buttons},
        }
        frame: dict[str, Any] = {"inverse3": devices, "verse_grip": [grip], "wireless_verse_grip": []}
        return {"session_id": self.session, **frame} if full else frame

    def _entry(self, device: _Device, *, full: bool) -> dict[str, Any]:
        faults, hand = self.faults, device.hand
        place = hand.position if device.centred else hand.position + _BASE
        state = {"cursor_position": _xyz(place if faults.position is None else np.array(faults.position))}
        entry: dict[str, Any] = {"device_id": device.device_id, "state": state}
        if not faults.bare:
            state["cursor_velocity"] = _xyz(hand.velocity)
            state["current_cursor_force"] = _xyz(faults.echo * hand.force)
            entry["status"] = {
                "calibrated": faults.calibrated,
                "in_use": faults.in_use,
                "power_supply": faults.powered,
                "ready": True,
                "started": True,
            }
        if full:
            preset = "arm_front_centered" if device.centred else "defaults"
            info = {"id": device.device_id, "device_type": faults.device_type, "major_version": 3}
            entry["config"] = {"type": faults.device_type, "device_info": info, "handedness": "right"}
            entry["config"] |= {"preset": preset, "basis": {"permutation": "XYZ"}}
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
            status, answer = HTTPStatus.OK, {"ok": True, "data": routes[path]()}
        return connection.respond(status, json.dumps(answer))


def _xyz(vector: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", vector.tolist(), strict=True))
