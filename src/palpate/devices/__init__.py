"""Haptic devices, one file each, chosen by name: ``page``, ``stroke:amplitude=0.02``, ``haply``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from palpate.checks import did_you_mean
from palpate.devices.crtk import CrtkDevice
from palpate.devices.device import Device, Sample, Traits
from palpate.devices.force_dimension import ForceDimensionDevice
from palpate.devices.gamepad import GamepadDevice
from palpate.devices.hand_kind import HandKind
from palpate.devices.haply import HaplyDevice
from palpate.devices.openhaptics import OpenHapticsDevice
from palpate.devices.page import PageDevice
from palpate.devices.profiles import PROFILES
from palpate.devices.recorded import RecordedHand
from palpate.devices.simulated import SimulatedHand
from palpate.devices.spacemouse import SpaceMouseDevice
from palpate.devices.stroke import StrokeDevice
from palpate.errors import UsageError
from palpate.network.shared_memory import Block

__all__ = ["Device", "Sample", "Traits", "device_named", "device_names", "device_traits", "hand_kind"]


class _Kind(Protocol):
    @property
    def hand(self) -> HandKind: ...
    @property
    def traits(self) -> Traits: ...
    def open(self, commands: Block, options: Mapping[str, str]) -> Device: ...


_KINDS: dict[str, _Kind] = {
    "page": PageDevice,
    "stroke": StrokeDevice,
    "simulated": SimulatedHand,
    "trace": RecordedHand,
    "haply": HaplyDevice,
    "forcedimension": ForceDimensionDevice,
    "openhaptics": OpenHapticsDevice,
    "gamepad": GamepadDevice,
    "spacemouse": SpaceMouseDevice,
    "crtk": CrtkDevice,
}


WORDS = {
    **{profile.name: profile.driver for profile in PROFILES.values()},
    **dict.fromkeys(
        ("force dimension", "dhd", "omega", "delta", "sigma", "lambda", "novint"), "forcedimension"
    ),
    **dict.fromkeys(("3d systems", "touchx", "touch x", "phantom", "geomagic", "sensable"), "openhaptics"),
    **dict.fromkeys(("inverse", "versegrip"), "haply"),
    **dict.fromkeys(("joystick", "joypad", "controller", "xbox", "playstation"), "gamepad"),
    **dict.fromkeys(("3dconnexion", "spacenavigator", "spacenav", "puck"), "spacemouse"),
    **dict.fromkeys(("ros", "dvrk", "robot"), "crtk"),
    **dict.fromkeys(("mouse", "browser", "touchscreen"), "page"),
    **dict.fromkeys(("simulation", "simulator"), "simulated"),
    **dict.fromkeys(("recording", "replay"), "trace"),
}
"""Makers' names of devices and other words, each with the kind of device that is meant."""


def device_names() -> tuple[str, ...]:
    """Return the names of all kinds of device."""
    return tuple(_KINDS)


def device_traits(device: str) -> Traits:
    """Return the traits of a device before it is opened, by ``name`` or ``name:options``.

    Raises
    ------
    UsageError
        If there is no device of that name.
    """
    name, _, text = device.partition(":")
    kind = _kind(name)
    by_options = getattr(kind, "traits_of", None)  # of a device whose file or settings say more than its kind
    return kind.traits if by_options is None else by_options(_options(text))


def hand_kind(device: str) -> HandKind:
    """Return who moves the hand of a device, by ``name`` or ``name:options``.

    Raises
    ------
    UsageError
        If there is no device of that name.
    """
    return _kind(device.partition(":")[0]).hand


def device_named(device: str, commands: Block) -> Device:
    """Open a device by ``name`` or ``name:key=value,key=value``.

    Parameters
    ----------
    device : str
        Its kind, and after a colon its options, such as ``stroke:frequency=1``; those not given keep their defaults.
    commands : Block
        The loop's command block, which the page steers.

    Raises
    ------
    UsageError
        If the name or an option is unknown, or a value out of range.
    DeviceError
        If the hardware doesn't answer.
    """
    name, _, text = device.partition(":")
    kind = _kind(name)
    return kind.open(commands, _options(text))


def _options(text: str) -> dict[str, str]:
    options: dict[str, str] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.partition("=")
        if options and part.strip().isdigit():
            raise UsageError(
                f"{part.strip()!r} stands behind a comma, and is no option of the device.",
                why="Commas stand between the options of a device.",
                fix=f"Write a number with a decimal point, such as {list(options)[-1]}=0.5.",
            )
        options[name.strip()] = value.strip()
    return options


def _kind(name: str) -> _Kind:
    if name not in _KINDS:
        model = name.strip().lower()
        meant = did_you_mean(name, _KINDS, meant=WORDS, shown=lambda kind: f"--device {kind}")
        if model in PROFILES:
            meant += f" It drives the {model}, and simulated:profile={model} stands for one without hardware."
        raise UsageError(
            f"There is no device {name!r}.",
            why=f"Devices: {', '.join(_KINDS)}; options follow a colon, as in stroke:frequency=1.",
            fix=meant or "Choose one of these; `palpate devices` says what is there.",
        )
    return _KINDS[name]
