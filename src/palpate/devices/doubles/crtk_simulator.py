"""A double of an arm that speaks CRTK behind a ROS bridge, with a simulated hand, for trials and tests without ROS.

It answers the bridge's operations subscribe, unsubscribe, advertise, unadvertise and publish, in the types of ROS 1 or
ROS 2, and passes on what is published. The arm has x away from the user, y left, z up, and behaves as the documentation
of the da Vinci Research Kit says of a master. Its first wrench makes it limp. Then it sinks by its weight, unless it
was asked to bear that, and its wrist swings about z, unless its orientation was locked after the wrench. The wrist
begins turned by a quarter: a wrench that is not said to be in the base's axes pushes in another direction. Pedals and
the lock are topics that a late subscriber hears, too. It has the faults of such a chain; see `CrtkFaults`.

References: *dVRK documentation*, API of arms: body/servo_cf, use_gravity_compensation, lock_orientation; API of the
system: foot pedals.
"""

from __future__ import annotations

import asyncio
import functools
import json
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.devices.device_options import number
from palpate.devices.doubles.service_double import HandSettings, MovedMass, ServiceDouble, ServiceFaults

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

__all__ = ["CrtkFaults", "CrtkSimulator", "CrtkSimulatorSettings"]

_WRIST, _SWING, _SWINGS = 0.5 * math.pi, 0.5, 0.7  # rad, rad, Hz
_STATES = {"enable": "ENABLED", "disable": "DISABLED", "pause": "PAUSED", "resume": "ENABLED"}


@dataclass(frozen=True)
class CrtkSimulatorSettings(HandSettings):
    """Settings of the bridge, the arm and its hand."""

    # s without a wrench until the force lapses; CRTK doesn't promise that it ever does
    silence: float = number(1e9, 0.0, above=True)
    weight: float = 2.0  # N, of the limp arm
    port: int = 9090  # of the bridge; 0 takes a free one
    host: str = "127.0.0.1"
    arm: str = "arm"  # namespace
    rate: float = number(1000.0, 1.0, 10_000.0)  # Hz, of positions
    ros: int = number(2, 1, 2, whole=True)  # 1 or 2: version of ROS, and so the spelling of types and stamps


@dataclass
class CrtkFaults(ServiceFaults):
    """Faults of the chain, switched while it runs; those of answers are those of positions."""

    swapped: int = 0  # number of the next positions that are sent after their successor
    deaf: bool = False  # what is published to the bridge is not passed on: no echo
    stampless: bool = False  # headers have stamps of zero
    stateless: bool = False  # there is no operating state
    complaint: str = ""  # sent once, as an error of the bridge
    # m by which each reported position is higher than the last, beside the hand's own motion
    runaway: float = 0.0
    # m, reported instead of the hand's; NaN is written as null
    position: tuple[float, float, float] | None = None


