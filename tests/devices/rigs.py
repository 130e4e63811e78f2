"""Hardware drivers on their doubles: time stands still until a rig moves it, and places are as a test wants."""

from __future__ import annotations

import contextlib
import json
import math
import select

import numpy as np
from library_double import LibraryDouble

from palpate.devices.crtk import CrtkDevice
from palpate.devices.crtk_settings import CrtkSettings
from palpate.devices.doubles.crtk_simulator import CrtkSimulator, CrtkSimulatorSettings
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.devices.force_dimension import ForceDimensionDevice, ForceDimensionSettings
from palpate.devices.haply import HaplyDevice, HaplySettings
from palpate.devices.openhaptics import OpenHapticsDevice, OpenHapticsSettings
from palpate.runtime import Workspace
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from waiting import wait_for

TICK = 1e-3


class Clock:
    """A clock that stands still until it is moved."""

    time = 0.0

    def __call__(self):
        return self.time


class Rig:
    """A driver and its double; a context manager.

    Kinds have `connect`, `advance` and `force`; `put` holds the hand at a place; `begin` and `end` switch what breaks
    them, of which `stopped`, `lost` and `wild` are the driver's words.
    """

    scale = 10.0  # metres of body per metre of hand
    final = ()  # faults after which a device must be opened again

    def __init__(self):
        self.device, self.at = None, np.zeros(3)
        self.stack = contextlib.ExitStack()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with self.stack:
            if self.device is not None:
                self.device.close()

    def open(self, **settings):
        """Open the device, and close the one that was open."""
        if self.device is not None:
            self.device.close()
        self.device = self.connect(**settings)
        return self.device

    def loop(self, model, shared, opened=None, **settings):
        """Return the loop around the device, which it opens unless it is."""
        traits = (opened or self.open()).traits
        workspace, limits = Workspace(traits.radius, self.scale), Limits(traits.max_force)
        self.looped = Loop(model, self.device, shared, workspace, limits, rate=1.0 / TICK, **settings)
        return self.looped

    def drive(self, ticks, force=(0.0, 0.0, 0.0)):
        """Read and write without a loop; return places and ages of the samples."""
        seen = []
        for _ in range(ticks):
            self.advance()
            sample = self.device.read(self.now)
            seen.append((sample.position.copy(), self.now - sample.time))
            self.device.write(np.array(force))
            self.arrive()
        return seen

    def sample(self, ticks):
        """Read and write without a force; return the latest sample."""
        self.drive(ticks)
        return self.device.sample

    def run(self, ticks):
        """Tick the loop; return the size of the force that was sent, and the fault, of each."""
        seen = []
        for _ in range(ticks):
            self.advance()
            self.looped.tick(self.now)
            self.arrive()
            seen.append((float(np.linalg.norm(self.looped.safety.force)), self.looped.fault))
        return seen

    def place(self, place):
        """Hold the hand at a place (3,), m, in the device's axes."""
        self.at = np.array(place)
        self.put(self.at)

    def lead(self, place, ticks, step):
        """Lead the hand to a place in so many ticks, which `step` makes; return what it returns."""
        start, seen = self.at, []
        for share in np.linspace(0.0, 1.0, ticks + 1)[1:]:
            self.place(start + share * (np.asarray(place) - start))
            seen += step(1)
        return seen

    def press(self, depth=0.01):
        """Bring the hand to rest, and press the body from there, m deep; return as `run` does."""
        rest, pressed = np.zeros(3), np.array(self.device.traits.axes).T @ np.array([0.0, -depth, 0.0])
        ways = ((rest, 40), (rest, 30), (pressed, 80), (pressed, 80))
        return [tick for place, ticks in ways for tick in self.lead(place, ticks, self.run)]

    def close(self):
        """Close the device, and return the force that the hand feels then."""
        self.device.close()
        return self.force()

    @property
    def now(self):
        """The loop's time, s."""
        return self.clock.time

    def advance(self):
        """Move the time by a tick, and let the double tell a new place."""
        self.clock.time += TICK

    def arrive(self):
        """Wait until what the driver has sent is there."""


