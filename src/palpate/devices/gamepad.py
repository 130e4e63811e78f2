"""A gamepad on Linux, through the kernel's input devices (package evdev): sticks in, rumble out.

The left stick is the hand in the plane that faces the user, the right stick or the triggers move it away and back.
Either the stick's place is the hand's place, so that a stick that is let go takes the hand back to the centre, or it
is the hand's velocity. The left stick's dead zone is round, so that it keeps directions; see `steering`.

Rumble is one number for each of two motors and no force: the weak motor runs with the size of the force, the strong
one with its rate of change. An effect lasts 100 ms and is renewed every 50 ms, so that it ends by itself when the loop
does. A pad that nobody touches sends nothing: silence is no stall here, and a pad that is gone is an error at once.

Codes and layouts are those of the Linux kernel (linux/input-event-codes.h; Documentation/input/gamepad.rst).
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.devices.device import Driver, Sample, Traits
from palpate.devices.device_options import DeviceOptions, number, switch, word
from palpate.devices.steering import DeadZone, SteeredHand
from palpate.errors import DeviceError, DeviceLostError

__all__ = ["GamepadDevice", "GamepadSettings"]

_SYN, _KEY, _ABS, _FF = 0, 1, 3, 0x15
_DROPPED, _REPORT = 3, 0  # of _SYN: events were lost; a set of events is complete
_X, _Y, _Z, _RX, _RY, _RZ, _GAS, _BRAKE = 0, 1, 2, 3, 4, 5, 9, 10
_SOUTH, _EAST, _START, _LEFT_STICK = 0x130, 0x131, 0x13B, 0x13D
_RUMBLE, _FULL = 0x50, 0xFFFF  # kind of effect, and its largest magnitude

_MOST_EVENTS = 256  # in one tick: more than any pad sends
_RENEWED, _LASTING = 0.050, 100  # s between rumble effects, ms that each lasts
_RISE = 0.1  # s from zero to full force that make the strong motor run at full
_WEAKEST = 0.01  # of full: less is no rumble


@dataclass(frozen=True)
class GamepadSettings(DeviceOptions):
    """Settings of the gamepad."""

    driver = "gamepad"
    path: str = ""  # event file, such as /dev/input/event7; empty takes the only gamepad
    mapping: str = word("position", "speed")  # position or speed: what a stick sets of the hand
    # stick or triggers: what moves the hand away from the user and back
    depth: str = word("stick", "triggers")
    # always, or button: the hand holds the body while the lower button (A, cross) is pressed
    hold: str = word("always", "button")
    # dead zone, as a share of the stick's way; where the pad's own is larger, that counts
    dead: float = number(0.15, 0.0, 0.5)
    # m/s of the hand at full stick, where the mapping is speed
    speed: float = number(0.08, 0.0, 1.0, above=True)
    rumble: float = switch(1.0)  # 0 does without rumble


class GamepadDevice(Driver):
    """One gamepad, with its name in the kernel; `rumbles` where it has motors that this program may turn on."""

    settings_kind = GamepadSettings
    called = "gamepad"
    traits = Traits(
        0.075,
        10.0,
        None,
        "no motor that pushes; the limit on the force that is drawn, and that makes the rumble full",
        buttons=1,
    )

    def __init__(self, settings: GamepadSettings | None = None) -> None:
        s = self._settings = settings or GamepadSettings()
        self._pad = _opened(s.path)
        self.name = str(self._pad.name)
        self.sample = Sample()
        self._raw: dict[int, float] = {}
        self._pressed: set[int] = set()
        self._dropped, self._last = False, math.nan
        by_speed = s.mapping == "speed"
        self._hand = SteeredHand(self.sample.position, self.traits.radius, s.speed if by_speed else 0.0)
        try:
            self._lay_out()
        except BaseException:
            self._pad.close()
            raise
        self._resume()
        self._shaken, self._force, self._norm = -math.inf, 0.0, 0.0
        self._effect, self.rumbles = -1, False
        if s.rumble and _RUMBLE in self._capable.get(_FF, ()):
            with contextlib.suppress(OSError):  # opened for reading alone, or no room for an effect
                self._shake(0.0, 0.0)
            self.rumbles = self._effect >= 0

    @classmethod
    def traits_of(cls, options: Mapping[str, str]) -> Traits:
        """Return the traits: with ``hold=button`` the one button is taken."""
        return replace(cls.traits, buttons=0) if options.get("hold") == "button" else cls.traits

    def read(self, now: float) -> Sample:
        """Return the hand that the sticks mean at `now`, s."""
        self.check_open()
        try:
            self._take_events()
        except OSError as error:
            raise DeviceLostError(f"The gamepad {self.name} is no longer there.", why=str(error)) from error
        self._last = now
        sample, pressed = self.sample, self._pressed
        self._move(now)
        holds = _SOUTH in pressed
        by_button = self._settings.hold == "button"
        sample.holding = holds or not by_button
        sample.buttons = int(holds and not by_button)
        sample.stop = _EAST in pressed or _START in pressed
        sample.time = now
        return sample

    def write(self, force: np.ndarray) -> None:
        """Rumble by a force (3,), N, and its rate of change; nothing pushes."""
        *_, norm = self.components(force)
        if not self.rumbles:
            return
        now, full = self._last, self.traits.max_force
        since = now - self._shaken
        if since < _RENEWED:
            return
        rate = abs(norm - self._norm) / max(since, _RENEWED)
        self._norm, self._shaken = norm, now
        try:
            self._shake(min(1.0, rate * _RISE / full), min(1.0, norm / full))
        except OSError as error:
            raise DeviceLostError(f"The gamepad {self.name} takes no rumble.", why=str(error)) from error

    def close(self) -> None:
        """Stop the rumble and let go."""
        if self.closed:
            return
        self.closed = True
        if self._effect >= 0:
            with contextlib.suppress(OSError):  # a pad that is gone rumbles no more
                self._pad.write(_FF, self._effect, 0)
                self._pad.erase_effect(self._effect)
        self._pad.close()

    def _lay_out(self) -> None:
        """Find out which of the pad's axes are what, and their ranges."""
        self._capable = self._pad.capabilities(absinfo=True)
        ranges = dict(self._capable.get(_ABS, ()))
        if not {_X, _Y} <= ranges.keys():
            raise DeviceError(f"{self.name} has no stick.", fix="Name a gamepad's event file with path=FILE.")
        # a pad by the kernel's rules has the right stick at RX, RY; many others have it at Z, RZ
        triggers, depth = ((_Z, _RZ), _RY) if _RY in ranges else ((_BRAKE, _GAS), _RZ)
        used = {_X, _Y, *(triggers if self._settings.depth == "triggers" else (depth,))}
        if missing := used - ranges.keys():
            raise DeviceError(
                f"{self.name} lacks the axes {sorted(missing)} for depth={self._settings.depth}.",
                fix="Choose depth=stick or depth=triggers, whichever it has.",
            )
        self._back, self._away = triggers
        self._depth = depth
        self._axes = {
            code: DeadZone(
                ranges[code].min,
                ranges[code].max,
                ranges[code].flat,
                self._settings.dead,
                one_sided=code in triggers,
            )
            for code in used
        }

    def _resume(self) -> None:
        """Ask for the state of axes and buttons; events alone don't tell it at first, and after a loss."""
        for code in self._axes:
            self._raw[code] = float(self._pad.absinfo(code).value)
        self._pressed = set(self._pad.active_keys())
        self._dropped = False

    def _take_events(self) -> None:
        for _ in range(_MOST_EVENTS):
            event = self._pad.read_one()
            if event is None:
                return
            if event.type == _SYN and event.code == _DROPPED:
                self._dropped = True
            elif self._dropped:
                if event.type == _SYN and event.code == _REPORT:
                    self._resume()
            elif event.type == _ABS:
                if event.code in self._axes:
                    self._raw[event.code] = float(event.value)
            elif event.type == _KEY:
                (self._pressed.add if event.value else self._pressed.discard)(event.code)

    def _move(self, now: float) -> None:
        """Move the hand on to `now`, s, towards, or as fast as, the sticks say."""
        axes, raw = self._axes, self._raw
        right, down = axes[_X].share(raw[_X]), axes[_Y].share(raw[_Y])
        size = math.hypot(right, down)
        stretch = axes[_X].outside(size) / size if size > 0.0 else 0.0
        if self._settings.depth == "triggers":
            back = axes[self._back](raw[self._back]) - axes[self._away](raw[self._away])
        else:
            back = axes[self._depth](raw[self._depth])
        centred = self._settings.mapping == "speed" and _LEFT_STICK in self._pressed
        self._hand.move(stretch * right, -stretch * down, back, now, centred=centred)

    def _shake(self, strong: float, weak: float) -> None:
        """Run the motors for a tenth of a second, 0 … 1 of full each."""
        from evdev import ff

        idle = max(strong, weak) < _WEAKEST
        if idle and self._effect >= 0:
            if self._force > 0.0:
                self._pad.write(_FF, self._effect, 0)
            self._force = 0.0
            return
        kind = ff.EffectType(
            ff_rumble_effect=ff.Rumble(strong_magnitude=int(_FULL * strong), weak_magnitude=int(_FULL * weak))
        )
        effect = ff.Effect(_RUMBLE, self._effect, 0, ff.Trigger(0, 0), ff.Replay(_LASTING, 0), kind)
        self._effect = int(self._pad.upload_effect(effect))
        self._force = max(strong, weak)
        if not idle:
            self._pad.write(_FF, self._effect, 1)


