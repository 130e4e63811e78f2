"""Robots and haptic devices that speak CRTK, through the ROS bridge's websocket: no ROS is needed here.

Below the arm's namespace the driver subscribes to ``measured_cp``, ``operating_state`` and, while it opens,
``measured_cv``, without a throttle and with a queue of one. It publishes the force on the hand as a wrench, in the
axes of the arm's base, and says so by ``body/set_cf_orientation_absolute``. ROS 1 and ROS 2 spell types in two ways;
where the bridge doesn't know one, the other is tried, once.

An arm of a da Vinci Research Kit goes limp with the first wrench. So it is asked to bear its own weight before that, by
``use_gravity_compensation``, and a master's wrist, passive from then on, to hold its orientation, by
``lock_orientation``. Both are asked for again and again while it is opened, since a subscriber may hear a new publisher
late, and after each stop, since an arm that was stopped or restarted has forgotten them; other arms don't listen
there. The console's pedals are read, too; see `crtk_pedals`.

The bridge takes milliseconds, so the delay is measured and the loop softens bodies that are too stiff for it. Opening
measures the round trip of short messages through the bridge: half of it is the way of a position, half that of a
force. In the loop the time of a sample comes from the stamp of its header: the smallest difference ever seen between
the loop's clock and the stamps belongs to a message that took the shortest way. A message whose stamp is not newer
than the last is a duplicate or late, and no fresh sample.

One wrench is sent for each fresh position, the zero force at once, and either again after 50 ms. Only the thread that
calls `read` and `write` is used.

References: *Collaborative Robotics Toolkit (CRTK) API*; *rosbridge v2.0 protocol specification*; *dVRK documentation*,
API of arms and of the system; dvrk_python, mtm.py and dvrk_mtm_test.py.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.devices.crtk_settings import (
    LARGEST_FORCE,
    LARGEST_RADIUS,
    LONGEST_DELAY,
    TYPES,
    CrtkSettings,
    axes_in_words,
)
from palpate.devices.device import ASSUMED_DAMPING, UNPUBLISHED, Driver, Sample, Traits, time_left
from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceError, DeviceStopError

__all__ = ["STATES", "CrtkDevice"]

STATES = {"DISABLED": "its motors are off", "PAUSED": "it is paused", "FAULT": "it has a fault"}
_RECEIVED = ("measured_cp", "measured_cv", "operating_state")
_ABSOLUTE, _ECHO = "body/set_cf_orientation_absolute", "palpate_echo"
_GRAVITY, _LOCK, _UNLOCK, _LOCKED = (
    "use_gravity_compensation",
    "lock_orientation",
    "unlock_orientation",
    "orientation_locked",
)
_ECHOES = 20  # messages, of whose round trips the median counts
_RESOLUTION = 6e-5  # m: none is published, the coarsest of all devices is taken
# poses at the start that are checked and thrown away, of which none is farther from the first one, m
_FIRST, _REACH = 50, 0.3
_ASKS = 5  # times that a limp arm is asked to hold its wrist
_AGAIN = 0.05  # s after which a force is sent again
_DRIFT = 2e-4  # s/s by which two clocks may run apart: four times what a bad crystal does
_ROUNDING = 0.01  # by which the length of an orientation's quaternion may differ from 1


class CrtkDevice(Driver):
    """One arm behind the bridge; its traits have the radius and force of the settings and the measured delay.

    `types` is the spelling of types in use, "ros1" or "ros2"; `round_trip` the time measured through the bridge, s;
    `repeated` counts positions whose stamp was not newer than the last one's, `published` the wrenches sent;
    `operating` is the state that the arm reports; `locked` says whether it holds its orientation, None where it says
    nothing.
    """

    settings_kind = CrtkSettings
    called = "CRTK arm"
    traits = Traits(
        LARGEST_RADIUS,
        LARGEST_FORCE,
        ASSUMED_DAMPING,
        f"before it is opened: the most that its options allow; {UNPUBLISHED}",
        axes=((0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)),
        buttons=CrtkSettings().console_pedals().buttons,
    )

    def __init__(self, settings: CrtkSettings | None = None) -> None:
        s = self._settings = settings or CrtkSettings()
        self.sample = Sample()
        self.repeated = self.published = 0
        self.operating, self.round_trip = "", 0.0
        self.locked: bool | None = None
        self._asks, self._orientation = 0, dict[str, float]()
        self._pedals = s.console_pedals()
        self._homed, self._busy, self._complaint = True, False, ""
        self._fresh = False
        self._now, self._sent, self._sent_at = -math.inf, 0.0, -math.inf
        self._stamp, self._stamp_text, self._offset, self._one_way = -math.inf, "{}", math.inf, 0.0
        self._echoes: list[int] = []
        self._asked = ""  # id of the latest subscriptions, which complaints about them repeat
        self._velocity = [0.0, 0.0, 0.0]
        self._origin, self._place = np.zeros(3), np.zeros(3)
        arm = s.arm.strip("/")
        self._prefix = f"/{arm}/" if arm else "/"
        self.name = f"CRTK arm {arm}" if arm else "The CRTK arm"
        self._pose, self._twist, self._state = (self._prefix + topic for topic in _RECEIVED)
        self._echo, self._wrench = self._prefix + _ECHO, self._prefix + s.wrench
        self._channel = WebsocketChannel(s.url, "ROS bridge")
        try:
            self.types = self._subscribe()
            self._advertise()
            self._make_ready()
            self._measure_round_trip()
            self._take_over()
        except BaseException:
            self.close()
            raise
        self.traits = replace(
            type(self).traits,
            radius=s.radius,
            max_force=s.force,
            source=f"radius and force: its options; {UNPUBLISHED}",
            delay=self._one_way,
            resolution=_RESOLUTION,
            axes=axes_in_words(s.axes),
            reach=_REACH,
            buttons=self._pedals.buttons,
            name=self.name,
        )

    @classmethod
    def traits_of(cls, options: Mapping[str, str]) -> Traits:
        """Return the traits: with the buttons that the pedals of the options are."""
        names = ("pedals", "clutch", "dead_man", "hold")
        pedals = CrtkSettings(**{name: options[name] for name in names if name in options}).console_pedals()  # type: ignore[arg-type]
        return replace(cls.traits, buttons=pedals.buttons)

    def read(self, now: float) -> Sample:
        """Return the newest position, at the time of its stamp as the loop's clock has it."""
        self.check_open()
        if self._now > -math.inf:
            self._offset += _DRIFT * max(0.0, now - self._now)
        else:
            self._offset, self._stamp = math.inf, -math.inf  # those of another clock, while it was opened
            self.sample.time = now - self._one_way
        self._now = now
        self._take(self._channel.receive(self._settings.wait))
        if self._complaint:
            words, self._complaint = self._complaint, ""
            raise DeviceError("The ROS bridge complains.", why=words, fix="See its log.")
        self._check_state()
        self._pedals.press(self.sample)
        np.subtract(self._place, self._origin, out=self.sample.position)
        return self.sample

    def write(self, force: np.ndarray) -> None:
        """Publish a force (3,), N, where a fresh position asks for one; a zero force in any case."""
        x, y, z, norm = self.components(force)
        stops = norm == 0.0 and self._sent > 0.0
        if self._fresh or stops or self._now - self._sent_at >= _AGAIN:
            if self._asks:
                self._asks -= 1
                self._ask_for_axes_and_weight()
            self._publish_force(x, y, z)
            if self._asks:
                self._ask_for_wrist(self._orientation)
            self._fresh, self._sent, self._sent_at = False, norm, self._now

    @property
    def note(self) -> str:
        """Words on positions that were passed over, and on a wrist that is not held; empty for none."""
        words = [f"{self.repeated} positions were late or doubled"] if self.repeated else []
        if self._settings.lock and self.locked is False:
            words.append("its wrist does not hold its orientation")
        return "; ".join(words)

    def close(self) -> None:
        """Publish zero force twice, since ROS may lose one, free the wrist, and let go.

        The arm goes on bearing its own weight. One that was not taken over gets no wrench: it would go limp by it.
        """
        if self.closed:
            return
        self.closed = True
        try:
            if self.published:
                self._publish_force(0.0, 0.0, 0.0)
                self._publish_force(0.0, 0.0, 0.0)
                if self._settings.lock:
                    self._send("publish", _UNLOCK, msg={})
            for topic in _RECEIVED:
                self._send("unsubscribe", topic)
            self._send("unadvertise", self._wrench)
        except DeviceError:
            pass  # the bridge is gone
        finally:
            self._channel.close()

    def _publish_force(self, x: float, y: float, z: float) -> None:
        self._channel.send(
            f'{{"op":"publish","topic":"{self._wrench}","msg":{{"header":{{"stamp":{self._stamp_text}}},"wrench":'
            f'{{"force":{{"x":{x:.6g},"y":{y:.6g},"z":{z:.6g}}},"torque":{{"x":0.0,"y":0.0,"z":0.0}}}}}}}}'
        )
        self.published += 1

    def _take(self, texts: list[str]) -> None:
        for text in texts:
            try:
                frame = json.loads(text)
            except ValueError as error:
                raise DeviceError("The ROS bridge sent what is not JSON.", why=text[:100]) from error
            if not isinstance(frame, dict):
                continue
            message = frame.get("msg")
            if frame.get("op") == "status":
                if frame.get("level") == "error" and frame.get("id", self._asked) == self._asked:
                    self._complaint = str(message)
            elif isinstance(message, dict):
                self._take_message(frame.get("topic"), message)

    def _take_message(self, topic: object, message: Mapping[str, Any]) -> None:
        if topic == self._pose:
            self._take_pose(message)
        elif topic == self._state:
            self.operating = str(message.get("state", ""))
            self._homed = bool(message.get("is_homed", True))
            self._busy = bool(message.get("is_busy", False))
        elif topic == self._twist:
            self._velocity = _vector((message.get("twist") or {}).get("linear"))
        elif topic in self._pedals.topics:
            self._pedals.take(str(topic), message)
        elif topic == self._prefix + _LOCKED:
            self.locked = bool(message.get("data"))
        elif topic == self._echo:
            self._echoes.append(int(message.get("data") or -1))

    def _take_pose(self, message: Mapping[str, Any]) -> None:
        """Take a position, and its time from its stamp: one that is not newer than the last is passed over."""
        stamp = (message.get("header") or {}).get("stamp") or {}
        # secs and nsecs of ROS 1, sec and nanosec of ROS 2
        seconds = stamp.get("secs", stamp.get("sec", 0)) + 1e-9 * stamp.get("nsecs", stamp.get("nanosec", 0))
        if seconds > 0.0:
            if seconds <= self._stamp:
                self.repeated += 1
                return
            self._stamp, self._stamp_text = seconds, json.dumps(stamp)
            self._offset = min(self._offset, self._now - seconds)
            taken = seconds + self._offset - self._one_way
        else:
            taken = self._now - self._one_way
        self.sample.time = max(self.sample.time, taken)
        pose = message.get("pose") or {}
        self._place[:] = _vector(pose.get("position"))
        self._orientation = pose.get("orientation") or {}
        self._fresh = True

    def _check_state(self) -> None:
        self.sample.holding = self._settings.state == 0.0 or (self.operating == "ENABLED" and self._homed)
        if not self.sample.holding:
            self._asks, self.locked = _ASKS, None
            raise DeviceStopError(f"{self.name} {self._state_in_words()}.", fix="Free it in its own program.")

    def _state_in_words(self) -> str:
        if self.operating != "ENABLED":
            words = STATES.get(self.operating, "which is no state to touch in")
            return f"reports {self.operating or 'no state'}: {words}"
        return "has not been homed: its positions are wrong" if not self._homed else "is ready"

    def _send(self, operation: str, topic: str, **message: object) -> None:
        """Send an operation of the bridge on a topic, which is the arm's unless it begins with a slash."""
        full = topic if topic.startswith("/") else self._prefix + topic
        self._channel.send(json.dumps({"op": operation, "topic": full} | message))

    def _until(self, seconds: float) -> Iterator[None]:
        """Receive while opening, for at most `seconds`; the caller leaves when it has what it waits for."""
        for left in time_left(seconds):
            yield
            self._now = time.monotonic()
            self._take(self._channel.receive(left))

    def _type(self, topic: str, types: str) -> str:
        name = TYPES[topic]
        return name if types == "ros1" else name.replace("/", "/msg/")

    def _subscribe(self) -> str:
        """Subscribe in one spelling of types or the other; return the one that brought a position."""
        s, complaints = self._settings, []
        for types in ("ros1", "ros2") if s.types == "auto" else (s.types,):
            self._asked = f"palpate-{types}"
            for topic in _RECEIVED if s.state else _RECEIVED[:2]:
                kind, latest = self._type(topic, types), {"throttle_rate": 0, "queue_length": 1}
                self._send("subscribe", topic, id=self._asked, type=kind, **latest)
            self._complaint = ""
            for _ in self._until(s.search):
                if self._fresh or self._complaint:
                    break
            if self._fresh:
                self._complaint = ""
                return types
            complaints.append(f"as {self._type('measured_cp', types)}: {self._complaint or 'silence'}")
            for topic in _RECEIVED:
                self._send("unsubscribe", topic, id=self._asked)
        raise DeviceError(
            f"No position comes from {self._pose}.",
            why=f"The ROS bridge at {s.url} answered, {'; '.join(complaints)}.",
            fix="Start the arm, name it with arm=NAMESPACE, and see `ros2 topic list` or `rostopic list`.",
        )

    def _advertise(self) -> None:
        for topic in (self._settings.wrench, _ABSOLUTE, "state_command", _ECHO, _GRAVITY, _LOCK, _UNLOCK):
            latch = topic in {_ABSOLUTE, _GRAVITY}
            self._send("advertise", topic, type=self._type(topic, self.types), latch=latch, queue_size=1)
        self._send("subscribe", self._echo, type=self._type(_ECHO, self.types), throttle_rate=0)
        heard = dict.fromkeys(self._pedals.topics, "pedal")
        if self._settings.lock:
            heard[self._prefix + _LOCKED] = _LOCKED
        for topic, kind in heard.items():
            # every message of a pedal counts: none may push another out of a queue
            kind = self._type(kind, self.types)
            self._send("subscribe", topic, id=self._asked, type=kind, throttle_rate=0)

    def _make_ready(self) -> None:
        """Wait for an arm that is enabled and homed; ask for either where the settings say so."""
        s = self._settings
        if not s.state:
            return
        asked = ""
        for _ in self._until(s.search if not s.home else 60.0):
            ready = self.operating == "ENABLED" and self._homed and not self._busy
            if ready:
                return
            if not self.operating or self._busy:
                continue
            if self.operating == "DISABLED" and s.enable:
                wish = "enable"
            elif self.operating == "ENABLED" and s.home:
                wish = "home"
            else:
                break
            if wish != asked:
                asked = wish
                self._send("publish", "state_command", msg={"string": wish})
        if not self.operating:
            raise DeviceError(
                f"{self.name} tells no operating state.", fix="Start it, or go without by crtk:state=0."
            )
        raise DeviceError(
            f"{self.name} {'is busy' if self._busy else self._state_in_words()}.",
            fix="Enable and home it in its own program, or with enable=1 and home=1: it then moves by itself.",
        )

    def _measure_round_trip(self) -> None:
        """Time short messages on their way through the bridge and back."""
        s, trips = self._settings, []
        for k in range(_ECHOES):
            # repeated: a subscriber may hear a new publisher late
            self._ask_for_axes_and_weight()
            if s.delay >= 0.0:
                continue
            sent = time.monotonic()
            self._send("publish", self._echo, msg={"data": str(k + 1)})
            for _ in self._until(s.search):
                if k + 1 in self._echoes:
                    trips.append(time.monotonic() - sent)
                    break
            else:
                raise DeviceError(
                    "The ROS bridge sends nothing back of what is published to it.",
                    why=f"A message on {self._echo} did not return within {s.search:g} s, so the delay is not known.",
                    fix="Let the bridge pass that topic, or give the round trip: crtk:delay=SECONDS.",
                )
        self._send("unsubscribe", self._echo)
        self._send("unadvertise", self._echo)
        self.round_trip = s.delay if s.delay >= 0.0 else sorted(trips)[len(trips) // 2]
        if self.round_trip > LONGEST_DELAY:
            raise DeviceError(
                f"The way through the ROS bridge and back takes {1e3 * self.round_trip:.0f} ms.",
                why=f"With a delay of more than {1e3 * LONGEST_DELAY:g} ms no force is sent to a hand.",
                fix="Run the bridge on this machine or by cable, with nothing else on it.",
            )
        self._one_way = 0.5 * self.round_trip

    def _take_over(self) -> None:
        """Make the arm limp at no force, while its first positions are checked and thrown away.

        The last one is the centre, if that was asked for.
        """
        first: np.ndarray | None = None
        held, seen = dict[str, float](), 0
        for _ in self._until(self._settings.search):
            if self._fresh:
                self._fresh, seen = False, seen + 1
                if first is None:
                    first, held = self._place.copy(), self._orientation
                if seen % (_FIRST // _ASKS) == 1:
                    self._publish_force(0.0, 0.0, 0.0)
                    self._ask_for_wrist(held)
            if seen >= _FIRST:
                break
        self._check_first(first, seen)
        self._send("unsubscribe", self._twist)
        if self._settings.origin == "here":
            self._origin[:] = self._place
        self._now = -math.inf  # from here on the loop's clock counts

    def _ask_for_axes_and_weight(self) -> None:
        for topic in (_ABSOLUTE, _GRAVITY) if self._settings.gravity else (_ABSOLUTE,):
            self._send("publish", topic, msg={"data": True})

    def _ask_for_wrist(self, orientation: Mapping[str, float]) -> None:
        """Ask for this orientation of the wrist; a place without one has no wrist to hold."""
        size = math.hypot(*(float(orientation.get(axis) or 0.0) for axis in "xyzw"))
        if self._settings.lock and not self.locked and abs(size - 1.0) < _ROUNDING:
            self._send("publish", _LOCK, msg=dict(orientation))

    def _check_first(self, first: np.ndarray | None, seen: int) -> None:
        if self._complaint:
            raise DeviceError(
                "The ROS bridge complains.",
                why=self._complaint,
                fix="See its log. Without pedals: crtk:pedals=; without a wrist that is held: crtk:lock=0.",
            )
        if seen < _FIRST or first is None:
            raise DeviceError(
                f"{self.name} sent {seen} positions within {self._settings.search:g} s.",
                fix=f"It must send {_FIRST} in that time; 200 a second or more are right for touch.",
            )
        self.check_start(math.dist(self._place, first), math.hypot(*self._velocity), _REACH)


def _vector(value: Any) -> list[float]:
    """Return x, y, z; NaN where one is missing or null, as JSON writes it."""
    entries = value if isinstance(value, dict) else {}
    return [math.nan if entries.get(axis) is None else float(entries[axis]) for axis in "xyz"]
