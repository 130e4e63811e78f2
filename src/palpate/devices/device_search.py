"""A search for haptic devices on this machine: by the names of files and ports, without loading or opening any.

Each kind of device is an entry of `HARDWARE`: the vendor's library, the port or socket of a local service, or the
kernel's list of gamepads. An entry says where it looks and what to do when nothing is there. Whether this version
drives what is found is asked of the table in `palpate.devices`: an entry whose `device` is in it can be used
by that name.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from palpate.devices import device_names, device_traits
from palpate.devices.force_dimension_library import PLACES as DHD_PLACES
from palpate.devices.openhaptics_library import PLACES as HD_PLACES
from palpate.devices.profiles import limits_in_words
from palpate.devices.spacemouse import CONFIGURATION, INSTALL, SOCKET, VARIABLE, sockets
from palpate.devices.surroundings import Surroundings
from palpate.devices.vendor_library import LibraryPlaces

__all__ = ["HARDWARE", "Finding", "GamepadSearch", "LibrarySearch", "PuckSearch", "ServiceSearch", "search"]


@dataclass(frozen=True)
class Finding:
    """One kind of device: what there is of it."""

    name: str  # of the device, or of the family of devices
    kind: str  # what it is reached through: built in, library, service or gamepad
    state: str  # ready for --device; present, without a driver in this version; or absent
    detail: str  # what was found
    looked_for: tuple[str, ...] = ()  # names of the files or ports
    looked_in: tuple[str, ...] = ()  # folders, variables of the environment or hosts
    remedy: str = ""  # what to do; empty where it is ready
    device: str = ""  # name for --device; empty where this version has no driver
    # what its driver knows of such devices: limits by type, buttons, whether it was tried on hardware
    facts: tuple[str, ...] = ()


class _Search(Protocol):
    @property
    def device(self) -> str: ...
    def look(self, surroundings: Surroundings) -> Finding: ...


def search(surroundings: Surroundings | None = None) -> tuple[Finding, ...]:
    """Return a finding for each device that this version has, and for each kind of hardware that was looked for."""
    surroundings = surroundings or Surroundings()
    hardware = {entry.device for entry in HARDWARE}
    own = (_built_in(name) for name in device_names() if name not in hardware)
    return (*own, *(replace(entry.look(surroundings), facts=_facts(entry.device)) for entry in HARDWARE))


_FACTS = {
    "haply": (
        "type: config.type of the service's inventory",
        "buttons: button of a wired VerseGrip; a, b, c of a wireless one; each stops the force unless an option has it",
        "a service before 3.5 tells less: haply:events=0,spelling=values,force_scale=1",
        "seen on hardware: no; fields after Haply's Inverse SDK 3.4 and 3.5",
    ),
    "forcedimension": (
        "type: dhdGetSystemType; a device that states a smaller force gets that",
        "buttons: the eight lowest of its mask; each stops the force unless an option has it",
        "seen on hardware: no; fields after the Haptic SDK 3.16",
    ),
    "openhaptics": (
        "type: HD_DEVICE_MODEL_TYPE; a device that states smaller limits gets those",
        "buttons: 1 to 4 of the stylus; each stops the force unless an option has it",
        "seen on hardware: no; fields after the headers of OpenHaptics HD",
    ),
}


def _facts(device: str) -> tuple[str, ...]:
    """Return what a driver knows of its devices, a line each."""
    limits = limits_in_words(device)
    return (*((f"limits by type: {limits}",) if limits else ()), *_FACTS.get(device, ()))


def _built_in(name: str) -> Finding:
    traits = device_traits(name)
    detail = f"workspace ±{1e3 * traits.radius:.0f} mm, at most {traits.max_force:g} N: {traits.source}"
    return Finding(name, "built in", "ready", detail, device=name)


def _state(found: bool, device: str) -> tuple[str, str]:
    """Return the state of what was found or not, and its name for ``--device``."""
    driven = device if device in device_names() else ""
    if not found:
        return "absent", driven
    return ("ready" if driven else "present"), driven


_NO_DRIVER = "This version has no driver for it yet: touch with the page, or with a scripted stroke."


def _advice(state: str, driven: str, to_install: str) -> str:
    if state == "ready":
        return ""
    return to_install if driven else _NO_DRIVER


@dataclass(frozen=True)
class LibrarySearch:
    """A vendor's shared library, by its file name."""

    places: LibraryPlaces

    @property
    def device(self) -> str:
        """Name of the driver."""
        return self.places.device

    def look(self, surroundings: Surroundings) -> Finding:
        """Return the finding on this machine."""
        places, system = self.places, surroundings.platform
        path = places.find(surroundings)
        state, driven = _state(path is not None, self.device)
        install = (
            f"Install {places.download} and name its library in the environment variable {places.override}. "
            f"Without hardware: palpate devices simulate {self.device}."
        )
        detail = "not found" if path is None else f"found {path}"
        names, looked_in = places.names(system), places.looked_in(system)
        advice = _advice(state, driven, install)
        return Finding(places.family, "library", state, detail, names, looked_in, advice, driven)


