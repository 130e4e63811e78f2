"""A double of the package evdev, with one gamepad whose events a test injects and whose rumble it reads."""

from __future__ import annotations

import errno
import types
from collections import deque, namedtuple

Event = namedtuple("Event", "type code value")
AbsInfo = namedtuple("AbsInfo", "value min max fuzz flat resolution")
SYN, KEY, ABS, FF = 0, 1, 3, 0x15
SOUTH, EAST, START, LEFT_STICK = 0x130, 0x131, 0x13B, 0x13D
X, Y, Z, RX, RY, RZ, GAS, BRAKE = 0, 1, 2, 3, 4, 5, 9, 10
STICK = AbsInfo(128, 0, 255, 0, 15, 0)  # as many pads have it: 8 bits, resting beside the middle
TRIGGER = AbsInfo(0, 0, 1023, 0, 0, 0)


class Pad:
    """A gamepad by the kernel's rules, and the `InputDevice` that reads it."""

    name, path = "Pad of two sticks", "/dev/input/event7"

    def __init__(self, axes=None, *, keys=(SOUTH, EAST, START, LEFT_STICK), rumble=True):
        self.axes = axes or {X: STICK, Y: STICK, RX: STICK, RY: STICK, Z: TRIGGER, RZ: TRIGGER}
        self.keys, self.rumble, self.pressed = keys, rumble, set()
        self.events, self.effects, self.lost, self.closed = deque(), {}, False, False
        self.played = deque(maxlen=10)  # the latest
        self.full = False  # no room for another effect

    def send(self, *events):
        """Change the state, and queue its events with the mark of their end."""
        for kind, code, value in events:
            if kind == ABS:
                self.axes[code] = self.axes[code]._replace(value=value)
            elif kind == KEY:
                (self.pressed.add if value else self.pressed.discard)(code)
            self.events.append(Event(kind, code, value))
        self.events.append(Event(SYN, 0, 0))

    def overflow(self, *events):
        """Change the state by more events than the kernel's buffer takes."""
        self.send(*events)
        self.events.clear()
        self.events.extend((Event(SYN, 3, 0), Event(ABS, X, 0), Event(SYN, 0, 0)))

    def move(self, code, value):
        self.send((ABS, code, value))

    def _check(self):
        if self.lost or self.closed:
            raise OSError(errno.ENODEV, "No such device")

    def capabilities(self, absinfo=True):
        able = {KEY: list(self.keys), ABS: list(self.axes.items() if absinfo else self.axes)}
        return able | ({FF: [0x50]} if self.rumble else {})

    def absinfo(self, code):
        return self.axes[code]

    def active_keys(self):
        return list(self.pressed)

    def read_one(self):
        self._check()
        return self.events.popleft() if self.events else None

    def upload_effect(self, effect):
        self._check()
        if self.full:
            raise OSError(errno.ENOSPC, "No space left on device")
        number = effect.id if effect.id >= 0 else len(self.effects)
        rumble = effect.kind.ff_rumble_effect
        self.effects[number] = (rumble.strong_magnitude, rumble.weak_magnitude, effect.replay.length)
        return number

    def erase_effect(self, number):
        self._check()
        del self.effects[number]

    def write(self, kind, code, value):
        self._check()
        assert kind == FF
        self.played.append((*self.effects[code], value))

    def close(self):
        self.closed = True


def module(*pads):
    """The package, with these pads plugged in."""
    plugged = {pad.path: pad for pad in pads}

    def device(path):
        if path not in plugged:
            raise FileNotFoundError(errno.ENOENT, "No such file or directory", path)
        return plugged[path]

    package = types.ModuleType("evdev")
    package.InputDevice, package.list_devices = device, lambda: list(plugged)
    package.ff = types.SimpleNamespace(
        Effect=namedtuple("Effect", "type id direction trigger replay kind"),
        EffectType=namedtuple("EffectType", "ff_rumble_effect"),
        Rumble=namedtuple("Rumble", "strong_magnitude weak_magnitude"),
        Trigger=namedtuple("Trigger", "button interval"),
        Replay=namedtuple("Replay", "length delay"),
    )
    return package
