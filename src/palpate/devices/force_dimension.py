"""Force Dimension delta, omega, sigma and lambda, and the Novint Falcon, through the vendor's library (DHD).

The library is loaded when a device is opened, see `force_dimension_library`. Opening takes these steps: one device
alone, or the one with the serial number asked for; homing where it needs it and only if asked, since it moves by
itself; the profile's largest force as the library's own limit; the firmware's watchdog at 20 ms; a hundred positions
with the brakes on, of which the later half must look right. Brakes and forces wait for the first `write`: until the
loop runs, nobody would feed the watchdog.

A wrist tells its orientation, and one with motors is given the torque; on any other the force acts alone.

In the loop `read` takes a position and the buttons, and every 5 ms the status. A reading that came too soon for the
library's time guard is no fresh sample. Forces that the device has turned off by itself are an error with its cause in
words. After its velocity brake or its watchdog they are turned on again once zero force was asked for half a second;
after its button or dead-man switch when the user does so; after anything else not before it is opened again.

Only the thread that opened a device uses it.
"""

from __future__ import annotations

import contextlib
import math
from ctypes import byref, c_double, c_ushort
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.devices.device import (
    ASSUMED_DAMPING,
    NO_TORQUE,
    UNPUBLISHED,
    Driver,
    Sample,
    Traits,
    free_buttons,
)
from palpate.devices.device_options import DeviceOptions, number, switch
from palpate.devices.force_dimension_library import FORCES_OFF, LOST, DhdLibrary, Status
from palpate.devices.orientation import rotation_into
from palpate.devices.profiles import DeviceProfile, device_profile, weakest_profile
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError

__all__ = ["AXES", "TYPES", "WATCHDOG", "ForceDimensionDevice", "ForceDimensionSettings"]

# Force Dimension: x towards the user, y right, z up. Here: x right, y up, z towards the user.
AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))

# the library's number of a type: our profile; a .3 of sigma and lambda has the base of its .7. Numbers that version
# 3.16 no longer has (31, 32, 61, 62, 64, 102, 103, 106, 107) are of older devices, which it may still open
TYPES = {
    33: "omega.3", 32: "omega.3", 34: "omega.6", 36: "omega.6", 35: "omega.7", 37: "omega.7", 60: "falcon",
    63: "delta.3", 31: "delta.3", 64: "delta.6", 61: "delta.6", 62: "delta.6", 106: "sigma.6+", 107: "sigma.6+",
    104: "sigma.7", 105: "sigma.7", 206: "sigma.7", 102: "sigma.7", 103: "sigma.7",
    108: "lambda.7", 109: "lambda.7", 203: "lambda.7",
}  # fmt: skip

WATCHDOG = 160  # times 125 µs: 20 ms without a force command, and the firmware turns the forces off
_DELAY = 0.00025  # s: one exchange at the 4 kHz of the link
_BUTTONS, _MASK = 8, 0xFF  # bits of the mask that are looked at; most devices have one button
_FIRST, _STEP = 100, 0.001  # samples at the start, s between them
_TOLERANCE = 1.01  # of the force limit that is read back
_LOOK, _REST = 0.005, 0.5  # s between looks at the status; s of zero force before forces come back
_BY_HAND = 4000  # looks, 20 s, until a hand has homed a Falcon
_RETURNING, _BY_THE_USER = frozenset((2, 3)), frozenset((1, 6))  # causes of forces off


@dataclass(frozen=True)
class ForceDimensionSettings(DeviceOptions):
    """Settings of the connection."""

    driver = "forcedimension"
    serial: float = number(0.0, 0.0, 65535.0, whole=True)  # number of the device; 0 takes the only one
    library: str = ""  # file of the vendor's library; empty looks for it
    simulator: float = switch(0.0)  # 1 lets the vendor's own simulator on this machine count as a device
    home: float = switch(0.0)  # 1 lets a device that needs it home itself: it moves by itself
    gravity: float = switch(1.0)  # 0 turns the compensation of the handle's weight off
    mass: float = number(-1.0, most=1.0)  # kg, mounted on the handle; negative keeps the device's own value
    # button, counted from 0, that works as a clutch; -1 for none. Of the others the first is the dead-man button where
    # one is asked for, and each stops the force else
    clutch: float = number(-1.0, -1.0, 7.0, whole=True)


