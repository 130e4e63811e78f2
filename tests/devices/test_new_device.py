"""A device that is none of palpate's own, as the guide builds it, driven by the loop."""

from __future__ import annotations

import re
import socket
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from palpate.devices.device import Sample, Traits
from palpate.devices.device_options import settings_from
from palpate.errors import DeviceError
from palpate.runtime import Fault, Workspace
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits

GUIDE = Path(__file__).parents[2] / "docs" / "guide" / "adding-a-device.md"
TICK = 1e-3


class UdpDevice:
    """A home-made device that sends its place and takes a force, both by UDP."""

    traits: ClassVar[Traits] = Traits(
        radius=0.05, max_force=2.0, damping=0.2, source="measured on the bench", mass=0.15, delay=0.001
    )

    def __init__(self, settings):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", int(settings.port)))
        self._socket.setblocking(False)
        self._sender, self._closed = None, False
        self.sample = Sample()
        self.sample.holding = True

    @classmethod
    def open(cls, commands, options):
        return cls(settings_from(UdpSettings, options))

    def read(self, now):
        while True:
            try:
                packet, self._sender = self._socket.recvfrom(64)
            except BlockingIOError:
                return self.sample
            self.sample.position[:] = struct.unpack("<3d", packet)
            self.sample.time = now

    def write(self, force):
        if self._closed:
            raise DeviceError("The UDP device is closed.", fix="Open it again.")
        if self._sender:
            self._socket.sendto(struct.pack("<3d", *force.tolist()), self._sender)

    def close(self):
        if not self._closed:
            self.write(np.zeros(3))
            self._closed = True
            self._socket.close()


@dataclass(frozen=True)
class UdpSettings:
    """Settings of the UDP device."""

    port: float = 9000.0


def test_the_page_shows_this_code():
    (block,) = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert block in Path(__file__).read_text(encoding="utf-8")


def test_the_device_of_the_guide_is_touched(plain, shared):
    udp = UdpDevice.open(shared.command, {"port": "0"})
    loop = Loop(plain, udp, shared, Workspace(0.05, 1.0), Limits(udp.traits.max_force), stiffness=20.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hand:
        hand.settimeout(5.0)
        for k in range(100):
            hand.sendto(struct.pack("<3d", 0.0, -1e-4 * k, 0.0), udp._socket.getsockname())
            loop.tick(k * TICK)
            force = struct.unpack("<3d", hand.recv(64))
        assert loop.fault is Fault.NONE
        assert force[1] == pytest.approx(20.0 * 99e-4, rel=0.05)
        for k in range(100, 130):
            loop.tick(k * TICK)
        assert loop.fault is Fault.INPUT_STALLED
        loop.end()
        with pytest.raises(DeviceError, match="closed"):
            udp.write(np.zeros(3))