class HaplyRig(Rig):
    """A Haply behind its service."""

    stopped, lost = "power supply", "04C2 is no longer there"  # words of these faults
    wild = "from its centre"

    def __init__(self, devices=("04C2",), inventory=None, **settings):
        super().__init__()
        self.clock = Clock()
        settings = SimulatorSettings(port=0, events=0, **settings)
        self.service = self.stack.enter_context(HaplySimulator(settings, self.clock, devices, inventory))

    def connect(self, **settings):
        usual = {"events": float(self.service.events_port), "wait": 1.0, "search": 0.0}
        device = HaplyDevice(HaplySettings(url=f"ws://127.0.0.1:{self.service.port}", **(usual | settings)))
        if device._events is not None:
            # its budget of time never ends: the machine may have much else to do
            device._events._clock = Clock()
        self.sent = self.service.received  # all of them were answered
        send = device._channel.send

        def count(text):
            send(text)
            self.sent += 1

        device._channel.send = count
        return device

    def arrive(self):
        clients = self.service._clients
        wait_for(
            lambda: self.service.received >= self.sent or {"simulation"} not in clients.values(), pause=0.0
        )

    def close(self):
        self.device.close()
        self.service.restart()  # after the last message was obeyed
        return self.service.force()

    def tell(self, name, message="", **data):
        """Let the service send an event, and wait until it is there."""
        self.service.send_event(name, message, **data)
        assert select.select(self.device._events._poll, (), (), 10.0)[0]

    def force(self):
        self.device.read(self.now)  # the command has been answered, so it has arrived
        return self.service.force()

    def put(self, place):
        self.service.faults.position = tuple(place)

    def press_button(self, down=True):
        self.service.press("a", down=down)

    def begin(self, story):
        faults = self.service.faults
        if story == "silence":
            self.device.wait, faults.held = 0.0, True
        elif story == "loss":
            faults.absent = -1
        elif story == "stop":
            faults.powered = False
        elif story == "no number":
            self.put((math.nan, 0.0, 0.0))
        elif story == "wild":
            self.put((5.0, 0.0, 0.0))

    def end(self, story):
        faults = self.service.faults
        if story == "silence":
            self.service.release()
            self.device.wait = 1.0
        faults.absent, faults.powered, faults.position = 0, True, None if story == "wild" else faults.position


class ArmClock(Clock):
    """The clock of an arm: it goes on by itself while a driver opens, and stands still until it is moved after that."""

    time, running = 5000.0, True

    def __call__(self):
        self.time += TICK if self.running else 0.0
        return self.time


class InStep:
    """The channel of a driver, which receives all that the bridge has sent so far, and nothing later."""

    def __init__(self, channel, service):
        self.channel, self._service, self._marks = channel, service, 0

    def __getattr__(self, name):
        return getattr(self.channel, name)

    def receive(self, wait):
        self._marks += 1
        mark, texts = json.dumps({"op": "mark", "id": f"{id(self)}-{self._marks}"}), []
        self._service._do(self._service._send("", mark))
        while mark not in texts:
            texts += self.channel.receive(10.0)
        return texts[: texts.index(mark)]


class CrtkRig(Rig):
    """An arm behind a ROS bridge, whose clock is an hour before the loop's."""

    stopped, lost = "it is paused", "ROS bridge"  # words of these faults
    wild, final = "from its centre", ("loss",)

    def __init__(self, **settings):
        super().__init__()
        self.clock = ArmClock()
        self.service = self.stack.enter_context(
            CrtkSimulator(CrtkSimulatorSettings(port=0, **settings), self.clock)
        )

    @property
    def now(self):
        return self.clock.time - 3600.0

    def connect(self, **settings):
        usual = {"arm": "arm", "delay": 0.0, "search": 10.0, "origin": "base"}
        self.service.stream(True)
        self.clock.running = True
        device = CrtkDevice(CrtkSettings(url=f"ws://127.0.0.1:{self.service.port}", **(usual | settings)))
        self.stand(device)
        return device

    def stand(self, device):
        """Let the arm send nothing by itself any more, and leave what it has sent unread."""
        self.service.stream(False)
        self.clock.running = False
        if not isinstance(device._channel, InStep):
            device._channel = InStep(device._channel, self.service)
        device._channel.receive(0.0)

    def advance(self):
        super().advance()
        self.service.step()

    def arrive(self):
        if self.device.published and not self.device.closed and self.service._clients:
            assert self.service.await_wrenches(self.device.published)

    def force(self):
        return self.service.force()

    def close(self):
        self.device.close()
        assert self.service.await_wrenches(self.device.published)
        return self.force()

    def put(self, place):
        self.service.faults.position = tuple(place)

    def press_button(self, down=True):
        self.service.press("footpedals/camera", int(down))

    def begin(self, story):
        service = self.service
        if story == "silence":
            service.faults.held = True
        elif story == "loss":
            service.restart()
        elif story == "stop":
            service.state = "PAUSED"
        elif story == "no number":
            self.put((math.nan, 0.0, 0.0))
        elif story == "wild":
            service.faults.runaway = 0.01

    def end(self, story):
        self.service.faults.runaway, self.service.state = 0.0, "ENABLED"
        if story == "silence":
            self.service.release()


