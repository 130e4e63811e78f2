"""Pedals of a da Vinci Research Kit's console, each a topic of its own, and what they mean to the hand.

A pedal's message is a `sensor_msgs/Joy` with one button: 0 where it is let go, 1 where it is pressed, 2 after a quick
tap, which is told once and with neither of the others. Of a pedal that has sent nothing it is not known whether it is
pressed: it counts as let go, so that a dead-man pedal gives no force before it was seen.

Reference: *dVRK documentation*, API of the system: foot pedals, per console.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.devices.device import Sample
from palpate.errors import DeviceError

__all__ = ["PEDALS", "Pedals"]

PEDALS = ("clutch", "coag", "bicoag", "camera", "cam_minus", "cam_plus")
_PRESSED, _TAPPED = 1, 2  # what a pedal's message says; 0: let go


class Pedals:
    """The pedals of one console, in a namespace that is empty where those without one count.

    `clutch`, `dead_man` and `hold` give pedals of these meanings, by name, or by topic with a slash; empty for none.
    All others are buttons that stop. `topics` has those of all pedals, with a leading slash; `buttons` counts the
    buttons, the dead-man pedal first.
    """

    def __init__(self, namespace: str, clutch: str, dead_man: str, hold: str) -> None:
        def topic(pedal: str) -> str:
            if "/" in pedal:
                return f"/{pedal.strip('/')}"
            return f"/{namespace.strip('/')}/{pedal}" if pedal and namespace else ""

        self._clutch, self._hold = topic(clutch), topic(hold)
        own = {clutch, dead_man, hold}
        others = [topic(pedal) for pedal in PEDALS if pedal not in own]
        first = topic(dead_man)
        # without a dead-man pedal the first bit stays free: any other button stops
        self._bits = {name: 1 << k for k, name in enumerate((first, *others)) if name}
        self.buttons = len(self._bits) if first else 0
        self.topics = tuple(name for name in (self._clutch, self._hold, *self._bits) if name)
        self._pressed: set[str] = set()
        self._tapped = 0

    def take(self, topic: str, message: Mapping[str, Any]) -> None:
        """Take a pedal's message; one that has no button is a DeviceError."""
        buttons = message.get("buttons") or ()
        if not buttons or buttons[0] not in {0, _PRESSED, _TAPPED}:
            raise DeviceError(f"The pedal {topic} sends no button, but {str(message)[:100]}.")
        if buttons[0] == _PRESSED:
            self._pressed.add(topic)
        else:
            self._pressed.discard(topic)
        if buttons[0] == _TAPPED:
            self._tapped |= self._bits.get(topic, 0)

    def press(self, sample: Sample) -> None:
        """Write what the pedals mean into a sample; a tap is a press for this sample alone."""
        pressed = self._pressed
        sample.clutched = self._clutch in pressed
        sample.holding = sample.holding and (not self._hold or self._hold in pressed)
        sample.buttons, self._tapped = self._tapped & ~1, 0
        for topic in pressed:
            sample.buttons |= self._bits.get(topic, 0)