@dataclass(frozen=True)
class ServiceSearch:
    """A program on this machine that owns the devices, by the ports that it listens on."""

    name: str  # of the family of devices
    device: str  # name of the driver
    ports: Mapping[int, str]  # each port, and what speaks there
    install: str  # what to install or start, as a sentence

    def look(self, surroundings: Surroundings) -> Finding:
        """Return the finding on this machine; a connection is made and closed at once, and nothing is sent."""
        host = "127.0.0.1"
        open_ports = [port for port in self.ports if surroundings.answers(host, port)]
        state, driven = _state(bool(open_ports), self.device)
        detail = ", ".join(f"port {port} answers, usually {self.ports[port]}" for port in open_ports)
        return Finding(
            self.name,
            "service",
            state,
            detail or "no port answers",
            tuple(f"port {port} ({words})" for port, words in self.ports.items()),
            (f"{host}, this machine",),
            _advice(state, driven, self.install),
            driven,
        )


@dataclass(frozen=True)
class GamepadSearch:
    """Gamepads in the Linux kernel's list of input devices: those with a joystick's handler."""

    name: str = "Gamepad (evdev)"
    device: str = "gamepad"
    listing: str = "/proc/bus/input/devices"

    def look(self, surroundings: Surroundings) -> Finding:
        """Return the finding on this machine."""
        pads = list(self._pads(surroundings))
        state, driven = _state(bool(pads), self.device)
        install = "Plug it in; on another system than Linux use it on the page, palpate view."
        closed = [path for _, path in pads if not os.access(surroundings.place(path), os.R_OK)]
        detail = ", ".join(f"{name} at {path}" for name, path in pads) or "none plugged in"
        remedy = _advice(state, driven, install)
        if pads and driven and not surroundings.installed("evdev"):
            state, remedy = "present", "Install the package that reads it: pip install 'palpate[gamepad]'."
        if closed:
            detail += f"; {', '.join(closed)} can't be read"
            remedy = f"Add yourself to the group input, and log in again. {remedy}".strip()
        return Finding(
            self.name, "gamepad", state, detail, ("a handler js…",), (self.listing,), remedy, driven
        )

    def _pads(self, surroundings: Surroundings) -> Iterator[tuple[str, str]]:
        """Yield name and event file of each gamepad."""
        for name, handlers in _inputs(surroundings, self.listing):
            if any(handler.startswith("js") for handler in handlers) and not _is_puck(name):
                event = next((h for h in handlers if h.startswith("event")), "")
                yield name, f"/dev/input/{event}"


@dataclass(frozen=True)
class PuckSearch:
    """3Dconnexion pucks by the socket of their driver, spacenavd; of one without it the kernel's list tells."""

    name: str = "3Dconnexion SpaceMouse, SpaceNavigator (spacenavd)"
    device: str = "spacemouse"
    listing: str = "/proc/bus/input/devices"

    def look(self, surroundings: Surroundings) -> Finding:
        """Return the finding on this machine; a connection is made and closed at once, and nothing is sent."""
        paths = sockets(surroundings.environment, surroundings.text(CONFIGURATION))
        heard = [path for path in paths if surroundings.listens(surroundings.place(path))]
        pucks = sorted({name for name, _ in _inputs(surroundings, self.listing) if _is_puck(name)})
        state, driven = _state(bool(heard), self.device)
        details = [f"the driver answers at {heard[0]}" if heard else "no driver answers"]
        details += [f"plugged in: {', '.join(pucks)}"] if pucks else []
        looked_in = (f"${VARIABLE}", f"socket = in {CONFIGURATION}", SOCKET)
        return Finding(
            self.name,
            "service",
            state,
            "; ".join(details),
            ("the socket of spacenavd",),
            looked_in,
            _advice(state, driven, INSTALL),
            driven,
        )


def _inputs(surroundings: Surroundings, listing: str) -> Iterator[tuple[str, list[str]]]:
    """Yield name and handlers of each entry of the Linux kernel's list of input devices."""
    for block in surroundings.text(listing).split("\n\n"):
        lines = {line[:1]: line[3:] for line in block.splitlines() if line[:1] in "NH"}
        yield lines.get("N", "").partition("=")[2].strip('"'), lines.get("H", "").partition("=")[2].split()


def _is_puck(name: str) -> bool:
    """Return whether an input device is a puck: its maker has mice and keyboards, too."""
    words = name.lower()
    return "3dconnexion" in words and not any(other in words for other in ("cadmouse", "keyboard", "numpad"))


HARDWARE: tuple[_Search, ...] = (
    ServiceSearch(
        name="Haply Inverse3, Inverse3x, Minverse; VerseGrip",
        device="haply",
        ports={10001: "websocket and HTTP of the service 3.x", 10000: "HTTP and format 3.0", 10020: "events"},
        install="Install and start the Haply Inverse Service 3.x (Haply Inverse SDK), or a double of it: "
        "palpate devices simulate haply.",
    ),
    LibrarySearch(DHD_PLACES),
    LibrarySearch(HD_PLACES),
    ServiceSearch(
        name="CRTK robots over the ROS bridge",
        device="crtk",
        ports={9090: "rosbridge"},
        install="Start the bridge, ros2 launch rosbridge_server rosbridge_websocket_launch.xml, or a double of it and "
        "an arm: palpate devices simulate crtk.",
    ),
    GamepadSearch(),
    PuckSearch(),
)
