"""Readers of what the Haply Inverse Service says, in each of the forms that its versions give to frames and answers.

The forms are those of Haply, *Inverse SDK* 3.4 and 3.5 ("Simulation Channel", "WebSocket Protocol", "HTTP", tutorials
"Print VerseGrip", "Print Wireless VerseGrip" and "Combined"), and of public clients where the maker is silent. A wired
grip has one button, ``button``; a wireless one ``buttons`` by name: a, b, c, with some grips home or button_0 to
button_3. What kind of device it is stands in ``config.type``. ``device_info.device_type`` is a number, which the maker
asks not to rely on; where it is a text, it counts too.
"""

from __future__ import annotations

import http.client
import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from palpate.devices.profiles import PROFILES, DeviceProfile, weakest_profile
from palpate.errors import DeviceError

__all__ = [
    "OLD_HTTP_PORT",
    "ask_scale",
    "choose_profile",
    "decode_frame",
    "device_types",
    "grips_in",
    "read_buttons",
    "read_orientation",
    "read_scale",
    "read_vector",
]

OLD_HTTP_PORT = 10000  # of the HTTP interface before version 3.5
_GRIPS = ("verse_grip", "wireless_verse_grip", "custom_verse_grip")
# keys under which an answer holds the scale, outermost first
_SCALE = ("data", "value", "force_scale", "devices/force_scale")


def decode_frame(text: str) -> Mapping[str, Any]:
    """Return a frame or an event; one that is no object is empty."""
    try:
        frame = json.loads(text)
    except ValueError as error:
        raise DeviceError("The Haply service sent a frame that is not JSON.", why=text[:100]) from error
    return frame if isinstance(frame, Mapping) else {}


def read_vector(state: Mapping[str, Any], name: str, missing: float) -> list[float]:
    """Return a vector of three, in the service's axes, with `missing` for what is not there."""
    value = state.get(name) or {}
    return [float(value.get(axis, missing)) for axis in "xyz"]


def device_types(entry: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the texts, in small letters, by which the entry of an inventory tells its type; each once."""
    config = entry.get("config") or {}
    texts = (config.get("type"), (config.get("device_info") or {}).get("device_type"))
    return tuple(dict.fromkeys(text.lower() for text in texts if isinstance(text, str) and text))


def choose_profile(types: tuple[str, ...]) -> DeviceProfile:
    """Return the profile of a type; of several the weaker, and of none or an unknown one the weakest of all."""
    known = [PROFILES.get(name) for name in types]
    profiles = [profile for profile in known if profile is not None and profile.driver == "haply"]
    if not profiles or len(profiles) < len(types):
        return weakest_profile("haply")
    return min(profiles, key=lambda profile: profile.max_force)


def grips_in(frame: Mapping[str, Any], grip_id: str = "") -> Iterator[Mapping[str, Any]]:
    """Go through the grips of a frame, or the one of that id; one that is asleep or disconnected is passed over.

    The buttons of such a grip are those of a time ago: a dead-man button that nobody holds any more would hold on.
    """
    for family in _GRIPS:
        for grip in frame.get(family) or ():
            status = grip.get("status") or {}
            away = status.get("connected") is False or status.get("awake") is False
            if not away and (not grip_id or grip.get("device_id") == grip_id):
                yield grip


def read_buttons(grip: Mapping[str, Any]) -> dict[str, bool]:
    """Return the buttons of a grip by name, in the order of their names, and whether each is pressed."""
    state = grip.get("state") or {}
    several = state.get("buttons")
    pressed = {name: value for name, value in state.items() if name == "button" or name.startswith("button_")}
    pressed |= several if isinstance(several, Mapping) else {}
    return {name: bool(pressed[name]) for name in sorted(pressed)}


def read_orientation(grip: Mapping[str, Any], quaternion: np.ndarray) -> None:
    """Fill a grip's turn (4,), a quaternion w, x, y, z, in the service's axes; one that tells none stays as it is."""
    told = (grip.get("state") or {}).get("orientation")
    if isinstance(told, Mapping):
        for k, axis in enumerate("wxyz"):
            quaternion[k] = float(told.get(axis, math.nan))


def read_scale(answer: Any) -> float:
    """Return the number in the service's answer on its scale: alone, in its envelope, or in an object.

    An answer that has none raises LookupError or TypeError.
    """
    while isinstance(answer, Mapping):
        if answer.get("ok") is False:
            raise LookupError(str(answer.get("error")))
        answer = next((answer[name] for name in _SCALE if name in answer), None)
    if isinstance(answer, bool) or not isinstance(answer, (int, float)):
        raise TypeError(f"{answer!r} is not a number")
    return float(answer)


def ask_scale(host: str, ports: tuple[int, ...]) -> tuple[float | None, str]:
    """Ask over HTTP by how much every force is scaled; return the factor, or None and why no port told it."""
    reasons = {}
    for port in ports:
        connection = http.client.HTTPConnection(host, port, timeout=2.0)
        try:
            connection.request("GET", "/settings/devices/force_scale?format=json")
            return read_scale(json.loads(connection.getresponse().read())), ""
        except (OSError, http.client.HTTPException, ValueError, TypeError, LookupError) as error:
            reasons[port] = f"port {port}: {type(error).__name__}: {error}"
        finally:
            connection.close()
    return None, "; ".join(reasons.values())