class CrtkSimulator(ServiceDouble):
    """The bridge and the arm, which move and stamp positions by the time, s, that `clock` returns.

    `state`, `homed` and `busy` are the arm's operating state, `port` is in use
    once started, `wrenches` counts those that have arrived, `stamp` is that of the newest one's header, `absolute` says
    whether they are in the axes of the base, and `limp` whether one has come, after which nothing but wrenches moves
    the arm. `gravity` says whether the arm bears its own weight; `locked` is the orientation that the wrist holds, None
    where it swings. `topics` maps those advertised to the bridge to their types, `received` each published topic to its
    latest message.
    """

    faults: CrtkFaults

    def __init__(
        self, settings: CrtkSimulatorSettings | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__("CRTK arm", clock)
        self.settings, self.faults = settings or CrtkSimulatorSettings(), CrtkFaults()
        self.state, self.homed, self.busy = "ENABLED", True, False
        self.port, self.wrenches, self.absolute = 0, 0, False
        self.limp, self.gravity = False, False
        self.locked: dict[str, float] | None = None
        self.received: dict[str, dict[str, Any]] = {}
        self._latched: dict[str, str] = {}
        self.stamp: dict[str, int] = {}
        self.topics: dict[str, str] = {}
        self._publishers: dict[str, set[ServerConnection]] = {}
        self._hand = MovedMass(self.settings)
        self._run_up = 0.0
        self._arrived = threading.Condition()
        self._streaming = asyncio.Event()
        self._streaming.set()
        self._prefix = f"/{self.settings.arm}/" if self.settings.arm else "/"
        self._latch(self._prefix + "orientation_locked", {"data": False})

    def force(self) -> np.ndarray:
        """Return the force (3,) on the hand, N, in the axes of the arm's base; its weight is in it."""
        return self._hand.force.copy()

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        """Send a message of a topic to all that have subscribed to it."""
        self._do(self._send(topic, json.dumps({"op": "publish", "topic": topic, "msg": message})))

    def press(self, pedal: str, value: int) -> None:
        """Let go a pedal of the console (0), press it (1) or tap it (2); its topic needs no leading slash."""
        topic = f"/{pedal.strip('/')}"
        message = {"header": self._header(self.clock()), "axes": [], "buttons": [value]}
        self._do(self._send(topic, self._latch(topic, message)))

    def stream(self, on: bool) -> None:
        """Send positions by themselves, or wait for `step`."""

        async def switch() -> None:
            if on:
                self._streaming.set()
            else:
                self._streaming.clear()

        self._do(switch())

    def step(self) -> None:
        """Move the hand to the clock's time and send position, velocity and state once."""
        self._do(self._publish_state())

    def hang(self) -> None:
        """Send nothing and leave unread what arrives, as a bridge that hangs does."""

        async def pause() -> None:
            self._streaming.clear()
            for client in self._clients:
                client.transport.pause_reading()

        self._do(pause())

    def await_wrenches(self, count: int) -> bool:
        """Wait until that many wrenches have arrived, at most ten seconds."""
        with self._arrived:
            return self._arrived.wait_for(lambda: self.wrenches >= count, 10.0)

    async def _listen(self) -> None:
        self.port = await self._serve(self._bridge, self.settings.host, self.settings.port)
        self._task = asyncio.get_running_loop().create_task(self._stream())

    async def _end(self) -> None:
        if hasattr(self, "_task"):
            self._task.cancel()
        await super()._end()

    async def _stream(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            await self._streaming.wait()
            await self._publish_state()
            due = max(due + 1.0 / self.settings.rate, loop.time() - 0.1)
            await asyncio.sleep(max(0.0, due - loop.time()))

    async def _bridge(self, connection: ServerConnection) -> None:
        with self._hears(connection) as topics:
            async for text in connection:
                if self.faults.closing:
                    self.faults.closing = False
                    break
                await self._obey(connection, topics, json.loads(text))
        for topic in list(self.topics):
            self._withdraw(topic, connection)

    def _withdraw(self, topic: str, connection: ServerConnection) -> None:
        """Forget a client that publishes to a topic, and the topic with the last one."""
        publishers = self._publishers.get(topic, set())
        publishers.discard(connection)
        if not publishers:
            self.topics.pop(topic, None)

    async def _obey(self, connection: ServerConnection, topics: set[str], message: dict[str, Any]) -> None:
        operation, topic = message.get("op"), str(message.get("topic", ""))
        kind = str(message.get("type", ""))
        if operation in {"subscribe", "advertise"} and (kind.count("/") == 2) != (self.settings.ros == 2):
            words = f"{operation}: Unable to import {kind} of {topic}"
            status = {"op": "status", "level": "error", "msg": words, "id": message.get("id")}
            await connection.send(json.dumps(status))
        elif operation == "subscribe":
            topics.add(topic)
            if topic in self._latched:
                await connection.send(self._latched[topic])
        elif operation == "unsubscribe":
            topics.discard(topic)
        elif operation == "advertise":
            self.topics[topic] = kind
            self._publishers.setdefault(topic, set()).add(connection)
        elif operation == "unadvertise":
            self._withdraw(topic, connection)
        elif operation == "publish" and topic in self.topics and not self.faults.deaf:
            await self._take(topic, message.get("msg") or {})

    async def _take(self, topic: str, message: dict[str, Any]) -> None:
        name = topic.removeprefix(self._prefix)
        self.received[topic] = message
        if name == "use_gravity_compensation":
            self.gravity = bool(message["data"])
        elif name in {"lock_orientation", "unlock_orientation"}:
            if self.limp:
                self.locked = dict(message) if name == "lock_orientation" else None
            locked = self._prefix + "orientation_locked"
            await self._send(locked, self._latch(locked, {"data": self.locked is not None}))
        elif name == "body/set_cf_orientation_absolute":
            self.absolute = bool(message["data"])
        elif name == "state_command":
            wish = message["string"]
            self.homed = {"home": True, "unhome": False}.get(wish, self.homed)
            self.state = _STATES.get(wish, self.state)
        elif name in {"body/servo_cf", "servo_cf"}:
            self._take_wrench(message, turned=name == "body/servo_cf" and not self.absolute)
        else:
            await self._send(topic, json.dumps({"op": "publish", "topic": topic, "msg": message}))

    def _take_wrench(self, message: dict[str, Any], *, turned: bool) -> None:
        force = np.array([float(message["wrench"]["force"][axis]) for axis in "xyz"])
        if not np.isfinite(force).all():
            return
        now = self.clock()
        self._hand.advance(now)
        if self.state == "ENABLED" and self.homed:
            turn = self._orientation(now)
            angle = 2.0 * math.atan2(turn["z"], turn["w"])
            tip = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
            self.limp = True
            self._hand.force[:] = force
            if turned:
                self._hand.force[:2] = tip @ force[:2]
            if not self.gravity:
                self._hand.force[2] -= self.settings.weight
            self._hand.commanded = now
        with self._arrived:
            self.wrenches += 1
            self.stamp = message["header"]["stamp"]
            self._arrived.notify_all()

    async def _publish_state(self) -> None:
        faults, now = self.faults, self.clock()
        self._hand.advance(now)
        if self.state != "ENABLED" or not self.homed:
            self._hand.force[:] = 0.0
            self.limp, self.locked = False, None  # in silence, as the real one does
        if faults.complaint:
            words, faults.complaint = faults.complaint, ""
            await self._send("", json.dumps({"op": "status", "level": "error", "msg": words}))
        header = self._header(0.0 if faults.stampless else now)
        if not faults.stateless:
            state = {"state": self.state, "is_homed": self.homed, "is_busy": self.busy}
            await self._publish("operating_state", {"header": header, **state})
        twist = {"linear": _xyz(self._hand.velocity), "angular": _xyz(np.zeros(3))}
        await self._publish("measured_cv", {"header": header, "twist": twist})
        self._run_up += faults.runaway
        place = self._hand.position + np.array([0.0, 0.0, self._run_up])
        if faults.position is not None:
            place = np.array(faults.position)
        pose = {"position": _xyz(place), "orientation": self._orientation(now)}
        await self._publish_pose({"header": header, "pose": pose})

    async def _publish_pose(self, message: dict[str, Any]) -> None:
        faults, topic = self.faults, self._prefix + "measured_cp"
        text = json.dumps({"op": "publish", "topic": topic, "msg": message})
        send = functools.partial(self._send, topic)
        if faults.swapped > 0:
            faults.swapped -= 1
            self._kept.append((send, text))
        else:
            await self._answer(send, text)
            if not faults.held:
                await self._send_kept()  # those that were overtaken

    async def _publish(self, name: str, message: dict[str, Any]) -> None:
        topic = self._prefix + name
        await self._send(topic, json.dumps({"op": "publish", "topic": topic, "msg": message}))

    def _orientation(self, now: float) -> dict[str, float]:
        """Return the wrist's quaternion: as it was locked, or swinging about z where the arm is limp."""
        if self.locked is not None:
            return self.locked
        angle = _WRIST + (_SWING * math.sin(2.0 * math.pi * _SWINGS * now) if self.limp else 0.0)
        return {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * angle), "w": math.cos(0.5 * angle)}

    def _latch(self, topic: str, message: dict[str, Any]) -> str:
        """Keep a message for those who subscribe later; return its text."""
        self._latched[topic] = json.dumps({"op": "publish", "topic": topic, "msg": message})
        return self._latched[topic]

    def _header(self, now: float) -> dict[str, Any]:
        return {"stamp": self._stamp(now), "frame_id": "base"} | (
            {"seq": 0} if self.settings.ros == 1 else {}
        )

    def _stamp(self, now: float) -> dict[str, int]:
        seconds, rest = divmod(round(1e9 * now), 10**9)
        names = ("secs", "nsecs") if self.settings.ros == 1 else ("sec", "nanosec")
        return dict(zip(names, (seconds, rest), strict=True))


def _xyz(vector: np.ndarray) -> dict[str, float | None]:
    """Return x, y, z as the bridge writes them: what is no number is null."""
    return {axis: float(v) if np.isfinite(v) else None for axis, v in zip("xyz", vector, strict=True)}