SWITCHES = {
    "silence": ("guard", 1e6),
    "stop": ("powered", 0),
    "loss": ("absent", 1),
    "no number": ("nan", 1),
    "wild": ("garbage", 90),
}


class ForceDimensionRig(Rig):
    """A device behind the double of Force Dimension's library."""

    stopped, lost = "has no power", "is no longer there"  # words of these faults
    wild = "from its centre"

    def __init__(self, library):
        super().__init__()
        self.dhd = LibraryDouble(library, manual=1, time=100)

    def connect(self, **settings):
        return ForceDimensionDevice(ForceDimensionSettings(library=str(self.dhd.path), **settings))

    @property
    def now(self):
        return self.dhd.time

    def advance(self):
        self.dhd.time += TICK

    def force(self):
        """The force that was asked for last."""
        return np.array([self.dhd.force_x, self.dhd.force_y, self.dhd.force_z])

    def felt(self):
        """The force that the hand feels."""
        return np.array([self.dhd.felt_x, self.dhd.felt_y, self.dhd.felt_z])

    def put(self, place):
        self.dhd.scripted, self.dhd.amplitude = 1, 0
        self.dhd.x, self.dhd.y, self.dhd.z = place

    def press_button(self, down=True):
        self.dhd.buttons = int(down)

    def begin(self, story):
        setattr(self.dhd, *SWITCHES[story])

    def end(self, story):
        name, _ = SWITCHES[story]
        setattr(self.dhd, name, 1 if name == "powered" else 0)


class OpenHapticsRig(Rig):
    """A device behind the double of the OpenHaptics library, whose frames come one by one."""

    stopped, lost = "too warm", "connection"  # words of these faults
    wild, final = "from its centre", ("loss",)

    def __init__(self, library):
        super().__init__()
        self.clock, self.silent = Clock(), False
        self.library = LibraryDouble(library, speed=50)

    def __exit__(self, *details):
        library = self.library
        library.manual = 0  # the last frame comes by itself
        super().__exit__(*details)
        assert library.illegal == library.outside == library.invalid == library.null_names == 0
        assert library.open == library.running == 0

    def connect(self, **settings):
        library = self.library
        library.manual, library.manual_after = 0, library.frames + 50
        device = OpenHapticsDevice(OpenHapticsSettings(library=str(library.path), **settings))
        library.manual_after, library.manual = 0, 1
        return device

    def advance(self):
        super().advance()
        if not self.silent:
            self.library.library.double_step(1)

    def close(self):
        self.library.manual = 0  # the last frame comes by itself
        return super().close()

    def force(self):
        self.library.library.double_step(1)  # a force is felt one frame later
        return np.array([self.library.force_x, self.library.force_y, self.library.force_z])

    def put(self, place):
        self.library.fixed = 1
        self.library.x, self.library.y, self.library.z = 1e3 * np.asarray(place)

    def press_button(self, down=True):
        self.library.buttons = int(down)

    def begin(self, story):
        if story == "silence":
            self.silent = True
        elif story == "no number":
            self.put((math.nan, 0.0, 0.0))
        elif story == "wild":
            self.library.garbage = 60
        else:
            self.library.error, self.library.error_frames = {"stop": 0x200, "loss": 0x302}[story], 1

    def end(self, story):
        self.silent, self.library.garbage = False, 0


class PlainRig(Rig):
    """A device that needs no double, or whose double needs no push; `connect` opens it."""

    def __init__(self, connect):
        super().__init__()
        self.clock, self.connect = Clock(), connect


RIGS = ("haply", "crtk", "forcedimension", "openhaptics")


def rig_of(name, double):
    """Return the rig of a driver of motors; `double` compiles the libraries."""
    if name in {"haply", "crtk"}:
        return {"haply": HaplyRig, "crtk": CrtkRig}[name]()
    return {"forcedimension": ForceDimensionRig, "openhaptics": OpenHapticsRig}[name](double(name))
