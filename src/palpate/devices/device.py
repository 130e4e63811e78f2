"""The contract of a haptic device in the loop: `read`, `write`, `close`.

To add one, copy the nearest file of this folder and enter it in the table of ``devices/__init__.py``; the
checklist in ``tests/devices/test_device_checklist.py`` then holds it to this contract. A page of the guide, "Adding a
device", goes through the steps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from palpate.devices.device_options import settings_from
from palpate.devices.hand_kind import HandKind
from palpate.devices.profiles import DeviceProfile
from palpate.errors import DeviceError, UsageError
from palpate.network.shared_memory import Block

__all__ = [
    "ASSUMED_DAMPING",
    "HARDWARE_PATIENCE",
    "NO_TORQUE",
    "PLAIN_AXES",
    "UNPUBLISHED",
    "Axes",
    "Device",
    "Driver",
    "Sample",
    "ScriptedHand",
    "Traits",
    "free_buttons",
    "quantisation_noise",
    "time_left",
]

HARDWARE_PATIENCE = 0.020  # s without a fresh sample after which a motorised device gets zero force
Axes = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
ASSUMED_DAMPING = 0.5  # N·s/m, of a device whose maker publishes none
_FASTEST_START = 1.0  # m/s
UNPUBLISHED = f"damping: none is published, {ASSUMED_DAMPING:g} N·s/m is assumed"
NO_TORQUE = np.zeros(3)
PLAIN_AXES: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def quantisation_noise(resolution: float) -> float:
    """Return the standard deviation, m, of the rounding to steps of `resolution`, m."""
    return resolution / math.sqrt(12.0)


@dataclass(frozen=True)
class Traits:
    """Traits of a kind of device, known before one is opened.

    An opened device whose own word differs has `traits` of its own: the loop asks those, and of two limits the smaller
    counts.

    Attributes
    ----------
    radius : float
        Workspace, m.
    max_force : float
        N.
    damping : float or None
        The device's own damping b, N·s/m, for the stability bounds; None where no motor pushes.
    source : str
        Where the figures come from.
    mass : float
        Apparent mass of the handle without a hand, kg: bounds the damping that the passivity controller may add.
    delay : float
        From a sample to the force that answers it, as far as it is the device's own and no time stamp shows it, s;
        None where nobody states it.
    stamped : bool
        Whether `Sample.time` says when a place was taken, so that its age shows the delay of the transport.
    axes : (3, 3) floats, row by row
        What turns the device's own axes into x right, y up, z towards the user; a rotation, det +1.
    max_stiffness : float
        Largest stiffness that its maker states, N/m; infinite where none is stated.
    continuous_force : float
        Force that its motors bear for long, N; infinite where none is stated.
    reach : float
        No place of the handle is farther from the centre, m; 0 takes twice the radius.
    speed : float
        No handle is faster, m/s: a sample that says so is not believed.
    resolution : float
        Steps of the sensor at the handle, m, where nobody states them as large as they are known from such devices.
    noise : float
        Standard deviation of a place along one axis while nothing moves, m, besides the rounding to steps. What the
        loop measures counts where it is larger.
    buttons : int
        How many buttons `Sample.buttons` tells of.
    orients : bool
        Whether `Sample.orientation` says how the handle is turned.
    max_torque : float
        Largest torque that its motors render, N m; 0 for a device without, whose `write` is given forces alone.
    name : str
        What the opened device calls itself; empty takes the name of its kind.

    Raises
    ------
    UsageError
        For a torque on a handle whose turn nobody knows: its work could not be counted.
    """

    radius: float
    max_force: float
    damping: float | None
    source: str
    mass: float = 0.1
    delay: float | None = None
    stamped: bool = False
    axes: Axes = PLAIN_AXES
    max_stiffness: float = math.inf
    continuous_force: float = math.inf
    reach: float = 0.0
    speed: float = 5.0
    resolution: float = 0.0
    noise: float = 0.0
    buttons: int = 0
    orients: bool = False
    max_torque: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        if self.max_torque > 0.0 and not self.orients:
            raise UsageError(
                "A device that renders a torque must tell how its handle is turned.",
                why="The passivity controller counts the work of the torque by the turns.",
                fix="State orients=True and fill Sample.orientation, or leave max_torque out.",
            )

    @property
    def place_noise(self) -> float:
        """Standard deviation of a place along one axis, rounding included, as stated, m."""
        return math.hypot(self.noise, quantisation_noise(self.resolution))


class Sample:
    """The latest reading, one object for the life of a device: `read` overwrites it and allocates nothing.

    Attributes
    ----------
    position : (3,)
        Hand, m from the centre of the workspace, in the axes that `Traits.axes` turns.
    orientation : (4,)
        Quaternion w, x, y, z of the handle's turn in the same axes, of length 1; where none is told, no turn.
    time : float
        Last sign of life, s of the loop's clock: a fresh sample of hardware, a heartbeat of a page.
    patience : float
        Age from which on the input counts as stalled, s.
    holding : bool
        Whether a hand holds the body.
    asleep : bool
        The device itself says that nobody is looking or steering: counts as stalled at any age.
    clutched : bool
        A clutch is pressed: the device moves alone, and nothing is felt until it is let go.
    buttons : int
        Buttons that are pressed, one bit each, counted without those that the driver itself uses. The first is the
        dead-man button where one is asked for; any other stops the force. See `free_buttons`.
    stop : bool
        A stop switch of the device is pressed.
    """

    __slots__ = (
        "asleep", "buttons", "clutched", "holding", "orientation", "patience", "position", "stop", "time",
    )  # fmt: skip

    def __init__(self, patience: float = HARDWARE_PATIENCE) -> None:
        self.position = np.zeros(3)
        self.orientation = np.array([1.0, 0.0, 0.0, 0.0])
        self.time = -np.inf
        self.patience = patience
        self.holding = False
        self.asleep = False
        self.clutched = False
        self.buttons = 0
        self.stop = False


class Device(Protocol):
    """A haptic device, real or virtual.

    `read` and `write` are called once a tick. They must not block for longer than a fraction of it and must
    not allocate. Whatever they raise, the loop turns into a fault and zero force: best a `DeviceStopError` where the
    device's own safety acts, a `DeviceLostError` where it is gone, a `DeviceError` or an `OSError` for the rest. A
    driver whose traits have a `max_torque` is called as `write(force, torque)`, with a torque (3,), N m, on the hand. A
    driver that counts what is no fault, such as saturated motors, may have a text `note`, which the report shows.
    """

    @property
    def traits(self) -> Traits:
        """Workspace, force and damping: of this device once it is opened, until then of its kind."""
        ...

    def read(self, now: float) -> Sample:
        """Return the latest reading at the tick that began at `now`, s."""
        ...

    def write(self, force: np.ndarray) -> None:
        """Push on the hand with `force` (3,), N, until the next call."""
        ...

    def close(self) -> None:
        """Zero force, then let go. Harmless when repeated."""
        ...


class Driver:
    """The common part of drivers: opened from texts, used until they are closed, and given finite forces.

    A kind has the dataclass of its options, `settings_kind`, what messages call it, `called`, and who moves its `hand`.
    """

    settings_kind: ClassVar[type]
    called: ClassVar[str] = "device"
    hand: ClassVar[HandKind] = HandKind.DEVICE
    traits: Traits
    name = ""  # what an opened device calls itself
    closed = False

    @classmethod
    def open(cls, commands: Block, options: Mapping[str, str]) -> Self:
        """Open from texts by option; the address of a service, ``ws://…``, needs no name."""
        return cls(settings_from(cls.settings_kind, options))  # type: ignore[call-arg]

    def limited_traits(self, profile: DeviceProfile, source: str, **own: Any) -> Traits:
        """Return the kind's traits with the limits of a profile, and before both what is the device's `own`."""
        limits = ("radius", "max_force", "max_stiffness", "resolution")
        known = {name: getattr(profile, name) for name in limits} | {"source": source, "name": self.name}
        return replace(type(self).traits, **(known | own))

    def check_open(self) -> None:
        """Refuse the use of a device that is closed."""
        if self.closed:
            raise DeviceError(f"The {self.called} is closed.", fix="Open it again.")

    def check_start(
        self, far: float, speed: float, reach: float, fix: str = "Hold it still while it is opened."
    ) -> None:
        """Refuse a start farther from the centre than `reach`, m, or faster than that of a hand that is still."""
        if not (far <= reach and speed <= _FASTEST_START):
            raise DeviceError(
                f"{self.name} starts {far:.3g} m from its centre with {speed:.3g} m/s.",
                why=f"A start is within {reach:.3g} m and slower than {_FASTEST_START:g} m/s.",
                fix=fix,
            )

    def components(self, force: np.ndarray) -> tuple[float, float, float, float]:
        """Return x, y, z and size of a force (3,), N, for a device that is open; one that isn't finite is refused."""
        self.check_open()
        x, y, z = force.tolist()
        size = math.hypot(x, y, z)
        if not math.isfinite(size):
            raise DeviceError(f"A force that is not a finite number was kept from the {self.called}.")
        return x, y, z, size


class ScriptedHand(Driver):
    """A hand that no force moves; `sent` (3,) keeps the latest force, N."""

    hand = HandKind.PROGRAM

    def __init__(self) -> None:
        self.sent, self.sample = np.zeros(3), Sample()

    def write(self, force: np.ndarray) -> None:
        """Remember the force (3,), N."""
        self.sent[:] = force

    def close(self) -> None:
        """Let go."""
        self.sent[:] = 0.0
        self.sample.holding = False


def time_left(seconds: float) -> Iterator[float]:
    """Yield the time that is left, s, until so many seconds are over."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        yield left


def free_buttons(pressed: int, own: int) -> int:
    """Return the bits of the buttons that are left when one is the driver's own: those above it move down.

    So the first of the others is the dead-man button, whichever the driver has taken. `own` counts from 0; negative for
    none.
    """
    if own < 0:
        return pressed
    below = (1 << own) - 1
    return (pressed & below) | (pressed >> 1 & ~below)