def _opened(path: str) -> Any:
    """Return the input device at a path, or the only gamepad that there is."""
    try:
        from evdev import InputDevice, list_devices
    except ImportError as error:
        raise DeviceError(
            "A gamepad needs the package evdev, which works on Linux alone.",
            why=str(error),
            fix="pip install 'palpate[gamepad]', which needs a C compiler and Python's headers. Elsewhere use the "
            "gamepad on the page: palpate view.",
        ) from error
    try:
        if path:
            return InputDevice(path)
        devices = [InputDevice(file) for file in list_devices()]
    except OSError as error:
        raise DeviceError(
            f"{f'The gamepad {path}' if path else 'A gamepad'} can't be opened.",
            why=str(error),
            fix="See `palpate devices`; for the right to read it add yourself to the group input and log in again.",
        ) from error
    pads = []
    for device in devices:
        able = device.capabilities(absinfo=False)
        if _SOUTH in able.get(_KEY, ()) and {_X, _Y} <= set(able.get(_ABS, ())):
            pads.append(device)
        else:
            device.close()
    if len(pads) == 1:
        return pads[0]
    names = ", ".join(f"{pad.name} at {os.fsdecode(pad.path)}" for pad in pads)
    for pad in pads:
        pad.close()
    raise DeviceError(
        f"There are {len(pads)} gamepads: {names}." if pads else "No gamepad can be opened.",
        why="" if pads else f"Looked at {len(devices)} input devices that this user may read.",
        fix="Name one: gamepad:path=/dev/input/event…"
        if pads
        else "Plug one in; for the right to read it add yourself to the group input and log in again.",
    )