class ForceDimensionDevice(Driver):
    """One device behind the vendor's library; its traits are its profile's, and where it states a smaller force, that.

    `profile` is that of its type; `name` has its serial number. `left_handed` says whether it is built for the left
    hand; its translations have the same axes. `watchdog` says whether its firmware watches over the force commands.
    `guarded` counts readings that came too soon and repeated old values, `saturations` forces of which a motor gave
    less, in the same direction.
    """

    settings_kind = ForceDimensionSettings
    called = "Force Dimension device"
    traits = Traits(
        0.15,
        20.0,
        ASSUMED_DAMPING,
        f"before it is opened: delta.3's, the largest; {UNPUBLISHED}",
        delay=_DELAY,
        axes=AXES,
        buttons=_BUTTONS,
    )

    def __init__(self, settings: ForceDimensionSettings | None = None) -> None:
        self._settings = settings = settings or ForceDimensionSettings()
        self._dhd = DhdLibrary.load(settings.library)
        self.sample = Sample()
        self.sample.holding = True
        self.guarded = self.saturations = 0
        self._x, self._y, self._z = c_double(), c_double(), c_double()
        self._place: tuple[Any, ...] = byref(self._x), byref(self._y), byref(self._z)
        self._status = Status()
        self._clutch = int(settings.clutch)
        self._position, self._push = self._dhd.dhdGetPosition, self._dhd.dhdSetForce
        self._now, self._looked, self._pushed = -math.inf, -math.inf, -math.inf
        self._on, self._cause = False, -1  # no cause: forces have not been on yet
        self.name = "The Force Dimension device"
        self._id = self._connect()
        try:
            self._identify()
            self._home()
            self._limit()
            self._check_start()
        except BaseException:
            self.close()
            raise

    def read(self, now: float) -> Sample:
        """Return position and buttons; one that came too soon for the time guard keeps the sample's time."""
        self.check_open()
        self._now, sample = now, self.sample
        if now - self._looked >= _LOOK:
            self._looked = -math.inf  # what it complains of is looked at again in the next tick
            self._look()
            self._looked = now
        code = self._position(*self._place, self._id)
        if code == 0:
            position = sample.position
            position[0], position[1], position[2] = self._x.value, self._y.value, self._z.value
            if self.traits.orients:
                rotation_into(self._frame, sample.orientation)
            sample.time = now
        elif code == 1:
            self.guarded += 1
        else:
            raise self._failure("tells no position", code)
        mask = self._dhd.dhdGetButtonMask(self._id) & _MASK
        sample.clutched = self._clutch >= 0 and bool(mask >> self._clutch & 1)
        sample.buttons = free_buttons(mask, self._clutch)
        return sample

    def write(self, force: np.ndarray, torque: np.ndarray = NO_TORQUE) -> None:
        """Push with a force (3,), N, and a torque (3,), N m; forces that are off are turned on where that is due."""
        x, y, z, norm = self.components(force)
        wrench = [x, y, z, *self.components(torque)[:3]] if self.traits.max_torque > 0.0 else [x, y, z]
        if norm > 0.0 or any(wrench[3:]):
            self._pushed = self._now
        if not self._on:
            self._turn_on()
            wrench = [0.0] * len(wrench)
        code = self._push(*wrench, self._id)
        if code == 2:
            self.saturations += 1
        elif code != 0:
            raise self._failure("takes no force", code)

    def close(self) -> None:
        """Zero force, forces off, brakes on, then let go."""
        if self.closed:
            return
        self.closed = True
        with contextlib.suppress(DeviceError):  # a device that is gone pushes no more
            numbers = 6 if self.traits.max_torque > 0.0 else 3
            self._dhd.call(
                "dhdSetForceAndTorque" if numbers == 6 else "dhdSetForce", *[0.0] * numbers, self._id
            )
        for last in ("dhdStop", "dhdClose"):
            with contextlib.suppress(DeviceError):
                self._dhd.call(last, self._id)

    @property
    def note(self) -> str:
        """Words on an unknown type, on saturated motors and on readings that came too soon; empty for none of it."""
        notes = []
        if self.profile.name == "unknown":
            notes.append(f"{self.name}: the least of each limit that this driver knows holds")
        if self.saturations:
            notes.append(f"a motor was saturated {self.saturations} times: less force, in the same direction")
        if self.guarded:
            notes.append(f"{self.guarded} readings came too soon for the library's time guard")
        return "; ".join(notes)

    def _look(self) -> None:
        """Read the status, and stop at what the device says of itself."""
        status = self._status
        code = self._dhd.dhdGetStatus(status.values, self._id)
        if code != 0:
            raise self._failure("tells no status", code)
        if not status.powered:
            raise DeviceStopError(f"{self.name} has no power.", fix="Plug in its supply and switch it on.")
        if not status.connected:
            raise DeviceLostError(f"{self.name} is no longer there.", fix="Connect it, then start again.")
        if status.wrong:
            raise DeviceStopError(
                f"{self.name} reports an error of its own.", fix="Switch it off and on, then start again."
            )
        if status.forces:
            self._on, self._cause = True, 0
        elif self._on or self._cause >= 0:
            if self._on:
                self._on, self._cause, self._pushed = False, status.cause, self._now
            raise DeviceStopError(
                f"{self.name} has turned its forces off: {FORCES_OFF.get(self._cause, 'unknown cause')}.",
                fix=_remedy(self._cause),
            )

    def _turn_on(self) -> None:
        """Turn the forces on: at first, and after causes that pass by themselves, at rest of the force."""
        first, rested = self._cause < 0, self._now - self._pushed >= _REST
        if not (first or (rested and self._cause in _RETURNING)):
            return
        dhd, device = self._dhd, self._id
        dhd.call("dhdSetBrakes", False, device, optional=True)
        dhd.call("dhdEnableForce", True, device)
        dhd.call("dhdSetGravityCompensation", self._settings.gravity == 1.0, device, optional=True)
        self._on, self._cause = True, 0

    def _failure(self, what: str, code: int) -> DeviceError:
        number, words = self._dhd.last_error()
        if code != -1:
            words = f"it returned {code}, which is no code of its own"
        gone = code == -1 and number in LOST
        kind = DeviceLostError if gone else DeviceError
        fix = "Check cable and power, then start again." if gone else "Start again."
        return kind(f"{self.name} {what}.", why=f"{words} (error {number})", fix=fix)

    def _connect(self) -> int:
        dhd, serial = self._dhd, int(self._settings.serial)
        if self._settings.simulator:
            if not dhd.has("dhdEnableSimulator"):
                raise DeviceError(
                    "This library can't reach the vendor's simulator.",
                    fix="Install the Force Dimension SDK, 3.16 or later, or leave simulator=1 out.",
                )
            dhd.dhdEnableSimulator(True)
        count = dhd.dhdGetDeviceCount()
        if count > 1 and not serial:
            raise DeviceError(
                f"There are {count} Force Dimension devices.", fix="Name one: forcedimension:serial=NUMBER."
            )
        device = dhd.dhdOpenSerial(serial) if serial else dhd.dhdOpen()
        if device < 0:
            number, words = dhd.last_error()
            raise DeviceError(
                f"Force Dimension device {serial} can't be opened."
                if serial
                else "No Force Dimension device can be opened.",
                why=f"{words} (error {number}); the library counts {max(0, count)} devices.",
                fix="Connect it and switch it on, close other programs that use it; on Linux its USB port must be "
                "open to you (a udev rule, see the vendor's manual).",
            )
        return int(device)

    def _identify(self) -> None:
        """Find out which device it is, and what it may do."""
        dhd, device = self._dhd, self._id
        kind, called, serial = dhd.dhdGetSystemType(device), dhd.dhdGetSystemName(device), c_ushort()
        numbered = dhd.dhdGetSerialNumber(byref(serial), device) == 0
        called = called.decode("utf-8", "replace") if called else "device"
        self.name = f"Force Dimension {called}" + (f" {serial.value}" if numbered else "")
        self.left_handed = bool(dhd.dhdIsLeftHanded(device))
        known = kind in TYPES
        self.profile: DeviceProfile = (
            device_profile(TYPES[kind]) if known else weakest_profile("forcedimension")
        )
        self.name += "" if known else f", unknown type {kind}"
        own = float(dhd.dhdGetMaxForce(device))  # negative: no limit of its own
        force = min(self.profile.max_force, own) if own >= 0.0 else self.profile.max_force
        if not force > 0.0:
            raise DeviceError(
                f"{self.name} allows no force.", fix="Raise its limit in the vendor's own program."
            )
        own_word = "; force: the device itself" if force < self.profile.max_force else ""
        source = f"{self.profile.name}: {self.profile.source}{own_word}; {UNPUBLISHED}"
        wrist = self._find_wrist()
        self.traits = self.limited_traits(self.profile, source, max_force=force, **wrist)

    def _find_wrist(self) -> dict[str, Any]:
        """Find out whether the handle tells its orientation and motors turn it; take the calls that do."""
        dhd, device = self._dhd, self._id
        needed = (
            "dhdHasWrist",
            "dhdHasActiveWrist",
            "dhdGetPositionAndOrientationFrame",
            "dhdSetForceAndTorque",
        )
        if not all(dhd.has(name) for name in needed) or not dhd.dhdHasWrist(device):
            return {}
        self._frame = (c_double * 9)()
        self._position = dhd.dhdGetPositionAndOrientationFrame
        self._place = (*self._place, self._frame)
        active = bool(dhd.dhdHasActiveWrist(device)) and self.profile.max_torque > 0.0
        if active:
            self._push = dhd.dhdSetForceAndTorque
        return {"orients": True, "max_torque": self.profile.max_torque if active else 0.0}

    def _home(self) -> None:
        """Refuse a device whose encoders count from anywhere, or let it home itself where that was asked for."""
        dhd, device = self._dhd, self._id
        if not dhd.has("drdIsInitialized"):
            dhd.call("dhdGetStatus", self._status.values, device)
            if not self._status.homed:
                raise DeviceError(
                    f"{self.name} has not been homed: its positions are wrong.",
                    fix="Home it with the vendor's own program, or use libdrd instead of libdhd.",
                )
            return
        if dhd.drdOpenID(device) < 0:
            raise self._failure("is not taken by the vendor's DRD", -1)
        if dhd.drdIsInitialized(device):
            return
        by_hand = self.profile.name == "falcon"
        if not self._settings.home:
            way = (
                "give forcedimension:home=1, and push its handle in and pull it out by hand"
                if by_hand
                else "clear its way and give forcedimension:home=1: it then moves by itself"
            )
            raise DeviceError(
                f"{self.name} has not been homed: its positions are wrong.",
                fix=f"Use the vendor's own program; or {way}.",
            )
        if by_hand:  # it doesn't home itself: the vendor's examples send no force until a hand has done it
            for _ in range(_BY_HAND):
                if dhd.drdIsInitialized(device):
                    return
                dhd.call("dhdSetForce", 0.0, 0.0, 0.0, device)
                dhd.dhdSleep(_LOOK)
        else:
            dhd.call("drdAutoInit", device)
            if dhd.drdIsRunning(device):
                dhd.call("drdStop", False, device)
        if not dhd.drdIsInitialized(device):
            raise DeviceError(f"{self.name} could not be homed.", fix="Use the vendor's own program.")

    def _limit(self) -> None:
        """Give library and firmware their limits, and see that they are taken."""
        dhd, device, force = self._dhd, self._id, self.traits.max_force
        dhd.call("dhdSetMaxForce", force, device)
        taken = float(dhd.dhdGetMaxForce(device))
        if not 0.0 <= taken <= _TOLERANCE * force:
            raise DeviceError(
                f"{self.name} doesn't take a limit of {force:g} N.", why=f"It answers {taken:g} N.",
                fix="Install the Force Dimension SDK, 3.16 or later.",
            )  # fmt: skip
        dhd.call("dhdEnableExpertMode")
        self.watchdog = dhd.call("dhdSetWatchdog", WATCHDOG, device, optional=True)
        if self._settings.mass >= 0.0:
            dhd.call("dhdSetEffectorMass", self._settings.mass, device)

    def _check_start(self) -> None:
        """Read positions for a tenth of a second, brakes on; of the later half each must look right."""
        before: tuple[float, ...] | None = None
        then = -math.inf
        for k in range(_FIRST):
            self._dhd.dhdSleep(_STEP)
            code = self._position(*self._place, self._id)
            if code not in {0, 1}:
                raise self._failure("tells no position", code)
            now = self._dhd.dhdGetTime()
            place = self._x.value, self._y.value, self._z.value
            if code == 1 or k < _FIRST // 2:  # several devices deliver garbage at first
                continue
            speed = math.dist(place, before) / max(_STEP, now - then) if before else 0.0
            before, then = place, now
            fix = "Home it, and hold it still while it is opened."
            self.check_start(math.hypot(*place), speed, 2.0 * self.traits.radius, fix)
        if before is None:
            raise DeviceError(f"{self.name} repeats old positions.", fix="Connect it to another USB port.")
        self.sample.position[:] = before


def _remedy(cause: int) -> str:
    if cause in _RETURNING:
        return "Hold it still: its forces return by themselves."
    if cause in _BY_THE_USER:
        return "Press its force button, or hold its dead-man switch."
    return "Check cable and power, then start again."
